// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <resonid/base/expected.hpp>
#include <string>
#include <string_view>

#include "monitor/brokers/mqtt_client.hpp"
#include "monitor/brokers/nats_settings.hpp"

namespace resonid::monitor {

/// Tells others of alarms. For one thread at a time.
class Publisher {
 public:
  virtual ~Publisher() = default;
  /// Returns when the other side has confirmed that it has the message; after an error it may have it all the
  /// same: publish again with the same key, until it succeeds. Waits at most some ten seconds.
  ///
  /// @param key the same for the same message, 1 ... 200 letters, digits and -_.:/ ; it stands in the body as
  /// `idempotency_key` too, for receivers that see nothing else
  /// @param topic topic, subject, or header `Resonid-Topic` of a webhook
  /// @param body a JSON object
  /// Errors: key, topic or body are none; field "publisher": no confirmation, and why.
  [[nodiscard]] virtual expected<void, Error> publish(std::string_view key, std::string_view topic,
                                                      std::string_view body) = 0;
  /// From another thread: a publish() that waits comes back within a second (a webhook that connects: 3 s),
  /// without confirmation, and so does every later one.
  virtual void interrupt() = 0;
};

/// The body with its key. Errors (fields "key", "body"): as above.
[[nodiscard]] expected<std::string, Error> with_key(std::string_view body, std::string_view key);

/// To topics, with QoS 1 (a PUBACK confirms; with QoS 2 a PUBCOMP, with QoS 0 that it was sent); user
/// property `Idempotency-Key` with MQTT 5. Errors: as MqttClient::start(). A broker that is not there is
/// tried again all the time.
[[nodiscard]] expected<std::unique_ptr<Publisher>, Error> make_mqtt_publisher(MqttSettings settings,
                                                                              int qos = 1);

/// To subjects, with the header `Nats-Msg-Id`, by which JetStream leaves out what comes twice.
/// @param stored whether the answer of a stream confirms, else that of the server, which keeps nothing
[[nodiscard]] std::unique_ptr<Publisher> make_nats_publisher(NatsSettings settings, bool stored);

struct WebhookSettings {
  std::string url = {};  ///< http:// or https://
  std::optional<Tls> tls = {};
  std::string bearer = {};  ///< Token for the header Authorization; empty: none.
  double timeout_s = 10.0;  ///< For the answer, and for the connection, which has 3 s at most; 0.1 ... 60.
};
/// By POST with the header `Idempotency-Key`; an answer of 2xx confirms. Redirections are not followed. An
/// answer of 400, 413 or 422 refuses the message: error of field "message".
/// Errors (fields "url", "timeout_s", "bearer"): no URL, out of range.
[[nodiscard]] expected<std::unique_ptr<Publisher>, Error> make_webhook_publisher(WebhookSettings settings);

}  // namespace resonid::monitor
