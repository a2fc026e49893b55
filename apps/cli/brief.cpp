// SPDX-License-Identifier: MIT
#include "brief.hpp"

#include "terminal.hpp"

namespace resonid::cli {

std::string trusted_text(bool trusted) { return trusted ? "Trusted." : "NOT trusted."; }

std::string brief_text(const std::string& verdict, const std::vector<std::string>& sentences,
                       const std::vector<diagnostics::Finding>& findings) {
  constexpr std::size_t kWidth = 100;  // as that of summaries
  std::string text = verdict + "\n", warnings;
  for (const auto& sentence : sentences) text += wrapped(sentence, kWidth, "", "  ");
  for (const auto& finding : findings) {
    if (finding.severity == diagnostics::Severity::error)
      text += wrapped("Error " + finding.id + ": " + finding.meaning, kWidth, "", "  ");
    if (finding.severity == diagnostics::Severity::warning && !finding.follows)
      warnings += (warnings.empty() ? "" : ", ") + std::string(finding.id);
  }
  return warnings.empty() ? text : text + wrapped("Warnings: " + warnings + ".", kWidth, "", "  ");
}

}  // namespace resonid::cli
