// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>
#include <resonid/design/detail/bounds.hpp>
#include <vector>

namespace resonid::design {

/// A maximum over frequency.
struct Peak {
  Transfer transfer = Transfer::sensitivity;
  double value = 0.0, frequency_hz = 0.0, bound = 0.0;
};

/// |L| = 1.
struct Crossing {
  double frequency_hz = 0.0;
  double phase_margin_deg = 0.0;  ///< 180 + arg L, in (-180, 180].
  bool falling = true;            ///< |L| falls with the frequency.
};

/// What a torque step of 1 Nm against the load does to the load's velocity (docs/methods/tune.md 1, 2.2).
struct LoadStep {
  double iae = 0.0;      ///< Ts sum |v|, rad
  double ie = 0.0;       ///< -Ts sum v, rad: 1/ki + 1/K of a two-mass drive under PI control
  double peak = 0.0;     ///< max |v|, rad/s
  double rebound = 0.0;  ///< How far it swings to the other side, relative to the peak.
};

/// A controlled pole pair.
struct ClosedLoopMode {
  double frequency_hz = 0.0, damping_ratio = 0.0;
};

/// One table for every controller on one machine (docs/methods/tune.md 2.1).
struct LoopFigures {
  bool stable = false;
  double spectral_radius = 0.0;
  std::vector<Peak> peaks;                       ///< [kTransfers]; of an unstable loop they mean nothing.
  std::vector<Crossing> crossings;               ///< All of them, ascending.
  std::optional<double> worst_phase_margin_deg;  ///< Least size over all crossings.
  std::optional<double> gain_margin_db;          ///< Least factor > 1 at arg L = -180 deg.
  std::optional<double> delay_margin_s;          ///< Least delay that takes a crossing to -1.
  std::optional<double> load_bandwidth_hz;       ///< Up to where |C GL S| stays above 1/sqrt(2).
  std::vector<ClosedLoopMode> modes;             ///< Oscillating ones, ascending.
  double noise_gain = 0.0;                       ///< Rms torque per rms of white velocity noise.
  LoadStep load_step;

  [[nodiscard]] const Peak& peak(Transfer transfer) const;
};

}  // namespace resonid::design
