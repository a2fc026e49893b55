// SPDX-License-Identifier: MIT
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

#include "monitor/brokers/nats_handles.hpp"

namespace resonid::monitor {

/// Pulls from a consumer of JetStream, one request for a batch after another.
///
/// Not by natsSubscription_Fetch(): that of libnats 3.4.1 writes beyond its list of messages where more than
/// half a batch has come late, when it had given up waiting. It takes those off the size of the batch, with
/// which it then compares how many it has.
class JetStreamPull {
 public:
  JetStreamPull(natsConnection* connection, const std::string& stream, const std::string& consumer,
                int batch);

  /// Whether it can be used; why not.
  [[nodiscard]] natsStatus status() const noexcept { return status_; }
  /// Waits up to 50 ms for the next message, which is to be acknowledged by acknowledge().
  ///
  /// @return empty, with `message` or without one; or why no more will come
  [[nodiscard]] std::string next(NatsMessage& message);
  /// Does not wait for what was asked for: that of a connection that is gone.
  void ask_again() noexcept { due_ = 0; }
  /// One that is lost on the way has the message come again.
  void acknowledge(const natsMsg* message) const;

 private:
  [[nodiscard]] natsStatus request();

  natsConnection* connection_;
  std::string subject_, payload_, inbox_;
  std::string answer_;  ///< Where the server answers the newest request: each has its own.
  std::uint64_t requests_ = 0;
  int batch_;
  NatsSubscription subscription_;
  natsStatus status_;
  int due_ = 0;  ///< Messages that were asked for and have not come.
  std::chrono::steady_clock::time_point asked_;
};

}  // namespace resonid::monitor
