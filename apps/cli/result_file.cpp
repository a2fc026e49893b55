// SPDX-License-Identifier: MIT
#include "result_file.hpp"

#include <nlohmann/json.hpp>
#include <resonid/base/error_text.hpp>
#include <resonid/io/csv.hpp>
#include <resonid/io/detail/json_file.hpp>
#include <resonid/report/json.hpp>

#include "errors.hpp"
#include "output.hpp"

namespace resonid::cli {

identification::Result read_result(const std::string& path, const std::string& option) {
  const std::string named = option.empty() ? "" : option + ": ";
  const auto json = io::read_json(path);
  if (!json) throw InputError(named + message_of(json.error()));
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
  write_output(path, io::response_csv(result.response, columns));
}

}  // namespace resonid::cli
