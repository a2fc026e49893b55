// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/identification/result.hpp>
#include <string>

// The lists of a result: what was chosen, what was tried, intervals of the bootstrap.
namespace resonid::report {

/// For a terminal; empty without any.
[[nodiscard]] std::string choices_text(const identification::Result& result);
[[nodiscard]] std::string structures_text(const identification::Result& result);
[[nodiscard]] std::string bootstrap_text(const identification::Result& result);

}  // namespace resonid::report
