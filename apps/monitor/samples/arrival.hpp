// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

namespace resonid::monitor {

/// Where a source stands after a message. Words 0 and 1 name the stream, as the source likes (device and
/// inode of a file; time at which a JetStream was made), words 2 and 3 count in it, word 2 before word 3 (0
/// and byte of a file; sequence and byte of a message). All zero: the source cannot tell.
struct SourcePosition {
  std::array<std::uint64_t, 4> word{};

  friend bool operator==(const SourcePosition&, const SourcePosition&) = default;
  [[nodiscard]] bool told() const noexcept { return *this != SourcePosition{}; }
  /// Whether what ends here had come when `other` was reached; false for another stream.
  [[nodiscard]] bool at_or_before(const SourcePosition& other) const noexcept {
    return word[0] == other.word[0] && word[1] == other.word[1] &&
           (word[2] < other.word[2] || (word[2] == other.word[2] && word[3] <= other.word[3]));
  }
};

/// Consecutive samples of one axis as a source got them. What it points to lives as long as the call that it
/// is given to.
struct Arrival {
  std::string_view axis;  ///< As the source names it; empty: the source has one axis only.
  std::optional<std::uint64_t> first_sample;  ///< By the sender.
  std::optional<std::int64_t> time_ns;        ///< UNIX, of the first sample, by the sender.
  double sample_rate_hz = 0.0;                ///< 0: not told.
  std::span<const std::string_view> columns;  ///< Names.
  std::span<const double> values;             ///< [sample][column]; not a number: missing.
  std::span<const std::uint64_t> ends;  ///< [sample] Byte of the stream or message at which it ends, for word
                                        ///< 3 of the position; empty: all come as one piece.

  [[nodiscard]] std::size_t samples() const noexcept {
    return columns.empty() ? 0 : values.size() / columns.size();
  }
};

}  // namespace resonid::monitor
