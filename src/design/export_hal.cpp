// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <cmath>
#include <string_view>

#include "design/export.hpp"
#include "design/export_text.hpp"

namespace resonid::design {
namespace {

constexpr std::string_view kHalHead =
    R"(# @name@: @law@ control of a @what@, designed by resonid, for LinuxCNC's pid@and_biquad@.
# The period of @thread@ must be @period@ ns; at another one these gains@and_filters@ are wrong.
# Connect @signals@, the torque (Nm), and the signal that enables:
#   net @name@-@reference@ <= ...        net @name@-torque => ...
#   net @name@-velocity <= ...           net @name@-enable <= ...
@connections@# Do not change Igain while it runs: it multiplies the sum, so that the torque would jump.
loadrt pid names=@outer@@name@-pid
)";

constexpr std::string_view kHalGains = R"(addf @name@-pid.do-pid-calcs @thread@
net @name@-torque <= @name@-pid.output
net @name@-enable => @name@-pid.enable
)";

/// Of one pid.
constexpr std::string_view kHalSettings = R"(setp @pid@.Pgain @kp@
setp @pid@.Igain @ki@
setp @pid@.Dgain 0
setp @pid@.FF0 @weight@
setp @pid@.FF1 @forward@
setp @pid@.FF2 0
@bias@setp @pid@.deadband 0
setp @pid@.maxerror 0
setp @pid@.maxerrorI 0
setp @pid@.maxoutput @limit@
setp @pid@.error-previous-target 0
)";

/// r = kv (reference - position) + velocity feed-forward, which stands for the derivative of the command.
constexpr std::string_view kHalOuter = R"(@sum@addf @name@-pos.do-pid-calcs @thread@
net @name@-position-reference => @name@-pos.command
net @name@-position => @name@-pos.feedback
net @name@-velocity-feed-forward => @name@-pos.command-deriv
net @name@-enable => @name@-pos.enable
)";
constexpr std::string_view kHalSum = R"(loadrt integ names=@name@-sum
addf @name@-sum @thread@
net @name@-velocity => @name@-sum.in
setp @name@-sum.gain 1
net @name@-position <= @name@-sum.out
)";
constexpr std::string_view kHalConnections =
    R"(#   net @name@-velocity-feed-forward <= ...    net @name@-torque-feed-forward <= ...
)";

/// Type 0 takes its coefficients as they are, once `enable` rises.
constexpr std::string_view kHalBiquad = R"(setp @filter@.type 0
setp @filter@.n0 @b0@
setp @filter@.n1 @b1@
setp @filter@.n2 @b2@
setp @filter@.d1 @a1@
setp @filter@.d2 @a2@
setp @filter@.enable 1
)";

/// The biquads of one path into a pin of the pid, from its signal on.
struct HalPath {
  std::string names;  ///< ",a,b"
  std::string text;
};
HalPath path_into(const ExportedController& design, std::string_view signal, std::string_view pin,
                  const std::string& thread) {
  HalPath path;
  std::string from = fmt::format("{}-{}", design.name, signal), settings;
  for (std::size_t i = 0; i < design.controller.biquads.size(); ++i) {
    const std::string filter = fmt::format("{}-{}{}", design.name, signal.front(), i + 1);
    const auto c = design.controller.biquads[i].coefficients(design.sample_time_s);
    path.names += (path.names.empty() ? "" : ",") + filter;
    path.text += fmt::format("addf {} {}\nnet {} => {}.in\n", filter, thread, from, filter);
    settings += filled_in(kHalBiquad, {{"filter", filter},
                                       {"b0", digits_17(c.b[0])},
                                       {"b1", digits_17(c.b[1])},
                                       {"b2", digits_17(c.b[2])},
                                       {"a1", digits_17(c.a[1])},
                                       {"a2", digits_17(c.a[2])}});
    from = filter + "-out";
    path.text += fmt::format("net {} <= {}.out\n", from, filter);
  }
  path.text += fmt::format("net {} => {}-pid.{}\n", from, design.name, pin) + settings;
  return path;
}

/// What HAL cannot express.
expected<void> check_hal(const ExportedController& design, const std::string& thread) {
  if (const auto valid = check_exported(design); !valid) return valid;
  if (!design.schedule.empty())
    return refuse("schedule", "must be empty: LinuxCNC's pid has one set of gains, and its torque would jump",
                  static_cast<double>(design.schedule.size()));
  if (thread.empty() || thread.find_first_of(" \t\r\n#") != std::string::npos)
    return refuse("thread", "must be the name of a thread");
  constexpr std::size_t kLongestName = 21;  // "NAME-pid.error-previous-target" has at most 47 characters
  if (design.name.size() > kLongestName)
    return refuse("name", "must have at most 21 characters for HAL", static_cast<double>(design.name.size()));
  const double period = 1e9 * design.sample_time_s;
  constexpr double kSamePeriod = 1e-5;
  if (std::abs(std::round(period) / period - 1.0) > kSamePeriod)
    return refuse("sample_time_s", "must be whole nanoseconds, as a thread's period is",
                  design.sample_time_s);
  return {};
}

struct HalPid {
  std::string name;
  double kp = 0.0, ki = 0.0;
  double set_point_weight = 1.0;
  std::string bias = {}, limit = "0", forward = "0";
};
/// pid knows kp (r - y); FF0 r takes away what the weight does: kp (r - y) - kp (1 - b) r = kp (b r - y).
std::string settings_of(const HalPid& pid) {
  const double off = pid.kp * (1.0 - pid.set_point_weight);
  return filled_in(kHalSettings, {{"pid", pid.name},
                                  {"kp", digits_17(pid.kp)},
                                  {"ki", digits_17(pid.ki)},
                                  {"weight", off == 0.0 ? "0" : digits_17(-off)},
                                  {"forward", pid.forward},
                                  {"bias", pid.bias},
                                  {"limit", pid.limit}});
}

}  // namespace

expected<std::string> to_hal(const ExportedController& design, const std::string& thread) {
  if (const auto valid = check_hal(design, thread); !valid) return tl::unexpected(valid.error());
  const double period = 1e9 * design.sample_time_s;
  const bool filtered = !design.controller.biquads.empty(), cascaded = design.kv > 0.0;
  const bool measured = cascaded && !design.sums_velocity;
  const HalPath reference = path_into(design, "reference", "command", thread);
  const HalPath velocity = path_into(design, "velocity", "feedback", thread);
  TextValues values = {{"name", design.name},
                       {"thread", thread},
                       {"period", fmt::format("{:.0f}", period)},
                       {"law", law_word(design)},
                       {"what", cascaded ? "position" : "velocity"},
                       {"signals", cascaded ? "the references, what was measured (rad, rad/s)"
                                            : "the reference and the measured velocity (rad/s)"},
                       {"reference", cascaded ? "position-reference" : "reference"},
                       {"outer", cascaded ? design.name + "-pos," : ""},
                       {"and_biquad", filtered ? " and biquad" : ""},
                       {"and_filters", filtered ? " and filters" : ""}};
  std::string connections = measured ? "#   net " + design.name + "-position <= ...\n" : "";
  if (cascaded) connections += filled_in(kHalConnections, values);
  if (cascaded && design.feed_forward) {
    const auto& f = *design.feed_forward;
    connections += fmt::format(
        "#   torque-feed-forward: {} times the acceleration of the reference + {} times its velocity\n"
        "#   + {} in its direction; position and velocity of it {} s later\n",
        f.inertia, f.viscous, f.coulomb, f.delay_s);
  }
  values.emplace_back("connections", connections);
  values.emplace_back("sum", design.sums_velocity ? filled_in(kHalSum, values) : std::string());
  std::string text = filled_in(kHalHead, values);
  if (filtered) text += fmt::format("loadrt biquad names={},{}\n", reference.names, velocity.names);
  HalPid inner{design.name + "-pid", design.controller.kp, design.controller.ki, design.set_point_weight};
  inner.bias = cascaded ? fmt::format("net {0}-torque-feed-forward => {0}-pid.bias\n", design.name)
                        : "setp " + inner.name + ".bias 0\n";
  if (design.torque_limit) inner.limit = digits_17(*design.torque_limit);
  if (cascaded) {
    HalPid outer{design.name + "-pos", design.kv};
    outer.bias = "setp " + outer.name + ".bias 0\n";
    outer.forward = "1";
    text += "\n" + filled_in(kHalOuter, values) + settings_of(outer) +
            fmt::format("net {0}-reference <= {0}-pos.output\n", design.name);
  }
  return text + "\n" + reference.text + "\n" + velocity.text + "\n" + filled_in(kHalGains, values) +
         settings_of(inner);
}

}  // namespace resonid::design
