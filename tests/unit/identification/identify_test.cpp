// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <resonid/identification/identify.hpp>
#include <resonid/plant/experiment.hpp>

namespace resonid::identification {
namespace {

/// A two-mass drive (anti-resonance 10.7 Hz, resonance 15.1 Hz) in open loop at 500 Hz, hardly any noise.
plant::ExperimentConfig drive() {
  plant::ExperimentConfig c;
  c.drive.driven_inertia = c.drive.load_inertia = 0.032;
  c.drive.stiffness = 143.75;
  c.drive.damping = 0.3;
  c.drive.viscous_friction = 0.05;
  c.measurement.noise_rms = 0.001;
  c.run.sample_rate_hz = 500.0;
  return c;
}

data::Record run(const plant::ExperimentConfig& c) { return plant::simulate_closed_loop(c).value().record; }

/// `periods` of 500 samples, lines 1 ... 40 Hz.
data::Record multisine(double periods = 8.0) {
  auto c = drive();
  c.excitation.kind = online::Kind::multisine;
  std::vector<double> lines;
  for (int f = 1; f <= 40; ++f) lines.push_back(f);
  c.excitation.lines_hz.assign(lines);
  c.excitation.amplitude = 0.2;
  c.run.duration_s = periods;
  return run(c);
}

data::Record prbs(double periods) {
  auto c = drive();
  c.excitation.kind = online::Kind::prbs;
  c.excitation.register_length = 10;
  c.run.duration_s = periods * 1023.0 / 500.0;
  return run(c);
}

data::Record chirp() {
  auto c = drive();
  c.excitation.kind = online::Kind::chirp;
  c.excitation.from_hz = 35.0;
  c.excitation.to_hz = 1.5;
  c.excitation.duration_s = 10.0;
  return run(c);
}

Options response_only() {
  Options o;
  o.model = ModelChoice::none;
  return o;
}

Options chirp_options() {
  auto o = response_only();
  o.chirp = online::SweepLaw{35.0, 1.5, 10.0};
  return o;
}

void expect_refused(const data::Record& record, const Options& options, const char* option,
                    const char* words) {
  const auto result = identify(record, options);
  ASSERT_FALSE(result) << option;
  EXPECT_EQ(result.error().field, option) << result.error().requirement;
  EXPECT_NE(result.error().requirement.view().find(words), std::string::npos) << result.error().requirement;
}

TEST(IdentifyChoosesTheMethod, FromTheExcitation) {
  EXPECT_EQ(identify(multisine(), response_only())->method, "periodic");
  EXPECT_EQ(identify(prbs(5.0), response_only())->method, "periodic");
  EXPECT_EQ(identify(prbs(1.5), response_only())->method, "welch");  // a period that does not repeat is none
  EXPECT_EQ(identify(chirp(), chirp_options())->method, "local-cubic");
}

TEST(IdentifyChoosesTheMethod, UnlessOneIsGiven) {
  auto options = chirp_options();
  options.method = Method::kalman;
  EXPECT_EQ(identify(chirp(), options)->method, "kalman");
  options = {};
  options.method = Method::model;
  const auto result = identify(multisine(), options);
  ASSERT_TRUE(result);
  EXPECT_EQ(result->method, "model");
  for (std::size_t i = 0; i < result->response.lines(); ++i)  // the model's response, not the measured one
    EXPECT_LT(
        std::abs(result->response.value[i] - result->model->drive.response(result->response.frequency_hz[i])),
        1e-12);
}

TEST(IdentifyChoosesTheApproach, JointWhereTheExcitationIsRecorded) {
  auto record = multisine();
  EXPECT_EQ(identify(record, response_only())->approach, "joint");
  record.excitation = {};
  EXPECT_EQ(identify(record, response_only())->approach, "direct");
}

TEST(IdentifyChoosesTheLines, OfTheExcitationTheChirpOrTheUser) {
  const auto periodic = identify(multisine(), response_only());
  ASSERT_EQ(periodic->response.lines(), 40U);
  EXPECT_NEAR(periodic->response.frequency_hz.front(), 1.0, 1e-9);
  const auto swept = identify(chirp(), chirp_options());
  ASSERT_EQ(swept->response.lines(), 336U);
  EXPECT_NEAR(swept->response.frequency_hz[1], 1.6, 1e-9);
  auto options = chirp_options();
  options.lines_hz = {20.0, 5.0, 5.0, 30.0};
  EXPECT_EQ(identify(chirp(), options)->response.frequency_hz, (std::vector<double>{5.0, 20.0, 30.0}));
  options.band_hz = {4.0, 25.0};
  EXPECT_EQ(identify(chirp(), options)->response.frequency_hz, (std::vector<double>{5.0, 20.0}));
}

TEST(IdentifyRefuses, WhatContradictsTheRecord) {
  const auto record = multisine();
  const auto refused = [&](const char* option, const char* words, auto&& change) {
    auto options = response_only();
    change(options);
    expect_refused(record, options, option, words);
  };
  refused("delay_s", "-0.1", [](Options& o) { o.delay_s = -0.1; });
  refused("delay_s", "nan", [](Options& o) { o.delay_s = std::nan(""); });
  refused("delay_s", "small part of the recording", [](Options& o) { o.delay_s = 5.0; });
  refused("confidence", "between 0 and 1", [](Options& o) { o.confidence = 1.0; });
  refused("band_hz", "empty", [](Options& o) { o.band_hz = {20.0, 20.0}; });
  refused("band_hz", "Nyquist", [](Options& o) { o.band_hz = {260.0, 300.0}; });
  refused("chirp", "250 Hz", [](Options& o) { o.chirp = online::SweepLaw{1.0, 250.0, 10.0}; });
  refused("chirp", "longer than 0 s", [](Options& o) { o.chirp = online::SweepLaw{1.0, 25.0, 0.0}; });
  refused("lines_hz", "250 Hz", [](Options& o) { o.lines_hz = {10.0, 260.0}; });
  refused("period_samples", "4000", [](Options& o) { o.period_samples = 4001; });
  refused("drop_periods", "leaves less than one", [](Options& o) { o.drop_periods = 8; });
  refused("drop_periods", "leaves less than one",
          [](Options& o) { o.drop_periods = std::numeric_limits<std::size_t>::max(); });
  refused("approach", "controller", [](Options& o) { o.approach = Approach::indirect; });
  refused("method", ".chirp", [](Options& o) { o.method = Method::local_cubic; });
  refused("method", "two whole periods", [](Options& o) {
    o.method = Method::periodic;
    o.period_samples = 3000;
  });
  refused("method", ".model", [](Options& o) { o.method = Method::model; });
}

TEST(IdentifyRefuses, ToFollowTheLinesOfAChirp) {
  auto options = chirp_options();
  for (const auto method : {Method::sliding_dft, Method::least_squares}) {
    options.method = method;
    expect_refused(chirp(), options, "method", "found a chirp");
  }
}

TEST(Identify, NamesTheMethodThatWasAskedFor) {
  auto options = chirp_options();
  options.model = ModelChoice::automatic;
  options.method = Method::simulate_and_correct;
  const auto result = identify(chirp(), options);
  ASSERT_TRUE(result) << result.error().requirement;
  const auto& choice = result->choices.at(1);
  EXPECT_EQ(choice.what, "method");
  EXPECT_EQ(choice.chosen, "simulate-and-correct");
  EXPECT_NE(choice.because.find("begins with local-cubic"), std::string::npos) << choice.because;
}

TEST(Identify, DoesNotTrustABlackBoxThatIsUnstable) {
  data::Record record;
  record.sample_rate_hz = 500.0;
  const double radius = 1.001;
  const data::TransferFunction growing{
      {0.0, 0.05}, {1.0, -2.0 * radius * std::cos(0.1), radius * radius}, 0.002};
  std::mt19937_64 engine(1);
  std::normal_distribution<double> normal;
  for (int k = 0; k < 2000; ++k) record.input.samples.push_back(normal(engine) > 0.0 ? 1.0 : -1.0);
  record.output.samples = growing.simulate(record.input.samples);
  for (double& y : record.output.samples) y += 0.05 * normal(engine);
  Options options;
  options.model = ModelChoice::black_box;
  options.order = 2;
  const auto result = identify(record, options);
  ASSERT_TRUE(result) << result.error().requirement;
  ASSERT_TRUE(result->black_box);
  EXPECT_FALSE(result->black_box->stable);
  EXPECT_TRUE(std::any_of(result->findings.begin(), result->findings.end(),
                          [](const auto& f) { return f.id == "unstable-model"; }));
  EXPECT_FALSE(result->trusted);
}

TEST(Identify, DropsPeriodsAtTheStart) {
  auto options = response_only();
  options.drop_periods = 3;
  const auto result = identify(multisine(), options);
  ASSERT_TRUE(result);
  EXPECT_EQ(result->record.samples, 2500U);
}

TEST(Identify, TellsItsStagesInOrder) {
  std::vector<std::string> stages;
  Options options;
  options.progress = [&](std::string_view stage) { stages.emplace_back(stage); };
  ASSERT_TRUE(identify(multisine(), options));
  ASSERT_GE(stages.size(), 4U);
  EXPECT_EQ(stages.front(), "measuring the response");
  EXPECT_EQ(stages.back(), "margins of the loop");
  EXPECT_NE(std::find(stages.begin(), stages.end(), "fitting a two-mass model to the recording"),
            stages.end());
  stages.clear();
  options.model = ModelChoice::none;
  ASSERT_TRUE(identify(multisine(), options));
  EXPECT_EQ(stages, (std::vector<std::string>{"measuring the response", "margins of the loop"}));
}

TEST(Identify, FitsTheStructureThatIsAskedFor) {
  Options options;
  options.model = ModelChoice::rigid;
  const auto rigid = identify(multisine(), options);
  ASSERT_TRUE(rigid && rigid->model);
  EXPECT_EQ(rigid->model->drive.structure, fit::Structure::rigid);
  ASSERT_FALSE(rigid->modes.empty());  // a rigid drive has none: they are those of the response
  for (const auto& mode : rigid->modes) EXPECT_FALSE(mode.from_model);
  EXPECT_TRUE(std::any_of(rigid->findings.begin(), rigid->findings.end(),
                          [](const auto& f) { return f.id == "response-shows-more"; }));
  EXPECT_FALSE(rigid->trusted);  // the response shows plainly that it is not rigid
  options.model = ModelChoice::two_mass;
  const auto two_mass = identify(multisine(), options);
  EXPECT_EQ(two_mass->model->drive.structure, fit::Structure::two_mass);
  EXPECT_TRUE(two_mass->trusted);
}

TEST(Identify, DeadSignalsAreFindings) {
  auto record = prbs(2.0);
  record.output.samples.assign(record.samples(), 1.5);
  const auto result = identify(record, response_only());
  ASSERT_TRUE(result);
  EXPECT_FALSE(result->trusted);
  EXPECT_TRUE(std::any_of(result->findings.begin(), result->findings.end(),
                          [](const auto& f) { return f.id == "dead-output"; }));
}

std::string refusal(const data::Record& record, const Options& options) {
  const auto result = identify(record, options);
  return result ? "no refusal"
                : std::string(result.error().field.view()) + ": " + result.error().requirement.str();
}

TEST(Identify, RefusesWhatContradictsTheRecord) {
  Options options = response_only();
  options.chirp = online::SweepLaw{35.0, 1.5, 10.0};
  EXPECT_TRUE(identify(chirp(), options));
  EXPECT_NE(refusal(multisine(), options).find("chirp: contradicts the recording"), std::string::npos);
  options.chirp = online::SweepLaw{1.5, 35.0, 10.0};
  EXPECT_NE(refusal(chirp(), options).find("is a chirp from 35 to 1.5 Hz in 10 s"), std::string::npos);
  options = response_only();
  for (const std::size_t right : {500U, 1000U}) {
    options.period_samples = right;
    EXPECT_TRUE(identify(multisine(), options)) << right;
  }
  options.period_samples = 450;
  EXPECT_NE(refusal(multisine(), options).find("repeats every 500 samples"), std::string::npos);
  options.period_samples = 1000;
  EXPECT_NE(refusal(chirp(), options).find("period_samples: is 1000, but"), std::string::npos);
}

TEST(Identify, RefusesSignalsThatSayNothing) {
  auto record = multisine();
  record.excitation = {};
  for (std::size_t k = 0; k < record.samples(); ++k)
    record.output.samples[k] = 3.0 - 2.5 * record.input.samples[k];
  EXPECT_NE(refusal(record, {}).find("output: y is -2.5 times u and a constant"), std::string::npos);
  EXPECT_NE(refusal(record, {}).find("proportional controller only answers the noise"), std::string::npos);
  record.input.samples.assign(record.samples(), 0.5);
  EXPECT_NE(refusal(record, {}).find("input: u is constant (0.5)"), std::string::npos);
}

/// A position that is called a velocity, and the other way round: one message, no figures.
TEST(Identify, NamesTheQuantityThatTheOutputIs) {
  const auto velocity = multisine();
  auto position = velocity;
  double angle = 0.0;
  for (double& y : position.output.samples) y = angle += y / position.sample_rate_hz;
  auto called_position = velocity;
  called_position.output_quantity = data::OutputQuantity::position;
  // What the file or the user tells of the unit is not doubted.
  EXPECT_NE(identify(position, {})->findings.front().id, "other-quantity");
  for (auto [record, cure] : {std::pair(position, "position"), std::pair(called_position, "velocity")}) {
    record.output.unit_assumed = true;
    const auto result = identify(record, {});
    ASSERT_TRUE(result);
    EXPECT_FALSE(result->trusted);
    EXPECT_EQ(result->findings.front().id, "other-quantity");
    EXPECT_NE(result->findings.front().meaning.find(std::string(".output_quantity ") + cure),
              std::string::npos);
    EXPECT_FALSE(result->model || result->black_box);
    EXPECT_EQ(std::count_if(result->findings.begin(), result->findings.end(),
                            [](const auto& f) { return f.severity == diagnostics::Severity::error; }),
              1);
  }
  position.output_quantity = data::OutputQuantity::position;
  EXPECT_TRUE(identify(position, {})->trusted);
}

/// Units of everything reported follow those of the signals.
Units units(data::Record record, const char* input, const char* output, data::OutputQuantity quantity,
            data::Motion motion = data::Motion::rotary) {
  record.input.unit = input;
  record.output.unit = output;
  record.output_quantity = quantity;
  record.motion = motion;
  return identify(record, response_only()).value().units;
}

TEST(Identify, UnitsFollowTheSignals) {
  using Q = data::OutputQuantity;
  const auto record = multisine();
  auto u = units(record, "Nm", "rad/s", Q::velocity);
  EXPECT_TRUE(u.physical);
  EXPECT_EQ(u.response, "(rad/s)/Nm");
  EXPECT_EQ(u.inertia, "kgm2");
  u = units(record, "Nm", "rad", Q::position);
  EXPECT_TRUE(u.physical);
  EXPECT_EQ(u.velocity, "rad/s");
  u = units(record, "Nm", "rad/s2", Q::acceleration);
  EXPECT_TRUE(u.physical);
  u = units(record, "N", "m", Q::position, data::Motion::linear);
  EXPECT_TRUE(u.physical);
  EXPECT_EQ(u.inertia, "kg");
  EXPECT_EQ(u.stiffness, "N/m");
  EXPECT_EQ(u.damping, "Ns/m");
  u = units(record, "V", "rad/s", Q::velocity);
  EXPECT_FALSE(u.physical);
  EXPECT_EQ(u.inertia, "V s2/rad");
  EXPECT_EQ(u.stiffness, "V/rad");
  EXPECT_EQ(u.torque, "V");
  u = units(record, "V", "V", Q::position);
  EXPECT_EQ(u.response, "(V/s)/V");
  u = units(record, "Nm", "rad/s", Q::velocity,
            data::Motion::linear);  // told as what they are, not as newtons
  EXPECT_FALSE(u.physical);
}

/// Low sines last longest, and most of the power is theirs; the resonance, 11.9 Hz, shows in the high ones.
TEST(Identify, ResonanceAmongTheHighSinesOfASteppedSineIsFound) {
  auto c = drive();
  c.drive.driven_inertia = 0.03;
  c.drive.load_inertia = 0.25;
  c.drive.stiffness = 150.0;
  c.drive.damping = 0.1;
  c.excitation.kind = online::Kind::stepped_sine;
  std::vector<double> lines;
  for (double f = 1.5; f < 22.0; f *= 1.15) lines.push_back(f);
  c.excitation.lines_hz.assign(lines);
  c.run.sample_rate_hz = 200.0;
  const auto result = identify(run(c), {}).value();
  EXPECT_TRUE(result.trusted);
  ASSERT_TRUE(result.model);
  EXPECT_EQ(result.model->drive.structure, fit::Structure::two_mass);
  const auto resonance = result.model->drive.resonance();
  EXPECT_NEAR(resonance.value, std::sqrt(150.0 * (1.0 / 0.03 + 1.0 / 0.25)) / 6.283185307,
              4.0 * resonance.std);
  EXPECT_LT(resonance.std, 0.01 * resonance.value);
}

}  // namespace
}  // namespace resonid::identification
