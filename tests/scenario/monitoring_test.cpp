// SPDX-License-Identifier: MIT
// What resonid monitor promises of alarms, over simulated drives with dry friction, load steps and noise.
//
//   RESONID_SOAK_HOURS     axis-hours of the false alarms (200)
//   RESONID_SOAK_INTERVAL  stated hours between false alarms of a one-axis installation (10)
//   RESONID_SOAK_RATE      sample rate, Hz (50)
//   RESONID_SOAK_SEEDS     belts that loosen (20)
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <limits>
#include <map>
#include <monitoring/axis_monitor.hpp>
#include <monitoring/threshold.hpp>
#include <random>
#include <resonid/online/models/physical_tracker.hpp>
#include <resonid/online/supervision/change_detection.hpp>
#include <resonid/plant/experiment.hpp>
#include <string>
#include <thread>
#include <vector>

namespace resonid::monitoring {
namespace {

double told(const char* name, double usual) {
  const char* value = std::getenv(name);
  return value != nullptr ? std::atof(value) : usual;
}

/// A drive whose resonance lies at 0.06 of the sample rate, so that all of them are alike but for their
/// speed.
struct Drive {
  double rate_hz = 250.0, noise = 0.02, excitation = 0.3;
  double stiffness() const { return 143.75 * std::pow(rate_hz / 250.0, 2); }
  double damping() const { return 0.3 * rate_hz / 250.0; }

  plant::ExperimentConfig experiment(double seconds, std::uint64_t seed) const {
    plant::ExperimentConfig e;
    e.drive.structure = plant::Structure::two_mass;
    e.drive.driven_inertia = e.drive.load_inertia = 0.032;
    e.drive.stiffness = stiffness();
    e.drive.damping = damping();
    e.drive.viscous_friction = 0.02;
    e.friction.driven.coulomb = 0.15;
    e.friction.load.coulomb = 0.1;
    std::mt19937_64 generator(seed * 77 + 5);
    std::exponential_distribution<double> gap(1.0 / 40.0);
    std::normal_distribution<double> normal;
    double load = 0.0;
    for (double at = 5.0; at < seconds; at += 2.0 + gap(generator)) {
      const double step = 0.4 * normal(generator) - 0.6 * load;
      load += step;
      e.disturbance.load_step.push_back(step);
      e.disturbance.load_step_at_s.push_back(at);
    }
    e.run = {rate_hz, seconds, seed};
    e.controller.kind = plant::ControllerKind::pi;
    e.controller.gain = 0.5 * rate_hz / 250.0;
    e.controller.integral_time_s = 0.2 * 250.0 / rate_hz;
    e.motion.kind = plant::MotionKind::constant;
    e.motion.velocity = 15.0;
    e.excitation.kind = online::Kind::prbs;
    e.excitation.amplitude = excitation;
    e.excitation.register_length = 10;
    // Slower drives move further under the same torque.
    e.measurement.noise_rms = noise * 250.0 / rate_hz;
    return e;
  }
  AxisSpec spec(double installation_s, double baseline_s) const {
    AxisSpec spec;
    spec.name = "x";
    spec.sample_rate_hz = rate_hz;
    spec.row_every_s = std::max(0.1, 25.0 / rate_hz);
    spec.baseline_s = baseline_s;
    spec.track.method = identification::TrackMethod::physical;
    spec.track.common.controller = pi(0.5 * rate_hz / 250.0, 0.2 * 250.0 / rate_hz);
    spec.alarms[Watched::load_torque].changes = false;
    spec.alarms[Watched::gap].changes = false;
    spec.alarms[Watched::coulomb_friction].changes = false;
    std::size_t detectors = 0;
    for (const auto& f : spec.alarms.figures) detectors += f.alarm.enabled && f.changes ? 1 : 0;
    spec.false_alarm_interval_s = detector_interval_s(installation_s, detectors).value();
    return spec;
  }
};

void add(AxisMonitor& monitor, const data::Record& r, Output& out) {
  std::vector<double> values;
  for (std::size_t k = 0; k < r.samples(); ++k)
    values.insert(values.end(), {r.excitation.samples[k], r.input.samples[k], r.output.samples[k]});
  std::span<const double> rest = values;
  while (!rest.empty()) {
    if (monitor.phase() == Phase::learning) monitor.learn();
    rest = rest.subspan(3 * monitor.add(rest.first(std::min<std::size_t>(rest.size(), 3 * 1000)), out));
  }
}

bool is_false_alarm(const AlarmEvent& e) {
  return e.alarm.kind == AlarmKind::change && e.transition == Transition::raised;
}

/// Deals numbers 0 ... count - 1 out to all cores.
void for_each(std::size_t count, const std::function<void(std::size_t)>& work) {
  std::atomic<std::size_t> next = 0;
  std::vector<std::jthread> threads;
  for (unsigned t = 0; t < std::max(1U, std::thread::hardware_concurrency()); ++t)
    threads.emplace_back([&] {
      for (std::size_t i = next++; i < count; i = next++) work(i);
    });
}

struct Watch {
  double hours = 0.0;
  std::map<std::string, int> alarms;
  std::string fault, times;  // of the alarms: figure and second of the run
};

/// A one-axis installation; between two runs of an hour its drive stands still.
Watch watch(const Drive& drive, double hours, double interval_h, std::uint64_t first_seed) {
  constexpr double kBaseline_s = 600.0;
  Watch w;
  auto monitor = AxisMonitor::create(drive.spec(interval_h * 3600.0, kBaseline_s)).value();
  for (double h = 0.0; h < hours; h += 1.0) {
    Output out;
    const std::uint64_t begin = monitor.next_sample();
    add(monitor,
        plant::simulate_closed_loop(drive.experiment(3600.0, first_seed + static_cast<std::uint64_t>(h)))
            ->record,
        out);
    monitor.miss(static_cast<std::uint64_t>(10.0 * drive.rate_hz));
    for (const auto& e : out.events)
      if (is_false_alarm(e)) {
        ++w.alarms[alarm_name(e.alarm)];
        const auto second = static_cast<std::int64_t>(static_cast<double>(e.sample - begin) / drive.rate_hz);
        w.times += " " + alarm_name(e.alarm) + "@" + std::to_string(second);
      }
    if (monitor.phase() != Phase::following) w.fault = "not followed: " + monitor.reason();
  }
  w.hours = hours - kBaseline_s / 3600.0;
  return w;
}

TEST(Monitoring, GivesFalseAlarmsAtTheStatedRate) {
  const double hours = told("RESONID_SOAK_HOURS", 200.0), interval_h = told("RESONID_SOAK_INTERVAL", 10.0);
  const Drive drive{told("RESONID_SOAK_RATE", 50.0)};
  const double life_h = std::max(10.0, std::min(100.0, interval_h));
  std::vector<Watch> all(static_cast<std::size_t>(std::ceil(hours / life_h)));
  for_each(all.size(), [&](std::size_t i) {
    all[i] = watch(drive, life_h, interval_h, 1000 * (i + 100));
    if (life_h > 10.0) std::printf("installation %zu of %zu:%s\n", i + 1, all.size(), all[i].times.c_str());
    std::fflush(stdout);
  });
  Watch sum;
  int alarms = 0;
  for (const auto& w : all) {
    EXPECT_EQ(w.fault, "");
    sum.hours += w.hours;
    sum.times += w.times;
    for (const auto& [name, count] : w.alarms) {
      sum.alarms[name] += count;
      alarms += count;
    }
  }
  const double due = sum.hours / interval_h;
  std::string figures;
  for (const auto& [name, count] : sum.alarms) figures += name + " " + std::to_string(count) + ", ";
  std::printf("%.0f axis-hours: %d false alarms, %.1f due: %s; at seconds of a run:%s\n", sum.hours, alarms,
              due, figures.c_str(), sum.times.c_str());
  // 95 % of a Poisson count, where that is wider than half and twice.
  const double spread = 1.96 * std::sqrt(due) + 1.0;
  EXPECT_GE(alarms, std::min(0.5 * due, due - spread));
  EXPECT_LE(alarms, std::max(2.0 * due, due + spread));
}

/// A belt that loosens by 5 % at an instant: when the monitor tells, and when a likelihood-ratio test that
/// knows the machine before and after the change, and its time, reaches `threshold`. From the change on;
/// below 0: told before it, not a number: never.
struct Loosening {
  double alarm_s = std::numeric_limits<double>::quiet_NaN();
  double bound_s = std::numeric_limits<double>::quiet_NaN();
};

/// The bound, from the raw samples: parameters known, states and load not.
double bound_s(const Drive& drive, const data::Record& record, double at_s, double threshold) {
  using Tracker = online::PhysicalTracker<double>;
  online::PhysicalTrackerConfig c;
  c.sample_rate_hz = drive.rate_hz;
  c.driven_inertia = c.load_inertia = {0.032, 0.0};
  c.damping = {drive.damping(), 0.0};
  c.viscous_friction_nms_rad.value = 0.02;
  c.torque_offset_std_nm = 1.5;
  c.noise_rms = drive.noise;
  c.replay_speed = 0;
  c.stiffness = {drive.stiffness(), 0.0};
  const auto before = std::make_unique<Tracker>(Tracker::create(c).value());
  c.stiffness.value *= 0.95;
  const auto after = std::make_unique<Tracker>(Tracker::create(c).value());
  const auto misfit = [](const Tracker& t) {
    return t.innovation() * t.innovation() / t.innovation_variance() + std::log(t.innovation_variance());
  };
  double ratio = 0.0;
  for (std::size_t k = 0; k < record.samples(); ++k) {
    for (const auto& t : {before.get(), after.get()})
      t->step(record.excitation.samples[k], record.input.samples[k], record.output.samples[k]);
    const double time_s = static_cast<double>(k) / drive.rate_hz;
    if (time_s < at_s) continue;
    ratio += 0.5 * (misfit(*before) - misfit(*after));
    if (ratio > 0.5 * threshold * threshold) return time_s - at_s;
  }
  return std::numeric_limits<double>::quiet_NaN();
}

Loosening loosening(const Drive& drive, const AxisSpec& spec, double threshold, std::uint64_t seed) {
  const double at_s = 1200.3;
  auto e = drive.experiment(at_s + 60.0, seed);
  e.disturbance.loosening = 0.05;
  e.disturbance.loosening_at_s = at_s;
  const auto record = plant::simulate_closed_loop(e)->record;
  auto monitor = AxisMonitor::create(spec).value();
  Output out;
  add(monitor, record, out);
  Loosening found;
  found.bound_s = bound_s(drive, record, at_s, threshold);
  const auto first = std::find_if(out.events.begin(), out.events.end(), is_false_alarm);
  if (first != out.events.end()) found.alarm_s = static_cast<double>(first->sample) / drive.rate_hz - at_s;
  return found;
}

TEST(Monitoring, FindsALooseningBeltNearlyAsSoonAsCanBe) {
  const auto seeds = static_cast<std::size_t>(told("RESONID_SOAK_SEEDS", 20.0));
  const Drive drive{250.0};
  const auto spec = drive.spec(3.6e6, 600.0);
  online::ChangeDetectorConfig level;
  level.sample_rate_hz = 10.0;
  level.block_s = 1.0;
  level.baseline_s = 600.0;
  level.false_alarm_interval_s = spec.false_alarm_interval_s;
  const double threshold = online::ChangeDetector<double>::create(level)->threshold();
  std::vector<Loosening> all(seeds);
  for_each(seeds, [&](std::size_t i) { all[i] = loosening(drive, spec, threshold, i + 1); });
  std::vector<double> later, bound;
  std::size_t early = 0;
  for (const auto& found : all) {
    ASSERT_TRUE(std::isfinite(found.bound_s));
    ASSERT_TRUE(std::isfinite(found.alarm_s));
    if (found.alarm_s < 0.0) {
      ++early;
      continue;
    }
    bound.push_back(found.bound_s);
    later.push_back(found.alarm_s - found.bound_s);
  }
  std::sort(later.begin(), later.end());
  std::sort(bound.begin(), bound.end());
  const auto at = [](const std::vector<double>& x, double part) {
    return x[std::min(x.size() - 1, static_cast<std::size_t>(part * static_cast<double>(x.size())))];
  };
  std::printf(
      "%zu belts: the bound comes %.2f s (95 %%: %.2f s) after the change, the alarm %.2f s (95 %%: %.2f s) "
      "after the bound; %zu false ones before\n",
      seeds, at(bound, 0.5), at(bound, 0.95), at(later, 0.5), at(later, 0.95), early);
  EXPECT_LE(at(later, 0.5), 3.0);
  EXPECT_LE(at(later, 0.95), 3.0);
  EXPECT_LE(early, 1 + seeds / 50);
}

}  // namespace
}  // namespace resonid::monitoring
