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

/// The page of `identify` over raw samples of an axis that a file holds (raw_csv()), as told for the axis,
/// with the version of the program and the command that makes it from the file; kept beside the file. Else
/// why there is none.
[[nodiscard]] expected<std::string, std::string> evidence_report(const InstalledAxis& axis,
                                                                 const std::filesystem::path& file,
                                                                 const std::string& version);

}  // namespace resonid::monitor
