// SPDX-License-Identifier: MIT
#pragma once

#include <identification/identify/measure/measure.hpp>
#include <optional>
#include <resonid/diagnostics/finding.hpp>
#include <resonid/identification/result.hpp>

namespace resonid::identification::detail {

/// Whether what a result lacks comes from an excitation that is too weak for the noise; nothing where the
/// result has no fault of its own. In a loop by the share of the input's power that is noise which the
/// controller feeds back (Feedback::noise_share), else by how few lines of the response rise above their
/// standard deviation.
[[nodiscard]] std::optional<diagnostics::Finding> inspect_excitation(const Experiment& experiment,
                                                                     const Measurement& measurement,
                                                                     const Options& options,
                                                                     const Result& result);

/// Whether the finding says that the record tells nothing of the machine at all.
[[nodiscard]] bool drowns_everything(const diagnostics::Finding& finding);

}  // namespace resonid::identification::detail
