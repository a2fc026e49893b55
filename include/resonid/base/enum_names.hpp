// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <span>
#include <string_view>

namespace resonid {

/// An enumerator and its name for people: on the command line, in TOML and in JSON.
template <class Enum>
struct EnumName {
  Enum value;
  std::string_view name;
};

/// Names stand beside their enum, in the form that name_of() and from_name() find by the enum's type:
///
///     enum class Sweep { linear, logarithmic };
///     inline constexpr EnumName<Sweep> kSweepNames[] = {{Sweep::linear, "linear"}, ...};
///     [[nodiscard]] constexpr std::span<const EnumName<Sweep>> enum_names(Sweep) noexcept { return
///     kSweepNames; }
template <class Enum>
concept NamedEnum = requires(Enum e) {
  { enum_names(e) } -> std::convertible_to<std::span<const EnumName<Enum>>>;
};

template <NamedEnum Enum>
[[nodiscard]] constexpr std::string_view name_of(Enum value) noexcept {
  for (const auto& known : enum_names(value))
    if (known.value == value) return known.name;
  return {};
}

template <NamedEnum Enum>
[[nodiscard]] constexpr std::optional<Enum> from_name(std::string_view name) noexcept {
  for (const auto& known : enum_names(Enum{}))
    if (known.name == name) return known.value;
  return std::nullopt;
}

}  // namespace resonid
