// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <resonid/diagnostics/finding.hpp>

#include "diagnostics/findings/kinds.hpp"

namespace resonid::diagnostics {
namespace {

struct Chapter {
  std::string_view title;
  std::span<const FindingKind> kinds;
};

std::array<Chapter, 8> chapters() noexcept {
  return {Chapter{"Data", detail::data_kinds()},
          Chapter{"Columns, signs and loop", detail::loop_kinds()},
          Chapter{"Models", detail::model_kinds()},
          Chapter{"Several recordings", detail::join_kinds()},
          Chapter{"Validation", detail::validate_kinds()},
          Chapter{"Comparison", detail::compare_kinds()},
          Chapter{"Tracking", detail::track_kinds()},
          Chapter{"Control design", detail::tune_kinds()}};
}

}  // namespace

std::vector<FindingKind> finding_catalogue() {
  std::vector<FindingKind> all;
  for (const auto& chapter : chapters()) all.insert(all.end(), chapter.kinds.begin(), chapter.kinds.end());
  return all;
}

const FindingKind* finding_kind(std::string_view id) noexcept {
  for (const auto& chapter : chapters()) {
    const auto found = std::find_if(chapter.kinds.begin(), chapter.kinds.end(),
                                    [&](const FindingKind& k) { return k.id == id; });
    if (found != chapter.kinds.end()) return &*found;
  }
  return nullptr;
}

std::string finding_title(std::string_view id) {
  if (const auto* kind = finding_kind(id)) return std::string(kind->title);
  std::string text(id);
  std::replace(text.begin(), text.end(), '-', ' ');
  if (!text.empty()) text[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(text[0])));
  return text;
}

std::string findings_markdown() {
  std::string out =
      "# Findings\n\n"
      "What `identify`, `inspect`, `validate`, `compare`, `track` and `tune` may say of a recording or a "
      "result. A "
      "note is worth "
      "knowing, a warning weakens a part of the result, an error withdraws the trust in it. Every finding "
      "has an id, by "
      "which JSON names it; `resonid help ID` shows its entry.\n";
  for (const auto& chapter : chapters()) {
    out += fmt::format("\n## {}\n", chapter.title);
    for (const auto& k : chapter.kinds)
      out += fmt::format("\n### {}\n\n**{}.** {}\n\n- Told by: {}\n- Trust: {}\n- Cause: {}\n- Cure: {}\n",
                         k.id, k.title, k.meaning, k.verbs, name_of(k.trust), k.cause, k.cure);
  }
  return out;
}

}  // namespace resonid::diagnostics
