// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/c/detail/types.h>

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
inline resonid_status fail(resonid_error* error, resonid_status status, std::string_view field,
                           std::string_view requirement, double value = kNoValue) noexcept {
  if (error == nullptr || error->struct_size < sizeof error->struct_size) return status;
  resonid_error whole{};
  whole.struct_size = error->struct_size;
  whole.status = status;
  whole.value = value;
  copy_text(whole.field, field);
  copy_text(whole.requirement, requirement);
  std::memcpy(error, &whole, std::min<std::size_t>(error->struct_size, sizeof whole));
  return status;
}
inline resonid_status fail(resonid_error* error, const Error& reason) noexcept {
  return fail(error, RESONID_ERROR_SETTINGS, reason.field, reason.requirement, reason.value);
}
inline resonid_status fail_null(resonid_error* error, std::string_view argument) noexcept {
  return fail(error, RESONID_ERROR_NULL, argument, "must not be NULL");
}

/// The caller's array; nothing when it is NULL, which its estimator refuses where it needs one.
template <class T>
std::span<const T> array(const T* values, std::size_t count) noexcept {
  return values == nullptr ? std::span<const T>() : std::span<const T>(values, count);
}

/// An enumerator of C++ that has the number, if there is one.
template <class Enum>
expected<Enum> enumerator(const char* field, std::uint32_t number, Enum last) noexcept {
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

/// `result` to the caller, as much of it as there is room for, beginning with the size.
template <class Struct>
resonid_status give(const Struct& result, void* out, std::size_t struct_size) noexcept {
  if (out == nullptr) return RESONID_ERROR_NULL;
  if (!possible_size<Struct>(struct_size)) return RESONID_ERROR_SIZE;
  const auto filled = static_cast<std::uint32_t>(std::min(struct_size, sizeof(Struct)));
  std::memcpy(out, &result, filled);
  std::memcpy(out, &filled, sizeof filled);
  return RESONID_OK;
}

/// Refuses unless the caller's array has one place for each of `count` values.
inline resonid_status check_array(const void* array, std::size_t given, std::size_t count) noexcept {
  if (array == nullptr) return RESONID_ERROR_NULL;
  return given == count ? RESONID_OK : RESONID_ERROR_RANGE;
}

}  // namespace resonid::c
