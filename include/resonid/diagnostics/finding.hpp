// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <resonid/base/enum_names.hpp>
#include <string>

namespace resonid::diagnostics {

/// How much a finding matters.
enum class Severity {
  info,     ///< Worth knowing.
  warning,  ///< Part of the result is weak; the rest stands.
  error,    ///< The result is not reliable.
};
inline constexpr EnumName<Severity> kSeverityNames[] = {
    {Severity::info, "info"}, {Severity::warning, "warning"}, {Severity::error, "error"}};
[[nodiscard]] constexpr std::span<const EnumName<Severity>> enum_names(Severity) noexcept {
  return kSeverityNames;
}

/// Something about the data or the result that its reader must know, in plain words.
struct Finding {
  std::string id;  ///< Stable name: "low-coherence".
  Severity severity = Severity::info;
  std::optional<double> value;      ///< What was measured.
  std::optional<double> threshold;  ///< Value that it is compared with.
  std::string meaning;              ///< One or two sentences for a drive engineer.
  bool follows = false;  ///< From a cause that another finding tells; texts and pages leave it out.
};

}  // namespace resonid::diagnostics
