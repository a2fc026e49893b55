// SPDX-License-Identifier: MIT
#include "report/document/words.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace resonid::report {

std::string interval_text(double low, double high) {
  const double half = 0.5 * std::abs(high - low);
  if (half > 0.0 && std::isfinite(half)) {
    const int decimals = 1 - static_cast<int>(std::floor(std::log10(half)));
    if (decimals >= 0 && decimals <= 6)
      return fmt::format("{:.{}f} ... {:.{}f}", low, decimals, high, decimals);
  }
  return fmt::format("{:.4g} ... {:.4g}", low, high);
}

std::size_t columns_of(std::string_view text) {
  return static_cast<std::size_t>(std::count_if(
      text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U; }));
}

std::string quantity_words(std::string name, std::string_view unit) {
  for (const std::string_view suffix : {"_hz", "_deg", "_db"})
    if (name.ends_with(suffix)) name.resize(name.size() - suffix.size());
  std::replace(name.begin(), name.end(), '_', ' ');
  constexpr std::pair<std::string_view, std::string_view> kWords[] = {
      {"driven ", "motor "}, {"antiresonance", "anti-resonance"}, {"coulomb friction", "dry friction"}};
  for (const auto& [ours, said] : kWords)
    if (const auto at = name.find(ours); at != std::string::npos) name.replace(at, ours.size(), said);
  constexpr std::string_view kInertia = "inertia";
  if (unit == "kg" && name.ends_with(kInertia))
    name.replace(name.size() - kInertia.size(), kInertia.size(), "mass");
  return name;
}

std::string reading_text(const std::vector<std::string>& reading) {
  if (reading.empty()) return {};
  return wrapped(fmt::format("read: {}", fmt::join(reading, "; ")), "  ", "    ") + "\n";
}

namespace {

/// Where the next line may break: not between a figure, its deviation and the sign of per cent.
std::size_t end_of_word(std::string_view text, std::size_t start) {
  auto end = std::min(text.find(' ', start), text.size());
  while (end < text.size()) {
    const auto next = text.substr(end + 1);
    const bool after_sign = end >= 2 && text.substr(end - 2, 2) == "+-";
    if (!after_sign && !next.starts_with("+- ") && !next.starts_with('%')) break;
    end = std::min(text.find(' ', end + 1), text.size());
  }
  return end;
}

}  // namespace

std::string wrapped(const std::string& text, const std::string& first, const std::string& indent,
                    std::size_t columns) {
  std::string out = first;
  std::size_t column = columns_of(first), start = 0;
  while (start < text.size()) {
    const std::size_t end = end_of_word(text, start);
    const std::size_t length = columns_of(std::string_view(text).substr(start, end - start));
    if (start > 0 && column + 1 + length > columns) {
      out += "\n" + indent;
      column = columns_of(indent);
    } else if (start > 0) {
      out += ' ';
      ++column;
    }
    out.append(text, start, end - start);
    column += length;
    start = end + 1;
  }
  return out;
}

std::string_view word_of(diagnostics::Severity severity) {
  return severity == diagnostics::Severity::info ? "note" : name_of(severity);
}

std::string findings_text(const std::vector<diagnostics::Finding>& findings) {
  std::string text;
  for (const auto& f : findings) {
    if (f.follows) continue;
    const auto mark = f.severity == diagnostics::Severity::error ? "ERROR" : word_of(f.severity);
    text += wrapped(fmt::format("{}: {} ({})", mark, f.meaning, f.id), "  ", "    ") + "\n";
  }
  return text.empty() ? text : "\nFindings\n" + text;
}

}  // namespace resonid::report
