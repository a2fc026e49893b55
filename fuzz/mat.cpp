// SPDX-License-Identifier: MIT
// MAT files of all versions. matio and HDF5 are not instrumented: what they get wrong shows as a crash, or in
// memory that this process allocated.
#include <cmath>
#include <resonid/io/record_reader.hpp>

#include "input_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace resonid;
  const fuzz::InputFile file(data, size);
  const auto table = io::read_mat(file.path());
  if (!table) return 0;
  fuzz::require(table->names.size() == table->columns.size() && !table->columns.empty());
  for (const auto& column : table->columns)
    for (const double x : column) fuzz::require(!std::isinf(x));
  static_cast<void>(io::to_record(*table, {}));
  return 0;
}
