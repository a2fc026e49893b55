// SPDX-License-Identifier: MIT
// TOML experiments: parsed, checked, and their errors explained.
#include <resonid/io/experiment.hpp>
#include <string_view>

#include "input_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace resonid;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  static_cast<void>(io::parse_experiment(text, "input"));
  static_cast<void>(io::parse_experiment(text, "input", 0.5));
  return 0;
}
