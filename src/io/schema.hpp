// SPDX-License-Identifier: MIT
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>
#include <resonid/base/enum_names.hpp>
#include <resonid/base/expected.hpp>
#include <resonid/online/excitation/excitation.hpp>
#include <string>
#include <string_view>
#include <type_traits>
#include <typeindex>
#include <utility>
#include <vector>

#include "io/named_tables.hpp"

/// Documents described configurations: what src/io/toml_visitor.hpp reads.
namespace resonid::io::schema {

/// The key that selects which others a table has.
[[nodiscard]] inline bool selects(std::string_view name) noexcept {
  return name == "kind" || name == "structure";
}

struct Key {
  std::string name, type, standard, doc;
  std::vector<std::string> where;  // names of the selecting enum for which there is such a key
  bool needed = false;
};

template <class Enum>
std::string choice(Enum) {
  std::string names;
  for (const auto& known : enum_names(Enum{}))
    names += fmt::format("{}`\"{}\"`", names.empty() ? "" : ", ", known.name);
  return names;
}

/// A table, or tables of one kind: no key.
template <class Field>
inline constexpr bool kIsTable =
    std::is_class_v<Field> && !std::is_same_v<Field, std::string> &&
    !std::is_same_v<Field, std::optional<double>> && !std::is_same_v<Field, std::vector<double>> &&
    !std::is_same_v<Field, std::vector<std::string>> && !std::is_same_v<Field, online::LineList>;

template <class Field>
std::string type_of(const Field& field) {
  if constexpr (std::is_same_v<Field, bool>)
    return "`true`, `false`";
  else if constexpr (std::is_same_v<Field, std::string>)
    return "text";
  else if constexpr (std::is_same_v<Field, std::vector<std::string>>)
    return "list of texts";
  else if constexpr (std::is_same_v<Field, double> || std::is_same_v<Field, std::optional<double>>)
    return "number";
  else if constexpr (std::is_same_v<Field, std::uint64_t>)
    return "whole number";
  else if constexpr (std::is_enum_v<Field>)
    return choice(field);
  else if constexpr (std::is_same_v<Field, online::LineList>)
    return "list of numbers or `\"FIRST:LAST:STEP\"`";
  else
    return "list of numbers";
}

template <class Field>
std::string standard_of(const Field& field) {
  if constexpr (std::is_same_v<Field, bool>)
    return field ? "`true`" : "`false`";
  else if constexpr (std::is_enum_v<Field>)
    return fmt::format("`\"{}\"`", name_of(field));
  else if constexpr (std::is_arithmetic_v<Field>)
    return fmt::format("{}", field);
  else if constexpr (std::is_same_v<Field, std::string>)
    return field.empty() ? "empty" : fmt::format("`\"{}\"`", field);
  else if constexpr (std::is_same_v<Field, std::optional<double>>)
    return field ? fmt::format("{}", *field) : "empty";
  else if constexpr (std::is_same_v<Field, std::vector<std::string>>)
    return field.empty() ? "empty" : fmt::format("`\"{}\"`", fmt::join(field, "\"`, `\""));
  else
    return "empty";
}

/// Sets the selecting field.
struct Select {
  std::size_t index;
  template <class Field>
  void operator()(std::string_view name, Field& field, std::string_view) const {
    if constexpr (std::is_enum_v<Field>)
      if (selects(name)) field = enum_names(field)[index].value;
  }
};

/// Counts the choices of the selecting field and names the chosen one.
struct Selection {
  std::size_t count = 0;
  std::string chosen;
  template <class Field>
  void operator()(std::string_view name, Field& field, std::string_view) {
    if constexpr (std::is_enum_v<Field>)
      if (selects(name)) {
        count = enum_names(field).size();
        chosen = name_of(field);
      }
  }
};

struct List {
  std::vector<Key> keys;
  template <class Field>
  void operator()(std::string_view name, Field& field, std::string_view doc) {
    if constexpr (!kIsTable<Field>)
      keys.push_back(
          {std::string(name), type_of(field), standard_of(field), std::string(doc), {}, name == "kind"});
  }
};

/// Gives the named field a further value: what is refused is a key that must be given.
struct Raise {
  std::string_view wanted;
  template <class Field>
  void operator()(std::string_view name, Field& field, std::string_view) const {
    if (name != wanted) return;
    if constexpr (std::is_same_v<Field, double>)
      field += 1.0;
    else if constexpr (std::is_same_v<Field, std::uint64_t>)
      ++field;
    else if constexpr (std::is_same_v<Field, std::vector<double>>)
      field.push_back(1.0);
    else if constexpr (std::is_same_v<Field, std::string>)
      field += 'x';
    else if constexpr (std::is_same_v<Field, std::vector<std::string>>)
      field.emplace_back("x");
    else if constexpr (std::is_same_v<Field, online::LineList>)
      field.assign(std::vector<double>{1.0});
  }
};

/// The keys of one selection. Those that are refused until they have been given are marked.
template <class Config, class Check>
std::vector<Key> keys_of(Config config, const Check& check) {
  List list;
  describe(list, config);
  constexpr int kMostRefusals = 40;
  for (int i = 0; i < kMostRefusals; ++i) {
    const auto ok = check(config);
    if (ok) break;
    const std::string field(ok.error().field);
    for (auto& key : list.keys) key.needed = key.needed || key.name == field;
    describe(Raise{field}, config);
  }
  return list.keys;
}

[[nodiscard]] inline bool same(const Key& a, const Key& b) { return a.name == b.name && a.doc == b.doc; }

/// One entry per key and meaning, in the order of the file.
template <class Config, class Check>
std::vector<Key> all_keys(const Config& standard, const Check& check) {
  std::vector<Key> all;
  Selection selection;
  Config first = standard;
  describe(selection, first);
  const auto entry = [&](const Key& key) {
    return std::find_if(all.begin(), all.end(), [&](const Key& k) { return same(k, key); });
  };
  for (std::size_t i = 0; i < std::max<std::size_t>(selection.count, 1); ++i) {
    Config config = standard;
    describe(Select{i}, config);
    Selection chosen;
    describe(chosen, config);
    const auto keys = keys_of(config, check);
    for (std::size_t k = 0; k < keys.size(); ++k) {
      auto place = entry(keys[k]);
      if (place == all.end()) {  // before the next key that is there already
        for (std::size_t next = k + 1; next < keys.size() && place == all.end(); ++next)
          place = entry(keys[next]);
        place = all.insert(place, keys[k]);
      }
      place->where.push_back(chosen.chosen);
      place->needed = place->needed || keys[k].needed;
    }
  }
  return all;
}

[[nodiscard]] inline std::string cell(std::string_view text) {
  std::string escaped;
  for (const char c : text) escaped += c == '|' ? std::string("\\|") : std::string(1, c);
  return escaped;
}

[[nodiscard]] inline std::string where_text(const Key& key, std::size_t selections) {
  if (key.where.size() == selections) return "";
  std::string text;
  for (const auto& name : key.where) text += (text.empty() ? "" : ", ") + name;
  return text;
}

/// Writes the chapter of every table that describe() of a configuration names, and of the tables in it.
/// `check(config)` is what refuses a table's keys. Keys that stood in another chapter are not told again.
template <class Check>
class Chapters {
 public:
  explicit Chapters(Check check) : check_(std::move(check)) {}

  template <class Field>
  void operator()(std::string_view name, Field& field, std::string_view doc) {
    if constexpr (kIsNamedTables<Field>) {
      (*this)(fmt::format("{}.NAME", name), field.standard, doc);
    } else if constexpr (kIsTable<Field>) {
      const std::string outer = std::exchange(path_, path_ + (path_.empty() ? "" : ".") + std::string(name));
      text_ += fmt::format("\n## [{}]: {}\n", path_, doc);
      const auto keys = all_keys(field, check_);
      const auto same_tables = keys.empty() ? tables_.find(typeid(Field)) : tables_.end();
      if (same_tables != tables_.end()) {
        text_ += fmt::format("\nTables and keys as in [{}].\n", same_tables->second);
      } else {
        if (keys.empty()) tables_.emplace(typeid(Field), path_);
        if (!keys.empty()) write(keys, field);
        describe(*this, field);
      }
      path_ = outer;
    }
  }

  [[nodiscard]] const std::string& text() const noexcept { return text_; }

 private:
  struct Told {
    std::string path;
    std::vector<Key> keys;
  };

  template <class Config>
  void write(const std::vector<Key>& keys, const Config& config) {
    const auto told = std::find_if(told_.begin(), told_.end(), [&](const Told& t) {
      return std::equal(keys.begin(), keys.end(), t.keys.begin(), t.keys.end(), same);
    });
    if (told != told_.end()) return refer(*told, keys);
    told_.push_back({path_, keys});
    Config first = config;
    Selection selection;
    describe(selection, first);
    const bool divided = selection.count > 0;
    text_ += fmt::format("\n| key | type | default |{} meaning, range (unit) |\n|---|---|---|{}---|\n",
                         divided ? " only for |" : "", divided ? "---|" : "");
    for (const auto& key : keys)
      text_ += fmt::format(
          "| `{}` | {} | {} |{} {} |\n", key.name, cell(key.type), key.needed ? "required" : key.standard,
          divided ? " " + where_text(key, selection.count) + " |" : std::string(), cell(key.doc));
  }

  void refer(const Told& told, const std::vector<Key>& keys) {
    std::string others;
    for (std::size_t i = 0; i < keys.size(); ++i)
      if (keys[i].standard != told.keys[i].standard)
        others +=
            fmt::format("{}`{}` {}", others.empty() ? "; defaults: " : ", ", keys[i].name, keys[i].standard);
    text_ += fmt::format("\nKeys as in [{}]{}.\n", told.path, others);
  }

  Check check_;
  std::string path_, text_;
  std::vector<Told> told_;
  std::map<std::type_index, std::string> tables_;  ///< Paths of those without keys of their own.
};

/// A chapter for every table of the configuration, with the defaults of `standard`.
template <class Config, class Check>
[[nodiscard]] std::string chapters_of(Config standard, Check check) {
  Chapters<Check> chapters(std::move(check));
  describe(chapters, standard);
  return chapters.text();
}

}  // namespace resonid::io::schema
