// SPDX-License-Identifier: MIT
// The data that a page carries.
#pragma once
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

namespace resonid::report {

inline constexpr const char* kOpen = R"(<script type="application/json" id="data">)";

/// The data as a browser hands it to the page: all up to the first end of its script element.
inline std::string carried_text(const std::string& html) {
  const std::size_t from = html.find(kOpen);
  EXPECT_NE(from, html.npos);
  const std::size_t begin = from + std::string(kOpen).size();
  return html.substr(begin, html.find("</script", begin) - begin);
}

inline nlohmann::json carried(const std::string& html) { return nlohmann::json::parse(carried_text(html)); }

inline std::size_t count(const std::string& text, const std::string& part) {
  std::size_t n = 0;
  for (std::size_t at = text.find(part); at != text.npos; at = text.find(part, at + 1)) ++n;
  return n;
}

}  // namespace resonid::report
