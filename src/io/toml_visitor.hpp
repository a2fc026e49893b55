// SPDX-License-Identifier: MIT
#pragma once

#include <fmt/core.h>
#include <toml++/toml.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <resonid/base/expected.hpp>
#include <resonid/io/detail/number_list.hpp>
#include <resonid/io/detail/suggestion.hpp>
#include <resonid/online/excitation/excitation.hpp>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "io/named_tables.hpp"
#include "io/text.hpp"
#include "io/toml_text.hpp"

namespace resonid::io {

/// Notes the keys whose value is infinite.
struct InfiniteKeys {
  std::vector<std::string>& names;
  template <class Field>
  void operator()(std::string_view name, Field& field, std::string_view) const {
    if constexpr (std::is_same_v<Field, double>)
      if (std::isinf(field)) names.emplace_back(name);
  }
};

/// Fills a described configuration from a TOML table. The first error is kept and ends the reading; keys that
/// are absent leave the field as it is, except `kind`, which every table that has one must give. Numbers are
/// finite, but for keys whose default is not: these may be `inf` and `-inf`.
class TomlVisitor {
 public:
  /// `path` is the table's name in messages, empty for the whole file. All arguments must outlive the
  /// visitor.
  TomlVisitor(const toml::table& table, std::string_view file, std::string path, std::optional<Error>& error)
      : table_(table), file_(file), path_(std::move(path)), error_(error) {}

  template <class Field>
  void operator()(std::string_view name, Field& field, std::string_view doc) {
    if (error_) return;
    known_.emplace_back(name);
    const toml::node* node = table_.get(name);
    if (node != nullptr) return read(*node, name, field, doc);
    if (name == "kind")
      refuse_at(table_.source(), {}, fmt::format("[{}] has no key 'kind', required: {}", path_, doc));
  }

  /// Reads the whole table, whose defaults are those of `Struct` as it is made.
  template <class Struct>
  void read_table(Struct& into) {
    Struct made{};
    describe(InfiniteKeys{infinite_}, made);
    describe(*this, into);
    finish();
  }

 private:
  /// To be called after describe(): refuses keys that no field has.
  void finish() {
    if (error_) return;
    const toml::key* first = nullptr;
    for (const auto& [key, node] : table_) {
      if (std::find(known_.begin(), known_.end(), key.str()) != known_.end()) continue;
      if (first == nullptr || key.source().begin < first->source().begin) first = &key;
    }
    if (first == nullptr) return;
    const std::string_view key = first->str();
    refuse_at(first->source(), {},
              fmt::format("unknown {} {}{}{}; known here: {}", path_.empty() ? "table" : "key",
                          in_quotes(full(key)), selected_, suggestion(key, known_), listed(known_)));
  }

  template <class Field>
  void read(const toml::node& node, std::string_view name, Field& field, std::string_view doc) {
    if constexpr (std::is_same_v<Field, bool>) {
      if (!node.is_boolean()) return refuse(node, name, "true or false", doc);
      field = node.as_boolean()->get();
    } else if constexpr (std::is_same_v<Field, double>) {
      const bool infinite = std::find(infinite_.begin(), infinite_.end(), name) != infinite_.end();
      if (!number(node, field, infinite)) refuse(node, name, "a number", doc);
    } else if constexpr (std::is_same_v<Field, std::optional<double>>) {
      if (!number(node, field.emplace())) refuse(node, name, "a number", doc);
    } else if constexpr (std::is_same_v<Field, std::string>) {
      if (!node.is_string()) return refuse(node, name, "a text in quotes", doc);
      field = node.as_string()->get();
    } else if constexpr (std::is_same_v<Field, std::vector<std::string>>) {
      read_texts(node, name, field, doc);
    } else if constexpr (std::is_same_v<Field, std::uint64_t>) {
      if (!node.is_integer() || node.as_integer()->get() < 0)
        return refuse(node, name, "a whole number >= 0", doc);
      field = static_cast<std::uint64_t>(node.as_integer()->get());
    } else if constexpr (std::is_enum_v<Field>) {
      read_name(node, name, field, doc);
    } else if constexpr (std::is_same_v<Field, std::vector<double>>) {
      if (const toml::node* wrong = list(node, field)) refuse(*wrong, name, "a list of numbers", doc);
    } else if constexpr (std::is_same_v<Field, online::LineList>) {
      read_lines(node, name, field, doc);
    } else {
      if (!node.is_table()) return refuse(node, name, "a table", doc);
      if constexpr (kIsNamedTables<Field>)
        read_named(*node.as_table(), name, field, doc);
      else
        TomlVisitor(*node.as_table(), file_, full(name), error_).read_table(field);
    }
  }

  template <class Table>
  void read_named(const toml::table& tables, std::string_view kind, NamedTables<Table>& field,
                  std::string_view doc) {
    for (const auto& [key, node] : tables) {
      const std::string name = std::string(kind) + "." + std::string(key.str());
      if (!node.is_table()) return refuse(node, name, "a table", doc);
      auto& table = field.tables.insert_or_assign(std::string(key.str()), field.standard).first->second;
      TomlVisitor(*node.as_table(), file_, full(name), error_).read_table(table);
      if (error_) return;
    }
  }

  void read_texts(const toml::node& node, std::string_view name, std::vector<std::string>& field,
                  std::string_view doc) {
    if (!node.is_array()) return refuse(node, name, "a list of texts", doc);
    field.clear();
    for (const auto& element : *node.as_array()) {
      if (!element.is_string()) return refuse(element, name, "a list of texts", doc);
      field.push_back(element.as_string()->get());
    }
  }

  template <class Enum>
  void read_name(const toml::node& node, std::string_view name, Enum& field, std::string_view doc) {
    std::vector<std::string> known;
    for (const auto& each : enum_names(Enum{})) known.emplace_back(each.name);
    const std::string found = node.is_string() ? node.as_string()->get() : std::string();
    if (const auto value = from_name<Enum>(found)) {
      field = *value;
      if (name == "kind" || name == "structure") selected_ = fmt::format(" with {} = '{}'", name, found);
      return;
    }
    refuse(node, name, "one of " + listed(known) + suggestion(found, known), doc);
  }

  void read_lines(const toml::node& node, std::string_view name, online::LineList& field,
                  std::string_view doc) {
    std::vector<double> lines;
    if (node.is_string()) {
      auto parsed = parse_lines(node.as_string()->get());
      if (!parsed) {
        return refuse_at(node.source(), full(name), parsed.error().requirement);
      }
      lines = std::move(*parsed);
    } else if (const toml::node* wrong = list(node, lines)) {
      return refuse(*wrong, name, "a list of numbers or \"FIRST:LAST:STEP\"", doc);
    }
    if (!field.assign(lines)) refuse(node, name, fmt::format("at most {} lines", online::kMaxLines), doc);
  }

  static bool number(const toml::node& node, double& value, bool infinite = false) {
    const auto found = node.value<double>();
    if (!node.is_number() || !found) return false;
    if (infinite ? std::isnan(*found) : !std::isfinite(*found)) return false;
    value = *found;
    return true;
  }
  /// What is no list of numbers in it, or nothing.
  static const toml::node* list(const toml::node& node, std::vector<double>& values) {
    if (!node.is_array()) return &node;
    values.clear();
    for (const auto& element : *node.as_array()) {
      double value = 0.0;
      if (!number(element, value)) return &element;
      values.push_back(value);
    }
    return nullptr;
  }

  [[nodiscard]] std::string full(std::string_view name) const {
    return path_.empty() ? std::string(name) : path_ + "." + std::string(name);
  }

  void refuse(const toml::node& node, std::string_view name, const std::string& required,
              std::string_view doc) {
    std::string found(toml::impl::node_type_friendly_names[static_cast<std::size_t>(node.type())]);
    if (node.is_string()) found = in_quotes(node.as_string()->get());
    if (node.is_integer()) found = fmt::format("{}", node.as_integer()->get());
    if (node.is_floating_point()) found = fmt::format("{:#}", node.as_floating_point()->get());
    refuse_at(node.source(), full(name),
              fmt::format("found {}, required {}; it is: {}", found, required, doc));
  }
  void refuse_at(const toml::source_region& region, std::string field, Phrase requirement) {
    error_ = Error{std::move(field), std::move(requirement), std::nan(""), position(file_, region)};
  }

  const toml::table& table_;
  std::string_view file_;
  std::string path_;
  std::optional<Error>& error_;
  std::vector<std::string> known_;
  std::vector<std::string> infinite_;
  std::string selected_;  // " with kind = 'pi'", what selects the keys of this table
};

/// The described configuration that a file holds.
template <class Config>
[[nodiscard]] expected<Config> read_described(const toml::table& file, std::string_view source) {
  Config config{};
  std::optional<Error> error;
  TomlVisitor(file, source, "", error).read_table(config);
  if (error) return unexpected(std::move(*error));
  return config;
}

}  // namespace resonid::io
