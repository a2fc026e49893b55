// SPDX-License-Identifier: MIT
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <optional>
#include <resonid/base/enum_names.hpp>
#include <resonid/io/detail/profile.hpp>
#include <resonid/online/excitation/excitation.hpp>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "io/named_tables.hpp"

namespace resonid::io {

/// One key of a described configuration with its value, as TOML.
struct DescribedKey {
  std::string path;   ///< "axis.x.delay_s", as checks name fields.
  std::string table;  ///< "axis.x", keys quoted where TOML asks for it; empty: above all tables.
  std::string key, value;

  friend bool operator==(const DescribedKey&, const DescribedKey&) = default;
};

/// Collects all keys of a described configuration: those of a table before those of the tables in it, as long
/// as describe() names them in this order. Optional numbers that are not there are left out.
class DescribedKeys {
 public:
  template <class Field>
  void operator()(std::string_view name, Field& field, std::string_view) {
    if constexpr (std::is_same_v<Field, bool>)
      add(name, field ? "true" : "false");
    else if constexpr (std::is_enum_v<Field>)
      add(name, toml_text(std::string(name_of(field))));
    else if constexpr (std::is_arithmetic_v<Field>)
      add(name, fmt::format("{}", field));
    else if constexpr (std::is_same_v<Field, std::string>)
      add(name, toml_text(field));
    else if constexpr (std::is_same_v<Field, std::optional<double>>)
      field ? add(name, fmt::format("{}", *field)) : void();
    else if constexpr (std::is_same_v<Field, std::vector<double>>)
      add(name, fmt::format("[{}]", fmt::join(field, ", ")));
    else if constexpr (std::is_same_v<Field, online::LineList>)
      add(name, fmt::format("[{}]", fmt::join(field.values(), ", ")));
    else if constexpr (std::is_same_v<Field, std::vector<std::string>>)
      add_texts(name, field);
    else if constexpr (kIsNamedTables<Field>)
      within(name, [&] {
        for (auto& entry : field.tables) within(entry.first, [&] { describe(*this, entry.second); });
      });
    else
      within(name, [&] { describe(*this, field); });
  }

  [[nodiscard]] std::vector<DescribedKey> take() && { return std::move(keys_); }

 private:
  void add(std::string_view name, std::string value) {
    keys_.push_back({joined(path_, name), table_, quoted(name), std::move(value)});
  }
  void add_texts(std::string_view name, const std::vector<std::string>& texts) {
    std::string list;
    for (const auto& text : texts) list += (list.empty() ? "" : ", ") + toml_text(text);
    add(name, "[" + list + "]");
  }
  template <class Visit>
  void within(std::string_view name, Visit&& visit) {
    const auto path = path_, table = table_;
    path_ = joined(path_, name);
    table_ = joined(table_, quoted(name));
    visit();
    path_ = path;
    table_ = table;
  }
  static std::string joined(const std::string& outer, std::string_view name) {
    return outer.empty() ? std::string(name) : outer + "." + std::string(name);
  }
  static std::string quoted(std::string_view name) {
    const bool bare = !name.empty() && std::all_of(name.begin(), name.end(), [](unsigned char c) {
      return c < 0x80 && (std::isalnum(c) != 0 || c == '_' || c == '-');
    });
    return bare ? std::string(name) : toml_text(std::string(name));
  }

  std::string path_, table_;
  std::vector<DescribedKey> keys_;
};

/// All keys of a configuration, those with their default included.
template <class Config>
[[nodiscard]] std::vector<DescribedKey> described_keys(Config config) {
  DescribedKeys keys;
  describe(keys, config);
  return std::move(keys).take();
}

/// The keys as a TOML document.
[[nodiscard]] inline std::string toml_of(const std::vector<DescribedKey>& keys) {
  std::string text, table;
  for (const auto& k : keys) {
    if (k.table != table) text += fmt::format("{}[{}]\n", text.empty() ? "" : "\n", k.table);
    table = k.table;
    text += fmt::format("{} = {}\n", k.key, k.value);
  }
  return text;
}

}  // namespace resonid::io
