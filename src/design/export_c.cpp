// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <functional>
#include <string_view>

#include "design/export.hpp"
#include "design/export_text.hpp"
#include "design/float_biquad.hpp"

namespace resonid::design {
namespace {

constexpr std::string_view kHeader =
    R"(/* @name@: PI control of a velocity, designed by resonid. C99, no heap, no library.
 *
 *   u = F (kp (b r - y) + sum of ki Ts (r - y)),   r, y in rad/s, u in Nm
 *
 * F: product of biquads (@count@), transposed direct form II. @name@_step() must be called every @period@ s. */
#ifndef @guard@
#define @guard@

typedef struct {
  @real@ kp, ki_ts, set_point_weight;
@declared@  @real@ sum; /* of ki Ts (r - y), Nm */
} @name@;

static inline void @name@_init(@name@ *c) {
  static const @name@ fresh = {
    @kp@, @ki_ts@, @weight@, @initial@@zero@};
  *c = fresh;
}

/* Torque for a reference and a measured velocity. */
static inline @real@ @name@_step(@name@ *c, @real@ reference, @real@ velocity) {
  const @real@ error = reference - velocity, sum = c->sum + c->ki_ts * error;
  @real@ u = c->kp * (c->set_point_weight * reference - velocity) + sum;
@filters@@limit@  c->sum = sum;
  return u;
}

/* Other gains, without a jump of the torque; the velocities are those of the last step. */
static inline void @name@_set_gains(@name@ *c, @real@ kp, @real@ ki, @real@ reference, @real@ velocity) {
  c->sum -= (kp - c->kp) * (c->set_point_weight * reference - velocity);
  c->kp = kp;
  c->ki_ts = ki * @step@;
}

#endif
)";

constexpr std::string_view kFilters = R"(  for (int i = 0; i < @count@; ++i) {
    const @real@ x = u;
    u = c->b[i][0] * x + c->s[i][0];
    c->s[i][0] = c->b[i][1] * x - c->a[i][0] * u + c->s[i][1];
    c->s[i][1] = c->b[i][2] * x - c->a[i][1] * u;
  }
)";

constexpr std::string_view kLimit = R"(  if (u > c->torque_limit) { /* the sum is not driven further out */
    if (error < @zero@) c->sum = sum;
    return c->torque_limit;
  }
  if (u < -c->torque_limit) {
    if (error > @zero@) c->sum = sum;
    return -c->torque_limit;
  }
)";

std::string guard_of(const std::string& name) {
  std::string guard = name + "_h";
  for (char& c : guard)
    if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 'a' + 'A');
  return guard;
}

/// Coefficients and states of the biquads, in the order in which they are declared.
std::string initial_filters(const ExportedController& design,
                            const std::function<std::string(double)>& number) {
  std::string b, a, s;
  for (const Biquad& biquad : design.controller.biquads) {
    const auto c = biquad.coefficients(design.sample_time_s);
    const char* comma = b.empty() ? "" : ", ";
    b += fmt::format("{}{{{}, {}, {}}}", comma, number(c.b[0]), number(c.b[1]), number(c.b[2]));
    a += fmt::format("{}{{{}, {}}}", comma, number(c.a[1]), number(c.a[2]));
    s += fmt::format("{}{{{}, {}}}", comma, number(0.0), number(0.0));
  }
  return b.empty() ? std::string() : fmt::format("{{{}}},\n    {{{}}},\n    {{{}}},\n    ", b, a, s);
}

}  // namespace

expected<std::string> to_c(const ExportedController& design, CNumber type) {
  if (const auto valid = check_exported(design); !valid) return tl::unexpected(valid.error());
  const bool in_float = type == CNumber::in_float;
  for (const Biquad& biquad : design.controller.biquads)
    if (in_float && float_biquad(biquad, design.sample_time_s).largest_error > kLargestFloatError)
      return refuse("biquads",
                    "must be computed in double: so far below the sample rate floats lose their shape",
                    biquad.frequency_hz * design.sample_time_s);
  const auto number = [in_float](double value) {
    if (!in_float) return digits_17(value);
    return digits_17(static_cast<double>(static_cast<float>(value))) + "f";
  };
  const FilteredPi& controller = design.controller;
  const std::string real = in_float ? "float" : "double", count = std::to_string(controller.biquads.size());
  const bool filtered = !controller.biquads.empty();
  std::string declared, initial;
  if (design.torque_limit) {
    declared += fmt::format("  {} torque_limit; /* Nm */\n", real);
    initial += number(*design.torque_limit) + ", ";
  }
  if (filtered) {
    declared +=
        fmt::format("  {0} b[{1}][3], a[{1}][2]; /* in powers of z^-1, without a0 = 1 */\n  {0} s[{1}][2];\n",
                    real, count);
    initial += initial_filters(design, number);
  }
  const TextValues common = {{"count", count}, {"real", real}, {"zero", number(0.0)}};
  return filled_in(kHeader, {{"name", design.name},
                             {"guard", guard_of(design.name)},
                             {"real", real},
                             {"count", count},
                             {"step", number(design.sample_time_s)},
                             {"period", fmt::format("{}", design.sample_time_s)},
                             {"kp", number(controller.kp)},
                             {"ki_ts", number(controller.ki * design.sample_time_s)},
                             {"weight", number(design.set_point_weight)},
                             {"zero", number(0.0)},
                             {"declared", declared},
                             {"initial", initial},
                             {"filters", filtered ? filled_in(kFilters, common) : std::string()},
                             {"limit", design.torque_limit ? filled_in(kLimit, common) : std::string()}});
}

}  // namespace resonid::design
