// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <resonid/report/detail/batch.hpp>
#include <resonid/report/detail/document.hpp>
#include <resonid/report/detail/typography.hpp>
#include <resonid/report/json.hpp>

#include "results.hpp"

namespace resonid::report {
namespace {

TEST(Typography, SetsSignsAndUnits) {
  EXPECT_EQ(typeset("motor inertia 0.032 +- 0.001 kgm2"), "motor inertia 0.032 \u00b1 0.001 kg m\u00b2");
  EXPECT_EQ(typeset("damping (Nms/rad), 3 Ns/m"), "damping (Nm s/rad), 3 N s/m");
  EXPECT_EQ(typeset("in rad/s2, V s2/rad, ((rad/s)/Nm)^2 and chi2"),
            "in rad/s\u00b2, V s\u00b2/rad, ((rad/s)/Nm)\u00b2 and \u03c7\u00b2");
  EXPECT_EQ(typeset("+-2.3 Nm; within +-1."), "\u00b12.3 Nm; within \u00b11.");
  EXPECT_EQ(typeset(""), "");
}

TEST(Typography, LeavesWhatIsToBeCopied) {
  for (const char* text :
       {"unknown column 'acc m/s2' here", "  resonid identify 'a.csv' --output acc_m/s2 --json kgm2\n",
        "kgm2.csv", "J_kgm2", "a+-b", "chi2.csv", "1e+-3", "1/s20"})
    EXPECT_EQ(typeset(text), text);
  EXPECT_EQ(typeset("the record's own +- 2 isn't 'x +- y'"), "the record's own \u00b1 2 isn't 'x +- y'");
  EXPECT_EQ(typeset("resonid demo\n0 +- 1"), "resonid demo\n0 \u00b1 1");
}

TEST(Typography, IsIdempotentAndKeepsTheWidthOfUnits) {
  const std::string once = typeset("3 +- 1 kgm2, rad/s2");
  EXPECT_EQ(typeset(once), once);
  for (const char* unit : {"kgm2", "Nms/rad", "Ns/m", "rad/s2", "V s2/rad", "Nm/rad"}) {
    const std::string plain = unit_words(unit), set = typeset(plain);
    std::size_t characters = 0;
    for (const char c : set) characters += (static_cast<unsigned char>(c) & 0xC0U) != 0x80U;
    EXPECT_EQ(characters, plain.size()) << set;
  }
}

/// Where the cells of a table's lines end does not depend on the characters.
TEST(Typography, KeepsColumnsInBothForms) {
  Document d;
  d.title = "t";
  d.sections = {
      {"s", {}, {}, {}, {{"", {"what", "value", "J, kgm2"}, {{"a", "1.5 +- 0.2", "1"}, {"b", "2", "3"}}}}}};
  EXPECT_NE(document_text(d).find(
                "  what       value  J, kgm2\n  a     1.5 +- 0.2        1\n  b              2        3\n"),
            std::string::npos)
      << document_text(d);
  EXPECT_NE(document_text(d, Characters::unicode)
                .find("  what      value  J, kg m\u00b2\n  a     1.5 \u00b1 0.2         1\n  b             2 "
                      "        3\n"),
            std::string::npos)
      << document_text(d, Characters::unicode);
}

/// A line never ends between a figure and its deviation.
TEST(Typography, KeepsFiguresTogether) {
  auto result = test::bare();
  for (int n = 1; n < 60; ++n) {
    result.findings = {{"jitter",
                        diagnostics::Severity::warning,
                        {},
                        {},
                        std::string(40 + n, 'x') + " of 15.1 +- 0.2 Hz, 66 % (NRMSE)"}};
    const auto text = summary_text(result);
    EXPECT_NE(text.find("15.1 +- 0.2"), std::string::npos) << text;
    EXPECT_NE(text.find("66 %"), std::string::npos) << text;
  }
}

}  // namespace
}  // namespace resonid::report
