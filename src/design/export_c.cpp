// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <string_view>

#include "design/export.hpp"
#include "design/export_text.hpp"
#include "design/float_biquad.hpp"

namespace resonid::design {
namespace {

constexpr std::string_view kCHeader =
    R"(/* @name@: @law@ control of a @what@, designed by resonid. C99, no heap, no library.
 *
@loop@ *   u = F (kp (b r - y) + sum of ki Ts (r - y))@and_torque@,   r, y in rad/s, u in Nm
 *
 * F: product of biquads (@count@), transposed direct form II. @name@_step() must be called every @period@ s. */
#ifndef @guard@
#define @guard@

typedef struct {
  @real@ kp, ki_ts, set_point_weight;
@declared@  @real@ sum;       /* of ki Ts (r - y), Nm */
  @real@ deviation; /* b r - y of the last step */
} @name@;

static inline void @name@_init(@name@ *c) {
  static const @name@ fresh = {
    @kp@, @ki_ts@, @weight@, @initial@@zero@, @zero@};
  *c = fresh;
}
@gains@
/* Torque for a reference and a measured velocity. */
static inline @real@ @name@_step(@name@ *c, @arguments@) {
@position@@scheduled@@reference@  const @real@ error = reference - velocity, sum = c->sum + c->ki_ts * error;
  @real@ u;
  c->deviation = c->set_point_weight * reference - velocity;
  u = c->kp * c->deviation + sum;
@filters@@feed_forward@@limit@  c->sum = sum;
  return u;
}
@set_gains@@torque@
#endif
)";

constexpr std::string_view kCSetGains = R"(
/* Other gains, without a jump of the torque.@jump@ */
static inline void @name@_set_gains(@name@ *c, @real@ kp, @real@ ki) {
  c->sum -= (kp - c->kp) * c->deviation;
  c->kp = kp;
  c->ki_ts = ki * @step@;
}
)";

/// Whoever knows the reference's acceleration calls it.
constexpr std::string_view kCTorque = R"(
/* Torque feed-forward by velocity and acceleration of the reference. The loop is to be given position and
 * velocity of the reference @delay@ s later: as late as it measures. */
static inline @real@ @name@_torque_feed_forward(@real@ velocity, @real@ acceleration) {
  const @real@ direction = (@real@)((velocity > @zero@) - (velocity < @zero@));
  return @inertia@ * acceleration + @viscous@ * velocity + @coulomb@ * direction;
}
)";

/// Tables of positions, gains, and their slopes up to the next position.
constexpr std::string_view kCGains = R"(
/* Gains at a position: linear between nodes, constant beyond them.@speed@ */
static inline void @name@_gains(@real@ position, @real@ *kp, @real@ *ki_ts) {
  static const @real@ at[@nodes@] = {@at@};
  static const @real@ kp_at[@nodes@] = {@kp_at@};
  static const @real@ ki_ts_at[@nodes@] = {@ki_ts_at@};
  static const @real@ kp_slope[@nodes@] = {@kp_slope@};
  static const @real@ ki_ts_slope[@nodes@] = {@ki_ts_slope@};
  @real@ way;
  int i = 0;
  while (i < @last@ && position >= at[i + 1]) ++i;
  way = position > at[i] ? position - at[i] : @zero@;
  *kp = kp_at[i] + way * kp_slope[i];
  *ki_ts = ki_ts_at[i] + way * ki_ts_slope[i];
}
)";

/// For another kp the sum takes what the torque would jump by, but not behind a torque that was cut.
constexpr std::string_view kCScheduled = R"(  @real@ kp, ki_ts;
  @name@_gains(position, &kp, &ki_ts);
  @unless_limited@c->sum -= (kp - c->kp) * c->deviation; /* no jump */
  c->kp = kp;
  c->ki_ts = ki_ts;
)";

constexpr std::string_view kCSummedPosition =
    R"(  const @real@ way = @step@ * velocity + c->position_rest, position = c->position + way;
  c->position_rest = way - (position - c->position); /* what rounding cuts off */
  c->position = position;
)";

constexpr std::string_view kCFilters = R"(  for (int i = 0; i < @count@; ++i) {
    const @real@ x = u;
    u = c->b[i][0] * x + c->s[i][0];
    c->s[i][0] = c->b[i][1] * x - c->a[i][0] * u + c->s[i][1];
    c->s[i][1] = c->b[i][2] * x - c->a[i][1] * u;
  }
)";

constexpr std::string_view kCLimit =
    R"(@marked@  if (u > c->torque_limit) { /* the sum is not driven further out */
    if (error < @zero@) c->sum = sum;
    return c->torque_limit;
  }
  if (u < -c->torque_limit) {
    if (error > @zero@) c->sum = sum;
    return -c->torque_limit;
  }
)";
constexpr std::string_view kCMarked = R"(  c->limited = u > c->torque_limit || u < -c->torque_limit;
)";

/// CMembers of the struct and what they begin with, in the order in which they are declared.
struct CMembers {
  std::string declared, initial;
};

void add_c_filters(CMembers& members, const ExportedController& design, std::string_view real,
                   const CNumberText& number) {
  std::string b, a, s;
  for (const Biquad& biquad : design.controller.biquads) {
    const auto c = biquad.coefficients(design.sample_time_s);
    const char* comma = b.empty() ? "" : ", ";
    b += fmt::format("{}{{{}, {}, {}}}", comma, number(c.b[0]), number(c.b[1]), number(c.b[2]));
    a += fmt::format("{}{{{}, {}}}", comma, number(c.a[1]), number(c.a[2]));
    s += fmt::format("{}{{{}, {}}}", comma, number(0.0), number(0.0));
  }
  if (b.empty()) return;
  members.declared +=
      fmt::format("  {0} b[{1}][3], a[{1}][2]; /* in powers of z^-1, without a0 = 1 */\n  {0} s[{1}][2];\n",
                  real, design.controller.biquads.size());
  members.initial += fmt::format("{{{}}},\n    {{{}}},\n    {{{}}},\n    ", b, a, s);
}

CMembers c_members_of(const ExportedController& design, std::string_view real, const CNumberText& number) {
  CMembers members;
  if (design.torque_limit) {
    members.declared += fmt::format("  {} torque_limit; /* Nm */\n", real);
    members.initial += number(*design.torque_limit) + ", ";
    if (!design.schedule.empty()) {
      members.declared += "  int limited; /* the last torque was cut */\n";
      members.initial += "0, ";
    }
  }
  if (design.kv > 0.0) {
    members.declared += fmt::format("  {} kv; /* 1/s */\n", real);
    members.initial += number(design.kv) + ", ";
  }
  if (design.sums_velocity) {
    members.declared += fmt::format("  {} position, position_rest; /* their sum is that of Ts y */\n", real);
    members.initial += number(0.0) + ", " + number(0.0) + ", ";
  }
  add_c_filters(members, design, real, number);
  return members;
}

std::string c_arguments_of(const ExportedController& design, std::string_view real) {
  std::string text =
      design.kv > 0.0
          ? fmt::format("{0} position_reference, {0} velocity_feed_forward, {0} torque_feed_forward,\n    ",
                        real)
          : fmt::format("{} reference, ", real);
  text += fmt::format("{} velocity", real);
  if (design.needs_position() && !design.sums_velocity) text += fmt::format(", {} position", real);
  return text;
}

std::string c_reference_of(const ExportedController& design, std::string_view real) {
  if (design.kv == 0.0) return {};
  return fmt::format("  const {} reference = c->kv * {} + velocity_feed_forward;\n", real,
                     design.sums_velocity ? "((position_reference - position) - c->position_rest)"
                                          : "(position_reference - position)");
}

std::string c_gains_of(const ExportedController& design, const TextValues& common,
                       const CNumberText& number) {
  const auto& nodes = design.schedule;
  if (nodes.empty()) return {};
  std::string at, kp, ki, kp_slope, ki_slope;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const ScheduleSlope slope = slope_behind(nodes, i);
    const char* comma = i == 0 ? "" : ", ";
    at += comma + number(nodes[i].position);
    kp += comma + number(nodes[i].kp);
    ki += comma + number(nodes[i].ki * design.sample_time_s);
    kp_slope += comma + number(slope.kp);
    ki_slope += comma + number(slope.ki * design.sample_time_s);
  }
  TextValues values = common;
  values.insert(values.end(), {{"nodes", std::to_string(nodes.size())},
                               {"speed", speed_comment(design)},
                               {"last", std::to_string(nodes.size() - 1)},
                               {"at", at},
                               {"kp_at", kp},
                               {"ki_ts_at", ki},
                               {"kp_slope", kp_slope},
                               {"ki_ts_slope", ki_slope}});
  return filled_in(kCGains, values);
}

/// What this target cannot express.
expected<void> check_c(const ExportedController& design, bool in_float) {
  if (const auto valid = check_exported(design); !valid) return valid;
  for (const Biquad& biquad : design.controller.biquads)
    if (in_float && float_biquad(biquad, design.sample_time_s).largest_error > kLargestFloatError)
      return refuse("biquads",
                    "must be computed in double: so far below the sample rate floats lose their shape",
                    biquad.frequency_hz * design.sample_time_s);
  return {};
}

}  // namespace

expected<std::string> to_c(const ExportedController& design, CNumber type) {
  const bool in_float = type == CNumber::in_float;
  if (const auto valid = check_c(design, in_float); !valid) return tl::unexpected(valid.error());
  const CNumberText number = c_number_text(type);
  const std::string real = in_float ? "float" : "double",
                    count = std::to_string(design.controller.biquads.size());
  const bool scheduled = !design.schedule.empty(), cascaded = design.kv > 0.0;
  const FilteredPi first =
      scheduled ? GainSchedule(design.schedule).at(design.schedule.front().position) : design.controller;
  const CMembers members = c_members_of(design, real, number);
  TextValues values = {
      {"name", design.name},
      {"guard", c_guard_of(design.name)},
      {"real", real},
      {"count", count},
      {"step", number(design.sample_time_s)},
      {"period", fmt::format("{}", design.sample_time_s)},
      {"kp", number(first.kp)},
      {"ki_ts", number(first.ki * design.sample_time_s)},
      {"weight", number(design.set_point_weight)},
      {"zero", number(0.0)},
      {"law", law_word(design)},
      {"jump", first.ki > 0.0
                   ? ""
                   : fmt::format("\n * Without ki the sum keeps what it takes for that, until {}_init().",
                                 design.name)},
      {"what", cascaded ? "position" : "velocity"},
      {"loop", cascaded ? " *   r = kv (reference - position) + velocity feed-forward\n" : ""},
      {"and_torque", cascaded ? " + torque feed-forward" : ""},
      {"feed_forward", cascaded ? "  u += torque_feed_forward;\n" : ""},
      {"unless_limited", design.torque_limit ? "if (!c->limited) " : ""},
      {"marked", scheduled ? std::string(kCMarked) : ""},
      {"declared", members.declared},
      {"initial", members.initial},
      {"arguments", c_arguments_of(design, real)},
      {"reference", c_reference_of(design, real)}};
  const auto part = [&values](std::string_view key, bool wanted, std::string_view text) {
    values.emplace_back(key, wanted ? filled_in(text, values) : std::string());
  };
  part("position", design.sums_velocity, kCSummedPosition);
  part("scheduled", scheduled, kCScheduled);
  part("filters", !design.controller.biquads.empty(), kCFilters);
  part("limit", design.torque_limit.has_value(), kCLimit);
  part("set_gains", !scheduled, kCSetGains);
  if (cascaded && design.feed_forward) {
    const auto& f = *design.feed_forward;
    values.insert(values.end(), {{"delay", fmt::format("{}", f.delay_s)},
                                 {"inertia", number(f.inertia)},
                                 {"viscous", number(f.viscous)},
                                 {"coulomb", number(f.coulomb)}});
  }
  part("torque", cascaded && design.feed_forward.has_value(), kCTorque);
  values.emplace_back("gains", c_gains_of(design, values, number));
  return filled_in(kCHeader, values);
}

}  // namespace resonid::design
