// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <filesystem>
#include <limits>
#include <memory>
#include <monitor/service/deliveries.hpp>
#include <monitor/store/store.hpp>
#include <stdexcept>
#include <utility>
#include <vector>

namespace resonid::monitor {

template <class T>
T must(expected<T, StoreError> result) {
  if (!result) throw std::runtime_error(result.error().text);
  return std::move(*result);
}

/// A process: what the recorder does with a store and deliveries, without an engine.
class Process {
 public:
  Process(const std::filesystem::path& folder, std::vector<InstalledTarget> targets,
          const Deliveries::Options& options = {0.005, 0.02})
      : store_(must(Store::open((folder / "monitor.sqlite").string(), {}))),
        reader_(must(Reader::open((folder / "monitor.sqlite").string()))),
        deliveries_(must(Deliveries::open(reader_, std::move(targets), options))) {
    deliveries_->start();
  }

  /// Transition number `sample` of an alarm, as after a replay when it was there before.
  void happens(std::uint64_t sample, bool written = true) {
    Batch batch;
    AlarmRecord alarm;
    alarm.id = "17";
    alarm.axis = "x";
    alarm.alarm = "stiffness";
    alarm.sample = sample;
    alarm.json = R"({"text":"fell"})";
    const EventRecord event{"x", sample, "stiffness", "raised", "17", 1, "fell", R"({"state":"active"})"};
    batch.alarms = {alarm};
    batch.events = {event};
    deliveries_->queue(alarm, event, now_ns(), batch);
    auto messages = batch.outbox;
    if (written) {
      const auto done = must(store_.commit(batch));
      std::erase_if(messages, [&](const auto& message) {
        return std::find(done.known_messages.begin(), done.known_messages.end(), message.key) !=
               done.known_messages.end();
      });
    } else {
      unwritten_ = batch;
    }
    deliveries_->send(std::move(messages));
  }
  /// What the recorder writes with its next commit.
  void commit() {
    Batch batch = std::exchange(unwritten_, {});
    batch.deliveries = deliveries_->take();
    must(store_.commit(batch));
  }
  [[nodiscard]] std::size_t waiting_in_store() {
    const auto targets = must(reader_.outbox_targets());
    std::size_t waiting = 0;
    for (const auto& target : targets)
      waiting += must(reader_.outbox_due(std::numeric_limits<std::int64_t>::max(), 1000, target)).size();
    return waiting;
  }
  [[nodiscard]] Deliveries& deliveries() { return *deliveries_; }
  [[nodiscard]] Deliveries::Status status(std::size_t target = 0) const {
    return deliveries_->status()[target];
  }

 private:
  Store store_;
  Reader reader_;
  std::unique_ptr<Deliveries> deliveries_;
  Batch unwritten_;
};

}  // namespace resonid::monitor
