// SPDX-License-Identifier: MIT
#include "monitor/brokers/mqtt_source.hpp"

#include <fmt/core.h>
#include <mosquitto.h>

#include "monitor/sources/thread_source.hpp"

namespace resonid::monitor {
namespace {

constexpr int kFirstRefusal = 128;  // of the codes that a broker answers a subscription with

class MqttSource final : public CountingSource {
 public:
  MqttSource(MqttSourceSettings settings, Axes& axes)
      : CountingSource(axes),
        feed_(delivery_, std::move(settings.topics), kMqttTopics),
        qos_(settings.qos),
        client_(std::move(settings.broker), handlers()) {}
  ~MqttSource() override { MqttSource::stop(); }

  void start() override {
    if (const auto started = client_.start(); !started)
      set_state(SourceState::failed, started.error().requirement.str());
  }
  void stop() override {
    delivery_.stop();
    client_.stop();
  }
  [[nodiscard]] std::string_view promise() const noexcept override {
    return "Nothing is lost, as long as the broker keeps the session and its queue has room; what comes "
           "twice is left out where samples have an index.";
  }

 private:
  MqttClient::Handlers handlers() {
    MqttClient::Handlers handlers;
    handlers.connected = [this](bool session) { connected(session); };
    handlers.waiting = [this](const std::string& why) { set_state(SourceState::waiting, why); };
    handlers.message = [this](std::string_view topic, std::string_view payload) { message(topic, payload); };
    handlers.subscribed = [this](int, std::span<const int> granted) { subscribed(granted); };
    return handlers;
  }

  void connected(bool session) {
    std::vector<std::string> filters;
    for (const auto& topic : feed_.topics()) filters.push_back(topic.filter);
    const auto sent = client_.subscribe(filters, qos_);
    if (!sent) return set_state(SourceState::waiting, sent.error().requirement.str());
    forgotten_ = had_session_ && !session;
    had_session_ = true;
  }

  /// A broker that refuses a subscription goes on serving the others.
  void subscribed(std::span<const int> granted) {
    std::string refused;
    const auto topics = feed_.topics();
    for (std::size_t k = 0; k < std::min(granted.size(), topics.size()); ++k)
      if (granted[k] >= kFirstRefusal)
        refused += fmt::format("{}the broker refuses to tell of '{}'", refused.empty() ? "" : "; ",
                               topics[k].filter);
    set_state(SourceState::running,
              refused.empty() && forgotten_
                  ? "the broker had forgotten the session: what was sent meanwhile is lost"
                  : std::move(refused));
  }

  void message(std::string_view topic, std::string_view payload) {
    const std::string name(topic);
    const auto topics = feed_.topics();
    for (std::size_t k = 0; k < topics.size(); ++k) {
      bool matches = false;
      mosquitto_topic_matches_sub(topics[k].filter.c_str(), name.c_str(), &matches);
      if (!matches) continue;
      if (delivery_.stopping() || !feed_.take(k, topic, payload)) client_.refuse();
      return;
    }
    feed_.count_unknown(topic, "was subscribed to before; a new client id is required to forget it");
  }

  Feed feed_;
  int qos_;
  MqttClient client_;
  bool had_session_ = false, forgotten_ = false;
};

}  // namespace

expected<std::unique_ptr<Source>, Error> make_mqtt_source(MqttSourceSettings settings, Axes& axes) {
  if (settings.broker.client_id.empty())
    return refuse("client_id", "a client id is required, by which the broker knows its session");
  if (settings.qos != 0 && settings.qos != 1) return refuse("qos", "must be 0 or 1", settings.qos);
  if (settings.topics.empty()) return refuse("topics", "at least one filter of topics is required");
  for (const auto& topic : settings.topics)
    if (topic.filter.empty() || mosquitto_sub_topic_check(topic.filter.c_str()) != MOSQ_ERR_SUCCESS)
      return refuse("topics",
                    fmt::format("'{}' is no filter of topics; one like machines/+/samples is required",
                                printable(topic.filter)));
  return std::make_unique<MqttSource>(std::move(settings), axes);
}

}  // namespace resonid::monitor
