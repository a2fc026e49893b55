// SPDX-License-Identifier: MIT
#pragma once

#include <nats/nats.h>

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <resonid/base/expected.hpp>
#include <string>
#include <string_view>

#include "monitor/brokers/nats_settings.hpp"

namespace resonid::monitor {

/// Calls the library's function that gives back what a pointer owns.
template <auto Destroy>
struct NatsDeleter {
  template <class T>
  void operator()(T* what) const noexcept {
    Destroy(what);
  }
};
using NatsOptions = std::unique_ptr<natsOptions, NatsDeleter<natsOptions_Destroy>>;
using NatsHandle = std::unique_ptr<natsConnection, NatsDeleter<natsConnection_Destroy>>;
/// To be declared before its connection, so that it goes after it: libnats before 3.6 may use one that is
/// gone for a message that has just come (nats.c, issue 637).
using NatsSubscription = std::unique_ptr<natsSubscription, NatsDeleter<natsSubscription_Destroy>>;
using NatsMessage = std::unique_ptr<natsMsg, NatsDeleter<natsMsg_Destroy>>;
using JetStreamHandle = std::unique_ptr<jsCtx, NatsDeleter<jsCtx_Destroy>>;
using StreamInfo = std::unique_ptr<jsStreamInfo, NatsDeleter<jsStreamInfo_Destroy>>;
using ConsumerInfo = std::unique_ptr<jsConsumerInfo, NatsDeleter<jsConsumerInfo_Destroy>>;
using MessageData = std::unique_ptr<jsMsgMetaData, NatsDeleter<jsMsgMetaData_Destroy>>;

/// As `read(T** out)` fills it.
template <class Owner, class Read>
natsStatus nats_read(Owner& owner, const Read& read) {
  typename Owner::pointer raw = nullptr;
  const natsStatus status = read(&raw);
  owner.reset(raw);
  return status;
}

[[nodiscard]] inline std::string_view payload_of(const natsMsg* message) {
  const auto bytes = static_cast<std::size_t>(natsMsg_GetDataLength(message));
  return bytes == 0 ? std::string_view{} : std::string_view(natsMsg_GetData(message), bytes);
}

/// What a status of the library means, with the newest details that this thread knows.
[[nodiscard]] std::string nats_text(natsStatus status);

/// A connection to NATS servers that the library makes again whenever it is lost.
class NatsConnection {
 public:
  /// Waits up to 2 s for a server. Errors (field "nats"): no server can be reached, or lets us in; files of
  /// TLS.
  [[nodiscard]] static expected<std::unique_ptr<NatsConnection>, Error> open(const NatsSettings& settings);
  NatsConnection(const NatsConnection&) = delete;
  NatsConnection& operator=(const NatsConnection&) = delete;
  ~NatsConnection();

  [[nodiscard]] natsConnection* get() const noexcept { return handle_.get(); }
  [[nodiscard]] bool connected() const noexcept {
    return natsConnection_Status(handle_.get()) == NATS_CONN_STATUS_CONNECTED;
  }
  /// For good: the library has given up.
  [[nodiscard]] bool closed() const noexcept { return natsConnection_IsClosed(handle_.get()); }
  /// How often it was made again.
  [[nodiscard]] std::uint64_t reconnects() const noexcept {
    return reconnects_.load(std::memory_order_acquire);
  }
  /// The newest error that the server told; empty: none since it was taken last.
  [[nodiscard]] std::string take_error();

 private:
  NatsConnection() = default;

  NatsHandle handle_;
  std::atomic<std::uint64_t> reconnects_{0};
  std::mutex mutex_;
  std::string error_;
  bool ended_ = false;
  std::condition_variable ended_changed_;
};

}  // namespace resonid::monitor
