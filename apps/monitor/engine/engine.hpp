// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <resonid/base/expected.hpp>
#include <string>
#include <vector>

#include "monitor/samples/ring.hpp"
#include "monitoring/axis_monitor.hpp"
#include "monitoring/response_curve.hpp"

namespace resonid::monitor {

/// The newest that is known of an axis.
struct LiveAxis {
  std::uint64_t revision = 0;  ///< Counts what was published of all axes.
  monitoring::Phase phase = monitoring::Phase::gathering;
  bool waits_to_learn = false;    ///< While `learning`: its turn is still to come.
  std::string reason;             ///< Why nothing is followed, or not trusted.
  std::uint64_t next_sample = 0;  ///< All before it are in what stands here.
  std::int64_t newest_ns = 0;     ///< UNIX, of the newest sample; 0: none yet.
  std::int64_t processed_ns = 0;  ///< UNIX, when it was taken in.
  std::int64_t row_ns = 0;        ///< UNIX, of the row's newest sample; 0: no row yet.
  monitoring::Row row;
  online::AxisRow estimate;  ///< The same with all that the engine says.
  std::array<monitoring::FigureChange, monitoring::kWatched> changes{};
  std::array<bool, monitoring::kWatched> watches{};  ///< Whether changes can be told yet.
  std::array<monitoring::AlarmState, monitoring::kAlarms> alarms{};
  bool stale = false;
  std::int64_t maintenance_until_ns = 0;  ///< UNIX time of its end; 0: there is none.
  std::string method, start;
  double memory_s = 0.0, learned_s = 0.0;
  /// Mean time between false alarms of each figure's detector, as they began with; 0: nothing is watched yet.
  double detector_interval_s = 0.0;
  std::shared_ptr<const monitoring::ResponseCurve> curve;
  std::int64_t curve_ns = 0;
};

/// An action with who did it and why.
struct Told {
  monitoring::Action action;
  std::int64_t time_ns = 0;
  std::string who, reason;
};

/// What an axis came to since the last time, for the store.
struct Results {
  std::size_t axis = 0;
  struct TimedRow {
    monitoring::Row row;
    std::int64_t time_ns = 0;
  };
  struct TimedEvent {
    monitoring::AlarmEvent event;
    std::int64_t time_ns = 0, since_ns = 0;
    std::string text;
    std::string who, reason;   ///< Where an action led to it.
    std::uint64_t action = 0;  ///< Its id; 0: samples led to it.
  };
  struct Snapshot {
    std::uint64_t sample = 0, position = 0;
    std::vector<std::byte> bytes;
  };
  std::vector<TimedRow> rows;  ///< The first of each second.
  std::vector<TimedEvent> events;
  std::vector<Told> actions;
  std::optional<Snapshot> snapshot;
};

struct EngineOptions {
  std::size_t workers = 0;         ///< Threads that follow axes; 0: one per core.
  std::size_t learners = 0;        ///< Threads that learn, behind the others; 0: one per two cores.
  double snapshot_every_s = 10.0;  ///< Of each axis; sooner where its ring fills.
  double stale_s = 3.0;            ///< Without samples for so long an axis is stale (stale_after_s()).
  double first_sample_s = 60.0;    ///< The same before its very first one: who watches may come first.
  /// An axis that has waited for its turn to learn for so long gathers newer samples instead where its ring
  /// is half full, whose source would have to wait, or where a person did something, which counts between
  /// samples.
  double learning_patience_s = 2.0;
  double publish_every_s = 0.05, curve_every_s = 0.5;
  /// How a UNIX time in ns is written in the texts of alarms; empty: as local date and time.
  std::function<std::string(std::int64_t)> time_text = {};
  /// Whether what came of an axis since its newest sample was refused, for the text of its alarm `stale`; may
  /// be empty.
  std::function<bool(std::size_t axis)> refused = {};
  /// Called with each row of an axis as it is made, by the thread that follows it; may be empty.
  std::function<void(std::size_t axis, const monitoring::AxisMonitor&)> on_row = {};
};

/// Follows all axes: takes their samples out of the rings, on worker threads to which axes are dealt out, and
/// hands over rows, events and snapshots. Nothing on the way of the samples waits for a lock. What it comes
/// to depends on the samples and the actions at their samples alone.
class Engine {
 public:
  struct Axis {
    monitoring::AxisMonitor monitor;  ///< As created or restored.
    Ring* ring = nullptr;             ///< Outlives the engine.
    std::vector<Told> actions;        ///< Taken before, from next_sample() on: they are taken again.
    bool begins_anew = false;         ///< Nothing is stored of it to go on from: it is, before all else.
  };
  Engine(std::vector<Axis> axes, EngineOptions options);
  Engine(const Engine&) = delete;
  Engine& operator=(const Engine&) = delete;
  ~Engine();  ///< Stops.

  void start();
  /// Takes in what the rings hold (for so long at most), makes a last snapshot of each axis, and ends the
  /// threads. Results are to be taken afterwards.
  void stop(double drain_s = 5.0);

  /// What has come since the last call. By one thread at a time.
  [[nodiscard]] std::vector<Results> take();
  /// The samples before this snapshot's position are no longer needed.
  void stored(std::size_t axis, std::uint64_t position);
  /// While snapshots cannot be stored the rings go on without.
  void keep_going(bool without_store);

  /// An action of a person, from the next sample on; what the state does not allow then changes nothing.
  /// Refused (field "action") where 1000 wait for that axis already, or the engine ends. `seconds`: of
  /// shelving or maintenance, from that sample on. For any thread.
  [[nodiscard]] expected<void, Error> act(std::size_t axis, monitoring::ActionKind kind,
                                          monitoring::AlarmId alarm, std::optional<double> seconds,
                                          std::string who, std::string reason);
  [[nodiscard]] std::shared_ptr<const LiveAxis> live(std::size_t axis) const;
  [[nodiscard]] std::size_t axes() const noexcept;
  [[nodiscard]] std::uint64_t revision() const noexcept;
  /// Share of a core that following took, of all workers, since the start.
  [[nodiscard]] double busy() const noexcept;
  /// For how long the slowest worker has been at the axis whose turn it is, s: parts of one, unless it hangs.
  [[nodiscard]] double turn_s() const noexcept;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

/// Without samples for so long an axis of this rate is stale: three of them at least are overdue.
[[nodiscard]] double stale_after_s(const EngineOptions& options, double sample_rate_hz);

/// UNIX time, ns.
[[nodiscard]] std::int64_t now_ns();

}  // namespace resonid::monitor
