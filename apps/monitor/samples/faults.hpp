// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <resonid/base/enum_names.hpp>
#include <span>
#include <string>
#include <string_view>

namespace resonid::monitor {

/// What can be wrong with samples that arrive.
enum class Fault : std::uint8_t {
  format,   ///< Not what the format requires; garbage between frames.
  size,     ///< Longer than the limits.
  axis,     ///< No such axis.
  columns,  ///< A column that the axis needs is not there.
  rate,     ///< The told rate, or the one that is found, is not that of the axis.
  value,    ///< Runs of values that are no finite numbers.
  clock,    ///< The sender's time jumps.
  order,    ///< Samples that come after later ones, or far ahead of what is due.
  restart   ///< The sender counts its samples from the beginning again.
};
inline constexpr std::size_t kFaults = 9;
inline constexpr EnumName<Fault> kFaultNames[] = {
    {Fault::format, "format"},   {Fault::size, "size"},   {Fault::axis, "axis"},
    {Fault::columns, "columns"}, {Fault::rate, "rate"},   {Fault::value, "value"},
    {Fault::clock, "clock"},     {Fault::order, "order"}, {Fault::restart, "restart"}};
[[nodiscard]] constexpr std::span<const EnumName<Fault>> enum_names(Fault) noexcept { return kFaultNames; }

/// The beginning of foreign bytes as they may stand in a message: UTF-8 without control characters, at most
/// `most` bytes.
[[nodiscard]] std::string printable(std::string_view bytes, std::size_t most = 80);

/// Counts faults by kind, with the newest example of each. For any thread.
class FaultLog {
 public:
  /// One more fault; `text` says what was found, where, and what is required.
  void note(Fault kind, std::string text);

  [[nodiscard]] std::uint64_t count(Fault kind) const noexcept {
    return counts_[static_cast<std::size_t>(kind)].load(std::memory_order_relaxed);
  }
  [[nodiscard]] std::uint64_t total() const noexcept;
  /// Empty while there was none.
  [[nodiscard]] std::string example(Fault kind) const;
  /// The newest one of any kind.
  [[nodiscard]] std::string newest() const;

 private:
  std::array<std::atomic<std::uint64_t>, kFaults> counts_{};
  mutable std::mutex mutex_;
  std::array<std::string, kFaults> examples_;
  std::size_t newest_ = 0;
};

}  // namespace resonid::monitor
