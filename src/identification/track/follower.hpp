// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <identification/track/axis_setup.hpp>
#include <identification/track/findings.hpp>
#include <identification/track/stiffness_drift.hpp>
#include <limits>
#include <memory>
#include <optional>
#include <resonid/base/detail/byte_archive.hpp>
#include <resonid/identification/track.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace resonid::identification::detail {

inline constexpr double kUnknown = online::AxisRow::kUnknown;

/// Where a row belongs.
struct Place {
  double time_s = 0.0;
  double lag_s = 0.0;
  double position_m = kUnknown;
};

/// The newest positions, since rows tell the one of a time that has gone.
class Positions {
 public:
  void step(double x);
  /// Between samples; the oldest known one before it, not a number without any.
  [[nodiscard]] double at(double sample) const;
  void save(ByteWriter& to) const;
  void restore(ByteReader& from);

 private:
  static constexpr std::size_t kKept = std::size_t{1} << 16U;
  std::vector<double> past_;
  std::size_t samples_ = 0;
};

/// The engine from the sample on where learning was over, with what tells it of the machine's motion: what
/// track() and the monitor have in common. The same samples give the same rows, in whatever batches, and from
/// a snapshot on.
class Follower {
 public:
  Follower(const data::Record& stretch, const TrackOptions& options, TrackPlan plan,
           std::unique_ptr<AxisSetup> setup, AxisPointer axis);

  /// One sample; `position`: not a number where there is none. True when it completed a row, whose place()
  /// is known then. Rows of the stretch that was learned from (`speaks` false) are none.
  bool step(const online::AxisSample<double>& sample, double position, bool speaks = true);
  [[nodiscard]] const Place& place() const { return place_; }
  [[nodiscard]] const online::Axis& axis() const { return *axis_; }
  [[nodiscard]] const TrackPlan& plan() const { return plan_; }
  [[nodiscard]] const AxisSetup& setup() const { return *setup_; }
  /// Those of the rows alone.
  [[nodiscard]] online::AxisCounts counts() const { return since(axis_->result().counts, learned_); }
  [[nodiscard]] double start_time_s() const { return start_time_s_; }
  /// Samples were lost.
  void miss(std::uint64_t count) { axis_->miss(count); }

  /// All that the rows to come depend on.
  void save(ByteWriter& to) const;
  /// What save() wrote by this library version; of the plan, what people are told. Nothing where the bytes
  /// are none of it.
  [[nodiscard]] static std::unique_ptr<Follower> restored(ByteReader& from);

 private:
  Follower(std::unique_ptr<AxisSetup> setup, AxisPointer axis);
  void look_at(double position, bool speaks);

  TrackPlan plan_;
  std::unique_ptr<AxisSetup> setup_;
  AxisPointer axis_;
  online::AxisCounts learned_{};
  double rate_hz_, start_time_s_;
  bool raw_time_, follows_position_;
  Positions positions_;
  StiffnessDrift drift_;
  double drift_per_s_;
  double newest_time_s_ = -std::numeric_limits<double>::infinity();
  Place place_;
};

/// The engine that a stretch makes; nothing when a longer one must tell (make_track_plan()).
[[nodiscard]] expected<std::unique_ptr<Follower>, Error> learn(const data::Record& stretch,
                                                               const TrackOptions& options, bool final);

}  // namespace resonid::identification::detail
