// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <resonid/base/expected.hpp>
#include <string>
#include <vector>

#include "monitor/brokers/mqtt_client.hpp"
#include "monitor/brokers/nats_settings.hpp"
#include "monitor/brokers/scout.hpp"

namespace resonid::monitor {

/// Called now and then; false ends the search.
using KeepLooking = std::function<bool()>;

/// All topics (`filter`, "#" for all) of an MQTT broker for so many seconds. Errors: as make_mqtt_source(),
/// and no connection, which is tried once.
[[nodiscard]] expected<std::vector<Discovered>, Error> discover_mqtt(MqttSettings broker,
                                                                     const std::string& filter,
                                                                     double seconds, const KeepLooking& keep);
/// All subjects (`filter`, ">" for all) of NATS for so many seconds, but those of the servers, and what the
/// streams of JetStream have, of the newest messages of each. Errors: no connection, no filter.
[[nodiscard]] expected<std::vector<Discovered>, Error> discover_nats(const NatsSettings& servers,
                                                                     const std::string& filter,
                                                                     double seconds, const KeepLooking& keep);

}  // namespace resonid::monitor
