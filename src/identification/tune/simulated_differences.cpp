// SPDX-License-Identifier: MIT
#include "identification/tune/simulated_differences.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "identification/parameter_words.hpp"
#include "identification/tune/figure_values.hpp"
#include "identification/tune/named_bounds.hpp"

namespace resonid::identification {
namespace {

using plant::DriveConfig;
using plant::ExperimentConfig;

constexpr double kSearchRoom = 0.002;      // by which searches aim below a bound
constexpr double kMayDiffer = 0.1;         // of what was promised, beyond its interval
constexpr double kMayDifferPercent = 2.0;  // of a step: overshoot, and what is left of it
constexpr double kDiffersMuch = 0.3;       // a warning where a step does

struct ComparedParameter {
  fit::Parameter parameter;
  double DriveConfig::*value;
};
constexpr ComparedParameter kCompared[] = {{fit::kDrivenInertia, &DriveConfig::driven_inertia},
                                           {fit::kMiddleInertia, &DriveConfig::middle_inertia},
                                           {fit::kLoadInertia, &DriveConfig::load_inertia},
                                           {fit::kStiffness, &DriveConfig::stiffness},
                                           {fit::kStiffness2, &DriveConfig::stiffness_2},
                                           {fit::kDamping, &DriveConfig::damping},
                                           {fit::kDamping2, &DriveConfig::damping_2},
                                           {fit::kViscousFriction, &DriveConfig::viscous_friction},
                                           {fit::kLoadViscousFriction, &DriveConfig::load_viscous_friction}};

/// A tooth belt as the two-mass machine that it is where its cart begins.
DriveConfig drive_at_shaft(const ExperimentConfig& experiment) {
  DriveConfig drive = experiment.drive;
  if (drive.structure != plant::Structure::tooth_belt) return drive;
  const auto p = plant::at_driven_shaft(drive, experiment.motion.from);
  drive.structure = plant::Structure::two_mass;
  drive.driven_inertia = p.driven_inertia;
  drive.load_inertia = p.load_inertia;
  drive.stiffness = p.stiffness;
  drive.damping = p.damping;
  return drive;
}

/// What an experiment has that the linear loop of the identified machine has not.
class LikelyReasons {
 public:
  LikelyReasons(const Tuning& tuning, const ExperimentConfig& experiment)
      : t_(tuning), e_(experiment), identified_(tuning.machines.front()) {}

  /// Those that its linear loop shows too.
  LikelyReasons& of_loop() {
    const auto& measured = e_.measurement;
    const double hold_s = 0.5 * static_cast<double>(measured.hold_samples - 1) * t_.sample_time_s;
    time("a torque lag", e_.actuator.lag_s, identified_.torque_lag_s);
    time("a delay", measured.delay_s + hold_s,
         std::max(0.0, identified_.known_delay_s + identified_.delay_s));
    time("a filter of the velocity", measured.filter_s, identified_.output_filter_s);
    if (measured.velocity == plant::VelocitySource::encoder &&
        identified_.velocity != fit::Velocity::differences)
      add("velocity by differences of an encoder's positions");
    machine();
    return *this;
  }

  /// Those that only a run shows.
  LikelyReasons& of_run(const SimulatedRun& run) {
    if (e_.friction.driven.any() || e_.friction.load.any()) add("dry friction");
    const double limit = e_.controller.torque_limit;
    constexpr double kRounding = 1e-6;
    const bool at_limit = limit > 0.0 && std::ranges::any_of(run.torque, [&](double torque) {
                            return std::abs(torque) >= (1.0 - kRounding) * limit;
                          });
    if (at_limit) add("the torque limit, which it reaches");
    if (e_.measurement.encoder_counts > 0.0) add("counts of the encoder");
    if (e_.actuator.torque_resolution > 0.0) add("steps of the torque");
    if (e_.drive.backlash > 0.0) add("backlash");
    if (e_.drive.stiffening_twist > 0.0) add("a coupling that stiffens");
    const auto& d = e_.disturbance;
    if (run.what.starts_with("motion") &&
        (d.load_torque != 0.0 || !d.load_step.empty() || d.eccentricity != 0.0 ||
         d.stiffness_drift_per_s != 0.0 || d.loosening != 0.0))
      add("disturbances of the experiment");
    return *this;
  }

  /// "; likely by dry friction"
  [[nodiscard]] std::string text() const {
    return "; likely by " + (list_.empty() ? "what a linear loop leaves out" : list_);
  }

 private:
  void add(const std::string& reason) { add_to_list(list_, reason, ", "); }

  void time(const char* words, double simulated_s, double identified_s) {
    constexpr double kPart = 0.05;  // of a sample
    if (std::abs(simulated_s - identified_s) <= kPart * t_.sample_time_s) return;
    add(fmt::format("{} of {:.3g} ms (identified: {:.3g} ms)", words, 1e3 * simulated_s, 1e3 * identified_s));
  }

  /// Parameters off by more than matters, and than their error bars tell.
  void machine() {
    constexpr double kPart = 0.05, kStds = 2.0;
    const DriveConfig simulated = drive_at_shaft(e_), identified = drive_config_of(identified_);
    if (simulated.structure != identified.structure)
      return add(fmt::format("a {} machine (identified: {})", name_of(simulated.structure),
                             name_of(identified.structure)));
    if (simulated.structure == plant::Structure::chain) return;
    for (const auto& compared : kCompared) {
      const double is = simulated.*compared.value, was = identified.*compared.value;
      const double variance = identified_.covariance(compared.parameter, compared.parameter);
      const double room =
          std::max(kPart * std::max(std::abs(is), std::abs(was)), kStds * std::sqrt(std::max(0.0, variance)));
      if (std::abs(is - was) > room)
        add(fmt::format("{} {:.3g} (identified: {:.3g})", detail::parameter_words(compared.parameter), is,
                        was));
    }
  }

  const Tuning& t_;
  const ExperimentConfig& e_;
  const fit::DriveModel& identified_;
  std::string list_;
};

/// From what 95 % of the machines do: settling of a load that swings back to the very edge of its band jumps.
double off_promise(const Tuning& t, const SimulatedFigure& simulated) {
  const auto* figure = t.proposed().figure(simulated.name);
  double low = *simulated.promised, high = low;
  if (figure != nullptr && figure->low && figure->high && figure->value != 0.0) {
    low = std::min(low, low * *figure->low / figure->value);
    high = std::max(high, high * *figure->high / figure->value);
  }
  return std::max({0.0, low - simulated.simulated, simulated.simulated - high});
}

bool is_percent_of_step(const SimulatedFigure& figure) {
  return figure.name == "reference_overshoot" || figure.name == "deviation_left";
}

/// A part of the promise; of small errors what a sample and a hundredth of the velocity make of them.
double may_be_off(const Tuning& t, const SimulatedRun& run, const SimulatedFigure& figure, double part) {
  constexpr double kSamples = 1.5, kOfVelocity = 0.01;
  if (is_percent_of_step(figure)) return kMayDifferPercent * part / kMayDiffer;
  const double most = part * std::abs(*figure.promised);
  double velocity = 0.0;
  for (const double r : run.reference) velocity = std::max(velocity, std::abs(r));
  if (figure.name == "reference_settling_s") return std::max(most, kSamples * t.sample_time_s);
  if (figure.name == "velocity_error") return std::max(most, kOfVelocity * velocity);
  if (figure.name == "position_error") return std::max(most, velocity * t.sample_time_s);
  return most;
}

}  // namespace

void compare_with_bound(Tuning& t, const ExperimentConfig& experiment, const LoopFigure& figure,
                        double simulated, double at_hz) {
  if (!figure.bound || simulated <= (1.0 + kSearchRoom) * *figure.bound) return;
  t.trusted = false;
  t.findings.push_back(
      {"simulation-beyond-bound", diagnostics::Severity::error, simulated, *figure.bound,
       fmt::format(
           "On the simulated drive {} is {:.4g} at {:.3g} Hz, beyond its bound of {:.4g} by more than "
           "{:g} %, by which searches aim below it{}.",
           figure_words(figure.name), simulated, at_hz, *figure.bound, 100.0 * kSearchRoom,
           LikelyReasons(t, experiment).of_loop().text())});
}

void compare_with_promise(Tuning& t, const ExperimentConfig& experiment, const SimulatedRun& run, bool cut) {
  if (run.what.ends_with("shaper")) return;  // the step without it tells as much
  std::string differing;
  const SimulatedFigure* first = nullptr;
  bool much = false, spread = false, of_step = false;
  for (const auto& figure : run.figures) {
    // What is summed up until it has settled is not all there after a cut.
    const bool is_cut = cut && (figure.name == "load_step_iae" || figure.name == "reference_settling_s");
    if (!figure.promised || is_cut) continue;
    const double off = off_promise(t, figure);
    if (off <= may_be_off(t, run, figure, kMayDiffer)) continue;
    differing += fmt::format("{}{} {:.3g}{} came, {:.3g} was promised", first == nullptr ? "" : "; ",
                             figure_words(figure.name), figure.simulated,
                             figure.unit.empty() ? "" : " " + figure.unit, *figure.promised);
    much = much || off > may_be_off(t, run, figure, kDiffersMuch);
    spread = spread || t.proposed().figure(figure.name) != nullptr;
    of_step = of_step || is_percent_of_step(figure);
    if (first == nullptr) first = &figure;
  }
  if (first == nullptr) return;
  // Errors of a motion are small, and friction alone is a part of them.
  const bool warns = much && !run.what.starts_with("motion");
  const std::string how = fmt::format("more than {:g} %{} off{}", 100.0 * kMayDiffer,
                                      of_step ? fmt::format(", {:g} % of the step,", kMayDifferPercent) : "",
                                      spread ? " what 95 % of the machines do" : "");
  t.findings.push_back({"simulation-differs",
                        warns ? diagnostics::Severity::warning : diagnostics::Severity::info,
                        first->simulated, first->promised,
                        fmt::format("{}: {} ({}){}.", run.what, differing, how,
                                    LikelyReasons(t, experiment).of_run(run).of_loop().text())});
}

}  // namespace resonid::identification
