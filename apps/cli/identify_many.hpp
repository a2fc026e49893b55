// SPDX-License-Identifier: MIT
#pragma once

#include <CLI/App.hpp>
#include <resonid/identification/result.hpp>
#include <string>
#include <vector>

#include "record_options.hpp"

namespace resonid::cli {

/// Everything that `identify` takes.
struct IdentifyOptions {
  std::vector<std::string> records;
  RecordOptions record;
  MethodOptions method;
  std::string report, json, response, validate_on, save_profile;
  std::uint64_t jobs = 0;
  bool join = false;
  bool require_trusted = false;
};

/// The records that the arguments name: files as they are, folders as their CSV and MAT files in order.
[[nodiscard]] std::vector<std::string> expanded(const std::vector<std::string>& arguments);

/// Holds a result against the record of --validate-on, if one is given.
void validate_elsewhere(const CLI::App& verb, const IdentifyOptions& o, identification::Result& result);

/// Several records: one table, one JSON, one report; a broken file gets a row with its error.
void identify_many(const CLI::App& verb, const IdentifyOptions& o, const std::vector<std::string>& files);

}  // namespace resonid::cli
