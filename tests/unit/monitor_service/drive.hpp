// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <monitor/service/installation.hpp>
#include <resonid/plant/experiment.hpp>
#include <string>
#include <thread>
#include <vector>

namespace resonid::monitor {

inline constexpr double kRate = 250.0;

/// ru, u, y of a drive with dry friction and load steps whose belt loosens by a tenth.
inline std::vector<double> drive_samples(double seconds, double loosens_at_s, std::uint64_t seed) {
  plant::ExperimentConfig e;
  e.drive.structure = plant::Structure::two_mass;
  e.drive.driven_inertia = e.drive.load_inertia = 0.032;
  e.drive.stiffness = 143.75;
  e.drive.damping = 0.3;
  e.drive.viscous_friction = 0.02;
  e.friction.driven.coulomb = 0.15;
  e.disturbance.loosening = 0.1;
  e.disturbance.loosening_at_s = loosens_at_s;
  e.disturbance.load_step = {0.4, -0.6};
  e.disturbance.load_step_at_s = {0.3 * seconds, 0.6 * seconds};
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

/// A sender with a memory: it goes on from what the ring has, with the samples' own numbers and times.
class ReplaySource : public Source {
 public:
  /// `speed`: samples per second over the rate; 0: as fast as they are taken.
  ReplaySource(Axes& axes, const std::vector<std::vector<double>>& values, double speed)
      : axes_(axes), values_(values), speed_(speed) {}
  ~ReplaySource() override { end(); }
  void start() override {
    thread_ = std::thread([this] { run(); });
  }
  void stop() override { end(); }
  [[nodiscard]] SourceStatus status() const override {
    SourceStatus s;
    s.state = done_.load() ? SourceState::ended : SourceState::running;
    return s;
  }
  [[nodiscard]] std::string_view promise() const noexcept override { return "loses nothing"; }

 private:
  void end() {
    stopping_.store(true);
    if (thread_.joinable()) thread_.join();
  }
  void run() {
    constexpr std::size_t kFrame = 37;
    const std::string_view columns[] = {"ru", "u", "y"};
    const auto begin = std::chrono::steady_clock::now();
    std::vector<std::uint64_t> first;
    for (std::size_t a = 0; a < values_.size(); ++a) first.push_back(axes_.all()[a]->next_for_sender());
    while (!stopping_.load()) {
      bool more = false;
      const double passed = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
      for (std::size_t a = 0; a < values_.size(); ++a) {
        Intake& intake = *axes_.all()[a];
        const std::uint64_t next = intake.next_for_sender();
        const std::size_t total = values_[a].size() / 3;
        if (next >= total) continue;
        more = true;
        if (speed_ > 0.0 && static_cast<double>(next - first[a]) > passed * speed_ * kRate) continue;
        Arrival arrival;
        arrival.first_sample = next;
        arrival.time_ns = 1'700'000'000'000'000'000 + static_cast<std::int64_t>(next) * 4'000'000;
        arrival.sample_rate_hz = kRate;
        arrival.columns = columns;
        const std::size_t count = std::min<std::size_t>(kFrame, total - next);
        arrival.values = std::span(values_[a]).subspan(3 * next, 3 * count);
        if (intake.add(arrival) == Intake::Outcome::full)
          std::this_thread::sleep_for(std::chrono::milliseconds(1));
      }
      if (!more) break;
      if (speed_ > 0.0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    done_.store(true);
  }

  Axes& axes_;
  const std::vector<std::vector<double>>& values_;
  double speed_;
  std::thread thread_;
  std::atomic<bool> stopping_{false}, done_{false};
};

inline Installation installation(const std::filesystem::path& data,
                                 const std::vector<std::vector<double>>& values, double speed) {
  Installation all;
  all.data = data;
  all.version = "test";
  all.retention.rows_s = all.retention.five_minutes_s = all.retention.evidence_s =
      0.0;  // the drive ran years ago
  all.engine.workers = 2;
  all.engine.snapshot_every_s = 0.2;
  all.engine.stale_s = 1e6;
  all.engine.learning_patience_s = 1e6;  // on a busy machine, too, each learns from its first samples
  for (std::size_t a = 0; a < values.size(); ++a) {
    InstalledAxis axis;
    axis.spec.name = "axis" + std::to_string(a);
    axis.spec.sample_rate_hz = kRate;
    axis.spec.baseline_s = 40.0;
    axis.spec.track.method = identification::TrackMethod::physical;
    axis.spec.alarms[monitoring::Watched::load_torque].changes = false;
    axis.columns = {"ru", "u", "y", ""};
    axis.source = "replay";
    axis.configuration = "test";
    all.axes.push_back(std::move(axis));
  }
  all.sources.push_back(
      {"replay", "replay", [&values, speed](Axes& axes) -> expected<std::unique_ptr<Source>, Error> {
         return std::make_unique<ReplaySource>(axes, values, speed);
       }});
  return all;
}

}  // namespace resonid::monitor
