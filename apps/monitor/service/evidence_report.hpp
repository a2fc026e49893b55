// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <resonid/base/expected.hpp>
#include <resonid/io/record_reader.hpp>
#include <string>

#include "monitor/service/installation.hpp"

namespace resonid::monitor {

/// How evidence_report() reads the file.
[[nodiscard]] io::ColumnMapping evidence_columns(const InstalledAxis& axis);

/// Why there is no report, in the words of the command line.
struct NoReport {
  std::string text;
  bool lasts = true;  ///< The samples are so: to ask again does not help.
};

/// The page of `identify` over raw samples of an axis that the file ALARM.csv has (raw_csv()), as told for
/// the axis, with the version of the program and the command that makes it from the file as it is downloaded;
/// kept beside the file.
[[nodiscard]] expected<std::string, NoReport> evidence_report(const InstalledAxis& axis,
                                                              const std::filesystem::path& file,
                                                              const std::string& version);

}  // namespace resonid::monitor
