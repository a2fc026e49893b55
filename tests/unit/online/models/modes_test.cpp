// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <golden.hpp>
#include <random>
#include <resonid/online/models/detail/model_response.hpp>
#include <resonid/online/models/modes.hpp>
#include <resonid/online/supervision/detail/loop_errors.hpp>
#include <vector>

#include "allocation_counter.hpp"

namespace resonid::online {
namespace {

using Model = DiscreteModel<double, 3>;

Model model_of(const nlohmann::json& sampled) {
  Model m;
  for (std::size_t i = 0; i < 3; ++i) {
    m.b[i] = sampled.at("b")[i + 1].get<double>();
    m.a[i] = sampled.at("a")[i + 1].get<double>();
  }
  return m;
}

// The golden coefficients carry 12 digits.
TEST(SampledModes, AreThoseOfTheContinuousMachine) {
  const auto golden = test::golden_json("models.json");
  int cases = 0;
  for (const auto& [name, machine] : golden.items()) {
    for (const char* key : {"Ts=0.0005", "Ts=0.001", "Ts=0.002", "Ts=0.004"}) {
      if (!machine.contains(key)) continue;
      const double rate_hz = 1.0 / std::stod(std::string(key).substr(3));
      const SampledModes<3> modes(model_of(machine.at(key)), rate_hz);
      ASSERT_EQ(modes.resonances().count, 1U) << name << key;
      ASSERT_EQ(modes.antiresonances().count, 1U) << name << key;
      EXPECT_NEAR(modes.resonances()[0].frequency_hz / machine.at("fres").get<double>(), 1.0, 1e-6)
          << name << key;
      EXPECT_NEAR(modes.antiresonances()[0].frequency_hz / machine.at("fares").get<double>(), 1.0, 1e-6)
          << name << key;
      ++cases;
    }
  }
  EXPECT_EQ(cases, 21);
}

TEST(SampledModes, GiveTheDampingRatio) {
  const auto golden = test::golden_json("models.json");
  const auto& p = golden.at("belt2").at("params");
  const double k = p.at("K").get<double>(), d = p.at("D").get<double>(), j = p.at("J1").get<double>();
  const SampledModes<3> modes(model_of(golden.at("belt2").at("Ts=0.002")), 500.0);
  const double twice = 2.0 * 0.05 * 0.05 / j;  // both inertias are alike: w^2 = K twice
  EXPECT_NEAR(modes.resonances()[0].damping_ratio, 0.5 * d * twice / std::sqrt(k * twice), 1e-6);
  EXPECT_NEAR(modes.antiresonances()[0].damping_ratio, 0.25 * d * twice / std::sqrt(0.5 * k * twice), 1e-6);
}

TEST(SampledModes, StandardDeviationsAreThoseOfDifferences) {
  const auto golden = test::golden_json("models.json");
  for (const auto& [name, key, rate_hz] :
       {std::tuple{"tooth_x0.38", "Ts=0.004", 250.0}, std::tuple{"tooth_x1.4", "Ts=0.002", 500.0},
        std::tuple{"belt3", "Ts=0.002", 500.0}}) {
    const Model m = model_of(golden.at(name).at(key));
    for (int i = 0; i < 6; ++i) {
      ModelCovariance<double, 3> one = ModelCovariance<double, 3>::Zero();
      one(i, i) = 1.0;
      const double h = 1e-6;
      std::array<double, 2> resonance{}, antiresonance{};
      for (int side = 0; side < 2; ++side) {
        Model moved = m;
        (i < 3 ? moved.b[static_cast<std::size_t>(i)] : moved.a[static_cast<std::size_t>(i - 3)]) +=
            side == 0 ? -h : h;
        const SampledModes<3> modes(moved, rate_hz);
        resonance[static_cast<std::size_t>(side)] = modes.resonances()[0].frequency_hz;
        antiresonance[static_cast<std::size_t>(side)] = modes.antiresonances()[0].frequency_hz;
      }
      const SampledModes<3> modes(m, rate_hz);
      const double by_resonance = std::abs(resonance[1] - resonance[0]) / (2.0 * h);
      const double by_antiresonance = std::abs(antiresonance[1] - antiresonance[0]) / (2.0 * h);
      EXPECT_NEAR(modes.resonances(one)[0].std_hz, by_resonance, 1e-4 * (1.0 + by_resonance)) << name << i;
      EXPECT_NEAR(modes.antiresonances(one)[0].std_hz, by_antiresonance, 1e-4 * (1.0 + by_antiresonance))
          << name << i;
    }
  }
}

TEST(SampledModes, FindTwoPairsOfAThreeMassDrive) {
  // From its poles: an integrator and two pairs.
  const double rate_hz = 1000.0;
  const auto pole = [&](double f, double zeta) {
    return std::exp(std::complex<double>(-zeta, std::sqrt(1.0 - zeta * zeta)) * kTwoPi * f / rate_hz);
  };
  const auto slow = pole(15.09, 0.099), fast = pole(78.63, 0.155);
  const Roots<5> poles{{{1.0, 0.0}, fast, std::conj(fast), slow, std::conj(slow)}};
  DiscreteModel<double, 5> m;
  m.a = from_roots<5>(poles);
  m.b = {0.1, 0.0, 0.0, 0.0, 0.0};
  const auto modes = SampledModes<5>(m, rate_hz).resonances();
  ASSERT_EQ(modes.count, 2U);
  EXPECT_NEAR(modes[0].frequency_hz, 15.09, 1e-6);
  EXPECT_NEAR(modes[0].damping_ratio, 0.099, 1e-8);
  EXPECT_NEAR(modes[1].frequency_hz, 78.63, 1e-6);
}

TEST(SampledModes, AreEmptyWhereNothingOscillates) {
  DiscreteModel<double, 3> m;
  m.b = {1.0, 0.1, 0.0};
  m.a = from_roots<3>({{{1.0, 0.0}, {0.5, 0.0}, {0.2, 0.0}}});
  EXPECT_TRUE(SampledModes<3>(m, 100.0).resonances().empty());
  DiscreteModel<double, 1> rigid{{0.5}, {-1.0}};
  EXPECT_TRUE(SampledModes<1>(rigid, 100.0).resonances().empty());
  EXPECT_TRUE(SampledModes<1>(rigid, 100.0).antiresonances().empty());
  m.a[0] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(SampledModes<3>(m, 100.0).resonances().empty());
}

TEST(Polynomial, RootsAreThoseItWasMadeFrom) {
  std::mt19937_64 generator(7);
  std::uniform_real_distribution<double> uniform(-1.2, 1.2);
  const std::size_t before = test::allocations();
  for (int round = 0; round < 300; ++round) {
    Roots<5> z;
    z[0] = uniform(generator);
    for (std::size_t i = 1; i < 5; i += 2) {
      const double x = uniform(generator), y = uniform(generator);
      if (round % 3 == 0) {
        z[i] = x;
        z[i + 1] = y;
      } else {
        z[i] = {x, y};
        z[i + 1] = {x, -y};
      }
    }
    const auto found = roots<5>(from_roots<5>(z));
    double largest = 0.0;
    for (const auto& w : z) {
      double nearest = 1e9;
      for (const auto& v : found) nearest = std::min(nearest, std::abs(v - w));
      EXPECT_LT(nearest, 1e-5);  // roots that nearly coincide keep half of the digits
      largest = std::max(largest, std::abs(w));
    }
    const Monic<5> c = from_roots<5>(z);
    EXPECT_TRUE(roots_within(c, largest * 1.001));
    EXPECT_FALSE(roots_within(c, largest * 0.999));
  }
  EXPECT_EQ(test::allocations(), before);
}

// Beside an integrator the slope is that of the resonance, (w Ts)^2: rounding alone makes steps far above
// 1e-16.
TEST(Polynomial, FindsTheIntegratorsRootInAFewStepsWhateverTheRounding) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> angle(0.02, 1.0), damping(0.001, 0.2), off(0.97, 1.0);
  for (int run = 0; run < 20'000; ++run) {
    const double w = angle(random), zeta = damping(random), pole = run % 2 == 0 ? 1.0 : off(random);
    const double c1 = -2.0 * std::exp(-zeta * w) * std::cos(w * std::sqrt(1.0 - zeta * zeta));
    const double c2 = std::exp(-2.0 * zeta * w);
    const auto root = detail::real_root_near_one({c1 - pole, c2 - pole * c1, -pole * c2});
    ASSERT_TRUE(root.has_value()) << run;
    EXPECT_NEAR(*root, pole, 1e-15 / (w * w)) << run;
  }
}

TEST(ModelResponse, IsTheGoldenOne) {
  const auto golden = test::golden_json("models.json");
  const auto& machine = golden.at("tooth_x0.8");
  const auto truth = test::golden_complex(machine.at("Ts=0.004").at("G_zoh"));
  const Model m = model_of(machine.at("Ts=0.004"));
  for (std::size_t i = 0; i < truth.size(); ++i)
    EXPECT_LT(std::abs(response(m, machine.at("f")[i].get<double>(), 250.0) - truth[i]), 1e-8);
}

TEST(ModelResponse, StandardDeviationIsTheScatter) {
  const auto golden = test::golden_json("models.json");
  const Model m = model_of(golden.at("tooth_x0.8").at("Ts=0.004"));
  std::mt19937_64 generator(3);
  std::normal_distribution<double> normal;
  Eigen::Matrix<double, 6, 6> root;
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j) root(i, j) = 1e-4 * normal(generator);
  const ModelCovariance<double, 3> covariance = root * root.transpose();
  double square = 0.0;
  constexpr int kRounds = 4000;
  const auto g = response(m, 50.0, 250.0);
  for (int round = 0; round < kRounds; ++round) {
    Eigen::Matrix<double, 6, 1> x;
    for (int i = 0; i < 6; ++i) x(i) = normal(generator);
    x = root * x;
    Model moved = m;
    for (std::size_t i = 0; i < 3; ++i) {
      moved.b[i] += x(static_cast<int>(i));
      moved.a[i] += x(static_cast<int>(i + 3));
    }
    square += std::norm(response(moved, 50.0, 250.0) - g) / kRounds;
  }
  const RelativeError error = relative_error(m, covariance, 50.0, 250.0);
  EXPECT_NEAR(std::abs(g) * std::sqrt(error.real + error.imag) / std::sqrt(square), 1.0, 0.06);
}

TEST(ModelResponse, DrawsUnstablePolesIn) {
  DiscreteModel<double, 3> m;
  const std::complex<double> outside = std::polar(1.1, 0.8);
  m.a = from_roots<3>({{{0.9, 0.0}, outside, std::conj(outside)}});
  EXPECT_FALSE(poles_within(m, 1.0));
  const auto drawn = stabilized(m, 0.99);
  EXPECT_TRUE(poles_within(drawn, 0.99 + 1e-9));
  EXPECT_NEAR(std::abs(std::arg(SampledModes<3>(drawn, 1.0).poles()[1])), 0.8, 1e-9);
  const auto same = stabilized(drawn, 0.995);
  EXPECT_EQ(same.a, drawn.a);
}

}  // namespace
}  // namespace resonid::online
