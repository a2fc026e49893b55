// SPDX-License-Identifier: MIT
#include <fmt/core.h>

#include <charconv>
#include <cmath>
#include <resonid/io/detail/number_list.hpp>

#include "io/text.hpp"

namespace resonid::io {
namespace {

std::vector<std::string_view> split(std::string_view text, char separator) {
  std::vector<std::string_view> parts;
  while (true) {
    const auto end = text.find(separator);
    parts.push_back(text.substr(0, end));
    if (end == std::string_view::npos) return parts;
    text.remove_prefix(end + 1);
  }
}

expected<std::vector<double>, Error> numbers(std::string_view text, char separator, std::string_view form) {
  std::vector<double> values;
  for (const auto part : split(text, separator)) {
    const auto value = parse_number(part);
    if (!value) return fail(fmt::format("found {}, required {}", in_quotes(text), form));
    values.push_back(*value);
  }
  return values;
}

}  // namespace

std::optional<double> parse_number(std::string_view text) noexcept {
  const auto first = text.find_first_not_of(" \t");
  if (first == std::string_view::npos) return std::nullopt;
  text = text.substr(first, text.find_last_not_of(" \t") + 1 - first);
  if (text.front() == '+') text.remove_prefix(1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

expected<std::vector<double>, Error> parse_lines(std::string_view text) {
  constexpr std::string_view kForm = "FIRST:LAST:STEP or a list F,F,F in Hz";
  constexpr double kMost = 1e5;
  if (text.find(':') == std::string_view::npos) return numbers(text, ',', kForm);
  const auto range = numbers(text, ':', kForm);
  if (!range) return range;
  if (range->size() != 3) return fail(fmt::format("found {}, required {}", in_quotes(text), kForm));
  const double first = (*range)[0];
  const double last = (*range)[1];
  const double step = (*range)[2];
  if (!(step > 0.0 && last >= first))
    return fail(
        fmt::format("found {}, which holds no line; required FIRST:LAST:STEP with FIRST <= LAST and STEP > 0",
                    in_quotes(text)));
  const double count = std::floor((last - first) / step + 1e-9) + 1.0;
  if (!(count <= kMost))
    return fail(fmt::format("found {}, which are {} lines; at most 100000", in_quotes(text), count));
  std::vector<double> lines(static_cast<std::size_t>(count));
  for (std::size_t i = 0; i < lines.size(); ++i) lines[i] = first + step * static_cast<double>(i);
  return lines;
}

expected<std::vector<double>, Error> parse_colons(std::string_view text, std::size_t count,
                                                  std::string_view form) {
  auto values = numbers(text, ':', form);
  if (values && values->size() != count)
    return fail(fmt::format("found {}, required {}", in_quotes(text), form));
  return values;
}

}  // namespace resonid::io
