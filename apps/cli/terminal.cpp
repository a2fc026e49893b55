// SPDX-License-Identifier: MIT
#include "terminal.hpp"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cstdlib>
#include <utility>

namespace resonid::cli {
namespace {

constexpr std::size_t kNarrowest = 40, kWidest = 100, kUsual = 80;

std::string_view environment(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? std::string_view() : std::string_view(value);
}

std::size_t terminal_columns() {
  const auto told = environment("COLUMNS");
  std::size_t columns = 0;
  const auto [end, error] = std::from_chars(told.data(), told.data() + told.size(), columns);
  if (error == std::errc() && end == told.data() + told.size() && columns > 0) return columns;
  ::winsize size{};
  if (::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0) return size.ws_col;
  return kUsual;
}

/// What a line of a summary that tells the verdict begins with.
constexpr std::array<std::pair<std::string_view, Paint>, 8> kVerdicts = {{
    {"Trusted", Paint::good},
    {"NOT trusted", Paint::bad},
    {"Not trusted", Paint::bad},
    {"Joint estimate: trusted", Paint::good},
    {"Joint estimate: NOT trusted", Paint::bad},
    {"Accepted", Paint::good},
    {"Doubtful", Paint::doubtful},
    {"Rejected", Paint::bad},
}};

}  // namespace

OutputSettings& output_settings() noexcept {
  static OutputSettings settings;
  return settings;
}

std::size_t text_width() { return std::clamp(terminal_columns(), kNarrowest, kWidest); }

bool is_screen(int stream) { return ::isatty(stream) != 0 && environment("TERM") != "dumb"; }

bool is_unicode() {
  if (output_settings().ascii) return false;
  for (const char* name : {"LC_ALL", "LC_CTYPE", "LANG"}) {
    std::string locale(environment(name));
    if (locale.empty()) continue;
    std::transform(locale.begin(), locale.end(), locale.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return locale.find("utf-8") != std::string::npos || locale.find("utf8") != std::string::npos;
  }
  return false;
}

bool is_coloured(int stream) {
  switch (output_settings().colour) {
    case When::always:
      return true;
    case When::never:
      return false;
    case When::automatic:
      break;
  }
  return is_screen(stream) && environment("NO_COLOR").empty();
}

std::string painted(std::string_view text, Paint paint, int stream) {
  if (!is_coloured(stream)) return std::string(text);
  constexpr std::array<std::string_view, 4> kCodes = {"\x1b[1m", "\x1b[1;32m", "\x1b[1;33m", "\x1b[1;31m"};
  return std::string(kCodes[static_cast<std::size_t>(paint)]) + std::string(text) + "\x1b[0m";
}

std::string with_painted_verdict(std::string_view summary, int stream) {
  if (!is_coloured(stream)) return std::string(summary);
  std::string text;
  while (!summary.empty()) {
    const auto end = std::min(summary.find('\n'), summary.size());
    const auto line = summary.substr(0, end);
    const auto verdict = std::find_if(kVerdicts.begin(), kVerdicts.end(),
                                      [&](const auto& v) { return line.starts_with(v.first); });
    text += verdict == kVerdicts.end() ? std::string(line) : painted(line, verdict->second, stream);
    if (end < summary.size()) text += '\n';
    summary.remove_prefix(std::min(end + 1, summary.size()));
  }
  return text;
}

std::size_t columns_of(std::string_view text) {
  return static_cast<std::size_t>(std::count_if(
      text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U; }));
}

std::vector<std::string> wrapped_lines(std::string_view text, std::size_t width) {
  std::vector<std::string> lines;
  std::string line;
  while (!text.empty()) {
    const auto end = std::min(text.find(' '), text.size());
    const auto word = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    if (word.empty()) continue;
    if (!line.empty() && columns_of(line) + 1 + columns_of(word) > width)
      lines.push_back(std::exchange(line, {}));
    if (!line.empty()) line += ' ';
    line += word;
  }
  if (!line.empty()) lines.push_back(std::move(line));
  return lines;
}

std::string wrapped(std::string_view text, std::size_t width, std::string_view first, std::string_view indent,
                    std::string_view line_end) {
  const std::size_t taken = std::max(columns_of(first), columns_of(indent)) + columns_of(line_end);
  const auto lines = wrapped_lines(text, width > taken ? width - taken : 1);
  std::string out;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    out += i == 0 ? first : indent;
    out += lines[i];
    out += i + 1 < lines.size() ? line_end : std::string_view();
    out += '\n';
  }
  return out;
}

}  // namespace resonid::cli
