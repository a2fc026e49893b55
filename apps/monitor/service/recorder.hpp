// SPDX-License-Identifier: MIT
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "monitor/engine/engine.hpp"
#include "monitor/samples/ring.hpp"
#include "monitor/service/alarm_record.hpp"
#include "monitor/service/installation.hpp"
#include "monitor/store/backlog.hpp"
#include "monitor/store/store.hpp"

namespace resonid::monitor {

/// Puts what the engine comes to into the store, one transaction for all axes every 200 ms, on a thread of
/// its own; keeps it while the disk is full, and copies the raw samples around an alarm.
class Recorder {
 public:
  struct Axis {
    const InstalledAxis* installed = nullptr;
    Ring* ring = nullptr;
    std::string configuration_hash;
  };
  /// `told`: called with each alarm's record as soon as it is lasting.
  Recorder(Store store, Engine& engine, std::vector<Axis> axes, const Installation& installation,
           std::vector<AlarmRecord> known, std::function<void(const AlarmRecord&)> told);
  ~Recorder();

  void start();
  /// After the engine: writes all that is left.
  void stop();

  struct Status {
    std::uint64_t bytes = 0, pending = 0;
    bool disk_full = false;
    std::string fault;  ///< Why nothing can be written; empty: all is well.
  };
  [[nodiscard]] Status status() const;

 private:
  struct Evidence {
    std::string alarm_id;
    std::size_t axis = 0;
    std::uint64_t from = 0, to = 0;
    std::int64_t due_ns = 0;
  };
  void run();
  void write(bool last);
  void gather(Batch& batch, std::vector<Results>& all);
  void copy_evidence(Batch& batch, std::int64_t now, bool last);
  [[nodiscard]] std::filesystem::path folder_of_evidence() const;

  Store store_;
  Engine& engine_;
  std::vector<Axis> axes_;
  const Installation& installation_;
  AlarmRecords alarms_;
  std::function<void(const AlarmRecord&)> told_;
  Backlog backlog_;
  std::vector<std::pair<std::size_t, std::uint64_t>> snapshots_;  // of the backlog: axis, position
  std::vector<Evidence> evidence_;
  std::atomic<bool> stopping_{false};
  std::thread thread_;
  mutable std::mutex status_mutex_;
  Status status_;
};

}  // namespace resonid::monitor
