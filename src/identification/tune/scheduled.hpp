// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/identification/tune.hpp>
#include <vector>

#include "design/posterior.hpp"

namespace resonid::identification {

/// PI gains over the positions of the results (docs/methods/tune.md 12), beside one PI for all of them, which
/// is the proposed controller: what there is where the position is not known to the drive.
[[nodiscard]] expected<void, Error> add_schedule(Tuning& tuning,
                                                 const std::vector<design::Posterior>& posteriors);

}  // namespace resonid::identification
