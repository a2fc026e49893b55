// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <resonid/base/expected.hpp>
#include <resonid/data/record.hpp>
#include <resonid/diagnostics/finding.hpp>
#include <resonid/identification/identify.hpp>
#include <resonid/identification/options.hpp>
#include <resonid/identification/result.hpp>
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
  closed_loop_output_error,           ///< "cloe": indirect, needs excitation and controller
  filtered_closed_loop_output_error,  ///< "f-cloe"
  instrumental_variables,             ///< "iv": refined, needs excitation and controller
  physical,                           ///< "physical": extended Kalman filter
  kalman,                             ///< "kalman": line bank, or the filter that follows a chirp
  sliding_dft,                        ///< "sliding-dft", with a rational fit of its lines
};

/// Name on the command line, and back.
[[nodiscard]] std::string_view name_of(TrackMethod method);

struct TrackOptions {
  Options common;  ///< Excitation, controller, delay, lines, band, approach ... as for identify().
  TrackMethod method = TrackMethod::automatic;
  double memory_s = 0.0;  ///< How long the estimate remembers; 0 chooses.
  /// physical: relative change of the stiffness per second to reckon with, 1/s; absent: chosen from the
  /// motion.
  std::optional<double> drift_per_s;
  std::size_t every = 1;  ///< Samples per row, >= 1.
  bool raw_time = false;  ///< Rows at the newest sample instead of the time that the estimate describes.
  std::optional<fit::DriveModel> start;  ///< Where estimators begin; absent: identified from the first part.
  std::optional<Units> start_units;      ///< Of `start`; other ones than the record's are refused.
  std::optional<Result> baseline;  ///< For the gap column; its model is the start when `start` is absent.
  /// Track keeps at most so many rows, evenly spread; 0: all of them.
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
  std::string method;    ///< As on the command line: "iv".
  std::string approach;  ///< "direct", "indirect", "joint".
  std::string reason;    ///< Why `auto` chose it; empty when it was told.
  std::string start;     ///< Where the start model came from; empty when the method needs none.
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
  TrustShares shares;
  bool trusted = false;  ///< No finding is an error.
  std::vector<diagnostics::Finding> findings;

  /// A figure or parameter by its name; nothing when it was not computed.
  [[nodiscard]] const TrackSeries* find(std::string_view name) const;
};

/// The record sample by sample through an on-line estimator: what a drive would have known, and when. Options
/// that contradict the record are refused; poor data give rows that are not trusted, and findings.
///
/// Every row passes four gates before it is trusted: there is excitation, the resonance has converged, the
/// parameters are physical, and the residual is what it was. docs/methods/track.md
[[nodiscard]] expected<Track, Error> track(const data::Record& record, const TrackOptions& options = {});

}  // namespace resonid::identification
