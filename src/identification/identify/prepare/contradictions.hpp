// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <resonid/base/error.hpp>
#include <resonid/data/record.hpp>
#include <resonid/identification/options.hpp>

namespace resonid::identification::detail {

/// What was told of the excitation against what the record shows of it: a chirp of another law, or of which
/// the exciting signal holds next to nothing; a period after which it does not repeat. Nothing where they
/// agree, or where the record does not tell.
///
/// The share of a told chirp is that of the variance, block by block about a straight line, that a cosine and
/// a sine along its phase explain: the loop may change amplitude and phase from block to block. That of a
/// period is the normalised autocorrelation at it.
[[nodiscard]] std::optional<Error> contradiction(const data::Record& record, const Options& options);

/// An input that does not move.
[[nodiscard]] std::optional<Error> constant_input(const data::Record& record);

/// An output that is a copy of the input, scaled and shifted: no machine answers so.
[[nodiscard]] std::optional<Error> copied_input(const data::Record& record);

}  // namespace resonid::identification::detail
