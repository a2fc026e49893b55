// SPDX-License-Identifier: MIT
#pragma once

#include <fit/drive/drive_simulation.hpp>
#include <resonid/data/detail/output_hold.hpp>
#include <resonid/fit/output_error.hpp>
#include <vector>

namespace resonid::fit::detail {

/// A record and what of it drives the simulation; with `direction`, dry friction is estimated.
struct RecordPart {
  const data::Record* record = nullptr;
  DriveSignals raw;
  data::OutputHold hold;  ///< Only new values of the output are fitted.
};

/// The maximum-likelihood fit itself, of configurations and records that have been checked. Consistency and
/// own fits are left empty.
[[nodiscard]] JointOutputErrorFit fit_drive(std::vector<RecordPart> parts, const OutputErrorConfig& config);

}  // namespace resonid::fit::detail
