// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <monitoring/axis_monitor.hpp>
#include <random>
#include <resonid/base/error_text.hpp>
#include <resonid/plant/experiment.hpp>
#include <vector>

namespace resonid::monitoring {
namespace {

constexpr double kRate = 250.0;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Excitation, input and output of a drive with dry friction and load steps, whose belt loosens.
std::vector<double> samples_of_drive(double seconds, double loosening, double loosens_at_s,
                                     std::uint64_t seed) {
  plant::ExperimentConfig e;
  e.drive.structure = plant::Structure::two_mass;
  e.drive.driven_inertia = e.drive.load_inertia = 0.032;
  e.drive.stiffness = 143.75;
  e.drive.damping = 0.3;
  e.drive.viscous_friction = 0.02;
  e.friction.driven.coulomb = 0.15;
  e.friction.load.coulomb = 0.1;
  e.disturbance.loosening = loosening;
  e.disturbance.loosening_at_s = loosens_at_s;
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal;
  for (double at = 7.0; at < seconds; at += 23.0) {
    e.disturbance.load_step_at_s.push_back(at);
    e.disturbance.load_step.push_back(0.3 * normal(generator));
  }
  e.run = {kRate, seconds, seed};
  e.controller.kind = plant::ControllerKind::pi;
  e.controller.gain = 0.5;
  e.controller.integral_time_s = 0.2;
  e.motion.kind = plant::MotionKind::constant;
  e.motion.velocity = 5.0;
  e.excitation.kind = online::Kind::prbs;
  e.excitation.amplitude = 0.3;
  e.excitation.register_length = 10;
  e.measurement.noise_rms = 0.02;
  const auto made = plant::simulate_closed_loop(e).value();
  std::vector<double> values;
  for (std::size_t k = 0; k < made.record.samples(); ++k)
    values.insert(values.end(), {made.record.excitation.samples[k], made.record.input.samples[k],
                                 made.record.output.samples[k]});
  return values;
}

AxisSpec spec_of_drive() {
  AxisSpec spec;
  spec.name = "x";
  spec.sample_rate_hz = kRate;
  spec.baseline_s = 60.0;
  spec.track.method = identification::TrackMethod::physical;
  for (auto& figure : spec.alarms.figures) figure.alarm.off_delay_s = 5.0;
  spec.alarms[Watched::load_torque].changes = false;
  return spec;
}

/// Adds samples in batches, and learns whenever that is due.
void run(AxisMonitor& monitor, std::span<const double> values, std::size_t batch, Output& out) {
  const std::size_t width = monitor.channels();
  while (!values.empty()) {
    if (monitor.phase() == Phase::learning) monitor.learn();
    const auto part = values.first(std::min(values.size(), batch * width));
    values = values.subspan(monitor.add(part, out) * width);
  }
}

bool same(const Row& a, const Row& b) {
  if (a.sample != b.sample || a.trusted != b.trusted || a.verdict != b.verdict) return false;
  return std::memcmp(a.figures.data(), b.figures.data(), sizeof a.figures) == 0;
}

void expect_same(const Output& a, const Output& b) {
  ASSERT_EQ(a.rows.size(), b.rows.size());
  for (std::size_t i = 0; i < a.rows.size(); ++i) ASSERT_TRUE(same(a.rows[i], b.rows[i])) << i;
  ASSERT_EQ(a.events.size(), b.events.size());
  for (std::size_t i = 0; i < a.events.size(); ++i) {
    EXPECT_EQ(a.events[i].sample, b.events[i].sample);
    EXPECT_EQ(a.events[i].alarm, b.events[i].alarm);
    EXPECT_EQ(a.events[i].transition, b.events[i].transition);
  }
}

TEST(AxisMonitor, FindsABeltThatLoosensAndWhy) {
  const double at = 150.0;
  const auto values = samples_of_drive(240.0, 0.1, at, 1);
  auto monitor = AxisMonitor::create(spec_of_drive()).value();
  Output out;
  run(monitor, values, 100, out);
  EXPECT_EQ(monitor.phase(), Phase::following);
  EXPECT_NEAR(monitor.row()[Watched::stiffness].value, 0.9 * 143.75,
              5.0 * monitor.row()[Watched::stiffness].std);
  ASSERT_FALSE(out.events.empty());
  const AlarmEvent& first = out.events.front();
  EXPECT_EQ(first.alarm.kind, AlarmKind::change);
  EXPECT_EQ(first.transition, Transition::raised);
  EXPECT_GE(static_cast<double>(first.sample) / kRate, at);
  EXPECT_LE(static_cast<double>(first.sample) / kRate, at + 5.0);
  EXPECT_NEAR(first.change.change.time_s, at, 4.0);
  const auto cause = likely_cause(shifts_of(monitor.facts()));
  EXPECT_EQ(cause.ranked.front().cause, Cause::coupling_looser);
}

TEST(AxisMonitor, GivesTheSameRowsInWhateverBatches) {
  const auto values = samples_of_drive(100.0, 0.0, 0.0, 2);
  auto monitor = AxisMonitor::create(spec_of_drive()).value();
  Output whole;
  run(monitor, values, values.size(), whole);
  ASSERT_GT(whole.rows.size(), 900U);
  std::mt19937_64 generator(3);
  auto again = AxisMonitor::create(spec_of_drive()).value();
  Output parts;
  for (std::size_t first = 0; first < values.size();) {
    const std::size_t count = std::min<std::size_t>(values.size() - first, 3 * (1 + generator() % 400));
    run(again, std::span(values).subspan(first, count), 1 + generator() % 50, parts);
    first += count;
  }
  expect_same(whole, parts);
}

TEST(AxisMonitor, GivesTheRowsOfTrack) {
  const auto values = samples_of_drive(60.0, 0.0, 0.0, 4);
  auto monitor = AxisMonitor::create(spec_of_drive()).value();
  Output out;
  run(monitor, values, 1000, out);
  data::Record record;
  record.sample_rate_hz = kRate;
  record.input.unit = record.excitation.unit = "Nm";
  record.output.unit = "rad/s";
  for (std::size_t k = 0; k < values.size(); k += 3) {
    record.excitation.samples.push_back(values[k]);
    record.input.samples.push_back(values[k + 1]);
    record.output.samples.push_back(values[k + 2]);
  }
  auto options = spec_of_drive().track;
  options.long_term = true;
  options.every = 25;
  const auto track = identification::track(record, options).value();
  const auto* stiffness = track.find("stiffness");
  ASSERT_NE(stiffness, nullptr);
  ASSERT_EQ(stiffness->value.size(), out.rows.size());
  for (std::size_t i = 0; i < out.rows.size(); ++i)
    ASSERT_EQ(stiffness->value[i], out.rows[i][Watched::stiffness].value) << i;
}

TEST(AxisMonitor, GoesOnFromASnapshotBitForBit) {
  const auto values = samples_of_drive(140.0, 0.1, 110.0, 5);
  auto monitor = AxisMonitor::create(spec_of_drive()).value();
  Output undisturbed;
  run(monitor, values, 500, undisturbed);
  std::mt19937_64 generator(6);
  for (int trial = 0; trial < 20; ++trial) {
    const std::size_t stop = 3 * (generator() % (values.size() / 3));
    auto before = AxisMonitor::create(spec_of_drive()).value();
    Output out;
    run(before, std::span(values).first(stop), 77, out);
    const auto bytes = before.snapshot();
    auto after = AxisMonitor::restore(spec_of_drive(), bytes);
    ASSERT_TRUE(after) << message_of(after.error());
    ASSERT_LE(3 * after->next_sample(), stop);
    // Rows and events from there on come again; those from before stay.
    std::erase_if(out.rows, [&](const Row& r) { return r.sample >= after->next_sample(); });
    std::erase_if(out.events, [&](const AlarmEvent& e) { return e.sample >= after->next_sample(); });
    run(*after, std::span(values).subspan(3 * after->next_sample()), 333, out);
    expect_same(undisturbed, out);
  }
}

TEST(AxisMonitor, RefusesBytesThatAreNoSnapshot) {
  const auto values = samples_of_drive(30.0, 0.0, 0.0, 7);
  auto monitor = AxisMonitor::create(spec_of_drive()).value();
  Output out;
  run(monitor, values, 500, out);
  const auto bytes = monitor.snapshot();
  EXPECT_LT(bytes.size(), 200'000U);
  for (std::size_t size = 0; size < bytes.size(); size += 1 + size / 7)
    EXPECT_FALSE(AxisMonitor::restore(spec_of_drive(), std::span(bytes).first(size))) << size;
  auto longer = bytes;
  longer.push_back(std::byte{0});
  EXPECT_FALSE(AxisMonitor::restore(spec_of_drive(), longer));
  auto other = bytes;
  other[20] = std::byte{'?'};  // in the version
  EXPECT_FALSE(AxisMonitor::restore(spec_of_drive(), other));
}

TEST(AxisMonitor, RestsWhereThereIsNothingToFollow) {
  auto spec = spec_of_drive();
  spec.track.method = identification::TrackMethod::automatic;
  auto monitor = AxisMonitor::create(spec).value();
  std::mt19937_64 generator(8);
  std::normal_distribution<double> normal;
  std::vector<double> noise(3 * 250 * 30);
  for (std::size_t k = 0; k < noise.size(); k += 3) {
    noise[k] = 0.0;
    noise[k + 1] = 0.01 * normal(generator);
    noise[k + 2] = 0.01 * normal(generator);
  }
  Output out;
  std::uint64_t furthest = 0;
  for (std::size_t at = 0; at < noise.size(); at += 3 * 250) {
    run(monitor, std::span(noise).subspan(at, 3 * 250), 50, out);
    furthest = std::max(furthest, monitor.next_sample() - monitor.resume_sample());
  }
  EXPECT_LE(furthest, monitor.longest_stretch());
  EXPECT_GT(2 * furthest, monitor.longest_stretch());
  EXPECT_TRUE(out.rows.empty());
  EXPECT_NE(monitor.phase(), Phase::following);
  EXPECT_FALSE(monitor.reason().empty());
  EXPECT_FALSE((monitor.alarms()[{AlarmKind::estimate, {}}].active));  // nothing excites it
}

TEST(AxisMonitor, PassesOverWhatIsMissing) {
  auto values = samples_of_drive(120.0, 0.0, 0.0, 9);
  auto monitor = AxisMonitor::create(spec_of_drive()).value();
  Output out;
  run(monitor, std::span(values).first(3 * 250 * 90), 250, out);
  monitor.miss(250 * 3600);
  for (std::size_t k = 3 * 250 * 90; k < 3 * 250 * 92; ++k) values[k] = kNaN;
  run(monitor, std::span(values).subspan(3 * 250 * 90), 250, out);
  EXPECT_EQ(monitor.next_sample(), 250U * (120 + 3600));
  EXPECT_TRUE(monitor.row().trusted);
  EXPECT_TRUE(std::is_sorted(out.rows.begin(), out.rows.end(),
                             [](const Row& a, const Row& b) { return a.sample < b.sample; }));
  EXPECT_TRUE(std::none_of(out.events.begin(), out.events.end(), [](const AlarmEvent& e) {
    return e.alarm.kind == AlarmKind::change && e.transition == Transition::raised;
  }));
}

/// The output of samples from one on with the sign turned round.
std::vector<double> turned(std::vector<double> values, std::size_t from, std::size_t to) {
  for (std::size_t k = 3 * from; k < std::min(3 * to, values.size()); k += 3) values[k + 2] *= -1.0;
  return values;
}
constexpr AlarmId kDataAlarm{AlarmKind::data, {}};

TEST(AxisMonitor, LearnsWhereSingleSamplesAreMissing) {
  auto values = samples_of_drive(40.0, 0.0, 0.0, 7);
  for (std::size_t k = 150; k < values.size() / 3; k += 150) values[3 * k + 2] = std::nan("");
  auto monitor = AxisMonitor::create(spec_of_drive()).value();
  Output out;
  run(monitor, values, 1000, out);
  EXPECT_EQ(monitor.phase(), Phase::following) << monitor.reason();
  ASSERT_FALSE(out.rows.empty());
  const auto& k = monitor.row()[Watched::stiffness];
  EXPECT_NEAR(k.value, 143.75, 5.0 * k.std);
  // By their numbers.
  auto numbered = AxisMonitor::create(spec_of_drive()).value();
  for (std::size_t gap = 0; gap < values.size() / 3; gap += 150) {
    if (numbered.phase() == Phase::learning) numbered.learn();
    if (gap > 0) numbered.miss(1);
    const std::size_t from = gap > 0 ? gap + 1 : 0, to = std::min(gap + 150, values.size() / 3);
    run(numbered, std::span(values).subspan(3 * from, 3 * (to - from)), 1000, out);
  }
  EXPECT_EQ(numbered.phase(), Phase::following) << numbered.reason();
  EXPECT_NEAR(numbered.row()[Watched::stiffness].value, 143.75, 5.0 * numbered.row()[Watched::stiffness].std);
}

TEST(AxisMonitor, SaysThatGapsKeepItFromLearning) {
  const auto values = samples_of_drive(20.0, 0.0, 0.0, 7);
  auto monitor = AxisMonitor::create(spec_of_drive()).value();
  Output out;
  for (std::size_t k = 0; k < values.size() / 3; k += 100) {
    run(monitor, std::span(values).subspan(3 * k, 3 * 100), 1000, out);
    monitor.miss(25);
  }
  EXPECT_EQ(monitor.phase(), Phase::gathering);
  EXPECT_NE(monitor.reason().find("samples are missing"), std::string::npos) << monitor.reason();
  ASSERT_EQ(out.events.size(), 1U);
  EXPECT_EQ(out.events[0].alarm.kind, AlarmKind::data);
  EXPECT_EQ(out.events[0].transition, Transition::raised);
  run(monitor, samples_of_drive(40.0, 0.0, 0.0, 7), 1000, out);
  EXPECT_EQ(monitor.phase(), Phase::following) << monitor.reason();
  EXPECT_EQ(monitor.reason(), "");
  EXPECT_EQ(out.events.back().transition, Transition::cleared);
}

TEST(AxisMonitor, DoesNotTrustAnAxisWhoseOutputIsTurnedRound) {
  const auto values = turned(samples_of_drive(40.0, 0.0, 0.0, 11), 0, 1'000'000);
  auto spec = spec_of_drive();
  spec.track.common.controller = pi(0.5, 0.2);
  auto monitor = AxisMonitor::create(spec).value();
  Output out;
  run(monitor, values, 250, out);
  EXPECT_EQ(monitor.contradiction().fault, ScaleFault::output_sign);
  EXPECT_EQ(monitor.reason().find("axis x: output_scale: the sign is turned round"), 0U) << monitor.reason();
  EXPECT_TRUE(monitor.alarms()[kDataAlarm].active);
  EXPECT_TRUE(std::none_of(out.rows.begin(), out.rows.end(), [](const Row& r) { return r.trusted; }));
  // The configuration is right now: the axis is followed.
  spec.output_scale = -1.0;
  auto again = AxisMonitor::create(spec).value();
  out = {};
  run(again, values, 250, out);
  EXPECT_TRUE(again.row().trusted) << again.reason();
  EXPECT_EQ(again.reason(), "");
  EXPECT_TRUE(out.events.empty());
}

TEST(AxisMonitor, TrustsNoMoreWhereASignTurnsRoundAndAgainOnceItIsRight) {
  constexpr std::size_t kTurned = 100 * 250, kBack = 190 * 250;
  const auto values = turned(samples_of_drive(260.0, 0.0, 0.0, 12), kTurned, kBack);
  auto spec = spec_of_drive();
  spec.track.common.controller = pi(0.5, 0.2);
  auto monitor = AxisMonitor::create(spec).value();
  Output out;
  const std::span<const double> all(values);
  run(monitor, all.first(3 * kTurned), 250, out);
  EXPECT_TRUE(monitor.row().trusted);
  EXPECT_FALSE(monitor.alarms()[kDataAlarm].active);
  run(monitor, all.subspan(3 * kTurned, 3 * (kBack - kTurned)), 250, out);
  EXPECT_EQ(monitor.contradiction().fault, ScaleFault::output_sign) << monitor.reason();
  EXPECT_FALSE(monitor.row().trusted);
  EXPECT_TRUE(monitor.alarms()[kDataAlarm].active);
  // The same from a snapshot within it.
  auto after = AxisMonitor::restore(spec, monitor.snapshot());
  ASSERT_TRUE(after) << message_of(after.error());
  EXPECT_EQ(after->reason(), monitor.reason());
  Output direct, restored;
  run(monitor, all.subspan(3 * monitor.next_sample()), 250, direct);
  run(*after, all.subspan(3 * after->next_sample()), 333, restored);
  std::erase_if(restored.rows, [&](const Row& r) { return r.sample < kBack; });
  std::erase_if(direct.rows, [&](const Row& r) { return r.sample < kBack; });
  expect_same(direct, restored);
  EXPECT_EQ(monitor.contradiction().fault, ScaleFault::none) << monitor.reason();
  EXPECT_TRUE(monitor.row().trusted) << monitor.reason();
  EXPECT_FALSE(monitor.alarms()[kDataAlarm].active);
}

TEST(AxisMonitor, TakesEachActionOnce) {
  const auto values = samples_of_drive(200.0, 0.1, 100.0, 10);
  auto monitor = AxisMonitor::create(spec_of_drive()).value();
  Output out;
  run(monitor, values, 250, out);
  const AlarmId resonance{AlarmKind::change, Watched::resonance};
  ASSERT_TRUE(monitor.alarms()[resonance].active);
  const Action seen{monitor.next_sample(), ActionKind::acknowledge, resonance, 0, 1};
  out = {};
  ASSERT_TRUE(monitor.act(seen, out));
  EXPECT_EQ(out.events.size(), 1U);
  EXPECT_TRUE(monitor.alarms()[resonance].acknowledged);
  ASSERT_TRUE(monitor.act(seen, out));
  EXPECT_EQ(out.events.size(), 1U);
  EXPECT_EQ(monitor.act({monitor.next_sample() + 1, ActionKind::relearn, {}, 0, 2}, out).error().field,
            "sample");
  // What is now is how it should be: the alarms end.
  ASSERT_TRUE(monitor.act({monitor.next_sample(), ActionKind::set_baseline, {}, 0, 2}, out));
  run(monitor, std::span(values).last(3 * 250 * 30), 250, out);
  EXPECT_FALSE(monitor.alarms()[resonance].active);
}

TEST(AxisMonitor, TakesAnotherIntervalOfFalseAlarmsWithTheNextBaseline) {
  const auto values = samples_of_drive(60.0, 0.0, 0.0, 10);
  auto spec = spec_of_drive();
  auto monitor = AxisMonitor::create(spec).value();
  Output out;
  EXPECT_EQ(monitor.detector_interval_s(), 0.0);
  run(monitor, values, 250, out);
  EXPECT_EQ(monitor.detector_interval_s(), spec.false_alarm_interval_s);
  const double before = spec.false_alarm_interval_s;
  spec.false_alarm_interval_s *= 100.0;
  auto later = AxisMonitor::restore(spec, monitor.snapshot()).value();
  EXPECT_EQ(later.detector_interval_s(), before);
  ASSERT_TRUE(later.act({later.next_sample(), ActionKind::set_baseline, {}, 0, 1}, out));
  EXPECT_EQ(later.detector_interval_s(), spec.false_alarm_interval_s);
  run(later, values, 250, out);
  EXPECT_EQ(later.phase(), Phase::following);
}

TEST(AxisMonitor, TellsThatAnExcitedDriveCannotBeLearned) {
  auto spec = spec_of_drive();
  spec.alarms.estimate.on_delay_s = 0.0;
  auto monitor = AxisMonitor::create(spec).value();
  std::mt19937_64 generator(8);
  std::normal_distribution<double> normal;
  std::vector<double> noise(3 * 250 * 40);
  for (double& x : noise) x = normal(generator);
  Output out;
  run(monitor, noise, 250, out);
  ASSERT_NE(monitor.phase(), Phase::following) << monitor.reason();
  EXPECT_TRUE((monitor.alarms()[{AlarmKind::estimate, {}}].active)) << monitor.reason();
}

TEST(AxisMonitor, GathersNewerSamplesWhereItsTurnToLearnDoesNotCome) {
  const auto values = samples_of_drive(60.0, 0.1, 1000.0, 1);
  const std::span<const double> all = values;
  auto monitor = AxisMonitor::create(spec_of_drive()).value();
  Output out;
  EXPECT_FALSE(monitor.act({0, ActionKind::gather, {}, 0, 1}, out));
  const std::size_t taken = monitor.add(all, out);
  ASSERT_EQ(monitor.phase(), Phase::learning);
  ASSERT_TRUE(monitor.act({taken, ActionKind::gather, {}, 0, 1}, out));
  EXPECT_EQ(monitor.resume_sample(), taken);
  run(monitor, all.subspan(3 * taken), 100, out);
  EXPECT_EQ(monitor.phase(), Phase::following);
  ASSERT_FALSE(out.rows.empty());
  EXPECT_GE(out.rows.front().sample, 2 * taken);
}

TEST(AxisMonitor, TellsOfSamplesThatStop) {
  auto monitor = AxisMonitor::create(spec_of_drive()).value();
  Output out;
  ASSERT_TRUE(monitor.act({0, ActionKind::stop, {}, 0, 1}, out));
  ASSERT_EQ(out.events.size(), 1U);
  EXPECT_EQ(out.events[0].alarm.kind, AlarmKind::stale);
}

TEST(AxisMonitor, RefusesSpecificationsThatCannotBe) {
  const auto field = [](auto&& change) {
    auto spec = spec_of_drive();
    change(spec);
    return AxisMonitor::create(spec).error().field;
  };
  EXPECT_EQ(field([](AxisSpec& s) { s.sample_rate_hz = 0.0; }), "sample_rate_hz");
  EXPECT_EQ(field([](AxisSpec& s) { s.row_every_s = -1.0; }), "row_every_s");
  EXPECT_EQ(field([](AxisSpec& s) { s.input_scale = 0.0; }), "input_scale");
  EXPECT_EQ(field([](AxisSpec& s) { s.excitation_scale = 0.0; }), "excitation_scale");
  EXPECT_EQ(field([](AxisSpec& s) { s.output_scale = kNaN; }), "output_scale");
  EXPECT_EQ(field([](AxisSpec& s) { s.baseline_s = kNaN; }), "baseline_s");
  EXPECT_EQ(field([](AxisSpec& s) { s.false_alarm_interval_s = 0.0; }), "false_alarm_interval_s");
}

}  // namespace
}  // namespace resonid::monitoring
