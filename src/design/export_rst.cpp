// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numeric>
#include <resonid/base/constants.hpp>
#include <resonid/data/transfer_function.hpp>
#include <string_view>

#include "design/export.hpp"
#include "design/export_text.hpp"
#include "design/float_biquad.hpp"

namespace resonid::design {
namespace {

constexpr std::string_view kRstHeader =
    R"(/* @name@: velocity controller (@what@), designed by resonid. C99, no heap, no library.
 *
 *   u = (T r - R y)/S in powers of z^-1@same@,   r, y in rad/s, u in Nm
 *
 * Transposed direct form II@remembers@. @name@_step() must be called every @period@ s. */
#ifndef @guard@
#define @guard@

typedef struct {
@limit_member@  @real@ state[@states@]; /* the last one stays 0 */
} @name@;

static inline void @name@_init(@name@ *c) {
  static const @name@ fresh = {@limit@{@zeros@}};
  *c = fresh;
}

/* Torque for a reference and a measured velocity. */
static inline @real@ @name@_step(@name@ *c, @real@ reference, @real@ velocity) {
@t@  static const @real@ r[@states@] = {@r@};
  static const @real@ s[@states@] = {@s@};
@a@  @real@ u = @first@ + c->state[0];
@excess@  int i;
@cut@  for (i = 1; i < @states@; ++i) c->state[i - 1] = c->state[i] + @further@ - s[i] * u@back@;
  return u;
}

#endif
)";

constexpr std::string_view kRstCut = R"(  if (u > c->torque_limit) {
    excess = u - c->torque_limit;
    u = c->torque_limit;
  }
  if (u < -c->torque_limit) {
    excess = u + c->torque_limit;
    u = -c->torque_limit;
  }
)";

constexpr std::string_view kRstBlock =
    R"((* @name@: velocity controller (@what@), designed by resonid. IEC 61131-3.
   u = (T r - R y)/S in powers of z^-1@same@
   Transposed direct form II@remembers@.
   To be called in every cycle of a task of @period@ s; in another one it gives no torque. *)
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
@variables@END_VAR
VAR CONSTANT
@constants@  sample_time : LREAL := @step@;
END_VAR

wrong_cycle_time := ABS(cycle_time - sample_time) > 0.01 * sample_time;
IF wrong_cycle_time OR NOT enable THEN
  torque := 0.0;
@reset@  RETURN;
END_IF;
torque := @first@ + state_1;
@cut@@states@END_FUNCTION_BLOCK
)";

constexpr std::string_view kRstBlockCut = R"(excess := 0.0;
IF torque > torque_limit THEN
  excess := torque - torque_limit;
  torque := torque_limit;
ELSIF torque < -torque_limit THEN
  excess := torque + torque_limit;
  torque := -torque_limit;
END_IF;
)";

/// Alike in length, S beginning with 1.
struct RstRows {
  std::vector<double> r, s, t;  ///< t empty: R
};
RstRows rows_of(const ExportedRst& design) {
  RstRows rows{design.r, design.s, design.t};
  const std::size_t length = std::max({rows.r.size(), rows.s.size(), rows.t.size(), std::size_t{2}});
  for (auto* row : {&rows.r, &rows.s, &rows.t}) {
    if (row->empty()) continue;
    row->resize(length, 0.0);
    for (double& c : *row) c /= design.s.front();
  }
  return rows;
}

expected<void> check_rst(const ExportedRst& design) {
  if (const auto valid = check_text(design.name, design.sample_time_s, design.torque_limit); !valid)
    return valid;
  if (design.r.empty() || design.s.empty())
    return refuse("structure", "must be given as a transfer function from velocity error to torque");
  for (const auto* row : {&design.r, &design.s, &design.t})
    for (const double c : *row)
      if (!std::isfinite(c)) return refuse("structure", "must have finite coefficients", c);
  if (design.s.front() == 0.0)
    return refuse("structure", "must have a denominator that begins with another number than 0", 0.0);
  return {};
}

std::complex<double> value_at(const std::vector<double>& row, std::complex<double> inverse_z) {
  std::complex<double> sum = 0.0;
  for (auto c = row.rbegin(); c != row.rend(); ++c) sum = *c + inverse_z * sum;
  return sum;
}

/// How fast the states forget a torque that was cut: in the integral time, which R/S tells near standstill,
/// ki/(1 - z^-1) + kp.
double forgetting_pole(const RstRows& rows) {
  double r = 0.0, r_slope = 0.0, s_slope = 0.0, s_bend = 0.0;  // at 1, by z^-1
  for (std::size_t i = 0; i < rows.r.size(); ++i) {
    const auto power = static_cast<double>(i);
    r += rows.r[i];
    r_slope += power * rows.r[i];
    s_slope += power * rows.s[i];
    s_bend += power * (power - 1.0) * rows.s[i];
  }
  constexpr double kMost = 1e4;
  const double samples = 0.5 * s_bend / s_slope - r_slope / r;
  return std::exp(-1.0 / (samples > 1.0 ? std::min(samples, kMost) : 1.0));
}

/// A of A v = T r - R y + (A - S) u, v being the torque before its limit (tune.md 16.3): S, but its roots
/// that do not decay, and integrators, decay.
std::vector<double> observer_of(const RstRows& rows, double sample_time_s) {
  constexpr double kSlow = 0.98;
  const double forgetting = forgetting_pole(rows);
  std::vector<std::complex<double>> product = {1.0};
  for (std::complex<double> root : data::TransferFunction{{1.0}, rows.s, sample_time_s}.poles()) {
    if (std::abs(root - 1.0) < 1.0 - kSlow)
      root = forgetting;
    else if (std::abs(root) > kSlow)
      root *= kSlow / std::abs(root);
    product.push_back(0.0);
    for (std::size_t i = product.size() - 1; i > 0; --i) product[i] -= root * product[i - 1];
  }
  std::vector<double> observer(rows.s.size(), 0.0);
  for (std::size_t i = 0; i < observer.size() && i < product.size(); ++i) observer[i] = product[i].real();
  return observer;
}

double to_float(double value) { return static_cast<double>(static_cast<float>(value)); }

/// Rounded so that what integrates does so still: the smallest coefficient of S takes what the others leave
/// of S(1) = 0.
RstRows in_float(RstRows rows) {
  constexpr double kRounding = 1e-7;
  double sum = 0.0, size = 0.0;
  for (const double c : rows.s) {
    sum += c;
    size += std::abs(c);
  }
  for (auto* row : {&rows.r, &rows.s, &rows.t})
    for (double& c : *row) c = to_float(c);
  if (std::abs(sum) > kRounding * size) return rows;
  const auto smallest = std::min_element(rows.s.begin() + 1, rows.s.end(), [](double a, double b) {
    return (a != 0.0 && std::abs(a) < std::abs(b)) || (a != 0.0 && b == 0.0);
  });
  *smallest = 0.0;
  *smallest = to_float(-std::accumulate(rows.s.begin(), rows.s.end(), 0.0));
  return rows;
}

/// What rounding to floats does to the responses of velocity and reference: the largest relative error, from
/// 1e-5 of the sample rate upwards.
double float_error(const RstRows& exact, const RstRows& rounded) {
  constexpr int kLines = 2000;
  constexpr double kFrom = 1e-5, kTo = 0.5;
  double largest = 0.0;
  for (int i = 0; i < kLines; ++i) {
    const auto inverse_z = std::polar(1.0, -kTwoPi * kFrom * std::pow(kTo / kFrom, i / (kLines - 1.0)));
    for (const auto row : {&RstRows::r, &RstRows::t}) {
      if ((exact.*row).empty()) continue;
      const auto law = [&](const RstRows& rows) {
        return value_at(rows.*row, inverse_z) / value_at(rows.s, inverse_z);
      };
      largest = std::max(largest, std::abs(law(rounded) / law(exact) - 1.0));
    }
  }
  return largest;
}

const char* same_of(const RstRows& rows) { return rows.t.empty() ? ", T being R" : ""; }

const char* remembers_of(const ExportedRst& design) {
  return design.torque_limit ? "; what the limit cuts off is forgotten by A, so that nothing winds up" : "";
}

}  // namespace

expected<std::string> to_c(const ExportedRst& design, CNumber type) {
  if (const auto valid = check_rst(design); !valid) return tl::unexpected(valid.error());
  const RstRows exact = rows_of(design);
  const bool is_float = type == CNumber::in_float;
  const RstRows rows = is_float ? in_float(exact) : exact;
  if (const double error = is_float ? float_error(exact, rows) : 0.0; !(error <= kLargestFloatError))
    return refuse("structure",
                  "must be computed in double: rounded to floats its response errs by more than 1 %", error);
  const CNumberText number = c_number_text(type);
  const auto list = [&](const std::vector<double>& row) {
    std::string text;
    for (const double c : row) text += (text.empty() ? "" : ", ") + number(c);
    return text;
  };
  const std::string real = is_float ? "float" : "double", states = std::to_string(rows.r.size());
  const bool same = rows.t.empty();
  return filled_in(
      kRstHeader,
      {{"name", design.name},
       {"what", design.what},
       {"same", same_of(rows)},
       {"remembers", remembers_of(design)},
       {"guard", c_guard_of(design.name)},
       {"period", fmt::format("{}", design.sample_time_s)},
       {"real", real},
       {"states", states},
       {"limit_member", design.torque_limit ? "  " + real + " torque_limit; /* Nm */\n" : ""},
       {"limit", design.torque_limit ? number(*design.torque_limit) + ", " : ""},
       {"zeros", list(std::vector<double>(rows.r.size(), 0.0))},
       {"t", same ? "" : fmt::format("  static const {} t[{}] = {{{}}};\n", real, states, list(rows.t))},
       {"r", list(rows.r)},
       {"s", list(rows.s)},
       {"first", same ? "r[0] * (reference - velocity)" : "t[0] * reference - r[0] * velocity"},
       {"further", same ? "r[i] * (reference - velocity)" : "t[i] * reference - r[i] * velocity"},
       {"a", design.torque_limit ? fmt::format("  static const {} a[{}] = {{{}}};\n", real, states,
                                               list(observer_of(rows, design.sample_time_s)))
                                 : ""},
       {"excess", design.torque_limit ? "  " + real + " excess = " + number(0.0) + ";\n" : ""},
       {"back", design.torque_limit ? " - a[i] * excess" : ""},
       {"cut", std::string(design.torque_limit ? kRstCut : "")}});
}

expected<std::string> to_structured_text(const ExportedRst& design) {
  if (const auto valid = check_rst(design); !valid) return tl::unexpected(valid.error());
  const RstRows rows = rows_of(design);
  const bool same = rows.t.empty();
  std::string variables, constants, reset, states;
  std::vector<double> observer;
  if (design.torque_limit) {
    observer = observer_of(rows, design.sample_time_s);
    variables += "  excess : LREAL := 0.0; (* what the limit cuts off *)\n";
  }
  const auto constant = [&](const std::string& name, double value) {
    constants += fmt::format("  {} : LREAL := {};\n", name, digits_17(value));
  };
  const auto from_inputs = [same](std::size_t i) {
    return same ? fmt::format("r_{} * (reference - velocity)", i)
                : fmt::format("t_{0} * reference - r_{0} * velocity", i);
  };
  for (std::size_t i = 0; i < rows.r.size(); ++i) {
    if (!same) constant(fmt::format("t_{}", i), rows.t[i]);
    constant(fmt::format("r_{}", i), rows.r[i]);
    if (i == 0) continue;
    constant(fmt::format("s_{}", i), rows.s[i]);
    variables += fmt::format("  state_{} : LREAL := 0.0;\n", i);
    reset += fmt::format("  state_{} := 0.0;\n", i);
    const std::string next = i + 1 < rows.r.size() ? fmt::format("state_{} + ", i + 1) : "";
    if (design.torque_limit) constant(fmt::format("a_{}", i), observer[i]);
    states += fmt::format("state_{0} := {1}{2} - s_{0} * torque{3};\n", i, next, from_inputs(i),
                          design.torque_limit ? fmt::format(" - a_{} * excess", i) : "");
  }
  if (design.torque_limit) constant("torque_limit", *design.torque_limit);
  return filled_in(kRstBlock, {{"name", design.name},
                               {"what", design.what},
                               {"same", same_of(rows)},
                               {"remembers", remembers_of(design)},
                               {"step", digits_17(design.sample_time_s)},
                               {"period", fmt::format("{}", design.sample_time_s)},
                               {"variables", variables},
                               {"constants", constants},
                               {"reset", reset},
                               {"first", from_inputs(0)},
                               {"cut", std::string(design.torque_limit ? kRstBlockCut : "")},
                               {"states", states}});
}

}  // namespace resonid::design
