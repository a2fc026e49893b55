// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <resonid/base/enum_names.hpp>
#include <span>
#include <string>

namespace resonid::monitor {

/// Why the store could not do it.
enum class StoreFault : std::uint8_t {
  full,          ///< No space, or a quota: goes away when there is space again.
  locked,        ///< Another process writes.
  read_only,     ///< The file or its file system.
  damaged,       ///< The file is not what was written.
  newer,         ///< Written by a later version of this program, or by another program.
  input_output,  ///< Anything else that the system refused.
  invalid,       ///< The caller's data.
};
inline constexpr EnumName<StoreFault> kStoreFaultNames[] = {
    {StoreFault::full, "full"},           {StoreFault::locked, "locked"},
    {StoreFault::read_only, "read-only"}, {StoreFault::damaged, "damaged"},
    {StoreFault::newer, "newer"},         {StoreFault::input_output, "input-output"},
    {StoreFault::invalid, "invalid"}};
[[nodiscard]] constexpr std::span<const EnumName<StoreFault>> enum_names(StoreFault) noexcept {
  return kStoreFaultNames;
}

/// A fault with what was found, where, and what is required, in words.
struct StoreError {
  StoreFault fault = StoreFault::input_output;
  std::string text;
};

}  // namespace resonid::monitor
