// SPDX-License-Identifier: MIT
#include "stored_result.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <resonid/base/error_text.hpp>
#include <resonid/io/detail/json_file.hpp>
#include <resonid/report/json.hpp>
#include <string>
#include <vector>

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

expected<identification::Result> stored_result(const std::filesystem::path& path) {
  const auto json = io::read_json(path);
  if (!json) return unexpected(json.error());
  const auto refused = [&](std::string requirement) {
    return unexpected(Error{{}, std::move(requirement), std::nan(""), path.string()});
  };
  if (const auto records = records_of_batch(*json); !records.empty())
    return refused(fmt::format(
        "holds a result for each of {}, required one: identify each by itself with --json FILE, or "
        "all together with --join",
        fmt::join(records, ", ")));
  auto result = report::from_json<identification::Result>(*json);
  if (!result) return refused("is no result of 'resonid identify --json'\n" + message_of(result.error()));
  return std::move(*result);
}

}  // namespace resonid::cli
