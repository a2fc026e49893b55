// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/base/expected.hpp>
#include <string>
#include <variant>

#include "monitor/brokers/mqtt_source.hpp"
#include "monitor/brokers/nats_source.hpp"
#include "monitor/service/configuration.hpp"
#include "monitor/sources/command_source.hpp"
#include "monitor/sources/demo_source.hpp"
#include "monitor/sources/file_source.hpp"
#include "monitor/sources/stream_source.hpp"
#include "monitor/sources/tcp_source.hpp"
#include "monitor/sources/udp_source.hpp"

namespace resonid::monitor {

using SourceSettings =
    std::variant<StreamSettings, FileSettings, TcpSettings, UdpSettings, MqttSourceSettings,
                 NatsSourceSettings, JetStreamSourceSettings, CommandSettings, DemoSettings>;

/// What a configuration without errors makes of one of its sources. Errors: files that are no longer there.
[[nodiscard]] expected<SourceSettings, Error> source_settings(const Configuration& configuration,
                                                              const std::string& name);

}  // namespace resonid::monitor
