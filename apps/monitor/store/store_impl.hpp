// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <monitor/store/schema.hpp>
#include <monitor/store/sqlite.hpp>
#include <monitor/store/store.hpp>
#include <optional>
#include <string>
#include <string_view>

namespace resonid::monitor {

/// Both halves of the writer: commits (store.cpp) and upkeep (upkeep.cpp). Throws SqliteFailure.
class Store::Impl {
 public:
  Impl(std::string path, const StoreOptions& options);
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl();

  Committed commit(const Batch& batch);
  Upkeep upkeep(std::int64_t now_ns);
  [[nodiscard]] std::string lost() const;
  /// After a fault: forgets what was taken for written, and makes room in the log.
  void recover(StoreFault fault) noexcept;

  StoreOptions options;
  const std::string path;

 private:
  struct AxisState {
    std::int64_t id = 0;
    std::int64_t newest_sample = -1;
    std::int64_t rows_from = 0;
    bool changed = false;
  };
  /// Rows on their way from `fresh` to their place, some axes at a time.
  struct Move {
    std::int64_t last_id = 0, next_axis = 0, last_axis = 0, axes_per_step = 1;
  };
  /// One process writes; let go after the connection is closed.
  class Lock {
   public:
    explicit Lock(const std::string& path);
    Lock(const Lock&) = delete;
    Lock& operator=(const Lock&) = delete;
    ~Lock();

   private:
    int descriptor_ = -1;
  };

  static detail::Connection open_checked(const std::string& path, const StoreOptions& options);
  AxisState& axis(const std::string& name);
  void write_rows(const Batch& batch, Committed& done);
  void write_snapshot(const SnapshotRecord& snapshot);
  void write_alarms(const Batch& batch, Committed& done);
  void write_people(const Batch& batch, Committed& done);
  void write_outbox(const Batch& batch, Committed& done);
  void checkpoint_if_due() noexcept;
  void truncate_log() noexcept;

  [[nodiscard]] bool move_is_due(std::int64_t now_ns);
  void move_rows(std::int64_t now_ns);
  bool settle_hour(std::int64_t now_ns);
  bool remove_aged(std::int64_t now_ns);
  bool remove_for_size(std::int64_t now_ns, bool& over_limit);
  bool remove_rows(std::int64_t before_ns);
  bool remove_summaries(std::string_view table, std::int64_t before_ns);
  bool doom_evidence(std::int64_t before_ns);
  bool forget_delivered(std::int64_t before_ns);
  bool give_space_back();
  [[nodiscard]] std::uint64_t used_bytes();
  [[nodiscard]] std::uint64_t evidence_bytes();

  Lock lock_;
  detail::Connection connection_;
  std::map<std::string, AxisState, std::less<>> axes_;
  std::optional<std::int64_t> fresh_;  // rows in `fresh`, once counted
  int wal_pages_ = 0, next_checkpoint_pages_ = 0;
  std::optional<Move> move_;
  std::optional<std::int64_t> moved_ns_, retained_ns_;
  bool retaining_ = false, over_limit_ = false;
};

}  // namespace resonid::monitor
