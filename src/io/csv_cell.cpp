// SPDX-License-Identifier: MIT
#include "io/csv_cell.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "io/csv_number.hpp"
#include "io/text.hpp"

namespace resonid::io {
namespace {

constexpr std::array<std::string_view, 21> kMissing = {
    "nan", "-nan", "nan(ind)", "-nan(ind)", "1.#qnan", "-1.#ind", "#nv", "#n/v", "#n/a", "#na",   "n/a",
    "na",  "n.a.", "null",     "none",      "nil",     "-",       "--",  "---",  "?",    "#wert!"};

/// Digits at the beginning, at most `most`; removes them.
std::optional<int> take_digits(std::string_view& text, std::size_t most) {
  std::size_t count = 0;
  int value = 0;
  while (count < most && count < text.size() && is_digit(text[count]))
    value = 10 * value + (text[count++] - '0');
  if (count == 0) return std::nullopt;
  text.remove_prefix(count);
  return value;
}

bool take(std::string_view& text, char c) {
  if (text.empty() || text.front() != c) return false;
  text.remove_prefix(1);
  return true;
}

void skip_blanks(std::string_view& text) {
  while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
}

/// A date in front, three numbers with the same mark between them; left as it is where there is none.
void skip_date(std::string_view& text) {
  for (const char mark : {'-', '.', '/'}) {
    std::string_view rest = text;
    if (!take_digits(rest, 4) || !take(rest, mark) || !take_digits(rest, 2) || !take(rest, mark) ||
        !take_digits(rest, 4))
      continue;
    if (!take(rest, 'T')) skip_blanks(rest);
    text = rest;
    return;
  }
}

/// What may stand behind the seconds: AM or PM, a zone. False for anything else.
bool take_ending(std::string_view text, double& hours) {
  skip_blanks(text);
  const std::string ending = lower(text);
  if (ending.empty() || ending == "z") return true;
  if (ending == "am" || ending == "pm") {
    if (!(hours >= 1.0 && hours < 13.0)) return false;
    hours = std::fmod(hours, 12.0) + (ending == "pm" ? 12.0 : 0.0);
    return true;
  }
  if (text.front() != '+' && text.front() != '-') return false;
  text.remove_prefix(1);
  return take_digits(text, 2) && (take(text, ':') || true) && take_digits(text, 2) && text.empty();
}

}  // namespace

bool says_missing(std::string_view text) noexcept {
  if (text.empty()) return true;
  if (text.size() > 9 || (is_digit(text.front()) && text.front() != '1')) return false;
  const std::string word = lower(text);
  return std::find(kMissing.begin(), kMissing.end(), word) != kMissing.end();
}

std::optional<double> parse_clock(std::string_view text) {
  skip_date(text);
  const auto hour = take_digits(text, 2);
  if (!hour || !take(text, ':')) return std::nullopt;
  const auto minute = take_digits(text, 2);
  if (!minute || !take(text, ':')) return std::nullopt;
  const auto second = take_digits(text, 2);
  if (!second || *hour > 23 || *minute > 59 || *second > 60) return std::nullopt;
  double fraction = 0.0;
  if (take(text, '.') || take(text, ',') || take(text, ':')) {
    double unit = 0.1;
    if (text.empty() || !is_digit(text.front())) return std::nullopt;
    for (; !text.empty() && is_digit(text.front()); text.remove_prefix(1), unit *= 0.1)
      fraction += unit * (text.front() - '0');
  }
  double hours = *hour;
  if (!take_ending(text, hours)) return std::nullopt;
  return 3600.0 * hours + 60.0 * *minute + *second + fraction;
}

std::optional<double> parse_decimal(std::string_view text, char decimal) {
  std::string padded(text);
  padded.append(kNumberPadding, '\0');
  double value = 0.0;
  if (parse_number(padded.data(), padded.data() + text.size(), value, decimal) != padded.data() + text.size())
    return std::nullopt;
  return value;
}

Cell read_cell(std::string_view text, char decimal) {
  if (const auto number = parse_decimal(text, decimal)) return {Cell::Kind::number, *number};
  if (says_missing(text)) return {Cell::Kind::missing, std::numeric_limits<double>::quiet_NaN()};
  if (const auto clock = parse_clock(text)) return {Cell::Kind::clock, *clock};
  return {Cell::Kind::text, std::numeric_limits<double>::quiet_NaN()};
}

}  // namespace resonid::io
