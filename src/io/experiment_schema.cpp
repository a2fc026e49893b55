// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <resonid/io/detail/experiment_schema.hpp>
#include <resonid/plant/experiment.hpp>
#include <string_view>
#include <type_traits>
#include <vector>

#include "io/experiment_introduction.hpp"

namespace resonid::io {
namespace {

/// The key that selects which others a table has.
bool selects(std::string_view name) noexcept { return name == "kind" || name == "structure"; }

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

template <class Field>
std::string type_of(const Field& field) {
  if constexpr (std::is_same_v<Field, bool>)
    return "`true`, `false`";
  else if constexpr (std::is_same_v<Field, double>)
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
    else if constexpr (std::is_same_v<Field, online::LineList>)
      field.assign(std::vector<double>{1.0});
  }
};

expected<void, Error> check(const online::ExcitationConfig& c) {
  constexpr double kAnyRateHz = 1000.0;
  const auto made = online::Excitation::create(c, kAnyRateHz);
  if (!made) return unexpected<Error>(made.error());
  return {};
}

/// The keys of one selection. Those that check() refuses until they have been given are marked.
template <class Config>
std::vector<Key> keys_of(Config config) {
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

bool same(const Key& a, const Key& b) { return a.name == b.name && a.doc == b.doc; }

/// One entry per key and meaning, in the order of the file.
template <class Config>
std::vector<Key> all_keys() {
  std::vector<Key> all;
  Selection selection;
  Config first;
  describe(selection, first);
  const auto entry = [&](const Key& key) {
    return std::find_if(all.begin(), all.end(), [&](const Key& k) { return same(k, key); });
  };
  for (std::size_t i = 0; i < std::max<std::size_t>(selection.count, 1); ++i) {
    Config config;
    describe(Select{i}, config);
    Selection chosen;
    describe(chosen, config);
    const auto keys = keys_of(config);
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

std::string cell(std::string_view text) {
  std::string escaped;
  for (const char c : text) escaped += c == '|' ? std::string("\\|") : std::string(1, c);
  return escaped;
}

std::string where_text(const Key& key, std::size_t selections) {
  if (key.where.size() == selections) return "";
  std::string text;
  for (const auto& name : key.where) text += (text.empty() ? "" : ", ") + name;
  return text;
}

/// Writes the chapter of every table that describe() of the experiment names.
struct Chapters {
  std::string text;

  template <class Config>
  void operator()(std::string_view name, Config&, std::string_view doc) {
    const auto keys = all_keys<Config>();
    Config first;
    Selection selection;
    describe(selection, first);
    const bool divided = selection.count > 0;
    text += fmt::format(
        "\n## [{}]: {}\n\n| key | type | default |{} meaning, range (unit) |\n|---|---|---|{}---|\n", name,
        doc, divided ? " only for |" : "", divided ? "---|" : "");
    for (const auto& key : keys)
      text += fmt::format(
          "| `{}` | {} | {} |{} {} |\n", key.name, cell(key.type), key.needed ? "required" : key.standard,
          divided ? " " + where_text(key, selection.count) + " |" : std::string(), cell(key.doc));
  }
};

}  // namespace

std::string experiment_schema() {
  Chapters chapters{std::string(kExperimentIntroduction)};
  plant::ExperimentConfig config;
  describe(chapters, config);
  return std::move(chapters.text);
}

}  // namespace resonid::io
