// SPDX-License-Identifier: MIT
// What a drive's measuring chain does to a record: filter and hold of the velocity, parts of a sample of
// delay, samples that are lost or stand twice.
#include <experiments.hpp>
#include <loop_of_two_masses.hpp>
#include <resonid/diagnostics/margins.hpp>

namespace resonid::fit {
namespace {

plant::ExperimentConfig servo(std::uint64_t seed) {
  auto c = test::loop_of_two_masses(0.0015, 0.0021, 270.0, 0.07, 0.06, 0.08);
  c.measurement.delay_s = 0.001;
  c.measurement.noise_rms = 0.02;
  c.motion = {plant::MotionKind::constant, 20.0};
  c.excitation.kind = online::Kind::chirp;
  c.excitation.amplitude = 0.3;
  c.excitation.from_hz = 5.0;
  c.excitation.to_hz = 300.0;
  c.excitation.duration_s = 2.0;
  c.run.sample_rate_hz = 2000.0;
  c.run.seed = seed;
  return c;
}

/// What the user knows, the structure too: what is tried beside it costs time.
identification::Options known(const plant::ExperimentConfig& c) {
  auto options = test::known(c);
  options.model = identification::ModelChoice::two_mass;
  options.friction = identification::Friction::none;
  return options;
}

bool has(const identification::Result& result, std::string_view id) {
  return std::any_of(result.findings.begin(), result.findings.end(),
                     [&](const diagnostics::Finding& f) { return f.id == id; });
}

/// Trusted, the machine and the margins of the loop as it ran within their error bars.
identification::Result expect_right(const plant::ExperimentConfig& c) {
  const auto simulation = test::simulated(c);
  auto result = test::identified(simulation.record, known(c));
  EXPECT_TRUE(result.trusted);
  if (!result.model || !result.loop) {
    ADD_FAILURE() << "no model";
    return result;
  }
  const auto& drive = result.model->drive;
  EXPECT_EQ(drive.structure, Structure::two_mass);
  test::expect_within(drive.estimate(kDrivenInertia), 0.0015, 4.0, 0.01);
  test::expect_within(drive.estimate(kLoadInertia), 0.0021, 4.0, 0.01);
  test::expect_within(drive.estimate(kStiffness), 270.0, 4.0, 0.01);
  const auto truth = diagnostics::loop_margins(simulation.truth.loop);
  const auto& margins = result.loop->margins;
  // The truth is interpolated between 6000 lines.
  EXPECT_NEAR(*margins.gain_margin_db, *truth.gain_margin_db, 4.0 * *result.loop->gain_margin_std_db + 0.002);
  EXPECT_NEAR(*margins.phase_margin_deg(), *truth.phase_margin_deg(),
              4.0 * *result.loop->phase_margin_std_deg + 0.002);
  return result;
}

TEST(MeasuringChain, FilterOfTheVelocityIsPartOfTheModel) {
  auto c = servo(1);
  c.measurement.filter_s = 0.0009;
  const auto result = expect_right(c);
  ASSERT_TRUE(result.model);
  test::expect_within(result.model->drive.estimate(kOutputFilter), 0.0009, 4.0, 0.03);
  EXPECT_FALSE(result.model->drive.estimated[kDelay]);
}

TEST(MeasuringChain, HeldVelocityIsFittedWhereItIsNew) {
  for (const std::uint64_t samples : {2, 4}) {
    auto c = servo(samples);
    c.measurement.hold_samples = samples;
    const auto result = expect_right(c);
    EXPECT_TRUE(has(result, "held-output"));
    EXPECT_FALSE(has(result, "disturbed-samples"));
  }
}

TEST(MeasuringChain, MarginsHoldAPartOfASampleOfDelay) {
  auto c = servo(3);
  c.measurement.delay_s = 0.0007;
  EXPECT_FALSE(has(expect_right(c), "held-output"));
}

/// Without every 60th row, or with it twice, more or less.
data::Record slipped(data::Record record, bool twice) {
  for (auto* channel : {&record.input, &record.output, &record.excitation, &record.reference}) {
    std::vector<double> samples;
    for (std::size_t k = 0; k < channel->samples.size(); ++k) {
      const bool slips = (k * k + 7 * k) % 60 == 0;
      if (!slips || twice) samples.push_back(channel->samples[k]);
      if (slips && twice) samples.push_back(channel->samples[k]);
    }
    channel->samples = std::move(samples);
  }
  return record;
}

TEST(MeasuringChain, LostAndRepeatedSamplesAreSeenWithoutTheirTimes) {
  auto c = servo(4);
  c.excitation.kind = online::Kind::prbs;
  c.excitation.register_length = 9;
  c.excitation.clock_divider = 4;
  c.run.duration_s = 2.0;
  c.measurement.noise_rms = 0.05;
  const auto record = test::simulated(c).record;
  for (const bool twice : {false, true}) {
    const auto result = test::identified(slipped(record, twice), known(c));
    EXPECT_FALSE(result.trusted);
    EXPECT_EQ(has(result, "repeated-samples"), twice);
    EXPECT_EQ(has(result, "dropped-samples"), !twice);
  }
  const auto whole = test::identified(record, known(c));
  EXPECT_TRUE(whole.trusted);
  EXPECT_FALSE(has(whole, "dropped-samples") || has(whole, "repeated-samples"));
}

}  // namespace
}  // namespace resonid::fit
