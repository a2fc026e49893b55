// SPDX-License-Identifier: MIT
#include "io/toml_text.hpp"

#include <cmath>

#include "io/text.hpp"

namespace resonid::io {
namespace {

/// The parser's words in one line: bytes of the file that do not print are left out.
std::string one_line(std::string_view description) {
  std::string line;
  for (const char c : description)
    if (static_cast<unsigned char>(c) >= 0x20 && c != 0x7f) line += c;
  return line;
}

/// The longest key of the table that a path begins with; keys may hold dots themselves.
std::string_view leading_key(const toml::table& table, std::string_view path) {
  std::string_view longest;
  for (const auto& [key, node] : table) {
    const std::string_view name = key.str();
    const bool leads = path.starts_with(name) && (path.size() == name.size() || path[name.size()] == '.');
    if (leads && name.size() > longest.size()) longest = name;
  }
  return longest;
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

Error placed(const toml::table& file, std::string_view source, Error error) {
  const std::string_view field = error.field.view();
  const toml::table* table = &file;
  std::string_view rest = field;
  while (true) {
    const std::string_view key = leading_key(*table, rest);
    const toml::node* node = key.empty() ? nullptr : table->get(key);
    if (node != nullptr && key.size() == rest.size()) {
      error.where = position(source, node->source());
      return error;
    }
    if (node == nullptr || !node->is_table()) break;
    table = node->as_table();
    rest.remove_prefix(key.size() + 1);
  }
  if (table != &file) {
    const std::string_view path = field.substr(0, field.size() - rest.size() - 1);
    return {{},
            fmt::format("[{}] has no key '{}', which {}", path, rest, error.requirement.view()),
            std::nan(""),
            position(source, table->source())};
  }
  const std::string_view missing = field.substr(0, field.find('.'));
  const std::string_view key = field.size() > missing.size() ? field.substr(missing.size() + 1) : "";
  return {{},
          fmt::format("has no table [{}]; its {} {}", missing, key.empty() ? "content" : key,
                      error.requirement.view()),
          std::nan(""),
          fmt::format("{}:1:1", source)};
}

}  // namespace resonid::io
