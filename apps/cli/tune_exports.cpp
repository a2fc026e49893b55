// SPDX-License-Identifier: MIT
#include "tune_exports.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <resonid/io/detail/suggestion.hpp>

#include "errors.hpp"

namespace resonid::cli {

std::vector<TuneExport> exports_of(const std::vector<std::string>& texts) {
  std::vector<std::string> known;
  for (const auto& format : enum_names(identification::ExportFormat{})) known.emplace_back(format.name);
  std::vector<TuneExport> list;
  for (const auto& text : texts) {
    const auto colon = text.find(':');
    const std::string format = text.substr(0, colon);
    const auto found = std::find(known.begin(), known.end(), format);
    if (colon == std::string::npos || colon + 1 == text.size() || found == known.end())
      throw UsageError(fmt::format("--export: found '{}', required FORMAT:FILE with one of {}{}", text,
                                   fmt::join(known, ", "),
                                   found == known.end() ? io::suggestion(format, known) : std::string()));
    list.push_back(
        {enum_names(identification::ExportFormat{})[static_cast<std::size_t>(found - known.begin())].value,
         text.substr(colon + 1)});
  }
  return list;
}

std::string name_of_structure(const std::string& structure, std::size_t order) {
  if (structure == "pi+biquads") {  // an order of one and of two for each filter
    const std::size_t count = order / 2;
    if (count == 0 || order % 2 == 0) return {};
    return fmt::format("PI + {} biquad{}", count, count == 1 ? "" : "s");
  }
  if (structure == "pid") return "PID";
  if (structure == "rst") return "RST";
  return structure == "state-feedback" ? "State feedback" : "";
}

}  // namespace resonid::cli
