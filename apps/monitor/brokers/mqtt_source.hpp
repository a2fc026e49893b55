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
  int qos = 1;  ///< 0: what is sent while nobody listens is lost. With 2 so would be what a kill cuts short.
};

/// Reads samples from an MQTT broker and a session that the broker keeps, see
/// docs/monitor_brokers.md. A message is acknowledged when its samples are in the ring; while an intake is
/// full nothing is read, and the broker queues.
///
/// Errors (fields "client_id", "topics", "qos", "mqtt"): no client id, a QoS that is neither 0 nor 1, no
/// filters or such as are none, files of TLS that cannot be used.
[[nodiscard]] expected<std::unique_ptr<Source>, Error> make_mqtt_source(MqttSourceSettings settings,
                                                                        Axes& axes);

}  // namespace resonid::monitor
