// SPDX-License-Identifier: MIT
#include "output.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <iterator>
#include <nlohmann/json.hpp>
#include <resonid/base/error_text.hpp>
#include <resonid/io/detail/atomic_file.hpp>
#include <vector>

#include "errors.hpp"
#include "progress.hpp"
#include "terminal.hpp"

namespace resonid::cli {
namespace {

void put(std::FILE* stream, std::string_view text) {
  if (std::fwrite(text.data(), 1, text.size(), stream) != text.size() || std::fflush(stream) != 0)
    throw std::runtime_error("standard output cannot be written");
}

}  // namespace

void print(std::string_view text) {
  finish_progress();
  put(stdout, text);
}

report::Characters characters_of_text() {
  return is_unicode() ? report::Characters::unicode : report::Characters::ascii;
}

void print_text(std::string_view text) { is_unicode() ? print(report::typeset(text)) : print(text); }

void print_summary(std::string_view text) { print_text(with_painted_verdict(text, STDOUT_FILENO)); }

void print_error(std::string_view text) { std::fwrite(text.data(), 1, text.size(), stderr); }

void write_output(const std::string& path, std::string_view contents) {
  if (path == "-") return print(contents);
  if (const auto written = io::write_file_atomically(path, contents); !written)
    throw std::runtime_error(message_of(written.error()));
}

void refuse_unwritable(std::initializer_list<std::string_view> paths) {
  for (const auto path : paths) {
    if (path.empty() || path == "-") continue;
    if (const auto writable = io::check_writable(path); !writable)
      throw std::runtime_error(message_of(writable.error()));
  }
}

void write_json(const std::string& path, const nlohmann::json& value) {
  write_output(path, value.dump(1) + "\n");
}

std::string csv_text(const std::vector<CsvColumn>& columns) {
  fmt::memory_buffer text;
  const auto out = std::back_inserter(text);
  for (std::size_t i = 0; i < columns.size(); ++i)
    fmt::format_to(out, "{}{}", i == 0 ? "" : ",", columns[i].name);
  text.push_back('\n');
  for (std::size_t k = 0; k < columns.front().values.size(); ++k) {
    for (std::size_t i = 0; i < columns.size(); ++i) {
      if (i > 0) text.push_back(',');
      fmt::format_to(out, "{:.10g}", columns[i].values[k]);
    }
    text.push_back('\n');
  }
  return fmt::to_string(text);
}

bool no_summary(const std::vector<std::pair<std::string_view, std::string_view>>& option_and_path) {
  std::string_view taken;
  for (const auto& [option, path] : option_and_path) {
    if (path != "-") continue;
    if (!taken.empty())
      throw UsageError(fmt::format("{} and {} cannot both be standard output", taken, option));
    taken = option;
  }
  return !taken.empty() || output_settings().quiet;
}

void refuse_shared_files(const std::vector<std::string_view>& inputs,
                         const std::vector<std::pair<std::string_view, std::string_view>>& option_and_path) {
  const auto canonical = [](std::string_view path) {
    std::error_code ignored;
    // Absolute first: of a relative path only the part that exists would be made so.
    return std::filesystem::weakly_canonical(std::filesystem::absolute(path, ignored), ignored);
  };
  std::vector<std::pair<std::string, std::filesystem::path>> taken;
  for (const auto input : inputs) taken.emplace_back("the input", canonical(input));
  for (const auto& [option, path] : option_and_path) {
    if (path.empty() || path == "-" || path.starts_with("/dev/")) continue;
    const auto file = canonical(path);
    for (const auto& [owner, other] : taken)
      if (file == other)
        throw UsageError(std::string(option) + ": '" + std::string(path) + "' is " + owner +
                         " too; required: a file of its own");
    taken.emplace_back("the file of " + std::string(option), file);
  }
}

}  // namespace resonid::cli
