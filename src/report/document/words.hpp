// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/base/detail/number_text.hpp>
#include <resonid/base/detail/statistics.hpp>
#include <resonid/identification/result.hpp>
#include <resonid/report/detail/typography.hpp>
#include <string>
#include <string_view>
#include <vector>

// Words and parts that the results of several verbs share.
namespace resonid::report {

/// "15.075 ... 15.137": as many decimals as half the distance has two digits.
[[nodiscard]] std::string interval_text(double low, double high);

/// Characters of UTF-8 text, not bytes.
[[nodiscard]] std::size_t columns_of(std::string_view text);

/// A name of JSON as people say it: "driven_inertia" is "motor inertia", in kg "motor mass"; "resonance_2_hz"
/// is "resonance 2".
[[nodiscard]] std::string quantity_words(std::string name, std::string_view unit = {});

/// The longest line for a terminal.
inline constexpr std::size_t kTerminalColumns = 100;

/// Text broken at spaces so that no line is longer; `first` stands before the first line,
/// `indent` before the others.
[[nodiscard]] std::string wrapped(const std::string& text, const std::string& first,
                                  const std::string& indent, std::size_t columns = kTerminalColumns);

/// What the reader assumed and converted, in lines for a terminal; empty for nothing.
[[nodiscard]] std::string reading_text(const std::vector<std::string>& reading);

[[nodiscard]] std::string_view word_of(diagnostics::Severity severity);

/// The findings under their heading, for a terminal; empty without any.
[[nodiscard]] std::string findings_text(const std::vector<diagnostics::Finding>& findings);

}  // namespace resonid::report
