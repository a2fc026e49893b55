// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/identification/tune.hpp>
#include <span>

namespace resonid::identification {

/// Sets what was promised of the proposed (or judged) controller beside what a recording under it shows:
/// `measured` is the result of that recording, identified with the controller and an excitation,
/// `designed_for` the result that the controller was designed for. Lines are compared by L = Ru/U - 1 (of
/// methods that smooth over lines: by controller times response), each with the error bars of both sides;
/// margins likewise. Where they disagree the finding names the likely
/// cause, by what differs between both models: the delay, the gain, the stiffness, the load, another mode.
/// Refused: a result without excitation, of another sample time or other units.
[[nodiscard]] expected<void, Error> check_on(Tuning& tuning, const Result& designed_for,
                                             const Result& measured);

/// For one controller for several results: the comparison with the machine that explains the recording best,
/// which the finding `checked-machine` names. `measured[i]` is the result of that recording, identified with
/// the delay of `designed_for[i]`.
[[nodiscard]] expected<void, Error> check_on(Tuning& tuning, std::span<const Result> designed_for,
                                             std::span<const Result> measured);

}  // namespace resonid::identification
