// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/diagnostics/finding.hpp>
#include <resonid/identification/result.hpp>
#include <vector>

namespace resonid::identification::detail {

/// Whether a fit would be wasted: the output is not what it is called.
[[nodiscard]] bool is_misnamed(const std::vector<diagnostics::Finding>& findings);

/// One fault, one message: of several errors the one that is nearest to the cause is kept and stands first,
/// faults of the data before those of what is recorded, before those of the machine, before what a model
/// lacks. Where the record says nothing of the machine (nothing excites it, a column is not what it is
/// called), model, margins and modes of the model go too: they mean nothing. Of lines that are noise the
/// modes that they show go as well.
/// @param discards_model false where the user asked for a model, who may want to see it all the same, unless
///        what was measured is noise
void keep_root_cause(bool discards_model, Result& result);

}  // namespace resonid::identification::detail
