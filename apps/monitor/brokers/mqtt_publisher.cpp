// SPDX-License-Identifier: MIT
#include <fmt/core.h>
#include <mosquitto.h>

#include <chrono>
#include <condition_variable>
#include <map>
#include <mutex>

#include "monitor/brokers/publisher.hpp"
#include "monitor/samples/faults.hpp"

namespace resonid::monitor {
namespace {

constexpr auto kPatience = std::chrono::seconds(5);
constexpr int kFirstRefusedReason = 128;

unexpected<Error> not_published(std::string why) {
  return unexpected<Error>(Error{"publisher", std::move(why)});
}

class MqttPublisher final : public Publisher {
 public:
  MqttPublisher(MqttSettings settings, int qos) : qos_(qos), client_(std::move(settings), handlers()) {}
  ~MqttPublisher() override { client_.stop(); }

  [[nodiscard]] expected<void, Error> start() { return client_.start(); }

  [[nodiscard]] expected<void, Error> publish(std::string_view key, std::string_view topic,
                                              std::string_view body) override {
    const auto text = with_key(body, key);
    if (!text) return unexpected(text.error());
    const std::string name(topic);
    if (name.empty() || mosquitto_pub_topic_check(name.c_str()) != MOSQ_ERR_SUCCESS)
      return refuse("topic",
                    fmt::format("'{}' is no topic; one without wildcards is required", printable(topic)));
    {
      const std::lock_guard lock(mutex_);
      acknowledged_.clear();
    }
    if (!client_.connected()) {  // the first message comes before the broker has answered
      std::unique_lock lock(mutex_);
      changed_.wait_for(lock, kPatience,
                        [&] { return client_.connected() || !why_.empty() || interrupted_; });
      if (!client_.connected()) return not_published(why_.empty() ? "no connection yet" : why_);
    }
    const auto message = client_.publish(name, *text, std::string(key), qos_);
    if (!message) return not_published(message.error().requirement.str());
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, kPatience, [&] {
      return acknowledged_.count(*message) > 0 || !client_.connected() || interrupted_;
    });
    if (acknowledged_.count(*message) == 0)
      return not_published(fmt::format("no acknowledgement of '{}' has come", name));
    if (const int reason = acknowledged_[*message]; reason >= kFirstRefusedReason)
      return not_published(fmt::format("the broker refuses '{}': {}", name, mosquitto_reason_string(reason)));
    return {};
  }

  void interrupt() override {
    const std::lock_guard lock(mutex_);
    interrupted_ = true;
    changed_.notify_all();
  }

 private:
  MqttClient::Handlers handlers() {
    MqttClient::Handlers handlers;
    handlers.connected = [this](bool) {
      const std::lock_guard lock(mutex_);
      changed_.notify_all();
    };
    handlers.waiting = [this](const std::string& why) {
      const std::lock_guard lock(mutex_);
      why_ = why;
      changed_.notify_all();
    };
    handlers.acknowledged = [this](int message, int reason) {
      const std::lock_guard lock(mutex_);
      acknowledged_[message] = reason;
      changed_.notify_all();
    };
    return handlers;
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  std::map<int, int> acknowledged_;  ///< Reasons of the messages since publish() began.
  std::string why_;                  ///< There is no connection.
  bool interrupted_ = false;
  int qos_;
  MqttClient client_;
};

}  // namespace

expected<std::unique_ptr<Publisher>, Error> make_mqtt_publisher(MqttSettings settings, int qos) {
  auto publisher = std::make_unique<MqttPublisher>(std::move(settings), qos);
  if (auto started = publisher->start(); !started) return unexpected(started.error());
  return publisher;
}

}  // namespace resonid::monitor
