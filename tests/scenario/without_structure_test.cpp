// SPDX-License-Identifier: MIT
// Machines that no drive structure describes: what is said all the same. Plants of chosen poles, so that
// resonances are known without the code under test.
#include <cmath>
#include <complex>
#include <experiments.hpp>
#include <random>
#include <resonid/base/constants.hpp>
#include <resonid/report/detail/compare.hpp>

namespace resonid {
namespace {

using identification::ModelChoice;
using identification::Options;

struct Pair {
  double hz = 0.0, damping = 0.0;
};

/// 1 / (1 - p z^-1) of a body with viscous friction, with these pairs of poles and of zeros.
data::TransferFunction plant(double rate_hz, const std::vector<Pair>& poles, const std::vector<Pair>& zeros) {
  const auto times = [&](std::vector<double> a, const Pair& m) {
    const double w = kTwoPi * m.hz / rate_hz;
    const auto z = std::exp(std::complex<double>(-m.damping * w, w * std::sqrt(1.0 - m.damping * m.damping)));
    const double factor[] = {1.0, -2.0 * z.real(), std::norm(z)};
    std::vector<double> product(a.size() + 2, 0.0);
    for (std::size_t i = 0; i < a.size(); ++i)
      for (std::size_t j = 0; j < 3; ++j) product[i + j] += a[i] * factor[j];
    return product;
  };
  std::vector<double> a = {1.0, -std::exp(-2.0 / rate_hz)}, b = {1.0};
  for (const auto& m : poles) a = times(a, m);
  for (const auto& m : zeros) b = times(b, m);
  double at_zero = 0.0, at_pole = 0.0;
  for (const double x : b) at_zero += x;
  for (const double x : a) at_pole += x;
  for (double& x : b) x *= 20.0 * at_pole / at_zero;
  b.insert(b.begin(), 0.0);
  return {b, a, 1.0 / rate_hz};
}

/// White torque of two levels, a noise of 2 % of the velocity.
data::Record record_of(const data::TransferFunction& g, std::size_t samples, unsigned seed) {
  std::mt19937 generator(seed);
  std::normal_distribution<double> normal;
  data::Record record;
  record.sample_rate_hz = 1.0 / g.sample_time_s;
  record.input = {"u", "Nm", {}};
  for (std::size_t k = 0; k < samples; ++k) record.input.samples.push_back(generator() % 2 == 0 ? -1.0 : 1.0);
  record.output = {"y", "rad/s", g.simulate(record.input.samples)};
  double square = 0.0;
  for (const double y : record.output.samples) square += y * y / static_cast<double>(samples);
  for (double& y : record.output.samples) y += 0.02 * std::sqrt(square) * normal(generator);
  return record;
}

/// Of a sensor on the load: two resonances and no anti-resonance between them.
const std::vector<Pair> kOnTheLoad = {{8.0, 0.03}, {30.0, 0.02}};

TEST(NoDriveStructure, LeavesResonancesThatAreReliable) {
  const auto result = test::identified(record_of(plant(200.0, kOnTheLoad, {}), 6000, 1), {});
  EXPECT_FALSE(result.trusted);
  EXPECT_FALSE(result.model);
  ASSERT_TRUE(result.black_box);
  EXPECT_TRUE(test::finding(result, "black-box-instead"));
  EXPECT_TRUE(result.reliable.response);
  EXPECT_TRUE(result.reliable.resonances);
  EXPECT_FALSE(result.reliable.parameters);
  ASSERT_EQ(result.modes.size(), kOnTheLoad.size());
  for (std::size_t i = 0; i < kOnTheLoad.size(); ++i) {
    EXPECT_FALSE(result.modes[i].anti);
    EXPECT_NEAR(result.modes[i].frequency_hz.value, kOnTheLoad[i].hz, 4.0 * result.modes[i].frequency_hz.std);
    EXPECT_LT(result.modes[i].frequency_hz.std, 0.01 * kOnTheLoad[i].hz);
  }
  const auto text = report::summary_text(result);
  EXPECT_NE(text.find("reliable by themselves: the measured response"), std::string::npos) << text;
  EXPECT_EQ(text.find("Parameters,"), std::string::npos) << text;
}

TEST(NoDriveStructure, IsNotSaidOfADrive) {
  const auto drive = plant(200.0, {{11.0, 0.04}}, {{7.8, 0.03}});
  const auto result = test::identified(record_of(drive, 3000, 1), {});
  EXPECT_TRUE(result.model);
  EXPECT_FALSE(result.black_box);
  EXPECT_FALSE(test::finding(result, "black-box-instead"));
}

/// Five modes, two of them in the band: the box holds there, and its order is spent there.
TEST(BlackBoxInABand, HoldsThere) {
  const std::vector<Pair> poles = {{8.0, 0.03}, {30.0, 0.02}, {110.0, 0.01}, {180.0, 0.01}, {260.0, 0.01}};
  const auto g = plant(1000.0, poles, {{12.0, 0.02}, {70.0, 0.02}, {150.0, 0.02}, {220.0, 0.02}});
  Options options;
  options.model = ModelChoice::black_box;
  options.band_hz = {3.0, 50.0};
  const auto result = test::identified(record_of(g, 16000, 1), options);
  ASSERT_TRUE(result.black_box);
  EXPECT_NEAR(result.black_box->model.transfer_function.sample_time_s, 0.004, 1e-12);
  EXPECT_LE(result.black_box->model.transfer_function.denominator.size(), 9U);
  std::vector<data::Mode> resonances;
  for (const auto& mode : result.modes)
    if (!mode.anti && mode.frequency_hz.value < 50.0) resonances.push_back(mode);
  ASSERT_GE(resonances.size(), 2U);
  EXPECT_NEAR(resonances[0].frequency_hz.value, 8.0, 4.0 * resonances[0].frequency_hz.std + 0.008);
  EXPECT_NEAR(resonances[1].frequency_hz.value, 30.0, 4.0 * resonances[1].frequency_hz.std + 0.03);
  EXPECT_FALSE(test::finding(result, "misfit"));
  for (const double f : {5.0, 8.0, 12.0, 20.0, 30.0, 45.0}) {
    const auto truth = g.response(f);
    EXPECT_LT(std::abs(result.black_box->model.response(std::vector<double>{f}).value[0] - truth),
              0.03 * std::abs(truth) + 0.01)
        << f;
  }
}

}  // namespace
}  // namespace resonid
