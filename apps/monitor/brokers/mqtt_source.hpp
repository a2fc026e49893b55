// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <vector>

#include "monitor/brokers/feed.hpp"
#include "monitor/brokers/mqtt_client.hpp"

namespace resonid::monitor {

struct MqttSourceSettings {
  MqttSettings broker = {};  ///< Its client id is required, and no other client's.
  std::vector<TopicSettings> topics = {};
};

/// Reads samples from an MQTT broker with QoS 1 and a session that the broker keeps, see
/// docs/monitor_brokers.md. A message is acknowledged when its samples are in the ring; while an intake is
/// full nothing is read, and the broker queues.
///
/// Errors (fields "client_id", "topics", "mqtt"): no client id, no filters or such as are none, files of TLS
/// that cannot be used.
[[nodiscard]] expected<std::unique_ptr<Source>, Error> make_mqtt_source(MqttSourceSettings settings,
                                                                        Axes& axes);

}  // namespace resonid::monitor
