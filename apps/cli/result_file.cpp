// SPDX-License-Identifier: MIT
#include "result_file.hpp"

#include <nlohmann/json.hpp>
#include <resonid/io/json_file.hpp>
#include <resonid/report/json.hpp>

#include "errors.hpp"

namespace resonid::cli {

identification::Result read_result(const std::string& path) {
  const auto json = io::read_json(path);
  if (!json) throw InputError(json.error().message);
  auto result = report::result_from_json(*json);
  if (!result)
    throw InputError(path + ": is no result of 'resonid identify --json'\n" + result.error().message());
  return std::move(*result);
}

}  // namespace resonid::cli
