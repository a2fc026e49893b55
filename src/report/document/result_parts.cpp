// SPDX-License-Identifier: MIT
#include "report/document/result_parts.hpp"

#include <resonid/diagnostics/detail/finding_catalogue.hpp>

#include "report/document/words.hpp"

namespace resonid::report {

Section findings_section(const std::vector<diagnostics::Finding>& findings) {
  Table table{"", {"Kind", "What it means", "Name"}, {}};
  for (const auto& f : findings)
    if (!f.follows)
      table.rows.push_back({std::string(word_of(f.severity)), f.meaning, diagnostics::finding_title(f.id)});
  Section section;
  section.title = "Findings";
  section.plain_tables.push_back(std::move(table));
  return section;
}

}  // namespace resonid::report
