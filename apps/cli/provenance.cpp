// SPDX-License-Identifier: MIT
#include "provenance.hpp"

#include <fmt/format.h>

#include <charconv>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <resonid/io/detail/sha256.hpp>

namespace resonid::cli {
namespace {

std::string& command_line() {
  static std::string text;
  return text;
}

/// Seconds since 1970: those that a reproducible build asks for, else the clock's.
std::time_t now() {
  if (const char* epoch = std::getenv("SOURCE_DATE_EPOCH"); epoch != nullptr) {
    long long seconds = 0;
    const char* end = epoch + std::strlen(epoch);
    if (const auto [at, error] = std::from_chars(epoch, end, seconds); error == std::errc() && at == end)
      return static_cast<std::time_t>(seconds);
  }
  return std::chrono::system_clock::to_time_t(std::chrono::system_clock::now());
}

std::string date_text(std::time_t time) {
  std::tm utc{};
  char text[32] = "";
  if (gmtime_r(&time, &utc) != nullptr) std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &utc);
  return text;
}

}  // namespace

std::string shell_word(std::string_view word) {
  const auto plain = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
           std::strchr("_-+=.,:/@%", c) != nullptr;
  };
  bool simple = !word.empty();
  for (const char c : word) simple = simple && plain(c);
  if (simple) return std::string(word);
  std::string out = "'";
  for (const char c : word) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return out + "'";
}

void remember_command(const std::string& program, int argc, const char* const* argv) {
  std::string text = program;
  for (int i = 1; i < argc; ++i) text += " " + shell_word(argv[i]);
  command_line() = std::move(text);
}

report::Provenance provenance_of_files(const std::vector<std::string>& files) {
  report::Provenance p;
  p.version = RESONID_VERSION;
  p.command = command_line();
  p.date = date_text(now());
  for (const auto& file : files)
    if (!file.empty() && file != "-") p.files.push_back({file, io::sha256_of_file(file).value_or("")});
  return p;
}

}  // namespace resonid::cli
