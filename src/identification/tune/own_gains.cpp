// SPDX-License-Identifier: MIT
#include <resonid/identification/tune_export.hpp>

namespace resonid::identification {

GainUnits gain_units(const std::string& input, const std::string& velocity) {
  if (input.empty() || velocity.empty()) return {};
  const bool of_time = velocity.ends_with("/s");
  const std::string per = velocity.find('/') == std::string::npos ? velocity : "(" + velocity + ")";
  return {input + "/" + per,
          of_time ? input + "/" + velocity.substr(0, velocity.size() - 2) : input + "/(" + velocity + " s)",
          of_time ? input + "/(" + velocity + "2)" : input + " s/" + per};
}

std::optional<OwnGains> own_gains(const Tuning& tuning) {
  if (tuning.input_scale == 1.0 && tuning.output_scale == 1.0) return std::nullopt;
  return OwnGains{tuning.input_scale / tuning.output_scale,
                  gain_units(tuning.input_unit, tuning.output_unit)};
}

}  // namespace resonid::identification
