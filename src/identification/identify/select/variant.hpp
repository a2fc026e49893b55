// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <resonid/fit/drive_model.hpp>
#include <string>
#include <vector>

namespace resonid::identification::detail {

/// What is estimated of a structure.
struct Variant {
  fit::Structure structure = fit::Structure::two_mass;
  bool friction = false;
  bool delay = false;
  bool dry = false;                          ///< Dry friction; told by the record only.
  std::vector<fit::Parameter> further = {};  ///< fit::OutputErrorConfig::further
  fit::Velocity velocity = fit::Velocity::sampled;

  [[nodiscard]] bool has(fit::Parameter parameter) const {
    return std::find(further.begin(), further.end(), parameter) != further.end();
  }
  [[nodiscard]] bool grounded() const {
    return has(fit::kMotorGroundStiffness) || has(fit::kLoadGroundStiffness);
  }
};

/// "two-mass with viscous friction and delay"
[[nodiscard]] std::string name_of(const Variant& variant);

/// The variant with one parameter more.
[[nodiscard]] Variant with(Variant variant, fit::Parameter parameter);

/// What a variant has beside its structure.
[[nodiscard]] std::size_t parameters_of(const Variant& variant);

/// Springs that push, friction that drives: an imitation of something else.
[[nodiscard]] bool implausible(const Variant& variant, const fit::DriveModel& model);

}  // namespace resonid::identification::detail
