// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <allocation_counter.hpp>
#include <array>
#include <cmath>
#include <complex>
#include <limits>
#include <resonid/base/constants.hpp>
#include <resonid/diagnostics/margins.hpp>
#include <vector>

namespace resonid::online {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// k / (s (s+1)^2): crossover where k = w (w^2 + 1), gain margin 2/k at w = 1, by hand.
template <class Real>
struct Lag {
  std::vector<Real> frequency_hz;
  std::vector<std::complex<Real>> value;

  explicit Lag(double k, double ratio = 1.01) {
    for (double w = 0.05; w < 20.0; w *= ratio) {
      const std::complex<double> s(0.0, w);
      frequency_hz.push_back(static_cast<Real>(w / kTwoPi));
      value.push_back(std::complex<Real>(k / (s * (s + 1.0) * (s + 1.0))));
    }
  }
};

TEST(LoopMargins, ALineBetweenTwoGapsCounts) {
  const std::complex<double> gap(kNan, 0.0);
  const std::array<double, 5> hz{1.0, 2.0, 3.0, 4.0, 5.0};
  const std::array<std::complex<double>, 5> loop{{{2.0, 0.0}, gap, {-0.75, 0.0}, gap, {0.5, 0.0}}};
  const auto m = loop_margins<double>(hz, loop);
  EXPECT_EQ(m.modulus_margin, 0.25);
  EXPECT_EQ(m.modulus_margin_hz, 3.0);
}

template <class Real>
class LoopMarginsOf : public testing::Test {};
using Reals = testing::Types<float, double>;
TYPED_TEST_SUITE(LoopMarginsOf, Reals);

TYPED_TEST(LoopMarginsOf, AThirdOrderLagByHand) {
  const Lag<TypeParam> loop(0.625);  // w (w^2 + 1) = 0.625 at w = 1/2
  const auto m = loop_margins<TypeParam>(loop.frequency_hz, loop.value);
  EXPECT_NEAR(m.crossover_hz * kTwoPi, 0.5, 1e-4);
  const double margin = 180.0 - 90.0 - 2.0 * std::atan(0.5) * 180.0 / kPi;
  EXPECT_NEAR(m.phase_margin_deg, margin, 5e-3);
  EXPECT_EQ(m.worst_phase_margin_deg, m.phase_margin_deg);
  EXPECT_NEAR(m.gain_margin_db, 20.0 * std::log10(2.0 / 0.625), 1e-3);
  EXPECT_NEAR(m.gain_margin_hz * kTwoPi, 1.0, 1e-3);
  double smallest = 10.0;  // min |1 + L| on a much finer grid
  for (double w = 0.3; w < 2.0; w += 1e-5) {
    const std::complex<double> s(0.0, w);
    smallest = std::min(smallest, std::abs(1.0 + 0.625 / (s * (s + 1.0) * (s + 1.0))));
  }
  EXPECT_NEAR(m.modulus_margin, smallest, 1e-4);
}

TEST(LoopMargins, AreThoseOfLoopMarginsBitForBit) {
  for (const double k : {0.1, 0.625, 1.9, 8.0}) {
    const Lag<double> loop(k, 1.05);
    const auto running = loop_margins<double>(loop.frequency_hz, loop.value);
    data::FrequencyResponse response;
    response.frequency_hz = loop.frequency_hz;
    response.value = loop.value;
    const auto whole = diagnostics::loop_margins(response);
    EXPECT_EQ(running.crossover_hz, whole.crossover_hz().value_or(kNan));
    EXPECT_EQ(running.phase_margin_deg, whole.phase_margin_deg().value_or(kNan));
    EXPECT_EQ(running.modulus_margin, whole.modulus_margin);
    EXPECT_EQ(running.modulus_margin_hz, whole.modulus_margin_hz);
    EXPECT_EQ(std::isnan(running.gain_margin_db), !whole.gain_margin_db.has_value());
  }
}

TEST(LoopMargins, NothingIsInterpolatedAcrossALineWithoutAValue) {
  Lag<double> loop(0.625);
  const auto crossover = loop_margins<double>(loop.frequency_hz, loop.value).crossover_hz;
  for (std::size_t i = 0; i + 1 < loop.value.size(); ++i)
    if (loop.frequency_hz[i + 1] > crossover) {
      loop.value[i] = {kNan, kNan};
      break;
    }
  loop.value.front() = {kNan, 0.0};
  const auto m = loop_margins<double>(loop.frequency_hz, loop.value);
  EXPECT_TRUE(std::isnan(m.crossover_hz));
  EXPECT_NEAR(m.gain_margin_db, 20.0 * std::log10(2.0 / 0.625), 1e-3);
  EXPECT_LT(m.modulus_margin, 1.0);
}

TEST(LoopMargins, AbsentWithoutLines) {
  const auto m = loop_margins<double>({}, {});
  EXPECT_TRUE(std::isnan(m.crossover_hz) && std::isnan(m.modulus_margin) && std::isnan(m.gain_margin_db));
  const std::array<double, 1> f{1.0};
  const std::array<std::complex<double>, 1> one{std::complex<double>(-1.0, 1.0)};
  EXPECT_EQ(loop_margins<double>(f, one).modulus_margin, 1.0);
}

TEST(LoopMargins, ALineAtATimeGivesTheSameAndNothingIsAllocated) {
  const Lag<float> loop(1.9);
  const auto whole = loop_margins<float>(loop.frequency_hz, loop.value);
  const auto before = test::allocations();
  MarginScan<float> scan;
  for (std::size_t i = 0; i < loop.value.size(); ++i) scan.step(loop.frequency_hz[i], loop.value[i]);
  const auto resonance = running_resonance<float>(loop.frequency_hz, loop.value);
  EXPECT_EQ(test::allocations(), before);
  EXPECT_TRUE(std::isnan(resonance.resonance_hz));
  EXPECT_EQ(scan.margins().crossover_hz, whole.crossover_hz);
  EXPECT_EQ(scan.margins().modulus_margin, whole.modulus_margin);
}

/// Two lightly damped masses: anti-resonance and resonance where the algebra has them.
TYPED_TEST(LoopMarginsOf, ResonanceOfATwoMassLoop) {
  const double j1 = 0.032, j2 = 0.032, stiffness = 143.75, damping = 0.05;
  std::vector<TypeParam> f;
  std::vector<std::complex<TypeParam>> value;
  for (double hz = 2.0; hz < 40.0; hz += 0.01) {
    const std::complex<double> s(0.0, kTwoPi * hz);
    const auto shaft = damping * s + stiffness;
    f.push_back(static_cast<TypeParam>(hz));
    value.push_back(
        std::complex<TypeParam>((j2 * s * s + shaft) / (s * (j1 * j2 * s * s + (j1 + j2) * shaft)) *
                                std::polar(1.0, -0.1)));  // 0.1 rad of lag: into the region
  }
  const auto found = running_resonance<TypeParam>(f, value);
  EXPECT_NEAR(found.antiresonance_hz, std::sqrt(stiffness / j2) / kTwoPi, 0.03);
  EXPECT_NEAR(found.resonance_hz, std::sqrt(stiffness * (1.0 / j1 + 1.0 / j2)) / kTwoPi, 0.03);
}

}  // namespace
}  // namespace resonid::online
