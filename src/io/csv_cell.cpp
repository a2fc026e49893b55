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
bool skip_date(std::string_view& text) {
  for (const char mark : {'-', '.', '/'}) {
    std::string_view rest = text;
    if (!take_digits(rest, 4) || !take(rest, mark) || !take_digits(rest, 2) || !take(rest, mark) ||
        !take_digits(rest, 4))
      continue;
    if (!take(rest, 'T')) skip_blanks(rest);
    text = rest;
    return true;
  }
  return false;
}

/// What may stand behind whole seconds: `.125`; false where a mark is not followed by a digit.
bool take_fraction(std::string_view& text, double& fraction) {
  if (!take(text, '.') && !take(text, ',') && !take(text, ':')) return true;
  if (text.empty() || !is_digit(text.front())) return false;
  for (double unit = 0.1; !text.empty() && is_digit(text.front()); text.remove_prefix(1), unit *= 0.1)
    fraction += unit * (text.front() - '0');
  return true;
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

bool is_without_hours(std::string_view text) noexcept {
  return std::count(text.begin(), text.end(), ':') == 1;
}

std::optional<double> parse_clock(std::string_view text) {
  constexpr std::size_t kHourDigits = 3, kMinuteDigits = 4;  // those of a run go on counting
  constexpr int kDay = 24, kHour = 60;
  const bool without_hours = is_without_hours(text);
  const bool dated = !without_hours && skip_date(text);
  const auto hour = without_hours ? std::optional(0) : take_digits(text, kHourDigits);
  if (!hour || (!without_hours && !take(text, ':'))) return std::nullopt;
  const auto minute = take_digits(text, without_hours ? kMinuteDigits : 2);
  if (!minute || !take(text, ':')) return std::nullopt;
  const std::size_t before = text.size();
  const auto second = take_digits(text, 2);
  const bool two_digits = before == text.size() + 2;
  if (!second || *second > 60 || (without_hours ? !two_digits : *minute >= kHour)) return std::nullopt;
  double fraction = 0.0;
  if (!take_fraction(text, fraction)) return std::nullopt;
  double hours = *hour;
  const bool of_a_day = dated || !text.empty();
  if ((of_a_day && (without_hours || *hour >= kDay)) || !take_ending(text, hours)) return std::nullopt;
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
