// SPDX-License-Identifier: MIT
#pragma once

#include <identification/track/axis_setup.hpp>
#include <map>

namespace resonid::identification::detail {

/// The loop L = C G e^{-jwTd} at some instants, for the Nyquist plot; the rows' margins are the engine's own.
class LoopCurves {
 public:
  LoopCurves(const TrackOptions& options, const TrackPlan& plan, const AxisSetup& setup);

  /// After every row.
  void add(const online::Axis& axis, double time_s);
  /// Evenly spread over what has been, the newest one last.
  [[nodiscard]] std::vector<LoopSnapshot> take(const online::Axis& axis);
  /// The baseline's loop, over its own band.
  [[nodiscard]] std::optional<data::FrequencyResponse> baseline() const;

 private:
  static constexpr std::size_t kMost = 8;

  [[nodiscard]] data::FrequencyResponse curve(const online::Axis& axis) const;
  [[nodiscard]] std::complex<double> controller_and_delay(double frequency_hz) const;

  const AxisSetup& setup_;
  std::optional<data::TransferFunction> controller_;
  double delay_s_;
  std::map<double, std::complex<double>> swept_;  // by frequency: what a chirp has passed
  std::vector<LoopSnapshot> kept_;
  double newest_s_ = 0.0;
  std::size_t stride_ = 1, rows_ = 0;
};

}  // namespace resonid::identification::detail
