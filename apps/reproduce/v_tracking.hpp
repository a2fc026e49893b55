// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <resonid/base/approach.hpp>
#include <resonid/online/lines/sliding_dft.hpp>
#include <resonid/online/models/discrete_model.hpp>
#include <resonid/plant/experiment.hpp>
#include <string>
#include <vector>

namespace resonid::reproduction::v {

/// How the lines are tracked and what is fitted to them.
struct Method {
  std::string name;
  double step_hz = 5.0;  ///< Of the lines, 20 ... 120 Hz.
  std::size_t window_samples = 400;
  online::DftWindow window = online::DftWindow::rectangular;
  bool levy = true;           ///< As published; else Sanathanan and Koerner with a fixed integrator.
  bool line_by_line = false;  ///< One line per sample into a recursive fit.
  Approach approach = Approach::indirect;
};
[[nodiscard]] Method published();  ///< 5 Hz, one period, rectangular, Levy, indirect.
[[nodiscard]] Method best();       ///< 10 Hz, two periods, Hann, Sanathanan and Koerner.

/// Two-mass parameters of the drive, cart in translation, as a model or the truth has them.
struct Drive {
  double resonance_hz = 0.0;
  double stiffness = 0.0;  ///< N/m
  double damping = 0.0;    ///< Ns/m
  double inertia = 0.0;    ///< of the driven side, kgm2
};

/// The model fitted at one sample.
struct Estimate {
  std::size_t sample = 0;
  double centre = 0.0;     ///< Middle of the window, in samples.
  double described = 0.0;  ///< That less the machine's own memory and the fit's.
  online::DiscreteModel<double, 3> model;
  Drive drive;  ///< Not a number where the model has no resonance or anti-resonance.
};

/// A run over the whole stroke and what was estimated while the whole window lay where the cart goes at
/// 0.38 m/s.
struct Run {
  plant::ExperimentConfig experiment;
  plant::Simulation simulation;
  std::vector<Estimate> estimates;
  std::vector<double> lines_hz;
  std::size_t from = 0, to = 0;  ///< Samples at constant velocity.

  [[nodiscard]] double position_m(double sample) const;
  [[nodiscard]] Drive truth(double sample) const;
};
/// A fit every `every` samples.
[[nodiscard]] Run run(const Method& method, double noise_rms, std::uint64_t seed, std::size_t every);

/// Line responses of a run at the moment when the window's centre passes a position, and those of the machine
/// resting there.
struct AtPosition {
  std::vector<double> frequency_hz, estimated_db, true_db;
};
[[nodiscard]] AtPosition response_at(const Method& method, double position_m, std::uint64_t seed);

}  // namespace resonid::reproduction::v
