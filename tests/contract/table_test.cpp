// SPDX-License-Identifier: MIT
// The table of docs/realtime.md says what the code is. `test_contract --write-table` puts it in its place
// anew.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>

#include "subject.hpp"

namespace resonid::test {
namespace {

std::string power_of_ten(double x) {
  return x < 1e3 ? std::to_string(std::lround(x)) : "1e" + std::to_string(std::lround(std::log10(x)));
}
std::string missing_of(const Case& c) {
  if (c.arguments == 0) return "takes none";
  std::string names;
  for (const auto& [bit, name] : {std::pair(kRu, "ru"), std::pair(kU, "u"), std::pair(kY, "y")})
    if ((c.arguments & bit) != 0) names += (names.empty() ? "" : ", ") + std::string(name);
  return names;
}
std::string spike_of(const Case& one, const Case& single) {
  if (one.arguments == 0) return "-";
  if (!one.forgets) return "`reset()`";
  return power_of_ten(one.spike) +
         (single.spike == one.spike ? "" : " (float: " + power_of_ten(single.spike) + ")");
}

std::string page() {
  std::ifstream file(RESONID_REALTIME_PAGE);
  return {std::istreambuf_iterator<char>(file), {}};
}

std::string table() {
  std::ostringstream out;
  out << "| class | built for | bytes, double | bytes, float | instructions of a step | missing if not "
         "finite | gets "
         "over a spike of |\n|---|---|---|---|---|---|---|\n";
  for (const Case& c : cases()) {
    if (c.single) continue;
    const auto same = std::find_if(cases().begin(), cases().end(), [&c](const Case& other) {
      return other.single && other.family == c.family;
    });
    const bool typed = same != cases().end();
    out << "| " << c.family << " | " << c.as_listed << " | " << c.bytes << " | "
        << (typed ? std::to_string(same->bytes) : "-") << " | " << c.cost << " | " << missing_of(c) << " | "
        << spike_of(c, typed ? *same : c) << " |\n";
  }
  return out.str();
}

TEST(RealtimePage, HoldsTheTableThatTheCodeGives) {
#if defined(__x86_64__) && defined(__GLIBCXX__)  // sizes are those of one machine type
  EXPECT_NE(page().find(table()), std::string::npos) << "run test_contract --write-table";
#endif
}

}  // namespace

int write_table() {
  const std::string text = page(), begin = "<!-- table -->\n";
  const auto from = text.find(begin), to = text.find("<!-- end of the table -->");
  if (from == std::string::npos || to == std::string::npos) return 1;
  std::ofstream(RESONID_REALTIME_PAGE) << text.substr(0, from) << begin << table() << text.substr(to);
  return 0;
}
}  // namespace resonid::test
