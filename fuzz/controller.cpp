// SPDX-License-Identifier: MIT
// Controllers: a JSON file, and the short form pi:KP,TI of the command line.
#include <cmath>
#include <resonid/io/controller_file.hpp>

#include "input_file.hpp"

namespace {

template <class Controller>
void check(const Controller& controller) {
  if (!controller) return;
  resonid::fuzz::require(!controller->denominator.empty() && controller->denominator.front() != 0.0);
  for (const auto* coefficients : {&controller->numerator, &controller->denominator})
    for (const double x : *coefficients) resonid::fuzz::require(std::isfinite(x));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace resonid;
  const fuzz::InputFile file(data, size);
  check(io::read_controller(file.path(), 0.004));
  check(io::read_controller("pi:" + std::string(reinterpret_cast<const char*>(data), size), 0.004));
  return 0;
}
