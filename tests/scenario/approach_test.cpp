// SPDX-License-Identifier: MIT
// Closed loop in heavy noise: noise sd 1 rad/s, three times the published gain. A direct spectral estimate is
// biased towards -1/C there; what identify() chooses by itself must not be, whatever was recorded.
#include <experiments.hpp>
#include <resonid/plant/detail/white_noise.hpp>
#include <resonid/response/welch.hpp>

namespace resonid {
namespace {

constexpr double kNoise = 1.0;

plant::ExperimentConfig tight_loop(std::uint64_t seed) {
  auto c = test::published_drive(kNoise, 10.0, seed);
  c.controller.gain *= 3.0;
  c.excitation.kind = online::Kind::prbs;
  c.excitation.amplitude = 2.1;
  c.excitation.register_length = 17;
  c.run.duration_s = 120.0;
  return c;
}

/// Every 1 Hz of 2 ... 33 Hz.
std::vector<double> grid() {
  std::vector<double> hz;
  for (int f = 2; f <= 33; ++f) hz.push_back(f);
  return hz;
}

/// Relative rms over the grid of |G - truth| / |truth|.
double error(const std::vector<std::complex<double>>& g, const data::FrequencyResponse& truth) {
  double sum = 0.0;
  for (std::size_t i = 0; i < g.size(); ++i) sum += std::norm(g[i] / truth.value[i] - 1.0);
  return std::sqrt(sum / static_cast<double>(g.size()));
}

/// The response near each of the grid's frequencies.
double error_of(const data::FrequencyResponse& g, const data::FrequencyResponse& truth) {
  std::vector<std::complex<double>> values;
  for (const double f : truth.frequency_hz) values.push_back(g.at(f));
  return error(values, truth);
}

double spectral_error(const plant::Simulation& run, const identification::Options& known, Approach approach) {
  response::WelchConfig config;
  config.segment_samples = 1024;
  response::ResponseOptions options;
  options.approach = approach;
  options.controller = known.controller;
  options.delay_s = known.delay_s;
  return error_of(response::welch(run.record, config, options).value(), run.truth.response);
}

TEST(TightLoop, SpectraByJointAndIndirectApproachAreFourTimesBetterThanDirectOnes) {
  constexpr std::uint64_t kSeeds = 4;
  double direct = 0.0, indirect = 0.0, joint = 0.0;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const auto experiment = tight_loop(seed);
    const auto run = test::simulated(experiment, grid());
    const auto known = test::known(experiment);
    direct += std::pow(spectral_error(run, known, Approach::direct), 2);
    indirect += std::pow(spectral_error(run, known, Approach::indirect), 2);
    joint += std::pow(spectral_error(run, known, Approach::joint), 2);
  }
  EXPECT_LT(4.0 * std::sqrt(indirect), std::sqrt(direct));
  EXPECT_LT(4.0 * std::sqrt(joint), std::sqrt(direct));
}

class TightLoopSeed : public testing::TestWithParam<std::uint64_t> {
 protected:
  void SetUp() override {
    experiment_ = tight_loop(GetParam());
    simulation_ = test::simulated(experiment_, grid());
    options_ = test::known(experiment_);
    direct_ = spectral_error(simulation_, options_, Approach::direct);
  }
  const data::FrequencyResponse& truth() const { return simulation_.truth.response; }
  data::Record input_and_output() const {
    auto record = simulation_.record;
    record.excitation = record.reference = {};
    return record;
  }
  double model_error(const identification::Result& result) const {
    return error(result.model.value().drive.values(truth().frequency_hz), truth());
  }
  /// The model's response stands in the place of the biased one, and the finding tells why.
  void expect_the_model(const identification::Result& result, const char* finding) const {
    EXPECT_EQ(result.method, "model");
    EXPECT_LT(4.0 * error_of(result.response, truth()), direct_);
    EXPECT_NE(test::finding(result, finding), nullptr);
  }
  static std::string choice(const identification::Result& result, std::string_view what) {
    for (const auto& c : result.choices)
      if (c.what == what) return c.chosen + ": " + c.because;
    return "";
  }
  plant::ExperimentConfig experiment_;
  plant::Simulation simulation_;
  identification::Options options_;
  double direct_ = 0.0;
};

TEST_P(TightLoopSeed, AutomaticChoiceIsNotTheBiasedOne) {
  const auto result = test::identified(simulation_.record, options_);
  EXPECT_EQ(result.approach, "joint");
  EXPECT_LT(3.0 * error_of(result.response, truth()), direct_);
  EXPECT_LT(4.0 * model_error(result), direct_);
}

TEST_P(TightLoopSeed, IndirectIsNotBiasedEither) {
  options_.approach = Approach::indirect;
  const auto result = test::identified(simulation_.record, options_);
  EXPECT_LT(3.0 * error_of(result.response, truth()), direct_);
  EXPECT_LT(4.0 * model_error(result), direct_);
}

TEST_P(TightLoopSeed, ExcitationIsReconstructedFromTheController) {
  auto record = simulation_.record;
  record.excitation = {};
  const auto result = test::identified(record, options_);
  EXPECT_EQ(result.approach, "joint");
  EXPECT_NE(choice(result, "approach").find("u - C (r - y)"), std::string::npos);
  EXPECT_LT(3.0 * error_of(result.response, truth()), direct_);
}

/// With another controller's numbers the rest of u is noise, no excitation, and must not be taken for one;
/// the answer of u to the noise of y tells them from the true ones.
TEST_P(TightLoopSeed, WrongControllerGivesNoExcitation) {
  auto record = simulation_.record;
  record.excitation = {};
  options_.controller = data::pi_controller(1.0, 0.2, 0.002);
  const auto result = test::identified(record, options_);
  EXPECT_EQ(result.approach, "direct");
  expect_the_model(result, "controller-differs");
  EXPECT_FALSE(result.trusted);
}

TEST_P(TightLoopSeed, OfInputAndOutputAloneTheModelIsReported) {
  const auto record = input_and_output();
  options_.controller = {};
  const auto result = test::identified(record, options_);
  expect_the_model(result, "feedback-bias");
  EXPECT_TRUE(result.trusted);
}

TEST_P(TightLoopSeed, OfInputAndOutputAloneNoSpectrumIsTrusted) {
  const auto record = input_and_output();
  options_.controller = {};
  options_.model = identification::ModelChoice::none;
  const auto result = test::identified(record, options_);
  ASSERT_NE(test::finding(result, "feedback-bias"), nullptr);
  EXPECT_EQ(test::finding(result, "feedback-bias")->severity, diagnostics::Severity::error);
  EXPECT_TRUE(result.modes.empty());
  EXPECT_FALSE(result.trusted);
}

/// Noise on the recorded torque, which the drive never felt: errors in variables.
TEST_P(TightLoopSeed, NoiseOnTheInputDoesNotBiasTheAutomaticChoice) {
  auto record = simulation_.record;
  plant::WhiteNoise noise(100 + GetParam(), 0.05);
  for (double& u : record.input.samples) u += noise.step();
  options_.controller = {};
  const auto result = test::identified(record, options_);
  EXPECT_NE(choice(result, "predictor").find("noise"), std::string::npos);
  EXPECT_LT(4.0 * model_error(result), direct_);
  const auto& drive = result.model.value().drive;
  EXPECT_NEAR(drive.value(fit::kLoadInertia), 0.032, 4.0 * drive.estimate(fit::kLoadInertia).std);
  EXPECT_TRUE(result.trusted);
}

INSTANTIATE_TEST_SUITE_P(Seeds, TightLoopSeed, testing::Range<std::uint64_t>(1, 4));

plant::ExperimentConfig published(std::uint64_t seed) {
  auto c = test::published_drive(0.1, 10.0, seed);
  test::sweep(c);
  return c;
}

TEST(LoopEvidence, WrongControllerIsNotTrustedAndTheMarginsAreTheRecordsOwn) {
  const auto run = test::simulated(published(1));
  auto options = test::known(published(1));
  const auto right = test::identified(run.record, options);
  EXPECT_EQ(test::finding(right, "controller-differs"), nullptr);
  options.controller = data::pi_controller(2.0, 0.147, 0.002);
  const auto wrong = test::identified(run.record, options);
  EXPECT_NE(test::finding(wrong, "controller-differs"), nullptr);
  EXPECT_FALSE(wrong.trusted);
  EXPECT_NEAR(wrong.loop->margins.crossover_hz().value(), 2.69, 0.05);  // Publication VI: 2.7 Hz
}

/// Docs: named from 2 % on, beyond three of its deviations. The gain alone is off: 1 % moves the crossover by
/// less than 1 %, and is left alone.
TEST(LoopEvidence, AControllerFivePercentOffIsNamedAndOneOfOnePercentIsNot) {
  for (const bool sequence : {false, true})
    for (const std::uint64_t seed : {1U, 2U}) {
      SCOPED_TRACE(testing::Message() << (sequence ? "prbs" : "sweep") << ", seed " << seed);
      auto c = test::published_drive(0.1, 10.0, seed);
      sequence ? test::prbs(c) : test::sweep(c);
      const auto run = test::simulated(c);
      const auto told = [&](double factor) {
        auto options = test::known(c);
        options.controller =
            data::pi_controller(factor * c.controller.gain, c.controller.integral_time_s, 0.002);
        return test::identified(run.record, options);
      };
      const auto near = told(1.01);
      EXPECT_EQ(test::finding(near, "controller-differs"), nullptr);
      EXPECT_TRUE(near.trusted);
      for (const double factor : {0.95, 1.05}) {
        const auto wrong = told(factor);
        const auto* named = test::finding(wrong, "controller-differs");
        ASSERT_NE(named, nullptr) << factor;
        EXPECT_EQ(named->severity, diagnostics::Severity::error);
        EXPECT_NEAR(named->value.value(), std::abs(factor - 1.0), 0.002);
        EXPECT_NEAR(named->threshold.value(), 0.02, 1e-9);
        EXPECT_FALSE(wrong.trusted);
        // Of the one that ran; 2.69 Hz is rounded.
        EXPECT_NEAR(wrong.loop->margins.crossover_hz().value(), 2.69,
                    4.0 * wrong.loop->crossover_std_hz.value() + 0.005);
      }
    }
}

TEST(LoopEvidence, MirroredAndExchangedSignalsAreNamed) {
  auto c = test::published_drive(0.1, 10.0, 2);
  test::prbs(c);
  const auto record = test::simulated(c).record;
  identification::Options options;
  options.model = identification::ModelChoice::none;
  EXPECT_EQ(test::finding(test::identified(record, options), "reversed"), nullptr);
  auto mirrored = record;
  for (double& y : mirrored.output.samples) y = -y;
  auto exchanged = record;
  std::swap(exchanged.input.samples, exchanged.output.samples);
  const auto text = [&](const data::Record& r) {
    const auto result = test::identified(r, options);
    const auto* finding = test::finding(result, "reversed");
    return finding == nullptr ? std::string() : finding->meaning;
  };
  EXPECT_NE(text(mirrored).find("sign of the encoder or of the torque is reversed"), std::string::npos);
  EXPECT_NE(text(exchanged).find("exchanged"), std::string::npos);
}

/// A stage on flexures: 0.02 kgm2 on 800 Nm/rad, computed with the exact step of its two states.
TEST(LoopEvidence, SpringToGroundIsNotTakenForExchangedColumns) {
  constexpr double kRate = 1000.0, kInertia = 0.02, kStiffness = 800.0, kFriction = 0.2;
  const double decay = 0.5 * kFriction / kInertia, w0 = std::sqrt(kStiffness / kInertia);
  const double w = std::sqrt(w0 * w0 - decay * decay), step = 1.0 / kRate;
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  data::Record record;
  record.sample_rate_hz = kRate;
  record.input = {"u", "Nm", {}};
  record.output = {"y", "rad/s", {}};
  double position = 0.0, velocity = 0.0;
  for (int k = 0; k < 20000; ++k) {
    const double torque = normal(random);
    record.input.samples.push_back(torque);
    record.output.samples.push_back(velocity + 1e-3 * normal(random));
    const double rest = torque / kStiffness, x = position - rest;
    const double e = std::exp(-decay * step), c = std::cos(w * step), s = std::sin(w * step);
    position = rest + e * (x * (c + decay / w * s) + velocity / w * s);
    velocity = e * (velocity * (c - decay / w * s) - x * w0 * w0 / w * s);
  }
  identification::Options options;
  options.model = identification::ModelChoice::none;
  const auto result = test::identified(record, options);
  EXPECT_NE(test::finding(result, "spring-to-ground"), nullptr);
  EXPECT_EQ(test::finding(result, "reversed"), nullptr);
  ASSERT_EQ(result.modes.size(), 1u);
  EXPECT_FALSE(result.modes[0].anti);
  EXPECT_NEAR(result.modes[0].frequency_hz.value, w0 / kTwoPi, 3.0 * result.modes[0].frequency_hz.std);
  EXPECT_NEAR(result.modes[0].damping_ratio.value, decay / w0, 3.0 * result.modes[0].damping_ratio.std);
  EXPECT_LT(result.modes[0].frequency_hz.std, 0.02 * w0 / kTwoPi);
}

/// The controller is fed a velocity, the record holds a position: said for the model, refused for a black
/// box.
TEST(LoopEvidence, IndirectOfAPositionIsTold) {
  auto c = test::published_drive(0.0, 0.0, 3);
  test::prbs(c);
  auto record = test::simulated(c).record;
  double place = 0.0;
  for (double& y : record.output.samples) y = place += y / record.sample_rate_hz;
  record.output_quantity = data::OutputQuantity::position;
  auto options = test::known(c);
  options.approach = Approach::indirect;
  options.method = identification::Method::welch;
  options.model = identification::ModelChoice::two_mass;
  const auto result = test::identified(record, options);
  ASSERT_TRUE(result.model.value().from_record);
  EXPECT_NE(test::finding(result, "indirect-response-only"), nullptr);
  options.model = identification::ModelChoice::black_box;
  const auto refused = identification::identify(record, options);
  ASSERT_FALSE(refused.has_value());
  EXPECT_EQ(refused.error().field, "approach");
}

}  // namespace
}  // namespace resonid
