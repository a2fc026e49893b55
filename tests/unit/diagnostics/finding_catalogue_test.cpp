// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <resonid/diagnostics/detail/finding_catalogue.hpp>
#include <set>

namespace resonid::diagnostics {
namespace {

TEST(FindingCatalogue, HasMeaningCauseAndCureOfEachIdOnce) {
  std::set<std::string_view> ids, titles;
  for (const auto& kind : finding_catalogue()) {
    EXPECT_TRUE(ids.insert(kind.id).second) << kind.id;
    EXPECT_TRUE(titles.insert(kind.title).second) << kind.title;
    EXPECT_EQ(kind.id.find_first_not_of("abcdefghijklmnopqrstuvwxyz-"), std::string_view::npos) << kind.id;
    for (const auto text : {kind.meaning, kind.cause, kind.cure}) {
      EXPECT_GT(text.size(), 5U) << kind.id;
      EXPECT_TRUE(text.ends_with('.')) << kind.id << ": " << text;
    }
    EXPECT_FALSE(kind.verbs.empty()) << kind.id;
  }
  EXPECT_GT(ids.size(), 100U);
}

TEST(FindingCatalogue, NamesFindingsInWords) {
  EXPECT_EQ(finding_title("explains-nothing"), "No predictive power");
  EXPECT_EQ(finding_title("not-known-here"), "Not known here");
  EXPECT_EQ(finding_title(""), "");
  ASSERT_NE(finding_kind("misfit"), nullptr);
  EXPECT_EQ(finding_kind("misfit")->trust, TrustEffect::may_withdraw);
  EXPECT_EQ(finding_kind("no-such-id"), nullptr);
}

TEST(FindingCatalogue, MakesThePage) {
  const auto page = findings_markdown();
  for (const auto& kind : finding_catalogue())
    EXPECT_NE(page.find("### " + std::string(kind.id) + "\n"), std::string::npos) << kind.id;
}

}  // namespace
}  // namespace resonid::diagnostics
