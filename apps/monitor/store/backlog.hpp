// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <monitor/store/records.hpp>

namespace resonid::monitor {

/// What waits to be committed: of the last 200 ms, or of hours where the disk is full. Bounded in what goes
/// on by itself: rows are thinned, the older the more, and of snapshots and positions the newest stay. What
/// people and alarms did is never dropped.
class Backlog {
 public:
  explicit Backlog(std::size_t most_rows = 200'000) noexcept : most_rows_(most_rows < 2 ? 2 : most_rows) {}

  void add(Batch&& batch);
  /// All of it, in the order in which it came. What Store::commit() gets.
  [[nodiscard]] const Batch& batch() const noexcept { return batch_; }
  [[nodiscard]] bool empty() const noexcept { return empty_; }
  /// It was committed.
  void clear();
  [[nodiscard]] std::uint64_t dropped_rows() const noexcept { return dropped_rows_; }

 private:
  void thin_rows();

  Batch batch_;
  std::size_t most_rows_;
  bool empty_ = true;
  std::uint64_t dropped_rows_ = 0;
};

}  // namespace resonid::monitor
