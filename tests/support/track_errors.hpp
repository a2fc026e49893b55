// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <resonid/base/error_text.hpp>
#include <resonid/data/transfer_function.hpp>
#include <resonid/diagnostics/margins.hpp>
#include <resonid/identification/track.hpp>
#include <resonid/online/supervision/detail/loop_errors.hpp>
#include <resonid/plant/detail/controller.hpp>
#include <resonid/plant/experiment.hpp>
#include <stdexcept>
#include <string>
#include <vector>

namespace resonid::test {

inline identification::Track tracked(const data::Record& record,
                                     const identification::TrackOptions& options) {
  auto track = identification::track(record, options);
  if (!track) throw std::runtime_error(message_of(track.error()));
  return std::move(*track);
}

/// Relative errors of the resonance at the described times from `from_s` on.
struct TrackErrors {
  double rms = 0.0, greatest = 0.0;
  std::size_t rows = 0;
};
inline TrackErrors errors_of(const identification::Track& track, const plant::OverTime& truth,
                             double from_s) {
  const auto& resonance = track.find("resonance_hz")->value;
  double squares = 0.0;
  TrackErrors e;
  for (std::size_t i = 0; i < resonance.size(); ++i) {
    const double t = track.time_s[i];
    if (t < from_s) continue;
    const auto above = std::upper_bound(truth.time_s.begin(), truth.time_s.end(), t) - truth.time_s.begin();
    const auto k =
        static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(above, 1, std::ssize(truth.time_s) - 1));
    const double part = (t - truth.time_s[k - 1]) / (truth.time_s[k] - truth.time_s[k - 1]);
    const double true_hz =
        truth.resonance_hz[k - 1] + part * (truth.resonance_hz[k] - truth.resonance_hz[k - 1]);
    const double error = std::isfinite(resonance[i]) ? resonance[i] / true_hz - 1.0 : 1.0;
    squares += error * error;
    e.greatest = std::max(e.greatest, std::abs(error));
    ++e.rows;
  }
  e.rms = std::sqrt(squares / static_cast<double>(e.rows));
  return e;
}

/// The same over the trusted rows only.
inline TrackErrors errors_of_trusted(identification::Track track, const plant::OverTime& truth) {
  auto& resonance = *std::find_if(track.figures.begin(), track.figures.end(),
                                  [](const auto& series) { return series.name == "resonance_hz"; });
  std::size_t kept = 0;
  for (std::size_t i = 0; i < resonance.value.size(); ++i) {
    if (!track.trusted_rows[i]) continue;
    resonance.value[kept] = resonance.value[i];
    track.time_s[kept++] = track.time_s[i];
  }
  if (kept == 0) return {};
  resonance.value.resize(kept);
  return errors_of(track, truth, 0.0);
}

/// The tooth belt with its cart where it starts, the stiffness off by a factor.
inline fit::DriveModel tooth_belt_start(const plant::ExperimentConfig& c, double stiffness_factor) {
  const auto& d = c.drive;
  const double place = c.motion.from, r2 = d.radius_m * d.radius_m;
  const double near = d.specific_stiffness_n / place,
               far = d.specific_stiffness_n / (d.upper_length_m - place),
               below = d.specific_stiffness_n / d.lower_length_m;
  const double stiffness = (near + far * below / (far + below)) * r2, load = d.cart_mass_kg * r2;
  const double omega = std::sqrt(stiffness * (1.0 / d.driven_inertia + 1.0 / load));
  fit::DriveModel drive;
  drive.structure = fit::Structure::two_mass;
  drive.sample_time_s = 1.0 / c.run.sample_rate_hz;
  drive.parameters.driven_inertia = d.driven_inertia;
  drive.parameters.load_inertia = load;
  drive.parameters.stiffness = stiffness_factor * stiffness;
  drive.parameters.damping = stiffness / (omega * d.quality);
  return drive;
}

/// What the user of such an experiment knows: delay, and the controller that runs.
inline identification::TrackOptions known_to_track(const plant::ExperimentConfig& c) {
  identification::TrackOptions o;
  o.common.delay_s = c.measurement.delay_s;
  o.common.controller = plant::Controller::create(c.controller, c.run.sample_rate_hz)->feedback();
  return o;
}

/// A figure's errors over trusted rows, and over their standard deviations.
struct FigureErrors {
  double squares = 0.0, normalised_squares = 0.0, rows = 0.0;
  void add(double error, double std) {
    squares += error * error;
    normalised_squares += error * error / (std * std);
    rows += 1.0;
  }
  [[nodiscard]] double rms() const { return std::sqrt(squares / rows); }
  [[nodiscard]] double normalised() const { return normalised_squares / rows; }
};

/// Figures of the loop that runs, over the place of a tooth belt's cart: those of the simulator's own loop at
/// standstill, every 3 cm, in between by a parabola through three places. The gap is to where the cart
/// starts.
class LoopTruth {
 public:
  static constexpr std::array<const char*, 5> kNames = {"resonance_hz", "crossover_hz", "phase_margin_deg",
                                                        "modulus_margin", "gap"};
  static constexpr std::array<bool, 5> kRelative = {true, true, false, false, false};
  using Errors = std::array<FigureErrors, kNames.size()>;

  explicit LoopTruth(plant::ExperimentConfig config) : first_(config.motion.from) {
    const double rate = config.run.sample_rate_hz;
    config.run.duration_s = 0.5;
    config.motion = {};
    config.motion.kind = plant::MotionKind::standstill;
    config.excitation = {};
    std::vector<double> grid;  // on which the baseline is known
    for (int i = 0; i < 1000; ++i) grid.push_back(0.499 * rate * std::pow(1e3, i / 999.0 - 1.0));
    std::vector<std::complex<double>> first;
    for (std::size_t i = 0; i < kPlaces; ++i) {
      config.motion.from = first_ + kStep * static_cast<double>(i);
      const auto simulation = plant::simulate_closed_loop(config, grid);
      if (!simulation) throw std::runtime_error(message_of(simulation.error()));
      const auto& truth = simulation->truth;
      if (i == 0) {
        first = truth.loop.value;
        baseline_.response.frequency_hz = truth.response.frequency_hz;
        baseline_.response.value = truth.response.value;
        baseline_.units.response = "(rad/s)/Nm";
      }
      double gap = 0.0;
      for (std::size_t k = 0; k < first.size(); ++k)
        gap = std::max(gap, online::chordal(truth.loop.value[k], first[k]));
      const auto m = diagnostics::loop_margins(truth.loop);
      at_.push_back({truth.resonances[0].frequency_hz, m.crossover_hz().value(), m.phase_margin_deg().value(),
                     m.modulus_margin, gap});
    }
  }
  /// Response of the machine with its cart where it starts.
  [[nodiscard]] const identification::Result& baseline() const { return baseline_; }
  [[nodiscard]] double at(std::size_t figure, double place) const {
    const double x = std::clamp((place - first_) / kStep, 0.0, static_cast<double>(at_.size() - 1));
    const auto i = std::clamp<std::size_t>(static_cast<std::size_t>(std::lround(x)), 1, at_.size() - 2);
    const double t = x - static_cast<double>(i);
    const double before = at_[i - 1][figure], here = at_[i][figure], after = at_[i + 1][figure];
    return here + 0.5 * t * (after - before) + 0.5 * t * t * (after - 2.0 * here + before);
  }
  /// Adds those of a track's trusted rows; the baseline must have been told.
  void add_errors(const identification::Track& track, Errors& errors) const {
    for (std::size_t figure = 0; figure < kNames.size(); ++figure) {
      const auto& series = *track.find(kNames[figure]);
      for (std::size_t i = 0; i < series.value.size(); ++i) {
        if (!track.trusted_rows[i]) continue;
        const double right = at(figure, track.position_m[i]), unit = kRelative[figure] ? right : 1.0;
        errors[figure].add((series.value[i] - right) / unit, series.std[i] / unit);
      }
    }
  }
  [[nodiscard]] Errors errors_of(const identification::Track& track) const {
    Errors errors;
    add_errors(track, errors);
    return errors;
  }

 private:
  static constexpr double kStep = 0.03;
  static constexpr std::size_t kPlaces = 42;  // up to 1.63 m
  double first_;
  identification::Result baseline_;
  std::vector<std::array<double, kNames.size()>> at_;
};

}  // namespace resonid::test
