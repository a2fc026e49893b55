// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <resonid/base/expected.hpp>
#include <resonid/io/error.hpp>
#include <resonid/plant/experiment.hpp>
#include <string_view>

namespace resonid::io {

/// Reads a simulated experiment from a TOML file with the tables [drive], [controller], [excitation],
/// [measurement] and [run]; their keys are the fields that describe() of each configuration names. A key that
/// is not known there, a wrong type and a value out of its range are errors that name file, line, column,
/// key, what was found and what is required.
[[nodiscard]] expected<plant::ExperimentConfig, Error> read_experiment(const std::filesystem::path& path);

/// As above for a text in memory; `source` stands for the file name in messages.
[[nodiscard]] expected<plant::ExperimentConfig, Error> parse_experiment(std::string_view text,
                                                                        std::string_view source);

}  // namespace resonid::io
