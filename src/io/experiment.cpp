// SPDX-License-Identifier: MIT
#include <fstream>
#include <iterator>
#include <resonid/io/experiment.hpp>

#include "io/toml_visitor.hpp"

namespace resonid::io {
namespace {

/// Where a refused field stands in the file: at its value, else at its table, else nowhere.
std::string explain(const toml::table& file, std::string_view source, std::string_view table,
                    const ConfigError& error) {
  const toml::table* section = file.get_as<toml::table>(table);
  if (section == nullptr)
    return fmt::format("{}: has no table [{}], whose {} {}", source, table, error.field, error.requirement);
  const toml::node* node = section->get(error.field);
  if (node == nullptr)
    return position(source, section->source()) +
           fmt::format("[{}] has no key '{}', which {}", table, error.field, error.requirement);
  const std::string found = std::isnan(error.value) ? std::string() : fmt::format("found {}, ", error.value);
  return position(source, node->source()) +
         fmt::format("{}.{}: {}{}", table, error.field, found, error.requirement);
}

std::string check(const plant::ExperimentConfig& c, const toml::table& file, std::string_view source) {
  if (const auto ok = plant::check(c.drive); !ok) return explain(file, source, "drive", ok.error());
  if (const auto ok = plant::check(c.controller); !ok) return explain(file, source, "controller", ok.error());
  if (const auto ok = plant::check(c.measurement); !ok)
    return explain(file, source, "measurement", ok.error());
  if (const auto ok = plant::check(c.run); !ok) return explain(file, source, "run", ok.error());
  const auto excitation = excitation::Excitation::create(c.excitation, c.run.sample_rate_hz);
  if (!excitation) return explain(file, source, "excitation", excitation.error());
  return {};
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
  if (error.empty()) error = check(config, file, source);
  if (!error.empty()) return fail(std::move(error));
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
