// SPDX-License-Identifier: MIT
#include "monitor/brokers/nats_subject.hpp"

#include <algorithm>
#include <cstddef>

namespace resonid::monitor {
namespace {

bool is_subject_character(char c) {
  const auto byte = static_cast<unsigned char>(c);
  return byte > ' ' && byte != 0x7F;
}

}  // namespace

bool is_subject_filter(std::string_view text) {
  std::size_t begin = 0;
  while (begin <= text.size()) {
    const std::size_t end = std::min(text.find('.', begin), text.size());
    const std::string_view token = text.substr(begin, end - begin);
    if (token.empty() || !std::all_of(token.begin(), token.end(), is_subject_character)) return false;
    if (token == ">" && end != text.size()) return false;
    begin = end + 1;
  }
  return true;
}

bool subject_matches(std::string_view filter, std::string_view subject) {
  if (filter.empty()) return true;
  while (true) {
    const std::size_t pattern_end = filter.find('.'), end = subject.find('.');
    const std::string_view pattern = filter.substr(0, pattern_end);
    if (pattern == ">") return !subject.empty();
    if (pattern != "*" && pattern != subject.substr(0, end)) return false;
    if (pattern_end == std::string_view::npos || end == std::string_view::npos) return pattern_end == end;
    filter.remove_prefix(pattern_end + 1);
    subject.remove_prefix(end + 1);
  }
}

bool is_stream_name(std::string_view text) {
  return !text.empty() && std::all_of(text.begin(), text.end(), [](char c) {
    return is_subject_character(c) && std::string_view(".*>/\\").find(c) == std::string_view::npos;
  });
}

}  // namespace resonid::monitor
