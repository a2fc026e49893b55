// SPDX-License-Identifier: MIT
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "monitor/sources/source.hpp"

namespace resonid::monitor {

/// Gives what a source decoded to the intakes of its axes, and counts. For any thread.
class Delivery {
 public:
  explicit Delivery(Axes& axes) : axes_(axes) {}

  /// The intake of an axis, of the only one where `axis` is empty; nothing where none is configured.
  [[nodiscard]] Intake* find(std::string_view axis) const;
  /// As Intake::add(). Of an axis that nobody configured: refused, and counted as unknown.
  [[nodiscard]] Intake::Outcome add(const Arrival& arrival, const SourcePosition& position = {});
  /// What arrived cannot be taken and will not come again.
  void drop(const Arrival& arrival);

  void count_message() noexcept { messages_.fetch_add(1, std::memory_order_relaxed); }
  void count_bytes(std::uint64_t bytes) noexcept { bytes_.fetch_add(bytes, std::memory_order_relaxed); }
  void count_lost(std::uint64_t messages) noexcept { lost_.fetch_add(messages, std::memory_order_relaxed); }
  /// Of an axis that nobody configured; `what` says so.
  void count_unknown(std::string what);
  /// While it lives, somebody waits for room in a ring.
  class Wait {
   public:
    /// @param name the axis, as the source calls it; empty: the only one
    Wait(Delivery& delivery, std::string_view name);
    Wait(const Wait&) = delete;
    Wait& operator=(const Wait&) = delete;
    ~Wait();

   private:
    Delivery& delivery_;
  };
  /// Whoever waits for room in an intake gives up.
  void stop() noexcept { stopping_.store(true, std::memory_order_release); }
  [[nodiscard]] bool stopping() const noexcept { return stopping_.load(std::memory_order_acquire); }
  [[nodiscard]] Axes& axes() const noexcept { return axes_; }
  /// For what is wrong before it is known which axis it is of: the log of the only axis, where there is one.
  [[nodiscard]] FaultLog& faults() const;
  /// For what is of no axis, whatever axes there are.
  [[nodiscard]] FaultLog& faults_of_none() const noexcept { return faults_; }
  /// The counters, and as text the faults with their newest examples. The state is `waiting` while anybody
  /// waits for room, which the text begins with then; else `running`.
  [[nodiscard]] SourceStatus status() const;

 private:
  Axes& axes_;
  mutable FaultLog faults_;
  std::atomic<bool> stopping_{false};
  std::atomic<std::uint64_t> messages_{0}, bytes_{0}, lost_{0}, unknown_{0};
  mutable std::mutex mutex_;  ///< For what follows.
  std::size_t waits_ = 0;     ///< How many wait for room in a ring.
  std::string waits_for_;     ///< The newest of these.
  std::vector<std::string> first_unknown_;
};

}  // namespace resonid::monitor
