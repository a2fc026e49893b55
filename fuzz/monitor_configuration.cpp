// SPDX-License-Identifier: MIT
// Configurations of the monitor: parsed, checked, written again, which must read as the same.
#include <string_view>

#include "input_file.hpp"
#include "monitor/service/configuration.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace resonid;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto file = monitor::parse_configuration(text, "input", "/tmp");
  for (const auto& error : file.findings.errors) fuzz::require(error.where.view().starts_with("input"));
  if (!file.usable()) return 0;
  const auto written = monitor::configuration_text(file.configuration);
  const auto again = monitor::parse_configuration(written, "input", "/tmp");
  fuzz::require(again.usable() && monitor::configuration_text(again.configuration) == written);
  return 0;
}
