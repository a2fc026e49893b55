// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <cmath>
#include <string_view>

#include "design/export.hpp"
#include "design/export_text.hpp"

namespace resonid::design {
namespace {

constexpr std::string_view kHalHead =
    R"(# @name@: PI control of a velocity, designed by resonid, for LinuxCNC's pid@and_biquad@.
# The period of @thread@ must be @period@ ns; at another one these gains@and_filters@ are wrong.
# Connect the reference and the measured velocity (rad/s), the torque (Nm), and the signal that enables:
#   net @name@-reference  <= ...        net @name@-torque => ...
#   net @name@-velocity   <= ...        net @name@-enable <= ...
# Do not change Igain while it runs: it multiplies the sum, so that the torque would jump.
loadrt pid names=@name@-pid
)";

constexpr std::string_view kHalGains = R"(addf @name@-pid.do-pid-calcs @thread@
net @name@-torque <= @name@-pid.output
net @name@-enable => @name@-pid.enable
setp @name@-pid.Pgain @kp@
setp @name@-pid.Igain @ki@
setp @name@-pid.Dgain 0
setp @name@-pid.FF0 0
setp @name@-pid.FF1 0
setp @name@-pid.FF2 0
setp @name@-pid.bias 0
setp @name@-pid.deadband 0
setp @name@-pid.maxerror 0
setp @name@-pid.maxerrorI 0
setp @name@-pid.maxoutput @limit@
setp @name@-pid.error-previous-target 0
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

}  // namespace

expected<std::string> to_hal(const ExportedController& design, const std::string& thread) {
  if (const auto valid = check_exported(design); !valid) return tl::unexpected(valid.error());
  if (design.set_point_weight != 1.0)
    return refuse("set_point_weight", "must be 1: LinuxCNC's pid knows the error only",
                  design.set_point_weight);
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
  const bool filtered = !design.controller.biquads.empty();
  const HalPath reference = path_into(design, "reference", "command", thread);
  const HalPath velocity = path_into(design, "velocity", "feedback", thread);
  const TextValues values = {{"name", design.name},
                             {"thread", thread},
                             {"period", fmt::format("{:.0f}", period)},
                             {"and_biquad", filtered ? " and biquad" : ""},
                             {"and_filters", filtered ? " and filters" : ""},
                             {"kp", digits_17(design.controller.kp)},
                             {"ki", digits_17(design.controller.ki)},
                             {"limit", design.torque_limit ? digits_17(*design.torque_limit) : "0"}};
  std::string text = filled_in(kHalHead, values);
  if (filtered) text += fmt::format("loadrt biquad names={},{}\n", reference.names, velocity.names);
  return text + "\n" + reference.text + "\n" + velocity.text + "\n" + filled_in(kHalGains, values);
}

}  // namespace resonid::design
