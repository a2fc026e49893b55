// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <cmath>
#include <resonid/base/constants.hpp>
#include <resonid/plant/experiment.hpp>

#include "plant/experiment_parts.hpp"
#include "plant/loop_poles.hpp"

namespace resonid::plant {
namespace {

constexpr double kMaxDelaySamples = 1e6;
constexpr std::size_t kMaxPoleDelay = 400;  // samples; beyond it the poles take too long
constexpr double kStable = 1.0 + 1e-9;      // rounding of a pole on the unit circle

unexpected<ExperimentError> refused(std::string_view table, const ConfigError& error) {
  return unexpected<ExperimentError>(located(table, error));
}

expected<void, ExperimentError> check_ranges(const ExperimentConfig& c) {
  if (const auto ok = check(c.drive); !ok) return refused("drive", ok.error());
  if (const auto ok = check(c.friction); !ok) return refused("friction", ok.error());
  if (const auto ok = check(c.disturbance); !ok) return refused("disturbance", ok.error());
  if (const auto ok = check(c.actuator); !ok) return refused("actuator", ok.error());
  if (const auto ok = check(c.controller); !ok) return refused("controller", ok.error());
  if (const auto ok = check(c.motion); !ok) return refused("motion", ok.error());
  if (const auto ok = check(c.measurement); !ok) return refused("measurement", ok.error());
  if (const auto ok = check(c.run); !ok) return refused("run", ok.error());
  const auto excitation = excitation::Excitation::create(c.excitation, c.run.sample_rate_hz);
  if (!excitation) return refused("excitation", excitation.error());
  if (c.measurement.delay_s * c.run.sample_rate_hz > kMaxDelaySamples)
    return refused("measurement", {"delay_s", "must be at most 1e6 samples", c.measurement.delay_s});
  if (c.controller.kind == ControllerKind::none && c.motion.kind != MotionKind::standstill &&
      c.motion.kind != MotionKind::constant)
    return refused("motion", {"kind", "must be standstill or constant without a controller to follow it"});
  return {};
}

expected<void, ExperimentError> check_resonances(const ExperimentConfig& c, double highest_factor) {
  const auto modes = resonances(mass_system(c.drive, highest_factor, c.drive.stroke_from_m));
  if (modes.empty() || modes.back().frequency_hz < 0.5 * c.run.sample_rate_hz) return {};
  return unexpected(
      ExperimentError{"run", "sample_rate_hz", fmt::format("{:g}", c.run.sample_rate_hz),
                      fmt::format("must be more than {:.4g}, since the drive resonates at {:.4g} Hz",
                                  2.0 * modes.back().frequency_hz, modes.back().frequency_hz)});
}

expected<void, ExperimentError> check_stroke(const ExperimentConfig& c, double duration_s) {
  if (c.drive.structure != Structure::tooth_belt) return {};
  const auto [lowest, highest] = MotionProfile::create(c.motion)->reached(duration_s);
  constexpr double kEnd = 1e-9;
  if (lowest >= c.drive.stroke_from_m - kEnd && highest <= c.drive.stroke_to_m + kEnd) return {};
  const bool constant = c.motion.kind == MotionKind::constant;
  const bool below = lowest < c.drive.stroke_from_m - kEnd;
  return unexpected(ExperimentError{
      "motion",
      constant ? "velocity" : (below == (c.motion.from <= c.motion.to) ? "from" : "to"),
      {},
      fmt::format("must keep the cart in its stroke, {:g} ... {:g} m: it goes to {:g} m within {:g} s",
                  c.drive.stroke_from_m, c.drive.stroke_to_m, below ? lowest : highest, duration_s)});
}

expected<void, ExperimentError> check_loop(const ExperimentConfig& c, const Drive& drive,
                                           const Machine& machine) {
  const double rate = c.run.sample_rate_hz;
  const auto controller = Controller::create(c.controller, rate);
  if (!controller) return refused("controller", controller.error());
  const auto feedback = controller->feedback();
  const SampleDelay delay = split_delay(c.measurement.delay_s, rate);
  if (!feedback) return {};
  const int last = machine.varies() ? 4 : 0;
  for (int i = 0; i <= last; ++i) {
    const double part = last == 0 ? 0.0 : static_cast<double>(i) / last;
    const double factor =
        machine.lowest_factor() + part * (machine.highest_factor() - machine.lowest_factor());
    const SampledDrive sampled = drive.sampled(factor);
    std::string how;
    if (delay.whole > kMaxPoleDelay) {
      if (!loop_is_unstable(sampled, delay, c.measurement.velocity, *feedback)) continue;
      how = fmt::format("with {} samples of delay it is not", delay.whole);
    } else {
      const auto pole = dominant_loop_pole(sampled, delay, c.measurement.velocity, *feedback);
      if (std::abs(pole) <= kStable) continue;
      how = fmt::format("a pole at {:.3g} Hz grows {:.4g}-fold per sample",
                        std::abs(std::arg(pole)) / kTwoPi * rate, std::abs(pole));
    }
    if (machine.varies())
      how += fmt::format(" where the stiffness is {:.3g} times its first value",
                         factor / machine.factor(0.0, c.motion.from));
    const bool has_gain = c.controller.gain != 0.0;
    return unexpected(ExperimentError{"controller", has_gain ? "gain" : "",
                                      has_gain ? fmt::format("{:g}", c.controller.gain) : std::string(),
                                      "must leave the closed loop stable: " + how});
  }
  return {};
}

}  // namespace

ExperimentError located(std::string_view table, const ConfigError& error) {
  return {std::string(table), std::string(error.field),
          std::isnan(error.value) ? std::string() : fmt::format("{:g}", error.value),
          std::string(error.requirement)};
}

std::string ExperimentError::text() const {
  return fmt::format("{}{}{}: {}{}{}{}", table, field.empty() ? "" : ".", field,
                     found.empty() ? "" : "found ", found, found.empty() ? "" : ", ", requirement);
}

MachineConfig machine_of(const ExperimentConfig& c) {
  return {c.drive, c.friction, c.disturbance, c.actuator.lag_s};
}

expected<void, ExperimentError> check(const ExperimentConfig& config) {
  if (const auto ok = check_ranges(config); !ok) return ok;
  const auto samples = length_of(config);
  if (!samples) return unexpected(samples.error());
  const double duration_s = static_cast<double>(*samples) / config.run.sample_rate_hz;
  const SampleDelay delay = split_delay(config.measurement.delay_s, config.run.sample_rate_hz);
  const auto drive = make_drive(machine_of(config), config.run.sample_rate_hz, delay.fraction, duration_s);
  if (!drive)
    return refused(drive.error().field == "load_coulomb" ? "friction" : "disturbance", drive.error());
  const Machine machine(machine_of(config), duration_s);
  if (const auto ok = check_resonances(config, machine.highest_factor()); !ok) return ok;
  if (const auto ok = check_stroke(config, duration_s); !ok) return ok;
  return check_loop(config, **drive, machine);
}

}  // namespace resonid::plant
