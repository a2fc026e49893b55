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
  bool load_dry = false;  ///< Dry friction on the load.
  bool stribeck = false;  ///< Dry friction that is larger where the driven side hardly moves.

  [[nodiscard]] bool any_dry() const { return dry || load_dry; }
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

/// The variant with its spring to the ground on the other side.
[[nodiscard]] Variant grounded_on_other_side(Variant variant);

/// What a variant has beside its structure. The mean over a sample costs as much as the delay in its stead;
/// friction of the load alone costs two, since it says where friction acts as well as how large it is.
[[nodiscard]] std::size_t parts_of(const Variant& variant);
/// By how much a variant must be better than another, in BIC, for what it has more; negative for less.
[[nodiscard]] double price_of(const Variant& variant, const Variant& other, double price);

/// The variant without dry friction of any kind.
[[nodiscard]] Variant without_dry_friction(Variant variant);

[[nodiscard]] bool lags(const Variant& variant);
/// The variant without a lag or filter, which may have stood for what it has now.
[[nodiscard]] Variant without_lags(Variant variant);

/// Springs that push, friction that drives: an imitation of something else.
[[nodiscard]] bool implausible(const Variant& variant, const fit::DriveModel& model);

}  // namespace resonid::identification::detail
