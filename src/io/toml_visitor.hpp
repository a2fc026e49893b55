// SPDX-License-Identifier: MIT
#pragma once

#include <fmt/core.h>
#include <toml++/toml.h>

#include <cmath>
#include <cstdint>
#include <optional>
#include <resonid/base/error.hpp>
#include <resonid/io/detail/number_list.hpp>
#include <resonid/io/detail/suggestion.hpp>
#include <resonid/online/excitation/excitation.hpp>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "io/text.hpp"

namespace resonid::io {

/// "file:line:column".
inline std::string position(std::string_view file, const toml::source_region& region) {
  return fmt::format("{}:{}:{}", file, region.begin.line, region.begin.column);
}

/// Fills a described configuration from a TOML table. The first error is kept and ends the reading; keys that
/// are absent leave the field as it is, except `kind`, which every table that has one must give.
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

 private:
  template <class Field>
  void read(const toml::node& node, std::string_view name, Field& field, std::string_view doc) {
    if constexpr (std::is_same_v<Field, bool>) {
      if (!node.is_boolean()) return refuse(node, name, "true or false", doc);
      field = node.as_boolean()->get();
    } else if constexpr (std::is_same_v<Field, double>) {
      if (!number(node, field)) refuse(node, name, "a number", doc);
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
      TomlVisitor inner(*node.as_table(), file_, full(name), error_);
      describe(inner, field);
      inner.finish();
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

  static bool number(const toml::node& node, double& value) {
    const auto found = node.value<double>();
    if (!node.is_number() || !found || !std::isfinite(*found)) return false;
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
  std::string selected_;  // " with kind = 'pi'", what selects the keys of this table
};

}  // namespace resonid::io
