// SPDX-License-Identifier: MIT
#include "identification/tune/usable.hpp"

#include <fmt/format.h>

#include <string>

namespace resonid::identification {
namespace {

std::string whose(const Result& result) {
  return result.record.file.empty() ? "the result" : "the result of " + result.record.file;
}

/// A loop acts by what it commands: what answers earlier was measured behind it.
expected<void, Error> check_ahead(const Result& result) {
  const auto& model = result.model->drive;
  const double delay_s = model.known_delay_s + model.delay_s;
  if (delay_s >= -0.01 * model.sample_time_s) return {};
  if (model.known_delay_s > 0.0)
    return refuse("results",
                  fmt::format("{} has a delay of {:.4g} ms, required 0 or more: it shows {:.4g} ms "
                              "less than the {:.4g} ms that were given; identify it with the "
                              "delay that it has, or without .delay_s",
                              whose(result), 1e3 * delay_s, -1e3 * model.delay_s, 1e3 * model.known_delay_s));
  return refuse("results",
                fmt::format("{} has a delay of {:.4g} ms, required 0 or more: its output comes earlier than "
                            "its input, which was measured and not commanded (input-ahead). What passes from "
                            "command to torque is missing in it, and a loop has that; identify it with the "
                            "commanded torque as .input",
                            whose(result), 1e3 * delay_s));
}

}  // namespace

expected<void, Error> check_usable(std::span<const Result> results) {
  for (const Result& result : results) {
    if (!result.model) continue;
    if (auto checked = check_ahead(result); !checked) return checked;
  }
  return {};
}

}  // namespace resonid::identification
