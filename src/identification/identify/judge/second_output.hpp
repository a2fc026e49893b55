// SPDX-License-Identifier: MIT
#pragma once

#include <identification/identify/select/select.hpp>

namespace resonid::identification::detail {

/// Puts the response of the load into the result and fits the drive model, if there is one, to it too; what
/// tells about both. A second output that contradicts the model, or is not of this drive, leaves it as it is.
[[nodiscard]] std::vector<diagnostics::Finding> fit_to_second_output(const Experiment& experiment,
                                                                     const Measurement& measurement,
                                                                     const Options& options,
                                                                     std::optional<Selection>& selection,
                                                                     Result& result);

}  // namespace resonid::identification::detail
