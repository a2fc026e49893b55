// SPDX-License-Identifier: MIT
#include <fstream>
#include <iterator>
#include <resonid/io/experiment.hpp>

#include "io/toml_visitor.hpp"

namespace resonid::io {
namespace {

/// The parser's words in one line: bytes of the file that do not print are left out.
std::string one_line(std::string_view description) {
  std::string line;
  for (const char c : description)
    if (static_cast<unsigned char>(c) >= 0x20 && c != 0x7f) line += c;
  return line;
}

expected<toml::table, Error> parse_toml(std::string_view text, std::string_view source) {
  if (text.find('\0') != std::string_view::npos)
    return fail(std::string(source) + ": is not TOML: it holds binary data");
  try {
    return toml::parse(text, source);
  } catch (const toml::parse_error& e) {
    return fail(position(source, e.source()) + "is not TOML: " + one_line(e.description()));
  }
}

/// The refusal with its place in the file: at the value, else at its table, else at the file.
std::string explain(const toml::table& file, std::string_view source, const plant::ExperimentError& error) {
  const toml::table* section = file.get_as<toml::table>(error.table);
  if (section == nullptr)
    return fmt::format("{}:1:1: has no table [{}]; its {} {}", source, error.table,
                       error.field.empty() ? "content" : error.field, error.requirement);
  if (error.field.empty()) return position(source, section->source()) + error.text();
  const toml::node* node = section->get(error.field);
  if (node == nullptr)
    return position(source, section->source()) +
           fmt::format("[{}] has no key '{}', which {}", error.table, error.field, error.requirement);
  return position(source, node->source()) + error.text();
}

}  // namespace

expected<plant::ExperimentConfig, Error> parse_experiment(std::string_view text, std::string_view source,
                                                          std::optional<double> duration_s) {
  const auto file = parse_toml(text, source);
  if (!file) return unexpected(file.error());
  plant::ExperimentConfig config;
  std::string error;
  TomlVisitor visitor(*file, source, "", error);
  describe(visitor, config);
  visitor.finish();
  if (!error.empty()) return fail(std::move(error));
  if (duration_s) config.run.duration_s = *duration_s;
  const auto ok = plant::check(config);
  if (ok) return config;
  const auto& refused = ok.error();
  if (duration_s && refused.table == "run" && refused.field == "duration_s")
    return fail(fmt::format("{}: with a duration of {:g} s: {}", source, *duration_s, refused.requirement));
  return fail(explain(*file, source, refused));
}

std::string explain_experiment(std::string_view text, std::string_view source,
                               const plant::ExperimentError& error) {
  const auto file = parse_toml(text, source);
  return file ? explain(*file, source, error) : file.error().message;
}

expected<std::string, Error> read_experiment_text(const std::filesystem::path& path) {
  std::error_code code;
  if (std::filesystem::is_directory(path, code))
    return fail(path.string() + ": is a folder, required a TOML file");
  std::ifstream file(path, std::ios::binary);
  if (!file) return fail(path.string() + ": cannot be opened: no such file, or no permission to read it");
  return std::string{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

expected<plant::ExperimentConfig, Error> read_experiment(const std::filesystem::path& path) {
  const auto text = read_experiment_text(path);
  if (!text) return unexpected(text.error());
  return parse_experiment(*text, path.string());
}

}  // namespace resonid::io
