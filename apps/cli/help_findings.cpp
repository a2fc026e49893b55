// SPDX-License-Identifier: MIT
#include "help_findings.hpp"

#include <algorithm>
#include <resonid/diagnostics/detail/finding_catalogue.hpp>

#include "option_names.hpp"
#include "terminal.hpp"

namespace resonid::cli {

std::string findings_page() { return in_options(diagnostics::findings_markdown()); }

std::optional<std::string> finding_text(std::string_view id) {
  const auto* kind = diagnostics::finding_kind(id);
  if (kind == nullptr) return std::nullopt;
  std::string text = std::string(kind->id) + ": " + std::string(kind->title) + "\n\n";
  const auto put = [&](std::string_view name, std::string_view what) {
    std::string line = in_options(what);
    std::erase(line, '`');
    constexpr std::size_t kNames = 10;
    std::string begin(name);
    begin.resize(kNames, ' ');
    text += wrapped(line, text_width(), begin, std::string(kNames, ' '));
  };
  put("meaning", kind->meaning);
  put("cause", kind->cause);
  put("cure", kind->cure);
  put("trust", name_of(kind->trust));
  put("told by", kind->verbs);
  return text;
}

}  // namespace resonid::cli
