// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <string_view>

#include "report/json/passes.hpp"

namespace resonid::report {

/// A kind of result file.
struct ResultFile {
  std::string name;     ///< "identification"
  std::string made_by;  ///< "Written by `resonid identify RECORD`"
  std::function<void(Fields&)> description;
};
[[nodiscard]] std::span<const ResultFile> result_files();
[[nodiscard]] const ResultFile& result_file(std::string_view name);

extern const std::string_view kResultsIntroduction;

}  // namespace resonid::report
