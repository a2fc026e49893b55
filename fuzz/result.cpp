// SPDX-License-Identifier: MIT
// Results as JSON: what is read can be written, and reads the same.
#include <nlohmann/json.hpp>
#include <resonid/report/json.hpp>
#include <string>

#include "input_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace resonid;
  const auto json = nlohmann::json::parse(data, data + size, nullptr, false);
  if (json.is_discarded()) return 0;
  static_cast<void>(report::result_from_json(json));
  return 0;
}
