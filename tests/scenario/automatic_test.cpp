// SPDX-License-Identifier: MIT
// What identify() chooses and tells by itself, over seeds and machines for which a choice once went wrong.
#include <algorithm>
#include <cmath>
#include <experiments.hpp>
#include <resonid/fit/output_error.hpp>
#include <resonid/io/shipped_experiments.hpp>
#include <resonid/plant/detail/white_noise.hpp>
#include <unsupported/Eigen/MatrixFunctions>

namespace resonid {
namespace {

/// Open loop, an encoder on the driven side; sampled exactly by the matrix exponential.
data::Record encoder_record(double noise, std::uint64_t seed) {
  const double ts = 0.002, j1 = 0.032, j2 = 0.032, k = 143.75, d = 0.3, b = 0.05;
  Eigen::Matrix<double, 5, 5> a = Eigen::Matrix<double, 5, 5>::Zero();  // v1, v2, twist, angle; torque
  a.row(0) << -(d + b) / j1, d / j1, -k / j1, 0.0, 1.0 / j1;
  a.row(1) << d / j2, -d / j2, k / j2, 0.0, 0.0;
  a.row(2) << 1.0, -1.0, 0.0, 0.0, 0.0;
  a.row(3) << 1.0, 0.0, 0.0, 0.0, 0.0;
  const Eigen::Matrix<double, 5, 5> step = (a * ts).exp();
  data::Record record;
  record.sample_rate_hz = 1.0 / ts;
  record.output_quantity = data::OutputQuantity::position;
  record.input = {"u", "Nm", {}};
  record.output = {"position", "rad", {}};
  plant::WhiteNoise coin(seed, 1.0), encoder(1000 + seed, noise);
  Eigen::Matrix<double, 5, 1> state = Eigen::Matrix<double, 5, 1>::Zero();
  for (int i = 0; i < 5000; ++i) {
    record.output.samples.push_back(state(3) + encoder.step());
    state(4) = coin.step() > 0.0 ? 1.0 : -1.0;
    record.input.samples.push_back(state(4));
    state = step * state;
  }
  return record;
}

/// A position says more than its differences: 0.03 % of the stiffness, 2 % by the measured response.
TEST(Encoder, APositionIsUsedToItsNoise) {
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    SCOPED_TRACE(seed);
    const auto result = test::identified(encoder_record(1e-4, seed), {});
    ASSERT_TRUE(result.model);
    EXPECT_TRUE(result.model->from_record);
    EXPECT_TRUE(result.trusted);
    ASSERT_EQ(result.model->drive.structure, fit::Structure::two_mass);
    const auto stiffness = result.model->drive.estimate(fit::kStiffness);
    EXPECT_LT(stiffness.std, 0.001 * 143.75);
    EXPECT_NEAR(stiffness.value, 143.75, 3.5 * stiffness.std);
    const auto friction = result.model->drive.estimate(fit::kViscousFriction);
    EXPECT_NEAR(friction.value, 0.05, 3.5 * friction.std);
  }
}

/// Two periods in noise: a third of the averaged lines are known well, and nothing moves in a rhythm.
TEST(Tensioner, AutoStaysWithAveragesThatTellEnough) {
  auto c = io::shipped_experiment("three_mass_tensioner");
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    SCOPED_TRACE(seed);
    c.run.seed = seed;
    const auto run = test::simulated(c);
    const auto result = test::identified(run.record, {});
    EXPECT_NE(result.method, "local-polynomial");
    EXPECT_TRUE(result.trusted);
    ASSERT_TRUE(result.loop && result.loop->margins.phase_margin_deg());
    EXPECT_NEAR(*result.loop->margins.phase_margin_deg(), 63.3, 1.0);
    const auto resonance =
        std::find_if(result.modes.begin(), result.modes.end(), [](const data::Mode& r) { return !r.anti; });
    ASSERT_NE(resonance, result.modes.end());
    EXPECT_NEAR(resonance->frequency_hz.value, run.truth.resonances.front().frequency_hz,
                4.0 * resonance->frequency_hz.std);
  }
}

/// A controller that the record shows but for noise on the input is uncertain, and so are its margins.
TEST(OwnController, ItsErrorIsInTheMargins) {
  auto c = io::shipped_experiment("vi_prbs_a");
  c.run.duration_s = 8.0;
  double squares = 0.0;
  constexpr int kSeeds = 8;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    c.run.seed = static_cast<std::uint64_t>(seed);
    auto record = test::simulated(c).record;
    plant::WhiteNoise noise(500 + c.run.seed, 0.3);
    for (double& u : record.input.samples) u += noise.step();
    identification::Options options;
    options.delay_s = c.measurement.delay_s;
    const auto result = test::identified(record, options);
    ASSERT_TRUE(result.loop && result.loop->phase_margin_std_deg);
    squares +=
        std::pow((*result.loop->margins.phase_margin_deg() - 63.488) / *result.loop->phase_margin_std_deg, 2);
  }
  EXPECT_LT(squares / kSeeds, 3.3);  // 1; chi-square of 8 degrees, 0.1 %
}

/// What is simulated in the loop of such a controller has its error: a gain that is off is taken for
/// friction.
TEST(OwnController, ItsErrorIsInTheModel) {
  auto c = io::shipped_experiment("vi_prbs_a");
  c.run.duration_s = 8.0;
  double squares = 0.0;
  constexpr int kSeeds = 8;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    c.run.seed = static_cast<std::uint64_t>(seed);
    auto record = test::simulated(c).record;
    plant::WhiteNoise noise(500 + c.run.seed, 0.3);
    for (double& u : record.input.samples) u += noise.step();
    fit::OutputErrorConfig config;
    config.initial.parameters = {0.03, 0.035, 150.0, 0.25, 0.0};
    config.viscous_friction = true;
    config.known_delay_s = c.measurement.delay_s;
    config.predictor = fit::Predictor::joint;
    const auto fit = fit::fit_output_error(record, config);
    ASSERT_TRUE(fit && fit->converged);
    const auto friction = fit->model.estimate(fit::kViscousFriction);
    squares += std::pow((friction.value - c.drive.viscous_friction) / friction.std, 2);
  }
  RecordProperty("squared error over the claimed one", std::to_string(squares / kSeeds));
  EXPECT_LT(squares / kSeeds, 3.3);  // 1; chi-square of 8 degrees, 0.1 % on either side
  EXPECT_GT(squares / kSeeds, 0.1);
}

/// Where the record does not excite the crossover the controller is extrapolated: no error bars, and a
/// finding.
TEST(OwnController, MarginsBeyondTheExcitedBandHaveNoErrorBars) {
  const auto run = test::simulated(io::shipped_experiment("v_tooth_chirp_near"));
  const auto result = test::identified(run.record, {});
  ASSERT_TRUE(result.loop);
  EXPECT_FALSE(result.loop->phase_margin_std_deg);
  EXPECT_TRUE(std::any_of(result.findings.begin(), result.findings.end(),
                          [](const diagnostics::Finding& f) { return f.id == "crossover-outside-band"; }));
}

/// A mode above the band, which the record does not show, would change them.
TEST(Margins, OfAModelBeyondTheBandHaveNoErrorBars) {
  auto c = io::shipped_experiment("vi_chirp_a");
  c.excitation.from_hz = 28.0;  // downwards; the phase crosses -180 deg at 50 Hz
  const auto result = test::identified(test::simulated(c).record, test::known(c));
  ASSERT_TRUE(result.loop);
  const auto& margins = result.loop->margins;
  const double end_hz = result.response.frequency_hz.back();
  ASSERT_LT(margins.crossover_hz().value(), end_hz);
  EXPECT_TRUE(result.loop->crossover_std_hz && result.loop->phase_margin_std_deg);
  ASSERT_GT(margins.gain_margin_hz.value(), 1.5 * end_hz);
  EXPECT_FALSE(result.loop->gain_margin_std_db);
  EXPECT_EQ(result.loop->modulus_margin_std.has_value(), margins.modulus_margin_hz < 1.5 * end_hz);
  EXPECT_TRUE(std::any_of(result.findings.begin(), result.findings.end(),
                          [](const diagnostics::Finding& f) { return f.id == "margins-beyond-band"; }));
}

/// Lines of a local polynomial that a two-mass model misses in a smooth way are not repeated by independent
/// noise.
TEST(FourMasses, NoBootstrapWhereRepetitionsWouldPromiseTooMuch) {
  const auto run = test::simulated(io::shipped_experiment("chain_four_masses"));
  identification::Options options;
  options.model = identification::ModelChoice::two_mass;
  options.method = identification::Method::local_polynomial;
  options.bootstrap = 20;
  options.delay_s = 0.006;  // 1 ms in truth: nothing of the record comes out with it
  const auto result = test::identified(run.record, options);
  ASSERT_TRUE(result.model);
  ASSERT_FALSE(result.model->from_record);
  EXPECT_FALSE(result.bootstrap);
  EXPECT_TRUE(std::any_of(result.findings.begin(), result.findings.end(),
                          [](const diagnostics::Finding& f) { return f.id == "no-bootstrap"; }));
}

}  // namespace
}  // namespace resonid
