// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/planning/plan.hpp>
#include <resonid/report/detail/document.hpp>
#include <resonid/report/json.hpp>
#include <string>
#include <vector>

namespace resonid::report {

/// What a plan comes to, in plain sentences, whether the accuracy targets are met first.
[[nodiscard]] std::vector<std::string> sentences(const planning::Plan& plan);

/// Readable summary for a terminal, lines of at most 100 characters.
[[nodiscard]] std::string summary_text(const planning::Plan& plan);

/// The page of `plan --report`: error bars side by side, spectrum beside the response, waveforms.
[[nodiscard]] Document document(const planning::Plan& plan);

}  // namespace resonid::report
