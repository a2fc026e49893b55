// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <resonid/base/expected.hpp>
#include <string>
#include <vector>

#include "monitor/service/installation.hpp"
#include "monitor/store/reader.hpp"
#include "monitor/store/records.hpp"

namespace resonid::monitor {

/// Tells every transition of an alarm to every target, each on a thread of its own: in order, each message
/// again until it is confirmed, after 1 s, 2 s ... 60 s. The store remembers what waits and what is
/// delivered: queue() and take() give its records, which the one who writes it commits. For any thread.
class Deliveries {
 public:
  struct Options {
    double first_wait_s = 1.0, most_wait_s = 60.0;
    std::size_t most_waiting = 20'000;  ///< For one target; beyond that the oldest is given up.
    double patience_s = 30.0 * 86400;   ///< For a target that is down; then a message is given up.
    double refused_s = 3600.0;          ///< The same for a message that is refused for what it is.
  };
  struct Status {
    std::string name;
    std::uint64_t waiting = 0;
    std::uint64_t delivered = 0, failures = 0, given_up = 0;  ///< Since the start.
    std::string fault;                                        ///< Why the last try failed; empty: it did not.
  };

  /// With the messages that a former process left.
  [[nodiscard]] static expected<std::unique_ptr<Deliveries>, StoreError> open(
      Reader& reader, std::vector<InstalledTarget> targets, const Options& options);
  ~Deliveries();
  Deliveries(const Deliveries&) = delete;
  Deliveries& operator=(const Deliveries&) = delete;

  void start();
  /// Ends what is being sent, which is not confirmed then, within seconds. What waits is for the next start.
  void stop();

  /// One message for each target of this transition, for the transaction that it is written in.
  void queue(const AlarmRecord& alarm, const EventRecord& event, std::int64_t time_ns, Batch& batch) const;
  /// Takes what queue() gave, but for what the store knew already.
  void send(std::vector<OutboxRecord> messages);
  /// What has become of messages since the last call.
  [[nodiscard]] std::vector<DeliveryRecord> take();
  [[nodiscard]] std::vector<Status> status() const;

 private:
  struct Line;
  Deliveries(std::string installation, const Options& options);
  void run(Line& line);

  std::string installation_;
  Options options_;
  std::vector<std::unique_ptr<Line>> lines_;
  std::vector<DeliveryRecord> forgotten_;  // of targets that are no longer there
};

}  // namespace resonid::monitor
