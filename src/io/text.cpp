// SPDX-License-Identifier: MIT
#include "io/text.hpp"

#include <fmt/core.h>

#include <algorithm>

namespace resonid::io {
namespace {

char lower_case(char c) noexcept { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

/// Number of single-character changes that turn one text into the other (Levenshtein), without regard to
/// case.
std::size_t distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t change = diagonal + (lower_case(a[i]) == lower_case(b[j]) ? 0U : 1U);
      diagonal = row[j + 1];
      row[j + 1] = std::min({change, row[j] + 1, diagonal + 1});
    }
  }
  return row.back();
}

}  // namespace

std::string in_quotes(std::string_view text) {
  constexpr std::size_t kLongest = 40;
  std::string result = "'";
  for (const char c : text.substr(0, kLongest))
    result += static_cast<unsigned char>(c) < 0x20 || c == 0x7f ? '?' : c;
  if (text.size() > kLongest) result += "...";
  return result + "'";
}

std::string lower(std::string_view text) {
  std::string result(text);
  std::transform(result.begin(), result.end(), result.begin(), lower_case);
  return result;
}

std::string nearest(std::string_view wanted, const std::vector<std::string>& names) {
  std::string best;
  std::size_t smallest = std::max<std::size_t>(2, wanted.size() / 3) + 1;
  for (const auto& name : names) {
    const std::size_t d = distance(wanted, name);
    if (d >= smallest || d >= std::max(wanted.size(), name.size())) continue;
    smallest = d;
    best = name;
  }
  return best;
}

std::string listed(const std::vector<std::string>& names) {
  constexpr std::size_t kMost = 40;
  std::string result;
  for (std::size_t i = 0; i < std::min(kMost, names.size()); ++i) result += (i == 0 ? "" : ", ") + names[i];
  if (names.size() > kMost) result += fmt::format(" and {} more", names.size() - kMost);
  return result;
}

}  // namespace resonid::io
