// SPDX-License-Identifier: MIT
#include "result_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>
#include <resonid/base/error_text.hpp>
#include <resonid/io/csv.hpp>
#include <resonid/io/detail/json_file.hpp>
#include <resonid/report/json.hpp>
#include <vector>

#include "errors.hpp"
#include "output.hpp"

namespace resonid::cli {

namespace {

/// Whose results a file holds that has several, and no joint one.
std::vector<std::string> records_of_batch(const nlohmann::json& json) {
  std::vector<std::string> files;
  const auto text = [](const nlohmann::json& object, const char* key) {
    const auto found = object.is_object() ? object.find(key) : object.end();
    return object.is_object() && found != object.end() && found->is_string() ? found->get<std::string>()
                                                                             : std::string();
  };
  if (!text(json, "schema").starts_with("resonid.identifications/") || json.contains("joint")) return files;
  if (const auto results = json.find("results"); results != json.end() && results->is_array())
    for (const auto& result : *results) files.push_back(text(result, "file"));
  return files;
}

}  // namespace

identification::Result read_result(const std::string& path, const std::string& option) {
  const std::string named = option.empty() ? "" : option + ": ";
  const auto json = io::read_json(path);
  if (!json) throw InputError(named + message_of(json.error()));
  if (const auto records = records_of_batch(*json); !records.empty())
    throw InputError(
        fmt::format("{}{}: holds a result for each of {}, required one: identify each by itself "
                    "with --json FILE, or all together with --join",
                    named, path, fmt::join(records, ", ")));
  auto result = report::from_json<identification::Result>(*json);
  if (!result)
    throw InputError(named + path + ": is no result of 'resonid identify --json'\n" +
                     message_of(result.error()));
  return std::move(*result);
}

void write_response(const std::string& path, const identification::Result& result) {
  std::vector<io::ResponseColumn> columns;
  if (result.distortion && result.distortion->realisations > 0)
    columns = {{"noise_std", result.distortion->noise_std},
               {"distortion_std", result.distortion->distortion_std}};
  if (const auto& second = result.second_output) {  // on the output's lines; not a number where it has none
    const auto& g = second->response;
    const auto column = [&](auto&& of) {
      std::vector<double> values;
      for (const double f : result.response.frequency_hz) {
        const auto at = std::lower_bound(g.frequency_hz.begin(), g.frequency_hz.end(), f);
        const bool there = at != g.frequency_hz.end() && *at == f;
        values.push_back(there ? of(static_cast<std::size_t>(at - g.frequency_hz.begin()))
                               : std::numeric_limits<double>::quiet_NaN());
      }
      return values;
    };
    columns.push_back({"load_real", column([&](std::size_t i) { return g.value[i].real(); })});
    columns.push_back({"load_imag", column([&](std::size_t i) { return g.value[i].imag(); })});
    columns.push_back({"load_std", column([&](std::size_t i) { return g.std[i]; })});
    columns.push_back({"load_coherence", column([&](std::size_t i) { return g.coherence[i]; })});
  }
  write_output(path, io::response_csv(result.response, columns));
}

}  // namespace resonid::cli
