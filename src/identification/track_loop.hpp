// SPDX-License-Identifier: MIT
#pragma once

#include <identification/online_tracker.hpp>
#include <identification/track_plan.hpp>
#include <resonid/diagnostics/margins.hpp>

namespace resonid::identification::detail {

/// What the plant's response of one instant means for the loop, and how far it is from the baseline's.
///
/// L = C G e^{-jwTd} with the known controller and the known delay; margins as METHOD 10.2 has them. Gap: the
/// largest chordal distance over frequency between W G and W G0, W = C where it is known, else 1 over the
/// baseline's median gain (METHOD 10.1: the distance needs a scale). It is pointwise: no winding numbers.
class LoopFigures {
 public:
  LoopFigures(const data::Record& record, const TrackOptions& options, const TrackPlan& plan);

  [[nodiscard]] bool has_loop() const { return controller_.has_value(); }
  [[nodiscard]] bool has_gap() const { return baseline_.has_value(); }

  /// Brings the figures to the tracker's newest estimate; unknown where it has none.
  void update(OnlineTracker& tracker);
  [[nodiscard]] const diagnostics::LoopMargins& margins() const { return margins_; }
  [[nodiscard]] bool known() const { return known_; }
  [[nodiscard]] double gap() const { return gap_; }
  [[nodiscard]] const data::FrequencyResponse& curve() const { return curve_; }
  /// The baseline's loop on a grid of its own.
  [[nodiscard]] std::optional<data::FrequencyResponse> baseline_loop() const;

 private:
  void follow(double resonance_hz);
  void use_frequencies(std::span<const double> frequency_hz);
  [[nodiscard]] std::complex<double> baseline_at(double frequency_hz) const;

  std::optional<data::TransferFunction> controller_;
  std::optional<Result> baseline_;
  double delay_s_;
  std::optional<data::TransferFunction> baseline_model_;
  std::vector<double> grid_hz_;   // for trackers that answer anywhere
  std::vector<double> model_hz_;  // the same with points about near_hz_
  double near_hz_ = 0.0;
  double gap_low_hz_ = 0.0, gap_high_hz_ = 0.0;  // where the baseline was measured
  double scale_ = 1.0;                           // of the gap without a controller
  std::vector<double> frequency_hz_;             // [point] in use
  std::vector<std::complex<double>> factor_;     // [point] C e^{-jwTd}
  std::vector<std::complex<double>> weight_;     // [point] of the gap
  std::vector<std::complex<double>> reference_;  // [point] W G0; not a number outside the baseline's band
  std::vector<std::complex<double>> plant_;      // [point]
  data::FrequencyResponse curve_;                // L
  diagnostics::LoopMargins margins_;
  double gap_ = kUnknown;
  bool known_ = false;
};

}  // namespace resonid::identification::detail
