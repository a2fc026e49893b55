// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/identification/tune_export.hpp>
#include <resonid/io/controller_file.hpp>
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

/// What people call a controller by the structure that its file tells and the order of its transfer function:
/// "PI + 2 biquads", "RST"; empty for a structure that no writer of ours tells.
[[nodiscard]] std::string name_of_structure(const std::string& structure, std::size_t order);

/// Puts what a controller file is made of into what was judged of it; false where its numerator and
/// denominator are others.
[[nodiscard]] bool put_parts(const io::ControllerFile& file, identification::TunedController& judged);

}  // namespace resonid::cli
