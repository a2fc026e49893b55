// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <resonid/base/expected.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "monitor/brokers/feed.hpp"
#include "monitor/brokers/mqtt_client.hpp"
#include "monitor/brokers/nats_settings.hpp"

namespace resonid::monitor {

/// One axis that a topic, subject or stream seems to carry; `format` is empty where nothing could be read.
struct Discovered {
  std::string name;    ///< Topic or subject.
  std::string stream;  ///< Of JetStream; empty: none.
  std::string axis;    ///< As the messages name it; empty: they do not.
  std::optional<PayloadFormat> format;
  std::vector<std::string> columns;
  std::uint64_t messages = 0, samples = 0;
  double told_rate_hz = 0.0;      ///< By the newest message; 0: not told.
  double measured_rate_hz = 0.0;  ///< Samples per second of their arrival; 0: fewer than two messages.
  bool numbered = false;          ///< Samples have an index.
  bool timed = false;             ///< They have a time.
};

/// Finds out what unknown messages carry.
class Scout {
 public:
  /// @param time_s of arrival, of any origin
  void add(std::string_view name, std::string_view stream, std::string_view payload, double time_s);
  /// By stream, name, axis.
  [[nodiscard]] std::vector<Discovered> found() const;

 private:
  struct Seen {
    Discovered what;
    double first_s = 0.0, last_s = 0.0;
    std::uint64_t samples_after_first = 0;
  };
  struct Key {
    std::string stream, name, axis;
    auto operator<=>(const Key&) const = default;
  };
  [[nodiscard]] bool read(PayloadFormat format, const Key& key, std::string_view payload, double time_s);
  void note(PayloadFormat format, Key key, const Arrival& arrival, double time_s);

  std::map<Key, Seen> seen_;
};

/// Called now and then; false ends the search.
using KeepLooking = std::function<bool()>;

/// All topics (`filter`, "#" for all) of an MQTT broker for so many seconds. Errors: as make_mqtt_source(),
/// and no connection within that time.
[[nodiscard]] expected<std::vector<Discovered>, Error> discover_mqtt(MqttSettings broker,
                                                                     const std::string& filter,
                                                                     double seconds, const KeepLooking& keep);
/// All subjects (`filter`, ">" for all) of NATS for so many seconds, but those of the servers, and what the
/// streams of JetStream have, of the newest messages of each. Errors: no connection, no filter.
[[nodiscard]] expected<std::vector<Discovered>, Error> discover_nats(const NatsSettings& servers,
                                                                     const std::string& filter,
                                                                     double seconds, const KeepLooking& keep);

}  // namespace resonid::monitor
