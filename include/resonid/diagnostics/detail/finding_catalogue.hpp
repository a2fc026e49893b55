// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/base/enum_names.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace resonid::diagnostics {

/// What a finding does to the trust in a result.
enum class TrustEffect {
  keeps,         ///< A note or a warning, never an error.
  may_withdraw,  ///< An error where it is severe, otherwise a note or a warning.
  withdraws,     ///< An error.
};
inline constexpr EnumName<TrustEffect> kTrustEffectNames[] = {
    {TrustEffect::keeps, "kept"},
    {TrustEffect::may_withdraw, "withdrawn where it is severe (an error)"},
    {TrustEffect::withdraws, "withdrawn"}};
[[nodiscard]] constexpr std::span<const EnumName<TrustEffect>> enum_names(TrustEffect) noexcept {
  return kTrustEffectNames;
}

/// A kind of finding: what stands in docs/findings.md and in `resonid help ID`. Options are named as fields
/// (`.band_hz`).
struct FindingKind {
  std::string_view id;     ///< As in JSON: "low-coherence".
  std::string_view title;  ///< In the field's words; what pages call it.
  std::string_view verbs;  ///< Who tells it, "identify, track".
  TrustEffect trust = TrustEffect::keeps;
  std::string_view meaning;  ///< What was seen.
  std::string_view cause;    ///< What it comes from, and what it does to the result.
  std::string_view cure;     ///< What to do.
};

/// All kinds, ordered as in the documentation: the data, the loop, the model, then verb by verb.
[[nodiscard]] std::vector<FindingKind> finding_catalogue();

/// The kind of an id; none for an unknown one.
[[nodiscard]] const FindingKind* finding_kind(std::string_view id) noexcept;

/// The title of an id; of an unknown one the id as words.
[[nodiscard]] std::string finding_title(std::string_view id);

/// The catalogue as a page of Markdown.
[[nodiscard]] std::string findings_markdown();

}  // namespace resonid::diagnostics
