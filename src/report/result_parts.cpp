// SPDX-License-Identifier: MIT
#include "report/result_parts.hpp"

namespace resonid::report {

Section findings_section(const std::vector<diagnostics::Finding>& findings) {
  static constexpr const char* kSeverities[] = {"note", "warning", "error"};
  Table table{"", {"Kind", "What it means", "Name"}, {}};
  for (const auto& f : findings)
    table.rows.push_back({kSeverities[static_cast<int>(f.severity)], f.meaning, f.id});
  Section section;
  section.title = "Findings";
  section.plain_tables.push_back(std::move(table));
  return section;
}

}  // namespace resonid::report
