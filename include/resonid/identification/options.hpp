// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <resonid/base/approach.hpp>
#include <resonid/data/transfer_function.hpp>
#include <string_view>
#include <utility>
#include <vector>

namespace resonid::identification {

enum class ExcitationType { automatic, chirp, multisine, prbs, stepped_sine, other };

/// How the response is measured; `model` reports the fitted model's response instead.
enum class Method {
  automatic,
  kalman,
  sliding_dft,
  welch,
  periodic,
  local_polynomial,
  local_cubic,
  least_squares,
  model,
  local_rational,
  simulate_and_correct,
  best_linear
};

/// black_box: a rational model of any order, for what no drive structure describes.
enum class ModelChoice { automatic, none, rigid, two_mass, three_mass, black_box };

/// What is estimated of friction on the driven side. automatic: what the record shows.
enum class Friction { automatic, none, viscous, dry, both };

/// Linear chirp from the record's first sample on; the stop may be the lower frequency.
struct Chirp {
  double start_hz = 0.0;
  double stop_hz = 0.0;
  double duration_s = 0.0;
};

/// How the kalman method tracks.
struct Tracker {
  std::optional<double> lambda;       ///< Fixed gain of the published filter; absent: placed poles.
  std::optional<double> pole_radius;  ///< 0 ... 1; absent: chosen from line spacing or sweep rate.
  bool offset = true;                 ///< One shared constant state (operating point).
  bool smoothing = true;              ///< Off line: no lag. Off: the published one-pass filter.
};

/// What the user knows and wants. The defaults choose everything from the record.
struct Options {
  ExcitationType excitation_type = ExcitationType::automatic;
  std::optional<Chirp> chirp;
  std::vector<double> lines_hz;    ///< Frequencies to report, ascending; empty: chosen.
  std::size_t period_samples = 0;  ///< Period of a periodic excitation; 0: detected.
  /// Periods discarded at the start of the record; best_linear: of each realisation, one at least.
  std::size_t drop_periods = 0;
  Method method = Method::automatic;
  std::optional<Approach> approach;  ///< Absent: joint with an excitation signal, else direct.
  std::optional<data::TransferFunction> controller;  ///< C, from velocity error to torque.
  double delay_s = 0.0;                              ///< Known delay in the measured output.
  std::optional<std::pair<double, double>> band_hz;
  ModelChoice model = ModelChoice::automatic;
  Friction friction = Friction::automatic;  ///< Of drive models; dry friction needs a fit to the record.
  std::size_t order = 0;      ///< Of the black-box model, 1 ... 20; 0: chosen on a validation part.
  std::size_t bootstrap = 0;  ///< Replicas of a parametric bootstrap; 0: error bars by covariance only.
  std::uint64_t seed = 1;     ///< Of the bootstrap.
  std::size_t jobs = 1;      ///< Threads of the bootstrap; 0: one per core. The result does not depend on it.
  double confidence = 0.95;  ///< Of the regions in report and summary, inside (0, 1).
  Tracker tracker;
  std::optional<double>
      radius_m;  ///< Of the driven roller: stiffness and damping are reported at the belt too.
  std::function<void(std::string_view)> progress;  ///< Called with the name of each stage that begins.
};

}  // namespace resonid::identification
