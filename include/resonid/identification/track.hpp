// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <resonid/base/enum_names.hpp>
#include <resonid/base/expected.hpp>
#include <resonid/data/record.hpp>
#include <resonid/diagnostics/finding.hpp>
#include <resonid/identification/identify.hpp>
#include <resonid/identification/options.hpp>
#include <resonid/identification/result.hpp>
#include <resonid/online/axis_config.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace resonid::identification {

/// Which on-line estimator runs over the record (`track --method`).
enum class TrackMethod {
  automatic,
  arx,                                ///< "arx"
  output_error,                       ///< "oe": RPLR, direct
  prediction_error,                   ///< "rpem": the same along the true gradient
  closed_loop_output_error,           ///< "cloe": indirect, needs excitation and controller
  filtered_closed_loop_output_error,  ///< "f-cloe"
  damped_closed_loop_output_error,    ///< "d-cloe": along a gradient that follows the estimate
  instrumental_variables,             ///< "iv": refined, needs excitation and controller
  physical,                           ///< "physical": extended Kalman filter
  kalman,                             ///< "kalman": line bank, or the filter that follows a chirp
  sliding_dft,                        ///< "sliding-dft", with a rational fit of its lines
};

inline constexpr EnumName<TrackMethod> kTrackMethodNames[] = {
    {TrackMethod::automatic, "auto"},
    {TrackMethod::arx, "arx"},
    {TrackMethod::output_error, "oe"},
    {TrackMethod::prediction_error, "rpem"},
    {TrackMethod::closed_loop_output_error, "cloe"},
    {TrackMethod::filtered_closed_loop_output_error, "f-cloe"},
    {TrackMethod::damped_closed_loop_output_error, "d-cloe"},
    {TrackMethod::instrumental_variables, "iv"},
    {TrackMethod::physical, "physical"},
    {TrackMethod::kalman, "kalman"},
    {TrackMethod::sliding_dft, "sliding-dft"}};
[[nodiscard]] constexpr std::span<const EnumName<TrackMethod>> enum_names(TrackMethod) noexcept {
  return kTrackMethodNames;
}

struct TrackOptions {
  /// Excitation, controller, delay, lines, band, approach ... as for identify(). Friction: `dry` adds Coulomb
  /// friction to arx, iv and physical, `viscous` lets physical estimate it, `both` both.
  Options common;
  TrackMethod method = TrackMethod::automatic;
  /// Learn from the whole record instead of its first stretch: the rows, which then begin at its first
  /// sample, know what came after them.
  bool whole_record = false;
  bool raw_time = false;  ///< Rows at the newest sample instead of the time that the estimate describes.
  /// Length of the stretch that method, excitation and start are decided from; rows begin after it. Absent:
  /// half a second (200 samples, 20 times the known delay, two periods at least), doubled while it does not
  /// suffice.
  std::optional<double> learn_s;
  double memory_s = 0.0;  ///< How long the estimate remembers; 0 chooses.
  /// How arx, oe, rpem and the cloe family let old samples lose weight.
  online::Forgetting forgetting = online::Forgetting::constant;
  /// iv: extrapolate to the newest sample from two memories: no lag but the oscillation's, 1.8 times the
  /// variance.
  bool extrapolate = false;
  /// For a machine that is watched for hours: physical forgets all parameters over its memory (when 0: two
  /// seconds or thirty periods of the resonance), unless the machine's position tells how it drifts.
  bool long_term = false;
  /// physical: relative change of the stiffness per second to reckon with, 1/s; absent: chosen from the
  /// positions seen so far.
  std::optional<double> drift_per_s;
  /// Watches a figure; what it is at first counts as usual. Rows then say `changed`.
  std::optional<online::AxisFigure> change_of;
  double false_alarm_interval_s = 3600.0;  ///< Mean time between changes that are none.
  std::size_t every = 1;                   ///< Samples per row, >= 1.
  std::optional<fit::DriveModel>
      start;  ///< Where estimators begin; absent: identified from the learning stretch.
  std::optional<Units> start_units;  ///< Units of `start`; other ones than the record's are refused.
  std::optional<Result> baseline;    ///< For the gap column; its model is the start when `start` is absent.
  /// Track keeps at most so many rows, evenly spread: every one, every second, every fourth ... 0: all of
  /// them.
  std::size_t kept_rows = 0;
  /// Every row as it is made, for records whose rows are too many to be kept: first the names of the columns,
  /// then their values, not a number where there is none. Either may be empty.
  std::function<void(std::span<const std::string>)> on_columns;
  std::function<void(std::span<const double>)> on_row;
};

/// One quantity over the rows.
struct TrackSeries {
  std::string name;           ///< As in the CSV header: "resonance_hz", "b1", "re_12.5".
  std::string unit;           ///< "Hz"; empty for plain numbers.
  std::vector<double> value;  ///< [row], not a number where there is none yet.
  std::vector<double> std;    ///< [row]; empty when the quantity has none.
};

/// The loop L = C Gd as it was known at one instant.
struct LoopSnapshot {
  double time_s = 0.0;
  data::FrequencyResponse curve;  ///< Delay included.
};

/// Shares of the rows that passed each gate, 0 ... 1: excitation and all of the rows after the start, the
/// others of those of them that had excitation.
struct TrustShares {
  double excited = 0.0, converged = 0.0, physical = 0.0, residual = 0.0, all = 0.0;
};

/// What an on-line estimator said while the record went through it.
struct Track {
  RecordFacts record;
  Units units;
  std::string method;      ///< As on the command line: "iv".
  std::string approach;    ///< "direct", "indirect", "joint".
  std::string reason;      ///< Why `auto` chose it; empty when it was told.
  std::string start;       ///< Where the start model came from; empty when the method needs none.
  double learned_s = 0.0;  ///< Length of the learning stretch.
  bool causal = true;      ///< No row depends on a later sample; false with `whole_record`.
  double known_delay_s = 0.0;
  double confidence = 0.95;
  std::size_t rows = 0;            ///< Made; `time_s` holds those that are kept.
  std::vector<double> time_s;      ///< [row], what the estimate describes (with raw_time: the newest sample).
  std::vector<double> lag_s;       ///< [row], the newest sample's time minus the one described.
  std::vector<double> position_m;  ///< [row], at time_s; empty when the record has none.
  std::vector<double> residual;  ///< [row], rms of the residual over the last stretch, in the output's unit.
  std::vector<TrackSeries>
      lines;  ///< Response: re_F, im_F, std_F per fixed line, or frequency_hz, real, imag, std.
  std::vector<TrackSeries> parameters;  ///< b1 ..., a1 ..., or physical ones.
  std::vector<TrackSeries> figures;  ///< resonance_hz, antiresonance_hz, margins, gap: those that there are.
  std::vector<bool> trusted_rows;    ///< [row]
  std::vector<LoopSnapshot> loop;    ///< Along the record; empty without a controller.
  std::optional<data::FrequencyResponse> baseline_loop;
  std::optional<online::Change> change;  ///< Change of the watched figure; times from the first sample on.
  TrustShares shares;
  bool trusted = false;  ///< No finding is an error.
  std::vector<diagnostics::Finding> findings;

  /// A figure or parameter by its name; nothing when it was not computed.
  [[nodiscard]] const TrackSeries* find(std::string_view name) const;
};

/// The record sample by sample through an on-line estimator: what a drive would have known, and when. Options
/// that contradict the record are refused; poor data give rows that are not trusted, and findings.
///
/// A learning stretch at the beginning decides on method, excitation and start; a row depends on no sample
/// after its own. Every row passes four gates before it is trusted: there is excitation, the resonance has
/// converged, the parameters are physical, and the residual is what it was. None is trusted where the stretch
/// has shown what no estimator here holds. docs/methods/track.md
[[nodiscard]] expected<Track, Error> track(const data::Record& record, const TrackOptions& options = {});

/// track() while the samples come in, in batches of any size: the rows are the same.
class Tracking {
 public:
  explicit Tracking(TrackOptions options);
  Tracking(Tracking&&) noexcept;
  Tracking& operator=(Tracking&&) noexcept;
  ~Tracking();

  /// The next samples; the first batch tells the rate, the time of sample 0 and which channels there are.
  /// Refused, once learning is over, are options that contradict the samples.
  expected<void, Error> add(const data::Record& batch);
  /// What was said and what is to be said of it. Refused when the learning stretch did not suffice.
  [[nodiscard]] expected<Track, Error> finish();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace resonid::identification
