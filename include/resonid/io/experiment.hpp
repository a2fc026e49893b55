// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <optional>
#include <resonid/base/expected.hpp>
#include <resonid/plant/experiment.hpp>
#include <string>
#include <string_view>

namespace resonid::io {

/// Reads a simulated experiment from a TOML file (docs/experiment_files.md; see experiment_schema()). Its
/// tables and keys are the fields that describe() of each configuration names. A key that is not known there,
/// a wrong type, a value out of its range and whatever plant::check() refuses are errors of one line that
/// name file, line, column, key, what was found and what is required.
[[nodiscard]] expected<plant::ExperimentConfig, Error> read_experiment(const std::filesystem::path& path);

/// As above for a text in memory; `source` stands for the file name in messages. `duration_s` replaces that
/// of the file.
[[nodiscard]] expected<plant::ExperimentConfig, Error> parse_experiment(
    std::string_view text, std::string_view source, std::optional<double> duration_s = {});

[[nodiscard]] expected<std::string, Error> read_experiment_text(const std::filesystem::path& path);

/// Where in the file a refused value stands, and why it was refused, in one line.
[[nodiscard]] Error explain_experiment(std::string_view text, std::string_view source, const Error& error);

}  // namespace resonid::io
