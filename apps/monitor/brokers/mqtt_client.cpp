// SPDX-License-Identifier: MIT
#include "monitor/brokers/mqtt_client.hpp"

#include <fmt/core.h>
#include <mosquitto.h>
#include <mqtt_protocol.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <optional>
#include <system_error>
#include <vector>

namespace resonid::monitor {
namespace {

constexpr int kLoop_ms = 200;
constexpr double kFirstWait_s = 0.25, kMostWait_s = 10.0;
constexpr auto kGoodbye = std::chrono::seconds(1);  // for a broker that does not read

std::string mosquitto_text(int code) {
  return code == MOSQ_ERR_ERRNO ? std::generic_category().message(errno) : mosquitto_strerror(code);
}

unexpected<Error> mqtt_error(std::string what) { return unexpected<Error>(Error{"mqtt", std::move(what)}); }

struct Properties {
  mosquitto_property* list = nullptr;
  Properties() = default;
  Properties(const Properties&) = delete;
  Properties& operator=(const Properties&) = delete;
  ~Properties() { mosquitto_property_free_all(&list); }
};

}  // namespace

MqttClient::MqttClient(MqttSettings settings, Handlers handlers)
    : settings_(std::move(settings)), handlers_(std::move(handlers)), client_(nullptr, mosquitto_destroy) {
  static const int initialized = mosquitto_lib_init();
  static_cast<void>(initialized);
}

MqttClient::~MqttClient() { stop(); }

/// Called by the library, on the thread of the connection.
void MqttClient::on_connect(int reason, int flags) {
  if (reason != 0) {
    refused_ = settings_.version == MqttVersion::v5 ? mosquitto_reason_string(reason)
                                                    : mosquitto_connack_string(reason);
    mosquitto_disconnect(client_.get());
    return;
  }
  was_connected_ = true;
  connected_.store(true, std::memory_order_release);
  handlers_.connected((flags & 1) != 0);
}

void MqttClient::set_handlers() {
  mosquitto* const client = client_.get();
  static constexpr auto kOf = [](void* self) -> MqttClient& { return *static_cast<MqttClient*>(self); };
  mosquitto_connect_with_flags_callback_set(
      client, [](mosquitto*, void* self, int reason, int flags) { kOf(self).on_connect(reason, flags); });
  mosquitto_disconnect_callback_set(client, [](mosquitto*, void* self, int) {
    kOf(self).connected_.store(false, std::memory_order_release);
  });
  mosquitto_message_callback_set(client, [](mosquitto*, void* self, const mosquitto_message* message) {
    const auto* payload = static_cast<const char*>(message->payload);
    const auto bytes = static_cast<std::size_t>(message->payloadlen);
    kOf(self).handlers_.message(message->topic,
                                bytes == 0 ? std::string_view{} : std::string_view(payload, bytes));
  });
  mosquitto_subscribe_callback_set(
      client, [](mosquitto*, void* self, int message, int count, const int* granted) {
        kOf(self).handlers_.subscribed(message, std::span(granted, static_cast<std::size_t>(count)));
      });
  mosquitto_publish_v5_callback_set(
      client, [](mosquitto*, void* self, int message, int reason, const mosquitto_property*) {
        kOf(self).handlers_.acknowledged(message, reason);
      });
}

expected<void, Error> MqttClient::set_access() {
  if (const auto& credentials = settings_.access.credentials)
    if (const int code = mosquitto_username_pw_set(client_.get(), credentials->user.c_str(),
                                                   credentials->password.c_str()))
      return mqtt_error(fmt::format("user or password: {}", mosquitto_text(code)));
  if (!settings_.access.tls) return {};
  const Tls& tls = *settings_.access.tls;
  const auto file = [](const std::filesystem::path& path) { return path.empty() ? nullptr : path.c_str(); };
  const int code = mosquitto_tls_set(client_.get(), file(tls.authorities),
                                     tls.authorities.empty() ? "/etc/ssl/certs" : nullptr,
                                     file(tls.certificate), file(tls.key), nullptr);
  if (code != MOSQ_ERR_SUCCESS)
    return mqtt_error(fmt::format("files of TLS ('{}', '{}', '{}'): {}", tls.authorities.string(),
                                  tls.certificate.string(), tls.key.string(), mosquitto_text(code)));
  return {};
}

expected<void, Error> MqttClient::start() {
  if (settings_.host.empty() || settings_.port == 0) return mqtt_error("a host and a port are required");
  if (settings_.keep_alive_s < 5 || settings_.keep_alive_s > 65535)
    return resonid::refuse("keep_alive_s", "5 ... 65535 s are required", settings_.keep_alive_s);
  const bool fresh = settings_.client_id.empty();
  client_.reset(mosquitto_new(fresh ? nullptr : settings_.client_id.c_str(), fresh, this));
  if (!client_)
    return mqtt_error(fmt::format("client id '{}': {}", settings_.client_id, mosquitto_text(MOSQ_ERR_ERRNO)));
  mosquitto_int_option(client_.get(), MOSQ_OPT_PROTOCOL_VERSION,
                       settings_.version == MqttVersion::v5 ? MQTT_PROTOCOL_V5 : MQTT_PROTOCOL_V311);
  mosquitto_int_option(client_.get(), MOSQ_OPT_TCP_NODELAY, 1);
  mosquitto_threaded_set(client_.get(), true);  // or it acknowledges before the handler runs
  if (auto set = set_access(); !set) return set;
  set_handlers();
  thread_ = std::thread([this] { run(); });
  return {};
}

void MqttClient::stop() {
  const std::lock_guard lock(ending_);
  {
    const std::lock_guard state(mutex_);
    stopping_.store(true, std::memory_order_release);
  }
  changed_.notify_all();
  if (connected()) mosquitto_disconnect(client_.get());
  if (thread_.joinable()) thread_.join();
}

void MqttClient::wait(double seconds) {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, std::chrono::duration<double>(seconds), [this] { return stopping_.load(); });
}

/// Anew every time: a repeated connection would forget its properties.
int MqttClient::connect() {
  refused_.clear();
  was_connected_ = false;
  if (settings_.version != MqttVersion::v5)
    return mosquitto_connect_async(client_.get(), settings_.host.c_str(), settings_.port,
                                   settings_.keep_alive_s);
  Properties properties;
  if (!settings_.client_id.empty())
    mosquitto_property_add_int32(&properties.list, MQTT_PROP_SESSION_EXPIRY_INTERVAL, UINT32_MAX);  // never
  return mosquitto_connect_bind_v5(client_.get(), settings_.host.c_str(), settings_.port,
                                   settings_.keep_alive_s, nullptr, properties.list);
}

int MqttClient::loop() {
  int code = MOSQ_ERR_SUCCESS;
  std::optional<std::chrono::steady_clock::time_point> last;
  while (code == MOSQ_ERR_SUCCESS) {
    if (stopping_.load(std::memory_order_acquire)) {
      const auto now = std::chrono::steady_clock::now();
      if (!last) last = now + kGoodbye;
      if (!connected() || now > *last) break;
    }
    code = mosquitto_loop(client_.get(), kLoop_ms, 1);
  }
  return code;
}

void MqttClient::run() {
  double wait_s = kFirstWait_s;
  while (!stopping_.load(std::memory_order_acquire)) {
    int code = connect();
    if (code == MOSQ_ERR_SUCCESS) code = loop();
    connected_.store(false, std::memory_order_release);
    if (stopping_.load(std::memory_order_acquire)) return;
    handlers_.waiting(fmt::format("{}:{}: {}", settings_.host, settings_.port,
                                  refused_.empty() ? mosquitto_text(code) : refused_));
    if (was_connected_) wait_s = kFirstWait_s;
    wait(wait_s);
    wait_s = std::min(2.0 * wait_s, kMostWait_s);
  }
}

expected<int, Error> MqttClient::subscribe(std::span<const std::string> filters, int qos) {
  std::vector<std::string> copies(filters.begin(), filters.end());
  std::vector<char*> names;
  for (auto& name : copies) names.push_back(name.data());
  int message = 0;
  const int code = mosquitto_subscribe_multiple(client_.get(), &message, static_cast<int>(names.size()),
                                                names.data(), qos, 0, nullptr);
  if (code != MOSQ_ERR_SUCCESS) return mqtt_error(fmt::format("cannot subscribe: {}", mosquitto_text(code)));
  return message;
}

expected<int, Error> MqttClient::publish(const std::string& topic, std::string_view body,
                                         const std::string& key, int qos) {
  if (!connected()) return mqtt_error(fmt::format("{}:{} is not connected", settings_.host, settings_.port));
  Properties properties;
  if (settings_.version == MqttVersion::v5)
    mosquitto_property_add_string_pair(&properties.list, MQTT_PROP_USER_PROPERTY, "Idempotency-Key",
                                       key.c_str());
  int message = 0;
  const int code = mosquitto_publish_v5(client_.get(), &message, topic.c_str(), static_cast<int>(body.size()),
                                        body.data(), qos, false, properties.list);
  if (code != MOSQ_ERR_SUCCESS)
    return mqtt_error(fmt::format("cannot publish to '{}': {}", topic, mosquitto_text(code)));
  return message;
}

void MqttClient::refuse() { ::shutdown(mosquitto_socket(client_.get()), SHUT_RDWR); }

}  // namespace resonid::monitor
