// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <resonid/data/record.hpp>
#include <resonid/identification/detail/inspect.hpp>
#include <resonid/report/detail/document.hpp>
#include <resonid/report/json.hpp>
#include <string>
#include <vector>

namespace resonid::report {

/// A file as `inspect` shows it: its columns, and what the recording in it holds.
struct FileInspection {
  struct Column {
    std::string name, unit;
    std::string guess;  ///< What it seems to hold; empty: nothing known.
    std::size_t missing = 0;
    double least = 0.0, greatest = 0.0;
  };
  std::string file;
  std::size_t rows = 0;
  std::vector<std::string> reading;  ///< How the file was read.
  std::vector<Column> columns;
  std::string obstacle;  ///< Why no recording could be made of it; empty when one could.
  std::optional<identification::Inspection> recording;
  std::string command;  ///< To go on with.
};

[[nodiscard]] std::string summary_text(const FileInspection& inspection);

/// The page of `inspect --report`: columns, signals and their spectra.
[[nodiscard]] Document document(const FileInspection& inspection, const data::Record* record);

[[nodiscard]] nlohmann::json to_json(const FileInspection& inspection);
template <>
expected<FileInspection> from_json(const nlohmann::json& json);

}  // namespace resonid::report
