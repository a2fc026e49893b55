// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <resonid/identification/tune_export.hpp>
#include <string>
#include <vector>

namespace resonid::cli {

/// `tune --first-loop`: what there is to design from before anything is identified.
struct FirstLoopVerb {
  std::string known;  ///< motor_inertia=X,...
  std::optional<double> sample_rate_hz, delay_s, torque_limit;
  std::vector<std::string> exports;
  identification::ExportNames names;
  std::string json;
};
void run_first_loop(const FirstLoopVerb& given);

}  // namespace resonid::cli
