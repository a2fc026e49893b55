// SPDX-License-Identifier: MIT
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <resonid/report/detail/typography.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace resonid::cli {

/// Where results go: `-` is standard output, everything else a file that appears complete or not at all.
void write_output(const std::string& path, std::string_view contents);
void write_json(const std::string& path, const nlohmann::json& value);

/// Refuses before long work what write_output() would refuse after it. Empty paths and `-` are left aside.
void refuse_unwritable(std::initializer_list<std::string_view> paths);

void print(std::string_view text);       ///< To standard output, as it is: what machines read.
void print_text(std::string_view text);  ///< What people read: typeset where they can read it (is_unicode).
void print_summary(std::string_view text);  ///< The same with the verdict in colour.
void print_error(std::string_view text);    ///< To standard error.

/// What print_text() writes in, for tables whose columns depend on it.
[[nodiscard]] report::Characters characters_of_text();

struct CsvColumn {
  std::string name;
  std::span<const double> values;
};
/// A header and one row per sample, ten significant digits.
[[nodiscard]] std::string csv_text(const std::vector<CsvColumn>& columns);

/// Refuses that a result would overwrite an input or another result.
void refuse_shared_files(const std::vector<std::string_view>& inputs,
                         const std::vector<std::pair<std::string_view, std::string_view>>& option_and_path);

/// Refuses that two results go to standard output; true when one does, or with -q: no summary must be
/// printed.
bool no_summary(const std::vector<std::pair<std::string_view, std::string_view>>& option_and_path);

}  // namespace resonid::cli
