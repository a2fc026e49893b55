// SPDX-License-Identifier: MIT
#pragma once

#include <CLI/App.hpp>
#include <optional>
#include <resonid/identification/tune.hpp>

namespace resonid::cli {

/// What of a call of `tune` decides which of its options have an effect.
struct TuneCall {
  bool first_loop = false, check = false, evaluate = false, shaper = false, exports = false;
  bool hal = false, klipper = false;  ///< Among the exports.
  identification::ControllerStructure structure = identification::ControllerStructure::automatic;
  std::optional<bool> position_loop;  ///< Of a given controller not known before its file is read.
  bool by_response = false;           ///< RESULT holds no drive model; not known before it is read.
};

/// Refuses options on the command line that would have no effect, by name and with what they go. Those of
/// a profile are for other calls, too.
void refuse_unused(const CLI::App& verb, const TuneCall& call);

}  // namespace resonid::cli
