// SPDX-License-Identifier: MIT
#include <fstream>
#include <iterator>
#include <resonid/io/experiment.hpp>

#include "io/toml_text.hpp"
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

/// The refusal with its place in the file: at the value, else at its table, else at the file.
Error placed(const toml::table& file, std::string_view source, Error error) {
  const std::string_view field = error.field.view();
  const std::string_view table = field.substr(0, field.find('.'));
  const std::string_view key = field.size() > table.size() ? field.substr(table.size() + 1) : "";
  const toml::table* section = file.get_as<toml::table>(table);
  if (section == nullptr)
    return {{},
            fmt::format("has no table [{}]; its {} {}", table, key.empty() ? "content" : key,
                        error.requirement.view()),
            std::nan(""),
            fmt::format("{}:1:1", source)};
  const toml::node* node = key.empty() ? section : section->get(key);
  if (node == nullptr)
    return {{},
            fmt::format("[{}] has no key '{}', which {}", table, key, error.requirement.view()),
            std::nan(""),
            position(source, section->source())};
  error.where = position(source, node->source());
  return error;
}

}  // namespace

expected<toml::table, Error> parse_toml(std::string_view text, std::string_view source) {
  if (text.find('\0') != std::string_view::npos)
    return fail(std::string(source), "is not TOML: it holds binary data");
  try {
    return toml::parse(text, source);
  } catch (const toml::parse_error& e) {
    return fail(position(source, e.source()), "is not TOML: " + one_line(e.description()));
  }
}

expected<plant::ExperimentConfig, Error> parse_experiment(std::string_view text, std::string_view source,
                                                          std::optional<double> duration_s) {
  const auto file = parse_toml(text, source);
  if (!file) return unexpected(file.error());
  plant::ExperimentConfig config;
  std::optional<Error> error;
  TomlVisitor visitor(*file, source, "", error);
  describe(visitor, config);
  visitor.finish();
  if (error) return unexpected(std::move(*error));
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
