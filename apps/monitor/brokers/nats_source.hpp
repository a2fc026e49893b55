// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "monitor/brokers/feed.hpp"
#include "monitor/brokers/nats_settings.hpp"

namespace resonid::monitor {

struct NatsSourceSettings {
  NatsSettings servers = {};
  std::vector<TopicSettings> subjects = {};
  int most_messages = 65'536;         ///< That wait in memory, of each filter; what comes then is lost.
  int most_bytes = 64 * 1024 * 1024;  ///< Likewise.
};

/// Reads samples from NATS subjects. A server keeps nothing for us: what it sends while we are away is lost,
/// and the intakes find the gap; what does not fit the queue is lost and counted.
///
/// Errors (field "subjects"): no filters, or such as are none.
[[nodiscard]] expected<std::unique_ptr<Source>, Error> make_nats_source(NatsSourceSettings settings,
                                                                        Axes& axes);

struct JetStreamSourceSettings {
  NatsSettings servers = {};
  std::string stream = {};
  std::string consumer = {};    ///< Durable, made where there is none; no other program's.
  TopicSettings subjects = {};  ///< Filter; empty: all of the stream.
  int batch = 256;              ///< Messages that are asked for at once, 1 ... 10000.
};

/// Reads samples from a stream of JetStream, see docs/monitor_brokers.md. A message is acknowledged when its
/// samples are in the ring; every axis' ring knows the stream and the sequence, so that what comes again is
/// left out.
///
/// Errors (fields "stream", "consumer", "subjects", "batch"): names that are none, out of range.
[[nodiscard]] expected<std::unique_ptr<Source>, Error> make_jetstream_source(JetStreamSourceSettings settings,
                                                                             Axes& axes);

}  // namespace resonid::monitor
