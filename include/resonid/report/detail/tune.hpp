// SPDX-License-Identifier: MIT
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <resonid/identification/tune.hpp>
#include <resonid/report/detail/document.hpp>
#include <resonid/report/json.hpp>
#include <string>
#include <vector>

namespace resonid::report {

/// What a design or an evaluation comes to, in plain sentences, whether it may be relied on first.
[[nodiscard]] std::vector<std::string> sentences(const identification::Tuning& tuning);

/// "Trusted.", "Bounds NOT kept." or another last word on whether the controller may be used.
[[nodiscard]] std::string trust_text(const identification::Tuning& tuning);

/// Readable summary for a terminal, lines of at most 100 characters.
[[nodiscard]] std::string summary_text(const identification::Tuning& tuning);

/// The page of `tune --report`: figures with their intervals, loop, steps, trade-offs, candidates.
[[nodiscard]] Document document(const identification::Tuning& tuning);

/// A controller as io::read_controller() takes it: {numerator, denominator, sample_time_s, structure}, and
/// `reference_numerator` where the reference goes its own way, `position_gain` of a cascade, and what it is
/// made of where that are gains.
[[nodiscard]] nlohmann::json controller_json(const identification::TunedController& controller);

/// The proposed controller likewise, with a warning of a design that is not trusted and the factor to the
/// recording's own units. Refused: one that is unstable on the identified machine, and a gain schedule.
[[nodiscard]] expected<nlohmann::json> controller_json(const identification::Tuning& tuning);
/// The first step of it, identification::first_step(). Refused too: a controller without gains.
[[nodiscard]] expected<nlohmann::json> first_step_json(const identification::Tuning& tuning);

}  // namespace resonid::report
