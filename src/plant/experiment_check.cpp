// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <resonid/base/constants.hpp>
#include <resonid/plant/experiment.hpp>

#include "plant/experiment_parts.hpp"
#include "plant/loop_poles.hpp"

namespace resonid::plant {
namespace {

constexpr double kMaxDelaySamples = 1e6;
constexpr std::size_t kMaxPoleDelay = 60;  // samples; beyond it the poles take too long
constexpr double kStable = 1.0 + 1e-9;     // rounding of a pole on the unit circle

/// The experiment itself is not in order.
unexpected<SimulationError> told(const Error& error) {
  return unexpected<SimulationError>(SimulationError{error});
}

unexpected<Error> refused(std::string_view table, const Error& error) {
  return unexpected<Error>(located(table, error));
}

expected<void> check_ranges(const ExperimentConfig& c) {
  if (const auto ok = check(c.drive); !ok) return refused("drive", ok.error());
  if (const auto ok = check(c.friction); !ok) return refused("friction", ok.error());
  if (const auto ok = check(c.disturbance); !ok) return refused("disturbance", ok.error());
  if (const auto ok = check(c.actuator); !ok) return refused("actuator", ok.error());
  if (const auto ok = check(c.controller); !ok) return refused("controller", ok.error());
  if (const auto ok = check(c.motion); !ok) return refused("motion", ok.error());
  if (const auto ok = check(c.measurement); !ok) return refused("measurement", ok.error());
  if (const auto ok = check(c.run); !ok) return refused("run", ok.error());
  const auto excitation = online::Excitation::create(c.excitation, c.run.sample_rate_hz);
  if (!excitation) return refused("excitation", excitation.error());
  if (c.measurement.delay_s * c.run.sample_rate_hz > kMaxDelaySamples)
    return refused("measurement", {"delay_s", "must be at most 1e6 samples", c.measurement.delay_s});
  if (c.controller.kind == ControllerKind::none && c.motion.kind != MotionKind::standstill &&
      c.motion.kind != MotionKind::constant)
    return refused("motion", {"kind", "must be standstill or constant without a controller to follow it"});
  if (c.motion.kind == MotionKind::constant && c.motion.velocity != 0.0 &&
      mass_system(c.drive, 1.0, c.drive.stroke_from_m).grounded())
    return refused("motion",
                   {"velocity", "must be 0 under constant motion: a spring to the ground holds the drive",
                    c.motion.velocity});
  return {};
}

expected<void> check_resonances(const ExperimentConfig& c, double highest_factor) {
  const auto modes = resonances(mass_system(c.drive, highest_factor, c.drive.stroke_from_m));
  if (modes.empty() || modes.back().frequency_hz < 0.5 * c.run.sample_rate_hz) return {};
  return refuse("run.sample_rate_hz",
                fmt::format("must be more than {:.4g}, since the drive resonates at {:.4g} Hz",
                            2.0 * modes.back().frequency_hz, modes.back().frequency_hz),
                c.run.sample_rate_hz);
}

/// Places between which the cart's reference goes, less the following error of a cascade.
MotionProfile::Range cart_range(const ExperimentConfig& c, const Controller& controller, double duration_s) {
  auto range = MotionProfile::create(c.motion)->reached(duration_s);
  if (c.motion.kind != MotionKind::constant) return range;
  const double radius = c.drive.radius_m;
  const double behind = radius * controller.following_error(c.motion.velocity / radius);
  return {range.lowest - behind, range.highest - behind};
}

expected<void> check_stroke(const ExperimentConfig& c, double duration_s) {
  if (c.drive.structure != Structure::tooth_belt) return {};
  const auto controller = Controller::create(c.controller, c.run.sample_rate_hz);
  if (!controller) return refused("controller", controller.error());
  const auto [lowest, highest] = cart_range(c, *controller, duration_s);
  constexpr double kEnd = 1e-9;
  if (lowest >= c.drive.stroke_from_m - kEnd && highest <= c.drive.stroke_to_m + kEnd) return {};
  const bool constant = c.motion.kind == MotionKind::constant;
  const bool below = lowest < c.drive.stroke_from_m - kEnd;
  return refuse(
      constant ? "motion.velocity" : (below == (c.motion.from <= c.motion.to) ? "motion.from" : "motion.to"),
      fmt::format("must keep the cart in its stroke, {:g} ... {:g} m: it goes to {:g} m within {:g} s",
                  c.drive.stroke_from_m, c.drive.stroke_to_m, below ? lowest : highest, duration_s));
}

/// Stiffnesses that the loop is judged at: those that the run goes through, a tooth belt's cart within
/// kAllowance of its stroke beside its reference. In even ratio, no more than 10 % apart, and so close that
/// the delay turns the resonance by less than kTurns from one to the next.
std::vector<double> judged_factors(const ExperimentConfig& c, const Machine& machine,
                                   const Controller& controller, double duration_s) {
  constexpr double kAllowance = 0.05;
  constexpr double kRatio = 1.1;
  constexpr double kTurns = 0.05;
  constexpr double kMost = 400.0;
  if (!machine.varies()) return {machine.lowest_factor()};
  double low = machine.lowest_factor();
  double high = machine.highest_factor();
  if (c.drive.structure == Structure::tooth_belt) {
    const double aside = kAllowance * (c.drive.stroke_to_m - c.drive.stroke_from_m);
    const auto reference = cart_range(c, controller, duration_s);
    MachineConfig part = machine.config();
    part.drive.stroke_from_m = std::max(c.drive.stroke_from_m, reference.lowest - aside);
    part.drive.stroke_to_m = std::min(c.drive.stroke_to_m, reference.highest + aside);
    const double nominal = tooth_belt_stiffness(part.drive, part.drive.stroke_from_m) /
                           tooth_belt_stiffness(c.drive, c.drive.stroke_from_m);
    const Machine there(part, duration_s);
    low = std::max(low, nominal * there.lowest_factor());
    high = std::min(high, nominal * there.highest_factor());
  }
  const auto highest_hz = [&](double factor) {
    return resonances(machine.system(factor)).back().frequency_hz;
  };
  const double late_s = c.measurement.delay_s + 1.0 / c.run.sample_rate_hz;
  const double nodes = std::max(std::log(high / low) / std::log(kRatio),
                                (highest_hz(high) - highest_hz(low)) * late_s / kTurns);
  const double count = std::ceil(std::clamp(nodes, 1.0, kMost));
  std::vector<double> factors;
  for (double i = 0.0; i <= count; ++i) factors.push_back(low * std::pow(high / low, i / count));
  return factors;
}

expected<void, SimulationError> check_loop(const ExperimentConfig& c, const Drive& drive,
                                           const Machine& machine, double duration_s) {
  const double rate = c.run.sample_rate_hz;
  const auto controller = Controller::create(c.controller, rate);
  if (!controller) return told(located("controller", controller.error()));
  const auto feedback = controller->velocity_feedback();
  const VelocityPath path = velocity_path(c.measurement, rate, controller->position_gain());
  const SampleDelay delay = split_delay(c.measurement.delay_s, rate);
  if (!feedback) return {};
  for (const double factor : judged_factors(c, machine, *controller, duration_s)) {
    const SampledDrive sampled = drive.sampled(factor);
    std::string how;
    if (delay.whole > kMaxPoleDelay) {
      if (!loop_is_unstable(sampled, delay, path, *feedback)) continue;
      how = fmt::format("with {} samples of delay it is not", delay.whole);
    } else {
      const auto pole = dominant_loop_pole(sampled, delay, path, *feedback);
      if (std::abs(pole) <= kStable) continue;
      const double grows_s = std::log(10.0) / (rate * std::log(std::abs(pole)));
      how = path.hold > 1 ? fmt::format("an oscillation grows tenfold in {:.3g} s", grows_s)
                          : fmt::format("an oscillation at {:.3g} Hz grows tenfold in {:.3g} s",
                                        std::abs(std::arg(pole)) / kTwoPi * rate, grows_s);
    }
    if (machine.varies())
      how += fmt::format(" where the drive resonates at {:.4g} Hz",
                         resonances(machine.system(factor)).front().frequency_hz);
    const bool has_gain = c.controller.gain != 0.0;
    return unexpected(SimulationError{
        {has_gain ? "controller.gain" : "controller", "must leave the closed loop stable: " + how,
         has_gain ? c.controller.gain : std::nan("")},
        true});
  }
  return {};
}

}  // namespace

Error located(std::string_view table, const Error& error) {
  return {fmt::format("{}{}{}", table, error.field.empty() ? "" : ".", error.field.view()), error.requirement,
          error.value};
}

MachineConfig machine_of(const ExperimentConfig& c) {
  return {c.drive, c.friction, c.disturbance, c.actuator.lag_s, c.measurement.second_output};
}

expected<void> check(const ExperimentConfig& config) {
  if (const auto ok = checked(config); !ok) return unexpected<Error>(ok.error());
  return {};
}

expected<void, SimulationError> checked(const ExperimentConfig& config) {
  if (const auto ok = check_ranges(config); !ok) return told(ok.error());
  const auto samples = length_of(config);
  if (!samples) return told(samples.error());
  const double duration_s = static_cast<double>(*samples) / config.run.sample_rate_hz;
  const SampleDelay delay = split_delay(config.measurement.delay_s, config.run.sample_rate_hz);
  const auto drive = make_drive(machine_of(config), config.run.sample_rate_hz, delay.fraction, duration_s);
  if (!drive)
    return told(located(drive.error().field == "load_coulomb" ? "friction" : "disturbance", drive.error()));
  const Machine machine(machine_of(config), duration_s);
  if (config.measurement.second_output != data::SecondOutput::none && machine.masses() < 2)
    return told({"measurement.second_output", "needs a load: this machine is rigid"});
  if (const auto ok = check_resonances(config, machine.highest_factor()); !ok) return told(ok.error());
  if (const auto ok = check_stroke(config, duration_s); !ok) return told(ok.error());
  return check_loop(config, **drive, machine, duration_s);
}

}  // namespace resonid::plant
