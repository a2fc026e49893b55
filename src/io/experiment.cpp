// SPDX-License-Identifier: MIT
#include <fstream>
#include <iterator>
#include <resonid/io/experiment.hpp>

#include "io/text.hpp"
#include "io/toml_text.hpp"
#include "io/toml_visitor.hpp"

namespace resonid::io {
expected<plant::ExperimentConfig, Error> parse_experiment(std::string_view text, std::string_view source,
                                                          std::optional<double> duration_s) {
  const auto file = parse_toml(text, source);
  if (!file) return unexpected(file.error());
  auto read = read_described<plant::ExperimentConfig>(*file, source);
  if (!read) return unexpected(read.error());
  plant::ExperimentConfig& config = *read;
  if (duration_s) config.run.duration_s = *duration_s;
  const auto ok = plant::check(config);
  if (ok) return config;
  const auto& refused = ok.error();
  if (duration_s && refused.field == "run.duration_s")
    return fail(std::string(source),
                fmt::format("with a duration of {:g} s: {}", *duration_s, refused.requirement.view()));
  return unexpected(placed(*file, source, refused));
}

Error explain_experiment(std::string_view text, std::string_view source, const Error& error) {
  const auto file = parse_toml(text, source);
  return file ? placed(*file, source, error) : file.error();
}

expected<std::string, Error> read_experiment_text(const std::filesystem::path& path) {
  std::error_code code;
  if (std::filesystem::is_directory(path, code))
    return fail(path.string(), "is a folder, required a TOML file");
  std::ifstream file(path, std::ios::binary);
  if (!file) return fail(path.string(), "cannot be opened: no such file, or no permission to read it");
  return std::string{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

expected<plant::ExperimentConfig, Error> read_experiment(const std::filesystem::path& path) {
  const auto text = read_experiment_text(path);
  if (!text) return unexpected(text.error());
  return parse_experiment(*text, path.string());
}

}  // namespace resonid::io
