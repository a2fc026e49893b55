// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/identification/detail/tune_export.hpp>
#include <string>
#include <vector>

namespace resonid::cli {

/// FORMAT:FILE
struct TuneExport {
  identification::ExportFormat format;
  std::string file;
};

/// What --export was given; anything else ends as a UsageError.
[[nodiscard]] std::vector<TuneExport> exports_of(const std::vector<std::string>& texts);

}  // namespace resonid::cli
