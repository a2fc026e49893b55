// SPDX-License-Identifier: MIT
#include <array>
#include <cmath>
#include <resonid/online/axis.hpp>

namespace resonid::online {

namespace detail {

std::optional<Error> fault_of(const AxisConfig& c, bool takes_velocity) noexcept {
  const auto bad = [](const char* field, const char* requirement, double value) {
    return Error{field, requirement, value};
  };
  if (!(c.sample_rate_hz > 0.0) || !std::isfinite(c.sample_rate_hz))
    return bad("sample_rate_hz", "must be > 0", c.sample_rate_hz);
  if (!(c.known_delay_s >= 0.0) || !std::isfinite(c.known_delay_s))
    return bad("known_delay_s", "must be >= 0", c.known_delay_s);
  if (!(c.memory_s >= 0.0) || !std::isfinite(c.memory_s)) return bad("memory_s", "must be >= 0", c.memory_s);
  if (c.memory_s > 0.0 && c.memory_s * c.sample_rate_hz < 4.0)
    return bad("memory_s", "must be 4 samples at least", c.memory_s);
  if (takes_velocity && c.output == AxisOutput::acceleration)
    return bad("output", "must be a velocity or a position for this method", static_cast<double>(c.output));
  if (c.row_every_samples == 0) return bad("row_every_samples", "must be 1 or more", 0.0);
  if (c.spread_samples == 0 || c.spread_samples > c.row_every_samples)
    return bad("spread_samples", "must lie between 1 and row_every_samples",
               static_cast<double>(c.spread_samples));
  if (!(c.loop_from_hz >= 0.0 && c.loop_from_hz < 0.5 * c.sample_rate_hz))
    return bad("loop_from_hz", "must be >= 0 and below half the sample rate", c.loop_from_hz);
  if (!(c.averaged_memories >= 0.0) || !std::isfinite(c.averaged_memories))
    return bad("averaged_memories", "must be >= 0", c.averaged_memories);
  if (!(c.centre_hz >= 0.0 && c.centre_hz < 0.5 * c.sample_rate_hz))
    return bad("centre_hz", "must be >= 0 and below half the sample rate", c.centre_hz);
  if (c.start_a.size() != c.start_b.size())
    return bad("start_a", "must be as many as start_b", static_cast<double>(c.start_a.size()));
  const bool at_lines = c.loop == AxisLoop::measured || c.loop == AxisLoop::controller_at_lines;
  if (at_lines && c.method != AxisMethod::lines && c.method != AxisMethod::sliding_dft)
    return bad("loop", "can be that at the lines for methods with fixed lines only",
               static_cast<double>(c.loop));
  const auto controller =
      AxisController::create(c.controller_numerator, c.controller_denominator, c.controller_of_position);
  if (!controller) return controller.error();
  return std::nullopt;
}

Error of_axis(Error error) noexcept {
  constexpr struct {
    std::string_view theirs, ours;
  } kNames[] = {{"frequency_hz", "lines_hz"},
                {"window_samples", "window_samples"},
                {"from_hz", "sweep"},
                {"to_hz", "sweep"},
                {"duration_s", "sweep"},
                {"memory_samples", "memory_s"},
                {"delay_samples", "known_delay_s"},
                {"delay_s", "known_delay_s"},
                {"start", "start_b"},
                {"adaptation.start", "adaptation"},
                {"adaptation.fixed", "adaptation"},
                {"adaptation.scale", "adaptation"},
                {"factor", "memory_s"}};
  for (const auto& name : kNames)
    if (error.field == name.theirs) error.field = name.ours;
  return error;
}

double axis_centre_hz(const AxisConfig& c) noexcept {
  if (c.centre_hz > 0.0) return c.centre_hz;
  if (c.method == AxisMethod::physical) {
    const double compliance = 1.0 / c.physical.driven_inertia.value + 1.0 / c.physical.load_inertia.value;
    return std::sqrt(c.physical.stiffness.value * compliance) / kTwoPi;
  }
  if (c.start_b.size() == 3) {
    DiscreteModel<double, 3> start;
    std::copy(c.start_b.begin(), c.start_b.end(), start.b.begin());
    std::copy(c.start_a.begin(), c.start_a.end(), start.a.begin());
    const auto modes = SampledModes<3>(start, c.sample_rate_hz).resonances();
    if (!modes.empty()) return modes[0].frequency_hz;
  }
  if (!c.lines_hz.empty()) return std::sqrt(c.lines_hz.front() * c.lines_hz.back());
  if (c.sweep.duration_s > 0.0) return std::sqrt(c.sweep.from_hz * c.sweep.to_hz);
  constexpr double kOfTheRate = 0.1;
  return kOfTheRate * c.sample_rate_hz;
}

std::array<double, 2> axis_band_hz(const AxisConfig& c) noexcept {
  constexpr double kBelow = 0.1, kAbove = 1.5, kMost = 0.45;  // about the centre; of the rate
  if (c.lines_hz.size() > 1) return {c.lines_hz.front(), c.lines_hz.back()};
  if (c.sweep.duration_s > 0.0)
    return {std::min(c.sweep.from_hz, c.sweep.to_hz), std::max(c.sweep.from_hz, c.sweep.to_hz)};
  const double centre = axis_centre_hz(c);
  return {kBelow * centre, std::min(kAbove * centre, kMost * c.sample_rate_hz)};
}

}  // namespace detail

}  // namespace resonid::online
