// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <functional>
#include <string_view>
#include <variant>

#include "monitor/samples/frame.hpp"
#include "monitor/samples/text_decoder.hpp"

namespace resonid::monitor {

/// Reads a stream of either; of lines come arrivals only. See FrameDecoder and TextDecoder.
class Decoder {
 public:
  using Take = std::function<void(const Message&)>;

  Decoder(const Format& format, FaultLog& faults);

  void add(std::string_view bytes, const Take& take);
  /// The stream ends here.
  void finish(const Take& take);
  /// As finish(), where what is not whole may lack its end: half a line is a fault.
  void break_off();
  /// A message that is whole, a datagram for example. Keeps no large buffers.
  void message(std::string_view bytes, const Take& take);
  /// The next byte is this one of its stream, and nothing is unfinished.
  void seek(std::uint64_t byte);
  /// Names of columns, see TextDecoder.
  [[nodiscard]] bool wants_names() const noexcept;
  void adopt_names(const Decoder& other, bool same_file);
  /// While an arrival is taken: the byte of the stream where it ends.
  [[nodiscard]] std::uint64_t end_of(const Arrival& arrival) const;

 private:
  std::variant<FrameDecoder, TextDecoder> decoder_;
  FaultLog& faults_;
  std::uint64_t offset_ = 0;  ///< Of the byte that the decoder of frames counts from.
};

}  // namespace resonid::monitor
