// SPDX-License-Identifier: MIT
#include "report/document/words.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace resonid::report {

std::string with_error(double value, double half_width) {
  if (!(half_width > 0.0) || !std::isfinite(half_width)) return fmt::format("{:.5g}", value);
  const int decimals = 1 - static_cast<int>(std::floor(std::log10(half_width)));
  if (decimals < 0 || decimals > 6 || std::abs(value) < 1e-3 || std::abs(value) >= 1e5) {
    constexpr int kMostDigits = 8;  // what is known better than that is a bound of the fit, not a figure
    const int digits = std::clamp(2 + static_cast<int>(std::floor(std::log10(std::abs(value) / half_width))),
                                  2, kMostDigits);
    return fmt::format("{:.{}g} +- {:.2g}", value, digits, half_width);
  }
  return fmt::format("{:.{}f} +- {:.{}f}", value, decimals, half_width, decimals);
}

std::string interval_text(double low, double high) {
  const double half = 0.5 * std::abs(high - low);
  if (half > 0.0 && std::isfinite(half)) {
    const int decimals = 1 - static_cast<int>(std::floor(std::log10(half)));
    if (decimals >= 0 && decimals <= 6)
      return fmt::format("{:.{}f} ... {:.{}f}", low, decimals, high, decimals);
  }
  return fmt::format("{:.4g} ... {:.4g}", low, high);
}

std::string reading_text(const std::vector<std::string>& reading) {
  if (reading.empty()) return {};
  return wrapped(fmt::format("read: {}", fmt::join(reading, "; ")), "  ", "    ") + "\n";
}

std::string wrapped(const std::string& text, const std::string& first, const std::string& indent) {
  constexpr std::size_t kWidth = 100;
  std::string out = first;
  std::size_t column = first.size(), start = 0;
  while (start < text.size()) {
    const std::size_t end = std::min(text.find(' ', start), text.size());
    const std::size_t length = end - start;
    if (start > 0 && column + 1 + length > kWidth) {
      out += "\n" + indent;
      column = indent.size();
    } else if (start > 0) {
      out += ' ';
      ++column;
    }
    out.append(text, start, length);
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
