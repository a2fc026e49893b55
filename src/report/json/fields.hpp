// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <resonid/base/enum_names.hpp>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

namespace resonid::report {

/// What a number may be.
enum class Range { any, positive, not_negative };
using enum Range;

/// A key of a result file.
struct Key {
  std::string_view name;
  std::string_view meaning;
  std::string_view unit = {};
  Range range = any;
};

/// When a key is there.
enum class Presence {
  required,  ///< Always.
  optional,  ///< Where the quantity was computed.
  assumed,   ///< Always, but older files lack it.
};
inline constexpr EnumName<Presence> kPresenceNames[] = {{Presence::required, "always"},
                                                        {Presence::optional, ""},
                                                        {Presence::assumed, "always, not in older files"}};
[[nodiscard]] constexpr std::span<const EnumName<Presence>> enum_names(Presence) noexcept {
  return kPresenceNames;
}

/// One of some names.
struct Chosen {
  std::span<const std::string_view> names;
  std::size_t index = 0;
};

/// Numbers of rows of which some have none: null in the file.
struct Gaps {
  std::vector<double>& value;
};

using Value =
    std::variant<double*, int*, std::size_t*, bool*, std::string*, Chosen*, std::vector<double>*,
                 std::vector<int>*, std::vector<bool>*, std::vector<std::string>*, Eigen::MatrixXd*, Gaps*>;

template <class T>
concept Leaf = std::is_constructible_v<Value, T*>;
template <class T>
struct IsOptional : std::false_type {};
template <class T>
struct IsOptional<std::optional<T>> : std::true_type {};

/// What goes through the description of a result: the writer, the reader and the sketch that schema and table
/// are made of. `describe(Fields&, T&)` says once what the file holds of a T:
///
///     f({"frequency_hz", "undamped", "Hz", positive}, mode.frequency_hz);
///     f({"std_hz", "its standard deviation", "Hz", not_negative}, mode.std_hz);  // optional: may be absent
///
/// A quantity that was not computed is absent, never 0 or null; numbers that are not finite count as such.
/// Descriptions are ordinary functions, so each is compiled once. The writer changes nothing.
class Fields {
 public:
  enum class Pass { write, read, sketch };
  explicit Fields(Pass pass) noexcept : pass_(pass) {}
  Fields(const Fields&) = delete;
  Fields& operator=(const Fields&) = delete;
  virtual ~Fields() = default;

  [[nodiscard]] bool writing() const noexcept { return pass_ == Pass::write; }
  [[nodiscard]] bool reading() const noexcept { return pass_ == Pass::read; }
  [[nodiscard]] bool sketching() const noexcept { return pass_ == Pass::sketch; }

  /// A key that is always there; an optional value is absent where it is empty or not finite.
  template <class T>
  void operator()(const Key& key, T& value) {
    if constexpr (IsOptional<T>::value)
      optional(key, value);
    else
      put(key, Presence::required, value, true);
  }
  /// A key that is absent where the value is this one, which reading gives for it; an empty text or list
  /// without one.
  template <class T>
  void unless(const T& absent, const Key& key, T& value) {
    bool present = !(value == absent);
    if constexpr (std::is_same_v<T, double>) present = present && std::isfinite(value);
    const bool found = put(key, Presence::optional, value, present);
    if (reading() && !found) value = absent;
  }
  template <class T>
  void unless_empty(const Key& key, T& value) {
    if (!put(key, Presence::optional, value, !value.empty()) && reading()) value.clear();
  }
  /// Where `there` says so; reading tells whether it was.
  template <class T>
  bool only_if(bool there, const Key& key, T& value) {
    return put(key, Presence::optional, value, there);
  }
  /// Always there, and required, where `there` says so, which others of the object tell.
  template <class T>
  void with(bool there, const Key& key, T& value) {
    if (there || sketching()) put(key, sketching() ? Presence::optional : Presence::required, value, true);
  }
  /// A key that older files lack: then the value stays as it is.
  template <class T>
  void assumed(const Key& key, T& value) {
    put(key, Presence::assumed, value, true);
  }
  /// Written only, as others of the file tell it too.
  template <class T>
  void derived(const Key& key, T value, bool there = true) {
    if constexpr (std::is_same_v<T, double>) there = there && std::isfinite(value);
    if (!reading()) put(key, Presence::optional, value, there);
  }

  /// An object that the body describes; true where it is there.
  template <class Body>
  bool object(const Key& key, bool there, Body&& body, Presence presence = Presence::optional) {
    if (!open(key, presence, there)) return false;
    body();
    close();
    return true;
  }
  template <class Body>
  void object(const Key& key, Body&& body) {
    object(key, true, std::forward<Body>(body), Presence::required);
  }

  /// A list of objects, each described by the body.
  template <class T, class Body>
  bool list(const Key& key, bool there, std::vector<T>& value, Body&& body,
            Presence presence = Presence::optional) {
    const auto size = open_list(key, presence, value.size(), there);
    if (!size) return false;
    if (value.size() != *size) value.resize(*size);
    for (std::size_t i = 0; i < *size; ++i) {
      open_element(i);
      body(value[i]);
      close_element();
    }
    close_list();
    return true;
  }

  /// The names of an enum that stands in the file by one of them.
  template <NamedEnum Enum>
  void choice(const Key& key, Enum& value, Presence presence = Presence::required) {
    const auto all = enum_names(Enum{});
    std::vector<std::string_view> names;
    Chosen chosen;
    for (std::size_t i = 0; i < all.size(); ++i) {
      names.push_back(all[i].name);
      if (all[i].value == value) chosen.index = i;
    }
    chosen.names = names;
    if (!leaf(key, presence, &chosen, true) || !reading()) return;
    value = all[chosen.index].value;
  }
  void choice(const Key& key, std::span<const std::string_view, 2> names, bool& second,
              Presence presence = Presence::required) {
    Chosen chosen{names, second ? 1U : 0U};
    if (leaf(key, presence, &chosen, true) && reading()) second = chosen.index == 1;
  }

  /// An object with keys that the result names: `body(name)` for each, as an object of that name.
  template <class Body>
  void map(const Key& key, const std::vector<std::string>& names, Body&& body) {
    object(key, [&] { each(names, [&](const Key& k) { object(k, [&] { body(k.name); }); }); });
  }
  /// Further keys of this object that the result names; reading, all those that have not been described.
  template <class Body>
  void each(const std::vector<std::string>& names, Body&& body) {
    const std::vector<std::string> all = further(names);
    for (const auto& name : all) body(Key{name, "of this name"});
  }

  /// Kinds of which the object is one: `body(i)` describes what kind i has. `which` is called for the kind
  /// that it is, reading one that `holds` tells.
  template <class Body>
  void one_of(std::size_t kinds, std::size_t which, Body&& body) {
    if (!sketching()) return body(which);
    for (std::size_t i = 0; i < kinds; ++i) {
      begin_kind(i);
      body(i);
      end_kind();
    }
  }
  /// Reading: whether the object has the key; whether it says this text.
  [[nodiscard]] virtual bool holds(std::string_view) const { return false; }
  [[nodiscard]] virtual bool says(std::string_view, std::string_view) const { return false; }

  /// Reading: notes what is required of a key unless it is so.
  virtual void require(bool, std::string_view, const std::string&) {}
  /// The file's own name and version: the first of them is written, all are read.
  virtual void schema(std::initializer_list<std::string_view> names) = 0;

 protected:
  /// A value; true where it is there (reading: where it was found).
  virtual bool leaf(const Key& key, Presence presence, Value value, bool there) = 0;
  virtual bool open(const Key& key, Presence presence, bool there) = 0;
  virtual void close() = 0;
  /// A list of objects; how many there are, nothing without the key.
  virtual std::optional<std::size_t> open_list(const Key& key, Presence presence, std::size_t size,
                                               bool there) = 0;
  virtual void open_element(std::size_t index) = 0;
  virtual void close_element() = 0;
  virtual void close_list() = 0;
  [[nodiscard]] virtual std::vector<std::string> further(const std::vector<std::string>& names) {
    return names;
  }
  virtual void begin_kind(std::size_t) {}
  virtual void end_kind() {}

 private:
  template <class T>
  bool put(const Key& key, Presence presence, T& value, bool there) {
    if constexpr (Leaf<T>) {
      return leaf(key, presence, &value, there);
    } else if constexpr (requires { value.push_back(value.front()); }) {
      return list(
          key, there, value, [&](auto& element) { describe(*this, element); }, presence);
    } else {
      return object(
          key, there, [&] { describe(*this, value); }, presence);
    }
  }

  template <class T>
  void optional(const Key& key, std::optional<T>& value) {
    bool there = value.has_value();
    if constexpr (std::is_same_v<T, double>) there = there && std::isfinite(*value);
    T fresh{};
    const bool found = put(key, Presence::optional, value ? *value : fresh, there);
    if (reading() && found) value = std::move(fresh);
  }

  Pass pass_;
};

}  // namespace resonid::report
