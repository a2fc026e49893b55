// SPDX-License-Identifier: MIT
// Text records: the table, and the record that is made of it.
#include <cmath>
#include <resonid/io/record_reader.hpp>

#include "input_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace resonid;
  const fuzz::InputFile file(data, size);
  const auto table = io::read_csv(file.path());
  if (!table) return 0;
  fuzz::require(table->names.size() == table->columns.size() && !table->columns.empty());
  for (const auto& column : table->columns) {
    fuzz::require(column.size() == table->columns.front().size());
    for (const double x : column) fuzz::require(!std::isinf(x));
  }
  const auto record = io::to_record(*table, {});
  fuzz::require(!record || record->sample_rate_hz > 0.0);
  io::ColumnMapping differences;
  differences.sample_rate_hz = 1000.0;
  differences.time = "none";
  differences.input = table->names.front();
  differences.output = table->names.back();
  differences.output_quantity = data::OutputQuantity::position;
  differences.differentiate = true;
  static_cast<void>(io::to_record(*table, differences));
  return 0;
}
