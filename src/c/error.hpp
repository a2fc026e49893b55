// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/c/types.h>

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <limits>
#include <resonid/base/expected.hpp>
#include <span>
#include <string_view>

namespace resonid::c {

inline constexpr double kNoValue = std::numeric_limits<double>::quiet_NaN();

template <std::size_t Room>
void copy_text(char (&to)[Room], std::string_view text) noexcept {
  const std::size_t count = text.size() < Room ? text.size() : Room - 1;
  std::memcpy(to, text.data(), count);
  to[count] = '\0';
}

/// Writes the reason where the caller wants it, and returns the status.
inline resonid_status fail(resonid_error* error, resonid_status status, const Error& reason) noexcept {
  if (error == nullptr || error->struct_size < sizeof error->struct_size) return status;
  resonid_error whole{};
  whole.struct_size = error->struct_size;
  whole.status = status;
  whole.value = reason.value;
  copy_text(whole.field, reason.field);
  copy_text(whole.requirement, reason.requirement);
  std::memcpy(error, &whole, std::min<std::size_t>(error->struct_size, sizeof whole));
  return status;
}
inline resonid_status fail_null(resonid_error* error, std::string_view argument) noexcept {
  return fail(error, RESONID_ERROR_NULL, {argument, "must not be NULL"});
}

/// The caller's array; nothing when it is NULL, which its estimator refuses where it needs one.
template <class T>
std::span<const T> array(const T* values, std::size_t count) noexcept {
  return values == nullptr ? std::span<const T>() : std::span<const T>(values, count);
}

/// An enumerator of C++ that has the number, if there is one.
template <class Enum>
expected<Enum, Error> enumerator(std::string_view field, std::uint32_t number, Enum last) noexcept {
  if (number > static_cast<std::uint32_t>(last))
    return refuse(field, "must be one of its constants", static_cast<double>(number));
  return static_cast<Enum>(number);
}

// Structs begin with their size and consist of slots of this many bytes, so that any prefix of whole slots is
// one that a caller with older headers may have.
template <class Struct>
bool possible_size(std::size_t size) noexcept {
  constexpr std::size_t kLargest = 65536;  // beyond it, memory that was never set
  return size >= alignof(Struct) && size % alignof(Struct) == 0 && size <= kLargest;
}

/// `result` to the caller, as much of it as there is room for.
template <class Struct>
resonid_status give(Struct result, Struct* out, std::size_t struct_size) noexcept {
  if (out == nullptr) return RESONID_ERROR_NULL;
  if (!possible_size<Struct>(struct_size)) return RESONID_ERROR_SIZE;
  const std::size_t filled = struct_size < sizeof(Struct) ? struct_size : sizeof(Struct);
  result.struct_size = static_cast<std::uint32_t>(filled);
  std::memcpy(out, &result, filled);
  return RESONID_OK;
}

/// A configuration of defaults in the caller's struct; what only a newer header knows is set to 0.
template <class Config>
resonid_status give_defaults(Config defaults, Config* out, std::size_t struct_size) noexcept {
  if (out == nullptr) return RESONID_ERROR_NULL;
  if (!possible_size<Config>(struct_size)) return RESONID_ERROR_SIZE;
  const std::size_t known = struct_size < sizeof(Config) ? struct_size : sizeof(Config);
  defaults.struct_size = static_cast<std::uint32_t>(struct_size);
  if (struct_size > known) std::memset(static_cast<void*>(out), 0, struct_size);
  std::memcpy(static_cast<void*>(out), &defaults, known);
  return RESONID_OK;
}

/// The caller's configuration over `config`, which holds the defaults. Of a longer struct than this library
/// knows, the rest must be 0: a newer caller that asks for what is not there is refused.
template <class Config>
resonid_status take(const Config* given, Config& config, resonid_error* error) noexcept {
  if (given == nullptr) return fail_null(error, "config");
  const std::size_t size = given->struct_size;
  const Error kSize{"struct_size", "must be set by the defaults function"};
  if (!possible_size<Config>(size)) return fail(error, RESONID_ERROR_SIZE, kSize);
  const std::size_t known = size < sizeof(Config) ? size : sizeof(Config);
  std::memcpy(static_cast<void*>(&config), given, known);
  const auto* bytes = reinterpret_cast<const unsigned char*>(given);
  for (std::size_t i = known; i < size; ++i)
    if (bytes[i] != 0)
      return fail(error, RESONID_ERROR_CONFIG,
                  {"struct_size", "has fields set that this library does not know"});
  return RESONID_OK;
}

}  // namespace resonid::c
