// SPDX-License-Identifier: MIT
#include "monitor/brokers/nats_source.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <chrono>

#include "monitor/brokers/broker_source.hpp"
#include "monitor/brokers/nats_handles.hpp"
#include "monitor/brokers/nats_subject.hpp"

namespace resonid::monitor {
namespace {

constexpr double kLook_s = 0.1;  // from one look at the counters to the next
constexpr std::int64_t kSubscribe_ms = 5000;
constexpr auto kDrain = std::chrono::seconds(1);  // in which what waits in memory is taken at the end

class NatsSource final : public BrokerSource {
 public:
  NatsSource(NatsSourceSettings settings, Axes& axes)
      : BrokerSource(axes, settings.subjects, kNatsSubjects), settings_(std::move(settings)) {}
  ~NatsSource() override { NatsSource::stop(); }

  [[nodiscard]] std::string_view promise() const noexcept override {
    return "What is sent while the process or the connection is down, and what waits in memory when it is "
           "killed, is lost.";
  }

 private:
  /// One filter; the library calls for it on a thread of its own.
  struct Subscription {
    NatsSource* source = nullptr;
    std::size_t topic = 0;
    NatsSubscription handle;
    std::int64_t dropped = 0;
    bool ended = false;
  };

  [[nodiscard]] std::string serve() override {
    std::vector<Subscription> subscriptions(settings_.subjects.size());
    const auto connection = NatsConnection::open(settings_.servers);
    if (!connection)
      return fmt::format("{}: {}", connection.error().where.view(), connection.error().requirement.view());
    std::string why = follow(**connection, subscriptions);
    end(subscriptions, (*connection)->connected());
    return why;
  }

  /// Takes what waits in memory, for a while and where there is room; what is left is counted as lost.
  void end(std::vector<Subscription>& subscriptions, bool connected) {
    const auto all_ended = [&] {
      return std::all_of(subscriptions.begin(), subscriptions.end(),
                         [](const Subscription& s) { return s.ended || !s.handle; });
    };
    for (auto& subscription : subscriptions)
      if (connected && subscription.handle) natsSubscription_Drain(subscription.handle.get());
    if (std::unique_lock lock(ending_); connected) ended_.wait_for(lock, kDrain, all_ended);
    for (auto& subscription : subscriptions) {
      if (!subscription.handle) continue;
      count_dropped(subscription);
      int waiting = 0;
      if (natsSubscription_GetPending(subscription.handle.get(), &waiting, nullptr) == NATS_OK)
        delivery_.count_lost(static_cast<std::uint64_t>(waiting));
      natsSubscription_Unsubscribe(subscription.handle.get());
    }
    std::unique_lock lock(ending_);
    ended_.wait(lock, all_ended);
  }

  [[nodiscard]] std::string follow(NatsConnection& connection, std::vector<Subscription>& subscriptions) {
    for (std::size_t k = 0; k < subscriptions.size(); ++k)
      if (const natsStatus status = subscribe(connection, k, subscriptions[k]); status != NATS_OK)
        return nats_text(status);
    if (const natsStatus status = natsConnection_FlushTimeout(connection.get(), kSubscribe_ms);
        status != NATS_OK)
      return nats_text(status);  // from here on the server knows
    std::string error;
    while (!stopping()) {
      if (connection.closed()) return error.empty() ? "the server has closed the connection" : error;
      if (auto newest = connection.take_error(); !newest.empty()) error = std::move(newest);
      set_state(connection.connected() ? SourceState::running : SourceState::waiting,
                connection.connected() || !error.empty() ? error : "no server answers");
      static_cast<void>(wait(kLook_s));
      for (auto& subscription : subscriptions) count_dropped(subscription);
    }
    return {};
  }

  [[nodiscard]] natsStatus subscribe(NatsConnection& connection, std::size_t topic,
                                     Subscription& subscription) {
    subscription.source = this;
    subscription.topic = topic;
    natsStatus status = nats_read(subscription.handle, [&](natsSubscription** handle) {
      return natsConnection_Subscribe(handle, connection.get(), settings_.subjects[topic].filter.c_str(),
                                      on_message, &subscription);
    });
    if (status != NATS_OK) return status;
    natsSubscription* const handle = subscription.handle.get();
    status = natsSubscription_SetPendingLimits(handle, settings_.most_messages, settings_.most_bytes);
    if (const natsStatus told = natsSubscription_SetOnCompleteCB(handle, on_end, &subscription);
        told != NATS_OK) {
      subscription.ended = true;  // it was closed before
      return told;
    }
    return status;
  }

  void count_dropped(Subscription& subscription) {
    std::int64_t dropped = 0;
    if (natsSubscription_GetDropped(subscription.handle.get(), &dropped) != NATS_OK) return;
    delivery_.count_lost(static_cast<std::uint64_t>(dropped - subscription.dropped));
    subscription.dropped = dropped;
  }

  static void on_message(natsConnection*, natsSubscription*, natsMsg* raw, void* closure) {
    const NatsMessage message(raw);
    const auto& subscription = *static_cast<Subscription*>(closure);
    NatsSource& source = *subscription.source;
    if (!source.feed_.take(subscription.topic, natsMsg_GetSubject(raw), payload_of(raw)))
      source.delivery_.count_lost(1);
  }

  static void on_end(void* closure) {
    auto& subscription = *static_cast<Subscription*>(closure);
    NatsSource& source = *subscription.source;
    const std::lock_guard lock(source.ending_);
    subscription.ended = true;
    source.ended_.notify_all();
  }

  NatsSourceSettings settings_;
  std::mutex ending_;
  std::condition_variable ended_;
};

}  // namespace

expected<std::unique_ptr<Source>, Error> make_nats_source(NatsSourceSettings settings, Axes& axes) {
  if (settings.subjects.empty()) return refuse("subjects", "at least one filter of subjects is required");
  for (const auto& subject : settings.subjects)
    if (!is_subject_filter(subject.filter))
      return refuse("subjects",
                    fmt::format("'{}' is no filter of subjects; one like machines.*.samples is required",
                                printable(subject.filter)));
  return std::make_unique<NatsSource>(std::move(settings), axes);
}

}  // namespace resonid::monitor
