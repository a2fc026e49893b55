// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <resonid/base/expected.hpp>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "monitor/samples/arrival.hpp"
#include "monitor/samples/faults.hpp"

namespace resonid::monitor {

/// The binary frame, byte for byte in docs/monitor_frame.md.
inline constexpr std::size_t kLongestFrame = 1'000'000;  ///< Bytes.
inline constexpr std::size_t kMostColumns = 64;
inline constexpr std::size_t kLongestName = 255;  ///< Bytes of an axis' or a column's name.

enum class ValueType : std::uint8_t { float32 = 1, float64 = 2 };

/// What the server has of an axis on a durable place; it answers every frame and every question with it.
struct Acknowledgement {
  static constexpr std::uint64_t kRefused = UINT64_MAX;  ///< The server takes no samples of that axis.
  std::string_view axis;
  std::uint64_t next_sample = 0;  ///< Counted as the sender counts.
};

/// A client asks where to go on.
struct Question {
  std::string_view axis;
};

using Message = std::variant<Arrival, Question, Acknowledgement>;

/// The bytes of a frame. Errors: more than kMostColumns columns or none, names that are empty (of columns),
/// longer than kLongestName or not UTF-8, values that are no whole samples, more than kLongestFrame bytes.
[[nodiscard]] expected<std::string, Error> encoded(const Arrival& arrival, ValueType type);
/// Names are cut to kLongestName bytes.
[[nodiscard]] std::string encoded(const Question& question);
[[nodiscard]] std::string encoded(const Acknowledgement& acknowledgement);

/// Finds messages in a stream of bytes. After garbage it goes on with the next message that is whole and
/// right; faults are counted as `format` and `size`. Never keeps more than kLongestFrame + 64 kB of bytes and
/// the values of one frame, and reads no byte more than about five times, whatever arrives.
class FrameDecoder {
 public:
  explicit FrameDecoder(FaultLog& faults) : faults_(faults) {}

  /// Takes the next bytes and gives every message that they complete to `take`.
  void add(std::string_view bytes, const std::function<void(const Message&)>& take);
  /// The stream ends here (a datagram, a connection): what is unfinished is a fault, and forgotten.
  void finish();
  /// After a message that is whole: gives large buffers back.
  void release();

  [[nodiscard]] std::uint64_t skipped_bytes() const noexcept { return skipped_; }
  /// Bytes of the stream up to the end of the message that is being taken.
  [[nodiscard]] std::uint64_t message_end() const noexcept { return message_end_; }

 private:
  std::size_t read_some(std::string_view bytes, const std::function<void(const Message&)>& take);
  [[nodiscard]] bool read_frame(std::string_view frame, const std::function<void(const Message&)>& take);
  void skip(std::string_view bytes, std::size_t count, std::string_view why);

  FaultLog& faults_;
  std::string rest_;  ///< What is not yet a whole message.
  bool in_garbage_ = false;
  std::uint64_t received_ = 0;  ///< Bytes.
  std::uint64_t done_ = 0;      ///< Bytes before `rest_`.
  std::uint64_t message_end_ = 0;
  std::uint64_t in_vain_ = 0;  ///< Bytes whose checksum was wrong, each time that they were read.
  std::uint64_t skipped_ = 0;  ///< Bytes that were no message.
  std::vector<std::string_view> columns_;
  std::vector<double> values_;
};

}  // namespace resonid::monitor
