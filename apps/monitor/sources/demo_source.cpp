// SPDX-License-Identifier: MIT
#include "monitor/sources/demo_source.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <resonid/io/shipped_experiments.hpp>
#include <resonid/online/excitation/excitation.hpp>
#include <utility>

#include "monitor/sources/thread_source.hpp"

namespace resonid::monitor {
namespace {

using SteadyClock = std::chrono::steady_clock;

constexpr double kPiece_s = 0.05;        // between looks at the clock
constexpr double kMostBehind_s = 1.0;    // then the clock is set back
constexpr double kMostPerArrival = 1e3;  // samples; buffers stay as large as the longest was
constexpr double kRun_s = 4.0 * 3600.0;
constexpr std::string_view kColumns[] = {"ru", "u", "y", "position"};

/// A machine that runs.
class DemoDrive {
 public:
  DemoDrive(DemoMachine machine, plant::ClosedLoop loop)
      : machine_(std::move(machine)),
        loop_(std::move(loop)),
        excitation_(*online::Excitation::create(machine_.experiment.excitation, rate_hz())),
        noise_(machine_.experiment.measurement, rate_hz(), machine_.experiment.run.seed) {}

  [[nodiscard]] double rate_hz() const noexcept { return machine_.experiment.run.sample_rate_hz; }
  [[nodiscard]] const std::string& axis() const noexcept { return machine_.axis; }
  [[nodiscard]] std::uint64_t samples() const noexcept { return sample_; }

  /// Puts `count` more samples to `values` ([sample][column]).
  void run(std::uint64_t count, std::vector<double>& values) {
    const auto length =
        static_cast<std::uint64_t>(std::llround(machine_.experiment.run.duration_s * rate_hz()));
    for (std::uint64_t k = 0; k < count; ++k, ++sample_) {
      if (sample_ > 0 && sample_ % length == 0) loop_ = *plant::make_loop(machine_.experiment);
      const double ru = excited() ? excitation_.step() : 0.0;
      const plant::ClosedLoop::Sample s = loop_.step(ru, noise_.step());
      values.insert(values.end(), {ru, s.input, s.output, s.place});
    }
  }

 private:
  [[nodiscard]] bool excited() const noexcept {
    if (machine_.paused_s == 0.0) return true;
    const double time_s = static_cast<double>(sample_) / rate_hz();
    return std::fmod(time_s, machine_.excited_s + machine_.paused_s) < machine_.excited_s;
  }

  DemoMachine machine_;
  plant::ClosedLoop loop_;
  online::Excitation excitation_;
  plant::MeasurementNoise noise_;
  std::uint64_t sample_ = 0;
};

class DemoSource final : public ThreadSource {
 public:
  DemoSource(std::vector<DemoDrive> drives, double speed, Axes& axes)
      : ThreadSource(axes), drives_(std::move(drives)), speed_(speed) {}
  ~DemoSource() override { stop(); }
  [[nodiscard]] std::string_view promise() const noexcept override {
    return "The drives are simulated; they start anew with the process, after a gap.";
  }

 private:
  void run() override {
    const auto first_ns = std::chrono::duration_cast<std::chrono::nanoseconds>(
                              std::chrono::system_clock::now().time_since_epoch())
                              .count();
    for (const DemoDrive& drive : drives_) {
      const Intake* const intake = delivery_.find(drive.axis());
      const std::uint64_t next = intake == nullptr ? 0 : intake->next_for_sender();
      // More than a second later where there are samples of an earlier run, as they do not continue them.
      first_.push_back(next == 0 ? 0 : next + static_cast<std::uint64_t>(2.0 * drive.rate_hz()));
    }
    set_state(SourceState::running);
    auto start = SteadyClock::now();
    while (wait(kPiece_s)) {
      const double elapsed_s = std::chrono::duration<double>(SteadyClock::now() - start).count();
      for (std::size_t k = 0; k < drives_.size() && !stopping(); ++k)
        advance(k, elapsed_s * speed_, first_ns);
      const double behind_s = std::chrono::duration<double>(SteadyClock::now() - start).count() - elapsed_s;
      if (behind_s < kMostBehind_s) continue;
      start += std::chrono::duration_cast<SteadyClock::duration>(std::chrono::duration<double>(behind_s));
      set_state(SourceState::running,
                fmt::format("the processor is too slow for {:g} times real time", speed_));
    }
  }

  /// Runs a drive up to a simulated time.
  void advance(std::size_t k, double to_s, std::int64_t first_ns) {
    DemoDrive& drive = drives_[k];
    const auto end = static_cast<std::uint64_t>(to_s * drive.rate_hz());
    while (drive.samples() < end && !stopping()) {
      Arrival arrival;
      arrival.axis = drive.axis();
      arrival.first_sample = first_[k] + drive.samples();
      arrival.time_ns = first_ns + std::llround(1e9 * static_cast<double>(drive.samples()) / drive.rate_hz());
      arrival.sample_rate_hz = drive.rate_hz();
      arrival.columns = kColumns;
      values_.clear();
      drive.run(std::min(end - drive.samples(), static_cast<std::uint64_t>(kMostPerArrival)), values_);
      arrival.values = values_;
      delivery_.count_bytes(values_.size() * sizeof(double));
      static_cast<void>(deliver(arrival));
    }
  }

  std::vector<DemoDrive> drives_;
  const double speed_;
  std::vector<std::uint64_t> first_;  ///< [drive] Index of its first sample.
  std::vector<double> values_;
};

}  // namespace

std::vector<DemoMachine> demo_machines() {
  DemoMachine belt{"belt", io::shipped_experiment("belt_loosens")};
  belt.experiment.disturbance.loosening = 0.2;
  belt.experiment.disturbance.loosening_at_s = 180.0;
  belt.experiment.disturbance.loosening_over_s = 60.0;

  DemoMachine shaft{"shaft", io::shipped_experiment("shaft_drive"), 60.0, 30.0};
  shaft.experiment.excitation.kind = online::Kind::prbs;  // followed for good, as no sweep is
  shaft.experiment.excitation.register_length = 10;
  shaft.experiment.actuator.lag_s = 0.0;  // which no estimator on line models

  DemoMachine conveyor{"conveyor", io::shipped_experiment("load_steps")};
  conveyor.experiment.friction.driven = {0.3, 0.4, 0.5};
  auto& load = conveyor.experiment.disturbance;
  load.load_step.clear();
  load.load_step_at_s.clear();
  for (double at_s = 45.0, step = -2.0; at_s < kRun_s; at_s += 90.0, step = -step) {
    load.load_step.push_back(step);
    load.load_step_at_s.push_back(at_s);
  }
  DemoMachine servo{"servo", io::shipped_experiment("servo_cascade")};
  std::vector<DemoMachine> machines{std::move(belt), std::move(shaft), std::move(conveyor), std::move(servo)};
  for (DemoMachine& machine : machines) machine.experiment.run.duration_s = kRun_s;
  return machines;
}

expected<std::unique_ptr<Source>, Error> make_demo_source(DemoSettings settings, Axes& axes) {
  if (settings.machines.empty()) return refuse("machines", "must be at least one");
  if (!(settings.speed >= 0.01 && settings.speed <= 1000.0))
    return refuse("speed", "must be 0.01 ... 1000", settings.speed);
  std::vector<DemoDrive> drives;
  for (DemoMachine& machine : settings.machines) {
    if (!(machine.excited_s >= 0.0)) return refuse("excited_s", "must be >= 0", machine.excited_s);
    if (!(machine.paused_s >= 0.0)) return refuse("paused_s", "must be >= 0", machine.paused_s);
    if (!(machine.experiment.run.duration_s > 0.0))
      return refuse("run.duration_s", "must be > 0", machine.experiment.run.duration_s);
    auto loop = plant::make_loop(machine.experiment);
    if (!loop) return unexpected(loop.error());
    drives.emplace_back(std::move(machine), *std::move(loop));
  }
  return std::make_unique<DemoSource>(std::move(drives), settings.speed, axes);
}

}  // namespace resonid::monitor
