// SPDX-License-Identifier: MIT
#pragma once

#include <CLI/App.hpp>
#include <cstdint>
#include <string>

namespace resonid::cli {

struct ReproduceOptions {
  std::string name, out, report, markdown, json;
  std::uint64_t seeds = 20;
};

/// The options of `reproduce`, for the program that does it and for the one that lists it.
void add_reproduce_options(CLI::App& verb, ReproduceOptions& o);

}  // namespace resonid::cli
