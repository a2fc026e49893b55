// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <identification/distortion.hpp>
#include <resonid/response/detection_lines.hpp>

namespace resonid::identification::detail {

std::vector<diagnostics::Finding> inspect_distortion(const data::Record& record, const Plan& plan) {
  if (plan.method != Method::periodic) return {};
  const auto found = response::detection_lines(record, {plan.period_samples, 0});
  if (!found) return {};
  // Below a thousandth the distortion is of no consequence to a loop.
  constexpr double kNoticeable = 1e-3;
  const auto shows = [&](const response::DistortionLevel& l) {
    return l.significant && l.level > kNoticeable;
  };
  const bool even = shows(found->even);
  const bool odd = shows(found->odd);
  if (!even && !odd) return {};
  const double level = std::max(even ? found->even.level : 0.0, odd ? found->odd.level : 0.0);
  const char* kind = even && odd ? "even and odd" : even ? "even" : "odd";
  const char* cause = odd ? "friction, saturation or a stiffening spring" : "an offset or one-sided limits";
  return {
      {"non-linear-distortion", level > 0.1 ? diagnostics::Severity::warning : diagnostics::Severity::info,
       level, kNoticeable,
       fmt::format("The drive answers at lines that are not excited, with {:.2g} % of the output at excited "
                   "lines ({} multiples: {}). The response holds for excitations of this size.",
                   100.0 * level, kind, cause)}};
}

}  // namespace resonid::identification::detail
