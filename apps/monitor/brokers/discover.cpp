// SPDX-License-Identifier: MIT
#include "monitor/brokers/discover.hpp"

#include <fmt/core.h>
#include <mosquitto.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <mutex>
#include <thread>

#include "monitor/brokers/nats_handles.hpp"
#include "monitor/brokers/nats_subject.hpp"

namespace resonid::monitor {
namespace {

constexpr std::uint64_t kNewest = 100;  // messages of a stream that are looked at
constexpr auto kTick = std::chrono::milliseconds(50);
constexpr double kNanosecond_s = 1e-9;

double now_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

void look(double seconds, const KeepLooking& keep) {
  const double end_s = now_s() + seconds;
  while (now_s() < end_s && keep()) std::this_thread::sleep_for(kTick);
}

/// What the newest messages of a stream tell; by their times in it.
void look_at_stream(jsCtx* js, const jsStreamInfo& stream, std::string_view filter, Scout& scout) {
  const std::string name = stream.Config->Name;
  const std::uint64_t last = stream.State.LastSeq;
  for (std::uint64_t k = std::max(stream.State.FirstSeq, last > kNewest ? last - kNewest + 1 : 1); k <= last;
       ++k) {
    NatsMessage message;
    const natsStatus status = nats_read(
        message, [&](natsMsg** raw) { return js_GetMsg(raw, js, name.c_str(), k, nullptr, nullptr); });
    if (status != NATS_OK) continue;
    const char* const subject = natsMsg_GetSubject(message.get());
    if (subject_matches(filter, subject))
      scout.add(subject, name, payload_of(message.get()),
                kNanosecond_s * static_cast<double>(natsMsg_GetTime(message.get())));
  }
}

struct StreamList {
  jsStreamInfoList* list = nullptr;
  StreamList() = default;
  StreamList(const StreamList&) = delete;
  StreamList& operator=(const StreamList&) = delete;
  ~StreamList() { jsStreamInfoList_Destroy(list); }
};

/// Nothing where the servers have no JetStream.
void look_at_streams(natsConnection* connection, std::string_view filter, Scout& scout,
                     const KeepLooking& keep) {
  JetStreamHandle js;
  jsOptions options;
  jsOptions_Init(&options);
  options.Wait = 2000;
  if (nats_read(js, [&](jsCtx** raw) { return natsConnection_JetStream(raw, connection, &options); }) !=
      NATS_OK)
    return;
  StreamList streams;
  if (js_Streams(&streams.list, js.get(), nullptr, nullptr) != NATS_OK) return;
  for (int k = 0; k < streams.list->Count && keep(); ++k)
    look_at_stream(js.get(), *streams.list->List[k], filter, scout);
}

}  // namespace

expected<std::vector<Discovered>, Error> discover_mqtt(MqttSettings broker, const std::string& filter,
                                                       double seconds, const KeepLooking& keep) {
  if (filter.empty() || mosquitto_sub_topic_check(filter.c_str()) != MOSQ_ERR_SUCCESS)
    return refuse("filter", fmt::format("'{}' is no filter of topics; # has all", printable(filter)));
  std::mutex mutex;
  Scout scout;
  std::string why = "no connection";
  bool connected = false;
  std::atomic<bool> failed{false};
  broker.client_id.clear();  // nobody's session is disturbed
  MqttClient* subscriber = nullptr;
  MqttClient::Handlers handlers;
  handlers.connected = [&](bool) {
    const std::lock_guard lock(mutex);
    connected = subscriber->subscribe(std::span(&filter, 1), 0).has_value();
  };
  handlers.waiting = [&](const std::string& text) {
    const std::lock_guard lock(mutex);
    why = text;
    failed = !connected;
  };
  handlers.message = [&](std::string_view topic, std::string_view payload) {
    const std::lock_guard lock(mutex);
    scout.add(topic, {}, payload, now_s());
  };
  MqttClient client(std::move(broker), std::move(handlers));
  subscriber = &client;
  if (const auto started = client.start(); !started) return unexpected(started.error());
  look(seconds, [&] { return !failed && keep(); });
  client.stop();
  if (!connected) return unexpected<Error>(Error{"mqtt", why});
  return scout.found();
}

expected<std::vector<Discovered>, Error> discover_nats(const NatsSettings& servers, const std::string& filter,
                                                       double seconds, const KeepLooking& keep) {
  if (!is_subject_filter(filter))
    return refuse("filter", fmt::format("'{}' is no filter of subjects; > has all", printable(filter)));
  NatsSubscription subscription;
  const auto connection = NatsConnection::open(servers);
  if (!connection) return unexpected(connection.error());
  Scout scout;
  look_at_streams((*connection)->get(), filter, scout, keep);
  const natsStatus status = nats_read(subscription, [&](natsSubscription** raw) {
    return natsConnection_SubscribeSync(raw, (*connection)->get(), filter.c_str());
  });
  if (status != NATS_OK) return unexpected<Error>(Error{"nats", nats_text(status)});
  const double end_s = now_s() + seconds;
  while (now_s() < end_s && keep()) {
    NatsMessage message;
    if (nats_read(message, [&](natsMsg** raw) {
          return natsSubscription_NextMsg(raw, subscription.get(), kTick.count());
        }) != NATS_OK)
      continue;
    const std::string_view subject = natsMsg_GetSubject(message.get());
    if (subject.front() != '$' && subject.rfind("_INBOX.", 0) != 0)
      scout.add(subject, {}, payload_of(message.get()), now_s());
  }
  return scout.found();
}

}  // namespace resonid::monitor
