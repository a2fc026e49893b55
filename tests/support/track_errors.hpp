// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <resonid/base/error_text.hpp>
#include <resonid/data/transfer_function.hpp>
#include <resonid/diagnostics/margins.hpp>
#include <resonid/identification/track.hpp>
#include <resonid/plant/detail/controller.hpp>
#include <resonid/plant/experiment.hpp>
#include <stdexcept>
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
};
inline TrackErrors errors_of(const identification::Track& track, const plant::OverTime& truth,
                             double from_s) {
  const auto& resonance = track.find("resonance_hz")->value;
  double squares = 0.0;
  std::size_t count = 0;
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
    ++count;
  }
  e.rms = std::sqrt(squares / static_cast<double>(count));
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

/// The tooth belt with its cart where it starts (METHOD 2.2), the stiffness off by a factor.
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

/// Crossover, phase and modulus margin of the loop that runs, over the place of a tooth belt's cart: those of
/// the simulator's own loop at standstill, every 3 cm, in between by a parabola through three places.
class LoopTruth {
 public:
  static constexpr std::array<const char*, 3> kNames = {"crossover_hz", "phase_margin_deg", "modulus_margin"};

  explicit LoopTruth(plant::ExperimentConfig config) {
    config.run.duration_s = 0.5;
    config.motion = {};
    config.motion.kind = plant::MotionKind::standstill;
    config.excitation = {};
    for (std::size_t i = 0; i < kPlaces; ++i) {
      config.motion.from = kFirst + kStep * static_cast<double>(i);
      const auto simulation = plant::simulate_closed_loop(config);
      if (!simulation) throw std::runtime_error(message_of(simulation.error()));
      const auto m = diagnostics::loop_margins(simulation->truth.loop);
      at_.push_back({m.crossover_hz().value(), m.phase_margin_deg().value(), m.modulus_margin});
    }
  }
  [[nodiscard]] double at(std::size_t figure, double place) const {
    const double x = std::clamp((place - kFirst) / kStep, 0.0, static_cast<double>(at_.size() - 1));
    const auto i = std::clamp<std::size_t>(static_cast<std::size_t>(std::lround(x)), 1, at_.size() - 2);
    const double t = x - static_cast<double>(i);
    const double before = at_[i - 1][figure], here = at_[i][figure], after = at_[i + 1][figure];
    return here + 0.5 * t * (after - before) + 0.5 * t * t * (after - 2.0 * here + before);
  }

 private:
  static constexpr double kFirst = 0.39, kStep = 0.031;
  static constexpr std::size_t kPlaces = 41;  // up to 1.63 m
  std::vector<std::array<double, 3>> at_;
};

/// Of one margin over the trusted rows: rms error in its unit (the crossover's over its value), mean of its
/// squared error over its stated variance, and how many rows there were.
struct MarginError {
  double rms = 0.0, normalised = 0.0;
  std::size_t rows = 0;
};
inline std::array<MarginError, 3> margin_errors(const identification::Track& track, const LoopTruth& truth) {
  std::array<MarginError, 3> errors;
  for (std::size_t figure = 0; figure < errors.size(); ++figure) {
    const auto& series = *track.find(LoopTruth::kNames[figure]);
    MarginError& e = errors[figure];
    for (std::size_t i = 0; i < series.value.size(); ++i) {
      if (!track.trusted_rows[i]) continue;
      const double right = truth.at(figure, track.position_m[i]);
      const double off = series.value[i] - right;
      const double part = figure == 0 ? off / right : off;
      e.rms += part * part;
      if (!series.std.empty()) {
        const double z = off / series.std[i];
        e.normalised += z * z;
      }
      ++e.rows;
    }
    e.rms = std::sqrt(e.rms / static_cast<double>(e.rows));
    e.normalised /= static_cast<double>(e.rows);
  }
  return errors;
}

}  // namespace resonid::test
