// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <resonid/diagnostics/finding.hpp>
#include <resonid/fit/output_error.hpp>
#include <span>

namespace resonid::identification::detail {

/// Samples that the record has lost or holds twice though its times do not tell: `dropped-samples`,
/// `repeated-samples`. Where a sample is missing the output is ahead of its simulation by one step s(k) =
/// yh(k) - yh(k-1), where one is repeated it is behind by as much. A share p of such samples makes the
/// whitened residual e, of deviation v, a mixture, whose likelihood against none is
///
///   sum ln(1 - p + p exp((+-2 e s - s^2)/(2 v^2))),
///
/// largest over p by expectation and maximisation (Dempster, Laird and Rubin 1977). Where e is heavy-tailed
/// for another reason, both signs gain alike and nothing is found; of a poor fit nothing is said.
[[nodiscard]] std::optional<diagnostics::Finding> inspect_slips(std::span<const double> output,
                                                                const fit::OutputErrorFit& fit);

}  // namespace resonid::identification::detail
