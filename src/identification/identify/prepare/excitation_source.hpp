// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/data/record.hpp>
#include <resonid/identification/options.hpp>

namespace resonid::identification::detail {

/// Where the signal comes from that the controller does not feed back.
enum class ExcitationSource {
  none,           ///< Nothing but the input is known: right in open loop only.
  recorded,       ///< A channel of the record.
  reconstructed,  ///< ru = u - C (r - y), the controller being known.
  reference,      ///< The loop's reference, which moves enough to serve as one.
};

/// Gives a record without an excitation channel one, if there is a way: a response without it would be biased
/// towards -1/C by the noise that the controller feeds back. With the controller known ru is
/// reconstructed, and taken when it comes out as what somebody would inject (two levels, a chirp, a period
/// that repeats to 0.1 %), or when the input shows noise that is fed back and ru shows none any more
/// (diagnostics::find_feedback): then the loop did run with this controller. Else a reference that turns
/// around often enough takes its place, from which a joint response, but no loop, can be had.
[[nodiscard]] ExcitationSource complete_excitation(data::Record& record, const Options& options);

}  // namespace resonid::identification::detail
