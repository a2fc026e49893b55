// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <string_view>

#include "design/export.hpp"
#include "design/export_text.hpp"

namespace resonid::design {
namespace {

constexpr std::string_view kBlock = R"((* @name@: PI control of a velocity, designed by resonid. IEC 61131-3.
   u = F (kp (b r - y) + sum of ki Ts (r - y)); F: product of biquads (@count@), transposed direct form II.
   To be called in every cycle of a task of @step@ s; in another one it gives no torque. *)
FUNCTION_BLOCK @name@
VAR_INPUT
  enable : BOOL;
  reference : LREAL; (* rad/s *)
  velocity : LREAL; (* rad/s, measured *)
  cycle_time : LREAL; (* s, of the task that calls this block *)
END_VAR
VAR_OUTPUT
  torque : LREAL; (* Nm *)
  wrong_cycle_time : BOOL;
END_VAR
VAR
  deviation : LREAL;
  integral_part : LREAL := 0.0; (* sum of ki Ts (r - y), Nm *)
  next_part : LREAL;
  filter_in : LREAL;
  filter_out : LREAL;
@states@END_VAR
VAR CONSTANT
  gain_p : LREAL := @kp@;
  gain_i_step : LREAL := @ki_ts@;
  set_point_weight : LREAL := @weight@;
  sample_time : LREAL := @step@;
@constants@END_VAR

wrong_cycle_time := ABS(cycle_time - sample_time) > 0.01 * sample_time;
IF wrong_cycle_time OR NOT enable THEN
  torque := 0.0;
  integral_part := 0.0;
@reset@  RETURN;
END_IF;
deviation := reference - velocity;
next_part := integral_part + gain_i_step * deviation;
filter_out := gain_p * (set_point_weight * reference - velocity) + next_part;
@filters@@limit@END_FUNCTION_BLOCK
)";

constexpr std::string_view kBiquad = R"(filter_in := filter_out;
filter_out := b@i@_0 * filter_in + s@i@_1;
s@i@_1 := b@i@_1 * filter_in - a@i@_1 * filter_out + s@i@_2;
s@i@_2 := b@i@_2 * filter_in - a@i@_2 * filter_out;
)";

constexpr std::string_view kUnlimited = R"(integral_part := next_part;
torque := filter_out;
)";

constexpr std::string_view kLimited = R"((* At the limit the sum is not driven further out. *)
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

}  // namespace

expected<std::string> to_structured_text(const ExportedController& design) {
  if (const auto valid = check_exported(design); !valid) return tl::unexpected(valid.error());
  const FilteredPi& controller = design.controller;
  std::string states, constants, reset, filters;
  for (std::size_t i = 1; i <= controller.biquads.size(); ++i) {
    const auto c = controller.biquads[i - 1].coefficients(design.sample_time_s);
    filters += filled_in(kBiquad, {{"i", std::to_string(i)}});
    for (int k = 0; k < 3; ++k)
      constants +=
          fmt::format("  b{}_{} : LREAL := {};\n", i, k, digits_17(c.b[static_cast<std::size_t>(k)]));
    for (int k = 1; k < 3; ++k) {
      constants +=
          fmt::format("  a{}_{} : LREAL := {};\n", i, k, digits_17(c.a[static_cast<std::size_t>(k)]));
      states += fmt::format("  s{}_{} : LREAL := 0.0;\n", i, k);
      reset += fmt::format("  s{}_{} := 0.0;\n", i, k);
    }
  }
  if (design.torque_limit)
    constants += fmt::format("  torque_limit : LREAL := {};\n", digits_17(*design.torque_limit));
  return filled_in(kBlock, {{"name", design.name},
                            {"count", std::to_string(controller.biquads.size())},
                            {"step", digits_17(design.sample_time_s)},
                            {"kp", digits_17(controller.kp)},
                            {"ki_ts", digits_17(controller.ki * design.sample_time_s)},
                            {"weight", digits_17(design.set_point_weight)},
                            {"states", states},
                            {"constants", constants},
                            {"reset", reset},
                            {"filters", filters},
                            {"limit", std::string(design.torque_limit ? kLimited : kUnlimited)}});
}

}  // namespace resonid::design
