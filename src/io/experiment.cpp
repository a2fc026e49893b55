// SPDX-License-Identifier: MIT
#include <fstream>
#include <iterator>
#include <resonid/io/experiment.hpp>

#include "io/toml_visitor.hpp"

namespace resonid::io {
namespace {

/// The refusal with the place of the field in the file: at its value, else at its table, else nowhere.
std::string explain(const toml::table& file, std::string_view source, const plant::ExperimentError& error) {
  const toml::table* section = file.get_as<toml::table>(error.table);
  if (section == nullptr) return fmt::format("{}: has no table [{}]: {}", source, error.table, error.text());
  if (error.field.empty()) return position(source, section->source()) + error.text();
  const toml::node* node = section->get(error.field);
  if (node == nullptr)
    return position(source, section->source()) +
           fmt::format("[{}] has no key '{}', which {}", error.table, error.field, error.requirement);
  return position(source, node->source()) + error.text();
}

}  // namespace

expected<plant::ExperimentConfig, Error> parse_experiment(std::string_view text, std::string_view source) {
  toml::table file;
  try {
    file = toml::parse(text, source);
  } catch (const toml::parse_error& e) {
    return fail(position(source, e.source()) + "is not TOML: " + std::string(e.description()));
  }
  plant::ExperimentConfig config;
  std::string error;
  TomlVisitor visitor(file, source, "", error);
  describe(visitor, config);
  visitor.finish();
  if (!error.empty()) return fail(std::move(error));
  if (const auto ok = plant::check(config); !ok) return fail(explain(file, source, ok.error()));
  return config;
}

expected<plant::ExperimentConfig, Error> read_experiment(const std::filesystem::path& path) {
  std::error_code code;
  if (std::filesystem::is_directory(path, code))
    return fail(path.string() + ": is a folder, required a TOML file");
  std::ifstream file(path, std::ios::binary);
  if (!file) return fail(path.string() + ": cannot be opened: no such file, or no permission to read it");
  const std::string text{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  return parse_experiment(text, path.string());
}

}  // namespace resonid::io
