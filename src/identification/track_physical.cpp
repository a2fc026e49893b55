// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <identification/identify/prepare/units.hpp>
#include <identification/track_plan.hpp>
#include <resonid/base/constants.hpp>
#include <resonid/online/models/physical_tracker.hpp>

namespace resonid::identification::detail {
namespace {

using online::PhysicalParameter;
using Tracker = online::PhysicalTracker<double>;

struct Reported {
  PhysicalParameter parameter;
  const char* name;
};
constexpr std::array kReported = {Reported{PhysicalParameter::driven_inertia, "driven_inertia"},
                                  Reported{PhysicalParameter::load_inertia, "load_inertia"},
                                  Reported{PhysicalParameter::stiffness, "stiffness"},
                                  Reported{PhysicalParameter::damping, "damping"},
                                  Reported{PhysicalParameter::torque_offset, "torque_offset"}};

/// Relative change of the stiffness per second to reckon with. A machine that is recorded to move goes
/// through its range at its greatest speed; a belt's stiffness goes with one over its length, so that at the
/// end where it is short it changes faster than that.
double drift_per_s(const data::Record& record, const TrackPlan& plan) {
  constexpr double kUnknownMachine = 0.03;
  constexpr double kUneven = 1.6;
  if (plan.measurement.sweep) return 0.0;  // what a sweep says of the stiffness it says once
  if (!record.position.present()) return kUnknownMachine;
  const auto& x = record.position.samples;
  const auto [low, high] = std::minmax_element(x.begin(), x.end());
  // Long enough for the excitation's own shaking to average out.
  const double window_s = std::min(1.0, 0.1 * record.duration_s());
  const auto window = std::max<std::size_t>(1, static_cast<std::size_t>(window_s * record.sample_rate_hz));
  double fastest = 0.0;
  for (std::size_t k = window; k < x.size(); ++k) fastest = std::max(fastest, std::abs(x[k] - x[k - window]));
  const double speed = fastest * record.sample_rate_hz / static_cast<double>(window);
  const double range = *high - *low;
  return range > 0.0 ? std::max(kUneven * speed / range, kUnknownMachine) : kUnknownMachine;
}

class Physical final : public OnlineTracker {
 public:
  Physical(std::unique_ptr<Tracker> tracker, const Units& units, double sample_rate_hz)
      : tracker_(std::move(tracker)), sample_rate_hz_(sample_rate_hz) {
    units_ = {units.inertia, units.inertia, units.stiffness, units.damping, units.torque};
  }

  void step(double ru, double u, double y) noexcept override { tracker_->step(ru, u, y); }
  [[nodiscard]] std::vector<OnlineColumn> columns() const override {
    std::vector<OnlineColumn> columns;
    for (std::size_t i = 0; i < kReported.size(); ++i)
      columns.push_back({kReported[i].name, units_[i], true, false});
    return columns;
  }
  void read(std::span<OnlineValue> values) override {
    for (std::size_t i = 0; i < kReported.size(); ++i)
      values[i] = {tracker_->value(kReported[i].parameter),
                   tracker_->standard_deviation(kReported[i].parameter)};
  }
  [[nodiscard]] bool ready() const override { return tracker_->ready(); }
  [[nodiscard]] double lag_samples() const override { return tracker_->lag_samples(); }
  [[nodiscard]] double residual() const override { return tracker_->residual(); }
  [[nodiscard]] bool white_residual() const override { return true; }
  [[nodiscard]] OnlineValue resonance() override {
    return {tracker_->resonance_hz(), tracker_->resonance_std_hz()};
  }
  [[nodiscard]] OnlineValue antiresonance() override {
    return {tracker_->antiresonance_hz(), tracker_->antiresonance_std_hz()};
  }
  [[nodiscard]] bool physical() override { return tracker_->plausible(); }
  [[nodiscard]] bool excited() const override { return tracker_->excited(); }
  void response(std::span<const double> frequency_hz, std::span<std::complex<double>> values) override {
    fit::DriveModel drive;
    drive.sample_time_s = 1.0 / sample_rate_hz_;
    drive.parameters = {
        tracker_->value(PhysicalParameter::driven_inertia), tracker_->value(PhysicalParameter::load_inertia),
        tracker_->value(PhysicalParameter::stiffness), tracker_->value(PhysicalParameter::damping),
        tracker_->value(PhysicalParameter::viscous_friction)};
    const auto g = drive.transfer_function();
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = g.response(frequency_hz[i]);
  }

 private:
  std::unique_ptr<Tracker> tracker_;
  std::array<std::string, kReported.size()> units_;
  double sample_rate_hz_;
};

/// How far off the start may be: ten times what its own covariance says, and at least as far as a machine
/// changes. The tracker is ready once it knows twice as much: of the damping, which warmth and wear move most
/// and a record tells least, no more must be asked than the record can tell.
online::StartingValue starting(const fit::DriveModel& drive, fit::Parameter parameter) {
  const double least = parameter == fit::kDamping ? 0.3 : 0.1;
  const auto e = drive.estimate(parameter);
  return {e.value, std::clamp(10.0 * e.std / std::max(e.value, 1e-300), least, 1.0)};
}

}  // namespace

TrackerMade make_physical_tracker(const data::Record& record, const TrackOptions& options,
                                  const TrackPlan& plan) {
  const auto refused = [](std::string message) {
    return tl::unexpected(Error{"method", std::move(message)});
  };
  if (!plan.start || plan.start->drive.structure != fit::Structure::two_mass)
    return refused("physical needs a two-mass model to begin with, and the record shows none: give .start");
  const auto& drive = plan.start->drive;
  const auto velocity = velocity_of(record);
  online::PhysicalTrackerConfig config;
  config.sample_rate_hz = record.sample_rate_hz;
  config.delay_s = std::max(0.0, plan.delay_s + velocity->further_delay_samples / record.sample_rate_hz);
  config.driven_inertia = starting(drive, fit::kDrivenInertia);
  config.load_inertia = starting(drive, fit::kLoadInertia);
  config.stiffness = starting(drive, fit::kStiffness);
  config.damping = starting(drive, fit::kDamping);
  config.viscous_friction_nms_rad = {drive.parameters.viscous_friction, 0.0};
  double largest = 0.0;
  for (const double u : record.input.samples) largest = std::max(largest, std::abs(u));
  config.torque_offset_std_nm = std::max(largest, 1e-12);
  config.torque_offset_drift_nm_rt_s = 0.005 * config.torque_offset_std_nm;
  config.stiffness_drift_per_s = options.drift_per_s.value_or(drift_per_s(record, plan));
  auto tracker = Tracker::create(config);
  if (!tracker)
    return refused(fmt::format("physical: {} {} (found {:.6g})", tracker.error().field.view(),
                               tracker.error().requirement.view(), tracker.error().value));
  return std::make_unique<Physical>(std::make_unique<Tracker>(*tracker), units_of(record),
                                    record.sample_rate_hz);
}

}  // namespace resonid::identification::detail
