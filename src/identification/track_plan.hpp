// SPDX-License-Identifier: MIT
#pragma once

#include <identification/identify/measure/methods.hpp>
#include <identification/online_tracker.hpp>

namespace resonid::identification::detail {

/// Where estimators begin.
struct StartModel {
  fit::DriveModel drive;
  std::string source;         ///< In words.
  std::size_t samples = 0;    ///< Of the record that went into it.
  bool whole_record = false;  ///< The rows then know what came after them.
  bool trusted = true;        ///< False: what was identified there is not to be trusted itself.
};

/// What will be done with a record, every choice made.
struct TrackPlan {
  TrackMethod method = TrackMethod::physical;  ///< Never automatic.
  Approach approach = Approach::direct;
  std::string reason;  ///< Why it was chosen.
  Plan measurement;    ///< Excitation, band, lines.
  std::optional<StartModel> start;
  double delay_s = 0.0;  ///< In the measured output: the known one, and what the start model found beyond it.
};

[[nodiscard]] expected<TrackPlan, Error> make_track_plan(const data::Record& record,
                                                         const TrackOptions& options);

/// From the options, else identified on the first part of the record: half a second (200 samples at least),
/// doubled until a two-mass model is found there whose resonance has been seen eight times and is known to
/// 1 %, or is all there is. Nothing when not even the whole record shows a model.
[[nodiscard]] std::optional<StartModel> find_start(const data::Record& record, const TrackOptions& options,
                                                   const Plan& plan);

/// The velocity that estimators of parameters work on: differences of a position. Nothing for an
/// acceleration.
struct Velocity {
  std::vector<double> samples;
  double further_delay_samples = 0.0;  ///< Half a sample for a difference.
};
[[nodiscard]] std::optional<Velocity> velocity_of(const data::Record& record);

// The estimators, each made for a record.
[[nodiscard]] TrackerMade make_line_tracker(const data::Record& record, const TrackOptions& options,
                                            const TrackPlan& plan);
[[nodiscard]] TrackerMade make_chirp_tracker(const data::Record& record, const TrackOptions& options,
                                             const TrackPlan& plan);
[[nodiscard]] TrackerMade make_physical_tracker(const data::Record& record, const TrackOptions& options,
                                                const TrackPlan& plan);
[[nodiscard]] TrackerMade make_discrete_tracker(const data::Record& record, const TrackOptions& options,
                                                const TrackPlan& plan);
/// The one that the plan names.
[[nodiscard]] TrackerMade make_tracker(const data::Record& record, const TrackOptions& options,
                                       const TrackPlan& plan);

}  // namespace resonid::identification::detail
