// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <string_view>

#include "design/export.hpp"
#include "design/export_text.hpp"

namespace resonid::design {
namespace {

constexpr std::string_view kStBlock =
    R"((* @name@: @law@ control of a @what@, designed by resonid. IEC 61131-3.
@loop@   u = F (kp (b r - y) + sum of ki Ts (r - y))@and_torque@
   F: product of biquads (@count@), transposed direct form II.
   To be called in every cycle of a task of @period@ s; in another one it gives no torque. *)
FUNCTION_BLOCK @name@
VAR_INPUT
  enable : BOOL;
@inputs@  velocity : LREAL; (* rad/s, measured *)
  cycle_time : LREAL; (* s, of the task that calls this block *)
END_VAR
VAR_OUTPUT
  torque : LREAL; (* Nm *)
  wrong_cycle_time : BOOL;
END_VAR
VAR
  deviation : LREAL;
  weighted_deviation : LREAL := 0.0; (* b r - y, of the last call *)
  integral_part : LREAL := 0.0; (* sum of ki Ts (r - y), Nm *)
  next_part : LREAL;
  filter_in : LREAL;
  filter_out : LREAL;
@variables@END_VAR
VAR CONSTANT
@constants@  set_point_weight : LREAL := @weight@;
  sample_time : LREAL := @step@;
END_VAR

wrong_cycle_time := ABS(cycle_time - sample_time) > 0.01 * sample_time;
@position@IF wrong_cycle_time OR NOT enable THEN
  torque := 0.0;
  integral_part := 0.0;
  weighted_deviation := 0.0;
@reset@  RETURN;
END_IF;
@scheduled@@reference@deviation := reference - velocity;
weighted_deviation := set_point_weight * reference - velocity;
next_part := integral_part + gain_i_step * deviation;
filter_out := gain_p * weighted_deviation + next_part;
@filters@@feed_forward@@limit@END_FUNCTION_BLOCK
@torque@)";

/// Whoever knows the reference's acceleration calls it.
constexpr std::string_view kStTorque = R"(
(* Torque feed-forward by velocity and acceleration of the reference. The block is to be given position and
   velocity of the reference @delay@ s later: as late as it measures. *)
FUNCTION @name@_torque_feed_forward : LREAL
VAR_INPUT
  reference_velocity : LREAL;
  reference_acceleration : LREAL;
END_VAR
VAR
  direction : LREAL;
END_VAR

direction := 0.0;
IF reference_velocity > 0.0 THEN
  direction := 1.0;
ELSIF reference_velocity < 0.0 THEN
  direction := -1.0;
END_IF;
@name@_torque_feed_forward := @inertia@ * reference_acceleration + @viscous@ * reference_velocity + @coulomb@ * direction;
END_FUNCTION
)";

constexpr std::string_view kStBiquad = R"(filter_in := filter_out;
filter_out := b@i@_0 * filter_in + s@i@_1;
s@i@_1 := b@i@_1 * filter_in - a@i@_1 * filter_out + s@i@_2;
s@i@_2 := b@i@_2 * filter_in - a@i@_2 * filter_out;
)";

constexpr std::string_view kStUnlimited = R"(integral_part := next_part;
torque := filter_out;
)";

constexpr std::string_view kStLimited = R"((* At the limit the sum is not driven further out. *)
limited := ABS(filter_out) > torque_limit;
IF filter_out > torque_limit THEN
  torque := torque_limit;
  IF deviation < 0.0 THEN
    integral_part := next_part;
  END_IF;
ELSIF filter_out < -torque_limit THEN
  torque := -torque_limit;
  IF deviation > 0.0 THEN
    integral_part := next_part;
  END_IF;
ELSE
  integral_part := next_part;
  torque := filter_out;
END_IF;
)";

constexpr std::string_view kStSegment = R"(@if@ place < position_@next@ THEN
  next_p := p_@i@ + (place - position_@i@) * p_slope_@i@;
  next_i := i_@i@ + (place - position_@i@) * i_slope_@i@;
)";

/// The place is kept within the ends; between them it is one of the segments.
constexpr std::string_view kStScheduled =
    R"((* Gains over position: linear between nodes, constant beyond them.@speed@ *)
place := position;
IF place < position_1 THEN
  place := position_1;
END_IF;
@segments@(* For another gain the sum takes what the torque would jump by, but not behind a torque that was cut. *)
@unless_limited@integral_part := integral_part - (next_p - gain_p) * weighted_deviation;
@end_unless@gain_p := next_p;
gain_i_step := next_i;
)";

/// StParts of the block that grow with the design.
struct StParts {
  std::string inputs, variables, constants, reset, filters, segments;

  void constant(std::string_view name, double value) {
    constants += fmt::format("  {} : LREAL := {};\n", name, digits_17(value));
  }
  void variable(std::string_view name, double value) {
    variables += fmt::format("  {} : LREAL := {};\n", name, digits_17(value));
  }
};

void add_st_filters(StParts& parts, const ExportedController& design) {
  for (std::size_t i = 1; i <= design.controller.biquads.size(); ++i) {
    const auto c = design.controller.biquads[i - 1].coefficients(design.sample_time_s);
    parts.filters += filled_in(kStBiquad, {{"i", std::to_string(i)}});
    for (std::size_t k = 0; k < 3; ++k) parts.constant(fmt::format("b{}_{}", i, k), c.b[k]);
    for (std::size_t k = 1; k < 3; ++k) {
      parts.constant(fmt::format("a{}_{}", i, k), c.a[k]);
      parts.variable(fmt::format("s{}_{}", i, k), 0.0);
      parts.reset += fmt::format("  s{}_{} := 0.0;\n", i, k);
    }
  }
}

void add_st_schedule(StParts& parts, const ExportedController& design) {
  const auto& nodes = design.schedule;
  parts.variables += "  place : LREAL;\n  next_p : LREAL;\n  next_i : LREAL;\n";
  for (std::size_t i = 1; i <= nodes.size(); ++i) {
    const ScheduleNode& node = nodes[i - 1];
    const ScheduleSlope slope = slope_behind(nodes, i - 1);
    parts.constant(fmt::format("position_{}", i), node.position);
    parts.constant(fmt::format("p_{}", i), node.kp);
    parts.constant(fmt::format("i_{}", i), node.ki * design.sample_time_s);
    if (i == nodes.size()) break;
    parts.constant(fmt::format("p_slope_{}", i), slope.kp);
    parts.constant(fmt::format("i_slope_{}", i), slope.ki * design.sample_time_s);
    parts.segments += filled_in(
        kStSegment,
        {{"if", i == 1 ? "IF" : "ELSIF"}, {"i", std::to_string(i)}, {"next", std::to_string(i + 1)}});
  }
  const std::string last =
      fmt::format("next_p := p_{0};\n{1}next_i := i_{0};\n", nodes.size(), nodes.size() > 1 ? "  " : "");
  parts.segments += nodes.size() > 1 ? "ELSE\n  " + last + "END_IF;\n" : last;
}

/// Gains: constants, or variables that the schedule sets.
void add_st_gains(StParts& parts, const ExportedController& design) {
  const double step = design.sample_time_s;
  if (design.schedule.empty()) {
    parts.constant("gain_p", design.controller.kp);
    parts.constant("gain_i_step", design.controller.ki * step);
    return;
  }
  parts.variable("gain_p", design.schedule.front().kp);
  parts.variable("gain_i_step", design.schedule.front().ki * step);
  add_st_schedule(parts, design);
}

void add_st_position(StParts& parts, const ExportedController& design) {
  if (design.kv > 0.0) {
    parts.inputs +=
        "  position_reference : LREAL; (* rad *)\n  velocity_feed_forward : LREAL; (* rad/s *)\n"
        "  torque_feed_forward : LREAL; (* Nm *)\n";
    parts.variables += "  reference : LREAL;\n";
    parts.constant("gain_v", design.kv);
  } else {
    parts.inputs += "  reference : LREAL; (* rad/s *)\n";
  }
  if (!design.needs_position()) return;
  if (design.sums_velocity)
    parts.variable("position", 0.0);
  else
    parts.inputs += "  position : LREAL; (* measured *)\n";
}

}  // namespace

expected<std::string> to_structured_text(const ExportedController& design) {
  if (const auto valid = check_exported(design); !valid) return tl::unexpected(valid.error());
  const bool scheduled = !design.schedule.empty(), cascaded = design.kv > 0.0;
  StParts parts;
  add_st_position(parts, design);
  add_st_gains(parts, design);
  add_st_filters(parts, design);
  if (design.torque_limit) {
    parts.constant("torque_limit", *design.torque_limit);
    parts.variables += "  limited : BOOL := FALSE;\n";
    parts.reset += "  limited := FALSE;\n";
  }
  const std::string schedule =
      scheduled
          ? filled_in(kStScheduled, {{"segments", parts.segments},
                                     {"speed", speed_comment(design)},
                                     {"unless_limited", design.torque_limit ? "IF NOT limited THEN\n  " : ""},
                                     {"end_unless", design.torque_limit ? "END_IF;\n" : ""}})
          : "";
  std::string torque;
  if (cascaded && design.feed_forward) {
    const auto& f = *design.feed_forward;
    torque = filled_in(kStTorque, {{"name", design.name},
                                   {"delay", fmt::format("{}", f.delay_s)},
                                   {"inertia", digits_17(f.inertia)},
                                   {"viscous", digits_17(f.viscous)},
                                   {"coulomb", digits_17(f.coulomb)}});
  }
  return filled_in(
      kStBlock,
      {{"name", design.name},
       {"law", law_word(design)},
       {"torque", torque},
       {"what", cascaded ? "position" : "velocity"},
       {"loop", cascaded ? "   r = kv (reference - position) + velocity feed-forward\n" : ""},
       {"and_torque", cascaded ? " + torque feed-forward" : ""},
       {"count", std::to_string(design.controller.biquads.size())},
       {"step", digits_17(design.sample_time_s)},
       {"period", fmt::format("{}", design.sample_time_s)},
       {"weight", digits_17(design.set_point_weight)},
       {"inputs", parts.inputs},
       {"variables", parts.variables},
       {"constants", parts.constants},
       {"reset", parts.reset},
       {"position", design.sums_velocity ? "position := position + sample_time * velocity;\n" : ""},
       {"scheduled", schedule},
       {"reference",
        cascaded ? "reference := gain_v * (position_reference - position) + velocity_feed_forward;\n" : ""},
       {"filters", parts.filters},
       {"feed_forward", cascaded ? "filter_out := filter_out + torque_feed_forward;\n" : ""},
       {"limit", std::string(design.torque_limit ? kStLimited : kStUnlimited)}});
}

}  // namespace resonid::design
