// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <filesystem>
#include <resonid/resonid.hpp>
#include <string>
#include <vector>

namespace resonid {
namespace {

/// The published drive (experiments/demo.toml): anti-resonance 10.67 Hz, resonance 15.09 Hz.
SimulateOptions published(std::uint64_t seed) {
  SimulateOptions e;
  e.drive.driven_inertia = e.drive.load_inertia = 0.032;
  e.drive.stiffness = 5.75e4;
  e.drive.damping = 120.0;
  e.drive.radius_m = 0.05;
  e.controller.kind = plant::ControllerKind::pi;
  e.controller.gain = 1.036;
  e.controller.integral_time_s = 0.147;
  e.excitation.kind = online::Kind::chirp;
  e.excitation.from_hz = 35.0;
  e.excitation.to_hz = 1.5;
  e.excitation.duration_s = 17.0;
  e.measurement.delay_s = 0.004;
  e.measurement.noise_rms = 0.1;
  e.motion = {plant::MotionKind::constant, 10.0};
  e.run.sample_rate_hz = 500.0;
  e.run.seed = seed;
  return e;
}

IdentifyOptions known() { return {.controller = pi(1.036, 0.147), .delay_s = 0.004}; }

class FrontDoor : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    simulation_ = new Simulation(simulate(published(1)).value());
    result_ = new Result(identify(simulation_->record, known()).value());
  }
  static void TearDownTestSuite() {
    delete result_;
    delete simulation_;
  }
  static inline Simulation* simulation_ = nullptr;
  static inline Result* result_ = nullptr;
};

TEST_F(FrontDoor, FindsTheModesThatAreTrue) {
  ASSERT_EQ(result_->modes.size(), 2U);
  for (std::size_t i = 0; i < 2; ++i) {
    const auto& mode = result_->modes[i];
    const auto& truth = (mode.anti ? simulation_->truth.antiresonances : simulation_->truth.resonances).at(0);
    EXPECT_EQ(mode.name(), i == 0 ? "anti-resonance" : "resonance");
    EXPECT_NEAR(mode.frequency_hz.value, truth.frequency_hz, 4.0 * mode.frequency_hz.std) << i;
    EXPECT_LT(mode.frequency_hz.std, 0.1);
  }
  EXPECT_TRUE(result_->trusted);
}

// The same law, sampled by hand: pi() takes the record's sample time.
TEST_F(FrontDoor, SamplesAPiControllerWithTheRecord) {
  auto options = known();
  options.controller = data::pi_controller(1.036, 0.147, 0.002);
  const auto sampled = identify(simulation_->record, options).value();
  ASSERT_TRUE(sampled.loop && result_->loop);
  EXPECT_EQ(*sampled.loop->margins.phase_margin_deg(), *result_->loop->margins.phase_margin_deg());
  EXPECT_EQ(sampled.modes.back().frequency_hz.value, result_->modes.back().frequency_hz.value);
}

TEST_F(FrontDoor, ReadsTheResultThatItWrote) {
  const auto back = from_json<Result>(to_json(*result_));
  ASSERT_TRUE(back);
  ASSERT_EQ(back->modes.size(), result_->modes.size());
  for (std::size_t i = 0; i < back->modes.size(); ++i) {
    EXPECT_EQ(back->modes[i].frequency_hz.value, result_->modes[i].frequency_hz.value);
    EXPECT_EQ(back->modes[i].frequency_hz.std, result_->modes[i].frequency_hz.std);
  }
  EXPECT_FALSE(from_json<Result>("{"));
  EXPECT_FALSE(from_json<Result>("{}"));
}

TEST_F(FrontDoor, ReadsTheResultsOfSeveralRecordsThatItWrote) {
  const std::vector<Record> records{simulation_->record, simulate(published(2)).value().record};
  BatchTask task;
  task.files = {"one.csv", "two.csv"};
  task.load = [&](std::size_t i) -> expected<identification::BatchJob, Error> {
    return identification::BatchJob{records[i], known()};
  };
  const Batch batch = identify_batch(task);
  ASSERT_TRUE(batch.complete());
  const std::vector<Result> results{*batch.entries[0].result, *batch.entries[1].result};
  const Joint joint = join(records, results, known()).value();

  const std::string text = to_json(batch, joint);
  const auto read = from_json<Batch>(text);
  ASSERT_TRUE(read);
  ASSERT_EQ(read->entries.size(), 2U);
  EXPECT_EQ(read->entries[1].file, "two.csv");
  EXPECT_EQ(read->entries[1].result->modes.at(0).frequency_hz.value, results[1].modes[0].frequency_hz.value);
  ASSERT_EQ(read->figures.size(), batch.figures.size());
  EXPECT_EQ(read->figures[0].mean, batch.figures[0].mean);
  const auto both = from_json<Joint>(text);
  ASSERT_TRUE(both);
  EXPECT_EQ(both->result.modes.at(0).frequency_hz.std, joint.result.modes[0].frequency_hz.std);
  EXPECT_EQ(from_json<Joint>(to_json(batch)).error().field, "$.joint");

  const auto file = std::filesystem::temp_directory_path() / "resonid_front_door_batch_test.html";
  EXPECT_EQ(write_report(file, batch, joint).value(), file);
  EXPECT_EQ(write_report(file, batch).value(), file);
  std::filesystem::remove(file);
}

TEST_F(FrontDoor, HoldsTheModelAgainstAnotherRecordAndResult) {
  const auto other = simulate(published(2)).value();
  ValidateOptions validation;
  validation.common = known();
  EXPECT_EQ(validate(other.record, *result_, validation).value().verdict, identification::Verdict::accepted);

  const auto again = identify(other.record, known()).value();
  EXPECT_FALSE(compare(*result_, again).value().changed);
  auto stiffer = published(3);
  stiffer.drive.stiffness *= 1.1;
  const auto changed = identify(simulate(stiffer).value().record, known()).value();
  EXPECT_TRUE(compare(*result_, changed).value().changed);
}

TEST_F(FrontDoor, WritesAPageAndSaysWhereItCannot) {
  const auto file = std::filesystem::temp_directory_path() / "resonid_front_door_test.html";
  EXPECT_EQ(write_report(file, *result_, simulation_->record).value(), file);
  EXPECT_GT(std::filesystem::file_size(file), 10000U);
  EXPECT_EQ(write_report(file, *simulation_).value(), file);
  std::filesystem::remove(file);
  EXPECT_FALSE(write_report("/nowhere/at/all.html", *result_, simulation_->record));
  EXPECT_FALSE(read_record("/nowhere/at/all.csv"));
}

// A tuning that is put together here: tune() has tests of its own.
TEST_F(FrontDoor, ReadsTheTuningThatItWrote) {
  Tuning tuning;
  tuning.sample_time_s = 0.002;
  tuning.units = result_->units;
  tuning.machines = {result_->model->drive};
  identification::TunedController controller;
  controller.structure = "pi";
  controller.name = "PI";
  controller.gains = design::FilteredPi{2.1, 21.5, {}};
  controller.feedback = data::pi_controller(2.1, 2.1 / 21.5, 0.002);
  controller.stable = true;
  tuning.candidates = {controller};
  const auto back = from_json<Tuning>(to_json(tuning));
  ASSERT_TRUE(back);
  EXPECT_EQ(back->proposed().feedback.numerator, controller.feedback.numerator);
  EXPECT_EQ(back->machines.at(0).parameters.stiffness, result_->model->drive.parameters.stiffness);
  EXPECT_EQ(to_json(*back), to_json(tuning));
  EXPECT_FALSE(from_json<Tuning>(to_json(*result_)));
  const auto file = std::filesystem::temp_directory_path() / "resonid_front_door_tuning_test.html";
  EXPECT_EQ(write_report(file, tuning).value(), file);
  EXPECT_GT(std::filesystem::file_size(file), 10000U);
  std::filesystem::remove(file);
}

TuneOptions few_draws() {
  TuneOptions options;
  options.structure = identification::ControllerStructure::pi;
  options.draws = 500;
  return options;
}

TEST_F(FrontDoor, DesignsAControllerAndTakesItAway) {
  const auto wanted = few_draws();
  ASSERT_TRUE(check_exportable(wanted, ExportFormat::c));
  EXPECT_EQ(check_exportable(wanted, ExportFormat::klipper).error().field, "shaper");
  Tuning tuning = tune(*result_, wanted).value();
  simulate_on_model(tuning, *result_);
  EXPECT_EQ(tuning.simulated.size(), 3U);  // a step of the reference, one of the load, a motion
  EXPECT_EQ(tuning.simulated.front().what, "reference step");

  ExportNames names;
  names.name = "loop";
  EXPECT_NE(exported(tuning, ExportFormat::c, names).value().find("loop_step"), std::string::npos);
  EXPECT_FALSE(exported(tuning, ExportFormat::klipper));
  const ControllerFile law = read_controller(controller_json(tuning).value(), 0.002).value();
  EXPECT_EQ(law.structure, "pi");
  EXPECT_EQ(law.numerator, tuning.proposed().feedback.numerator);
  EXPECT_EQ(law.denominator, tuning.proposed().feedback.denominator);
  EXPECT_FALSE(read_controller(controller_json(tuning).value(), 0.001));

  EXPECT_FALSE(own_gains(tuning));
  tuning.input_scale = 2.0;
  tuning.input_unit = "A";
  tuning.output_unit = "rad/s";
  const OwnGains own = own_gains(tuning).value();
  EXPECT_EQ(own.factor, 2.0);
  EXPECT_EQ(own.units.kp, "A/(rad/s)");
  EXPECT_NE(controller_json(tuning)->find("recorded_units"), std::string::npos);
  tuning.candidates.front().stable = false;
  EXPECT_EQ(controller_json(tuning).error().field, "evaluate");
}

// The machine again, under the new controller.
TEST_F(FrontDoor, ChecksADesignOnARecording) {
  Tuning tuning = tune(*result_, few_draws()).value();
  auto experiment = published(2);
  experiment.controller = {};
  experiment.controller.kind = plant::ControllerKind::transfer_function;
  experiment.controller.numerator = tuning.proposed().feedback.numerator;
  experiment.controller.denominator = tuning.proposed().feedback.denominator;
  const auto after = simulate(experiment).value();
  const auto measured =
      identify(after.record, {.controller = tuning.proposed().feedback, .delay_s = 0.004}).value();
  ASSERT_TRUE(check_on(tuning, *result_, measured));
  const TuningCheck& check = tuning.check.value();
  EXPECT_TRUE(check.agrees) << check.cause;
  EXPECT_GT(check.judged_lines, 10U);

  auto scheduled = tuning;
  scheduled.schedule.emplace();
  EXPECT_EQ(check_on(scheduled, *result_, measured).error().field, "check");
  scheduled.schedule.reset();
  scheduled.machines.clear();  // as a design by a response
  EXPECT_EQ(check_on(scheduled, *result_, measured).error().field, "check");
  EXPECT_EQ(simulate_on(scheduled, experiment_of(*result_, few_draws())).error().field, "simulate");
  Result bare = *result_;
  bare.model.reset();
  EXPECT_EQ(check_on(tuning, bare, measured).error().field, "check");
  simulate_on_model(tuning, bare);
  EXPECT_EQ(tuning.findings.back().id, "not-simulated");
  EXPECT_EQ(results_over_position(bare, Track{}).error().field, "results");
}

TEST(FirstLoopOfTheFrontDoor, IsTakenAwayBeforeThereIsAResult) {
  FirstLoopOptions known;
  known.motor_inertia = 0.032;
  known.total_inertia = 0.064;
  known.sample_rate_hz = 500.0;
  known.delay_s = 0.004;
  const FirstLoop loop = first_loop(known).value();
  EXPECT_NE(exported(loop, ExportFormat::structured_text).value().find("FUNCTION_BLOCK"), std::string::npos);
  EXPECT_EQ(read_controller(controller_json(loop), 0.002).value().numerator,
            loop.controller.feedback.numerator);
}

TEST_F(FrontDoor, RefusesWrongCalls) {
  auto options = known();
  options.confidence = 1.5;
  const auto refused = identify(simulation_->record, options);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().field, "confidence");
  EXPECT_FALSE(compare(*result_, *result_, {.weight = {}, .confidence = 0.0}));
  EXPECT_FALSE(plan(Result{}));
}

// Names are what the command line and the files say.
TEST(EnumNames, LeadBothWays) {
  for (const auto& known : enum_names(identification::Method{})) {
    EXPECT_EQ(name_of(known.value), known.name);
    EXPECT_EQ(from_name<identification::Method>(known.name), known.value);
  }
  EXPECT_FALSE(from_name<identification::Method>("wavelet"));
  EXPECT_EQ(name_of(Approach::joint), "joint");
}

}  // namespace
}  // namespace resonid
