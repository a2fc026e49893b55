// SPDX-License-Identifier: MIT
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <resonid/base/expected.hpp>
#include <span>
#include <string>
#include <string_view>
#include <thread>

#include "monitor/brokers/access.hpp"
#include "monitor/brokers/mqtt_version.hpp"

struct mosquitto;

namespace resonid::monitor {

struct MqttSettings {
  std::string host = "localhost";
  std::uint16_t port = 1883;
  MqttVersion version = MqttVersion::v3_1_1;
  std::string client_id = {};  ///< Fixed: the broker keeps what it has for it. Empty: a new one each time.
  int keep_alive_s = 30;       ///< 5 ... 65535.
  Access access = {};
};

/// A connection to an MQTT broker, made again whenever it is lost, on a thread of its own.
///
/// A QoS 1 message is acknowledged after `message` has returned, not before: the thread writes only between
/// two calls of it. Handlers run on that thread. With TLS the process must ignore SIGPIPE: the library writes
/// to connections that the broker has closed.
class MqttClient {
 public:
  struct Handlers {
    std::function<void(bool session_present)> connected = [](bool) {};
    std::function<void(const std::string& why)> waiting = [](const std::string&) {};  ///< Tried again later.
    std::function<void(std::string_view topic, std::string_view payload)> message = [](auto, auto) {};
    std::function<void(int message, std::span<const int> granted)> subscribed = [](int, auto) {};
    std::function<void(int message, int reason)> acknowledged = [](int, int) {};  ///< Of what was published.
  };

  MqttClient(MqttSettings settings, Handlers handlers);
  MqttClient(const MqttClient&) = delete;
  MqttClient& operator=(const MqttClient&) = delete;
  ~MqttClient();

  /// Errors: settings out of range, files of TLS that cannot be used.
  [[nodiscard]] expected<void, Error> start();
  /// Ends the connection and the thread. An attempt to connect is not cut short (MQTT 5, and a host that does
  /// not answer: two minutes).
  void stop();
  [[nodiscard]] bool connected() const noexcept { return connected_.load(std::memory_order_acquire); }

  /// Number of the message, for `subscribed`. In the handler `connected`. Errors: no valid filters.
  [[nodiscard]] expected<int, Error> subscribe(std::span<const std::string> filters, int qos);
  /// Number of the message, for `acknowledged`. Errors: not connected, no valid topic.
  /// @param key user property Idempotency-Key, with MQTT 5
  [[nodiscard]] expected<int, Error> publish(const std::string& topic, std::string_view body,
                                             const std::string& key, int qos);
  /// For the handler `message`: the message is not acknowledged and comes again, as the connection is cut.
  void refuse();

 private:
  void run();
  void set_handlers();
  [[nodiscard]] expected<void, Error> set_access();
  [[nodiscard]] int connect();
  [[nodiscard]] int loop();
  void wait(double seconds);
  void on_connect(int reason, int flags);

  MqttSettings settings_;
  Handlers handlers_;
  std::unique_ptr<mosquitto, void (*)(mosquitto*)> client_;
  std::thread thread_;
  std::atomic<bool> stopping_{false}, connected_{false};
  std::string refused_;         ///< Why the broker let us not in.
  bool was_connected_ = false;  ///< Since the last attempt.
  std::mutex mutex_, ending_;
  std::condition_variable changed_;
};

}  // namespace resonid::monitor
