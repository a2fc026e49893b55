// SPDX-License-Identifier: MIT
#pragma once

#include <chrono>
#include <cstddef>
#include <deque>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "monitor/samples/arrival_copy.hpp"
#include "monitor/sources/decoder.hpp"
#include "monitor/sources/delivery.hpp"
#include "monitor/sources/descriptor.hpp"

namespace resonid::monitor {

/// One client of a source that listens. Reads no more while an intake is full or while its answers are not
/// read.
class TcpConnection {
 public:
  using Clock = std::chrono::steady_clock;

  TcpConnection(Descriptor socket, const Format& format, Delivery& delivery);

  /// Takes what has come, at most one buffer.
  void receive(std::span<char> buffer);
  /// Tries again what an intake had no room for.
  void deliver_kept();
  /// Sends what can be sent of the answers.
  void send();

  /// For poll: POLLIN, POLLOUT, both, or 0.
  [[nodiscard]] short events() const noexcept;
  /// Nothing more will come, and everything is done.
  [[nodiscard]] bool done() const noexcept { return ended_ && kept_.empty() && answers_.empty(); }
  [[nodiscard]] bool waits_for_room() const noexcept { return !kept_.empty(); }
  [[nodiscard]] int socket() const noexcept { return socket_.get(); }
  /// Since it sent something, or was able to read.
  [[nodiscard]] Clock::time_point last() const noexcept { return last_; }
  [[nodiscard]] bool useful() const noexcept { return useful_; }
  /// Bytes that came since the last message.
  [[nodiscard]] std::size_t unfinished() const noexcept { return unfinished_; }

 private:
  struct Kept {
    ArrivalCopy message;
    bool question = false;  ///< About the message's axis.
  };

  void take(const Message& message);
  [[nodiscard]] bool handle(const Arrival& arrival);
  void answer(std::string_view axis);

  Descriptor socket_;
  Decoder decoder_;
  Delivery& delivery_;
  bool answers_frames_;
  std::deque<Kept> kept_;
  std::string answers_;
  std::size_t unfinished_ = 0;
  Clock::time_point last_ = Clock::now();
  bool useful_ = false, ended_ = false;
};

}  // namespace resonid::monitor
