// SPDX-License-Identifier: MIT
// The two forms of the covariance in recursive least squares, beside the textbook's.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <resonid/online/models/detail/symmetric_covariance.hpp>
#include <resonid/online/models/rls.hpp>

namespace resonid::online {
namespace {

constexpr std::size_t kN = 6;

/// ARX(3,3) of a lightly damped oscillation (poles of radius 0.99) and a slow pole (0.9), driven by a random
/// binary input, with a white equation error.
class ResonantArx {
 public:
  static constexpr std::array<double, kN> kTruth{0.9, -0.5, 0.8, -1.6102, 1.61918, -0.882};
  const std::array<double, kN>& next() {
    for (std::size_t i = 2; i > 0; --i) {
      f_[i] = f_[i - 1];
      f_[3 + i] = f_[2 + i];
    }
    f_[0] = uniform() > 0.0 ? 1.0 : -1.0;
    f_[3] = -output_;
    output_ = 0.1 * uniform();
    for (std::size_t i = 0; i < kN; ++i) output_ += f_[i] * kTruth[i];
    return f_;
  }
  [[nodiscard]] double output() const { return output_; }

 private:
  double uniform() {
    state_ ^= state_ << 13;
    state_ ^= state_ >> 7;
    state_ ^= state_ << 17;
    return static_cast<double>(state_ >> 11) * 0x1p-53 - 0.5;
  }
  std::uint64_t state_ = 88172645463325252ULL;
  std::array<double, kN> f_{};
  double output_ = 0.0;
};

template <class Factors>
struct Case;
template <class R, std::size_t N>
struct Case<UdFactors<R, N>> {
  using Real = R;
};
template <class R, std::size_t N>
struct Case<SymmetricCovariance<R, N>> {
  using Real = R;
};

template <class Factors>
class CovarianceForm : public testing::Test {
 public:
  using Real = typename Case<Factors>::Real;
  using Rls = RecursiveLeastSquares<Real, kN, Factors>;
  static std::array<Real, kN> narrow(const std::array<double, kN>& f) {
    std::array<Real, kN> g;
    for (std::size_t i = 0; i < kN; ++i) g[i] = static_cast<Real>(f[i]);
    return g;
  }
};
using Forms = testing::Types<UdFactors<double, kN>, UdFactors<float, kN>, SymmetricCovariance<double, kN>,
                             SymmetricCovariance<float, kN>>;
TYPED_TEST_SUITE(CovarianceForm, Forms);

/// P = (P - k (P f)')/lambda of the whole matrix, as it is often printed: how many updates it takes until it
/// is of no use. What rounding makes unsymmetric grows by 1/lambda per update.
template <class Real>
int updates_of_the_textbook(int most) {
  using Vector = Eigen::Matrix<Real, 6, 1>;
  Eigen::Matrix<Real, 6, 6> p = Eigen::Matrix<Real, 6, 6>::Identity();
  ResonantArx machine;
  for (int k = 0; k < most; ++k) {
    const auto& regressor = machine.next();
    Vector f;
    for (int i = 0; i < 6; ++i) f(i) = static_cast<Real>(regressor[static_cast<std::size_t>(i)]);
    const Vector pf = p * f;
    const Vector gain = pf / (Real(0.99) + f.dot(pf));
    p = ((p - gain * pf.transpose()) / Real(0.99)).eval();
    if (!p.allFinite() || p.diagonal().minCoeff() <= Real(0)) return k;
  }
  return most;
}

TEST(TextbookLeastSquares, Diverges) {
  EXPECT_LT(updates_of_the_textbook<double>(1000000), 200000);
  EXPECT_LT(updates_of_the_textbook<float>(1000000), 200000);
}

TYPED_TEST(CovarianceForm, EnduresAMillionUpdatesOnAResonantMachine) {
  using Number = typename TestFixture::Real;
  auto rls = TestFixture::Rls::create({.factor = 0.99}).value();
  ResonantArx machine;
  double worst = 0.0;
  for (int k = 0; k < 1000000; ++k) {
    const auto f = this->narrow(machine.next());
    rls.step(f, static_cast<Number>(machine.output()));
    if (k < 2000 || k % 500 != 0) continue;
    const auto p = rls.information_inverse();
    ASSERT_TRUE(p.allFinite()) << k;
    ASSERT_EQ(p, p.transpose()) << k;
    ASSERT_GT(p.diagonal().minCoeff(), Number(0)) << k;
    for (std::size_t i = 0; i < kN; ++i)
      worst = std::max(worst, std::abs(static_cast<double>(rls.parameters()[i]) - machine.kTruth[i]));
  }
  EXPECT_EQ(rls.skipped_samples(), 0U);
  EXPECT_LT(worst, 0.05);  // the scatter of a memory of 100 samples: 5 standard deviations are 0.04
}

TYPED_TEST(CovarianceForm, EnduresSilence) {
  using Number = typename TestFixture::Real;
  auto rls = TestFixture::Rls::create({.factor = 0.99, .largest_variance = 100.0}).value();
  ResonantArx machine;
  for (int block = 0; block < 20; ++block) {
    for (int k = 0; k < 5000; ++k) {
      const auto f = this->narrow(machine.next());
      rls.step(f, static_cast<Number>(machine.output()));
    }
    ASSERT_TRUE(rls.excited());
    const auto held = rls.parameters();
    for (int k = 0; k < 20000; ++k) rls.step({}, Number(0));
    ASSERT_FALSE(rls.excited());
    const auto p = rls.information_inverse();
    ASSERT_TRUE(p.allFinite());
    ASSERT_LT(p.trace(), Number(6 * 120));
    for (std::size_t i = 0; i < kN; ++i) {
      ASSERT_EQ(rls.parameters()[i], held[i]);
      ASSERT_NEAR(rls.parameters()[i], machine.kTruth[i], 0.05);
    }
  }
}

TEST(CovarianceForms, AgreeWhateverTheForgetting) {
  for (const auto forgetting :
       {Forgetting::none, Forgetting::constant, Forgetting::variable, Forgetting::directional}) {
    const RecursiveLeastSquaresConfig config{
        .start_variance = 4.0, .forgetting = forgetting, .largest_variance = 10.0, .smallest_variance = 1e-5};
    auto ud = RecursiveLeastSquares<double, kN>::create(config).value();
    auto symmetric =
        RecursiveLeastSquares<double, kN, SymmetricCovariance<double, kN>>::create(config).value();
    ResonantArx machine;
    for (int k = 0; k < 3000; ++k) {
      auto f = machine.next();
      const double weight = k % 3 == 0 ? 0.5 : 1.0;
      if (k % 1000 > 700) f[1] = 0.0;  // one silent direction: the limits act
      ud.step(f, machine.output(), weight);
      symmetric.step(f, machine.output(), weight);
    }
    const auto p = ud.information_inverse();
    EXPECT_LT((p - symmetric.information_inverse()).norm(), 1e-9 * p.norm());
    for (std::size_t i = 0; i < kN; ++i) EXPECT_NEAR(ud.parameters()[i], symmetric.parameters()[i], 1e-9);
    EXPECT_EQ(ud.excited(), symmetric.excited());
  }
}

TYPED_TEST(CovarianceForm, SkipsWhatIsNotFinite) {
  using Number = typename TestFixture::Real;
  auto rls = TestFixture::Rls::create({}).value();
  ResonantArx machine;
  for (int k = 0; k < 100; ++k) rls.step(this->narrow(machine.next()), static_cast<Number>(machine.output()));
  const auto before = rls.parameters();
  const auto p = rls.information_inverse();
  auto f = this->narrow(machine.next());
  f[2] = std::numeric_limits<Number>::quiet_NaN();
  EXPECT_FALSE(rls.step(f, Number(1)));
  EXPECT_EQ(rls.parameters(), before);
  EXPECT_EQ(rls.information_inverse(), p);
  EXPECT_EQ(rls.skipped_samples(), 1U);
}

}  // namespace
}  // namespace resonid::online
