// SPDX-License-Identifier: MIT
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "monitor/engine/engine.hpp"
#include "monitor/samples/intake.hpp"
#include "monitor/samples/ring.hpp"
#include "monitor/service/alarm_record.hpp"
#include "monitor/service/deliveries.hpp"
#include "monitor/service/disk_alarm.hpp"
#include "monitor/service/evidence_files.hpp"
#include "monitor/service/installation.hpp"
#include "monitor/store/backlog.hpp"
#include "monitor/store/reader.hpp"
#include "monitor/store/store.hpp"

namespace resonid::monitor {

/// Puts what the engine comes to into the store, one transaction for all axes every 200 ms, on a thread of
/// its own; keeps it while the disk is full, and tells that; copies the raw samples around an alarm, keeps
/// the response with a baseline; and hands alarms on to those who are told of them.
class Recorder {
 public:
  struct Axis {
    const InstalledAxis* installed = nullptr;
    Ring* ring = nullptr;
    const Intake* intake = nullptr;
    std::string configuration_hash;
    std::string begins_anew;          ///< Why nothing of a former process goes on; empty: it does.
    std::uint64_t replayed_from = 0;  ///< Events from here on come again where the store has them.
  };
  /// `told`: called with each alarm's record as soon as it is lasting.
  Recorder(Store store, Reader reader, Engine& engine, std::vector<Axis> axes,
           const Installation& installation, const std::vector<AlarmRecord>& known,
           std::unique_ptr<Deliveries> deliveries, std::function<void(const AlarmRecord&)> told);
  ~Recorder();

  void start();
  /// After the engine: writes all that is left.
  void stop();

  struct Status {
    std::uint64_t bytes = 0, pending = 0;
    bool disk_full = false;
    std::string fault;       ///< Why nothing can be written; empty: all is well.
    std::string over_limit;  ///< Why more is kept than may be; empty: it is not.
    std::vector<Deliveries::Status> deliveries;
    std::vector<AlarmRecord> unwritten;  ///< Alarms that the store does not know yet, newest first.
  };
  [[nodiscard]] Status status() const;
  struct Baselines {
    /// Those set until then are not used any more: the axis was learned anew, or began anew.
    std::int64_t forgotten_ns = std::numeric_limits<std::int64_t>::min();
    /// Of the newest one; null: none is used, or nothing was known when it was set.
    std::shared_ptr<const monitoring::ResponseCurve> curve;
  };
  [[nodiscard]] Baselines baselines(std::size_t axis) const;

 private:
  struct Evidence {
    std::string alarm_id;
    std::size_t axis = 0;
    std::uint64_t from = 0, to = 0;
    std::int64_t due_ns = 0;
    std::uint64_t known_to = 0;  // of what a former process copied
  };
  void run();
  void write(bool last);
  [[nodiscard]] bool commit(Status& status, std::vector<OutboxRecord>& messages, bool last);
  void upkeep(std::chrono::steady_clock::time_point due);
  void note_upkeep(const StoreError* fault);
  void gather(Batch& batch, std::vector<Results>& all);
  [[nodiscard]] Baselines stored_baselines(const Axis& axis);
  void set_baseline(std::size_t axis, const Told& told, Batch& batch);
  [[nodiscard]] Evidence evidence_around(std::string alarm_id, std::size_t axis, std::uint64_t sample) const;
  void find_evidence();
  void close_orphans();
  void expect_replays();
  [[nodiscard]] bool lacks_evidence(const std::string& alarm_id);
  void copy_evidence(Batch& batch, std::int64_t now, bool last);
  [[nodiscard]] std::filesystem::path folder_of_evidence() const;

  Store store_;
  Reader reader_;
  Engine& engine_;
  std::vector<Axis> axes_;
  const Installation& installation_;
  AlarmRecords alarms_;
  std::vector<AlarmRecord> known_;  // that the store has at the start
  std::shared_ptr<Deliveries> deliveries_;
  DiskAlarm disk_alarm_;
  std::function<void(const AlarmRecord&)> told_;
  Batch first_;  // of the start
  Backlog backlog_;
  std::map<std::size_t, std::uint64_t> snapshots_;  // of the backlog: axis, position
  std::vector<Evidence> evidence_;
  std::int64_t evidence_removed_ns_ = 0;
  EvidenceSizes evidence_sizes_;
  std::chrono::steady_clock::time_point commit_again_{}, upkeep_failed_{};
  std::string upkeep_fault_;  // empty: upkeep goes on
  std::atomic<bool> stopping_{false};
  std::thread thread_;
  mutable std::mutex status_mutex_;
  Status status_;
  std::vector<Baselines> baselines_;  // with status_mutex_
};

}  // namespace resonid::monitor
