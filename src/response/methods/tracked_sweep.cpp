// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <resonid/base/constants.hpp>
#include <resonid/online/lines/chirp_tracker.hpp>

#include "response/methods/sweep.hpp"

namespace resonid::response {
namespace {

using Complex = std::complex<double>;
using Tracker = online::ChirpTracker<double>;

expected<Tracker, Error> make_tracker(const Sweep& sweep, const SweptConfig& config, bool backward) {
  online::ChirpTrackerConfig c;
  c.sample_rate_hz = 1.0 / sweep.sample_time_s;
  c.sweep = sweep.law.sweep;
  c.from_hz = sweep.law.from_hz;
  c.to_hz = sweep.law.to_hz;
  c.duration_s = sweep.law.duration_s;
  if (backward) {  // begins where the recorded part of the sweep ends
    c.duration_s = static_cast<double>(sweep.phase_rad.size() - 1) * sweep.sample_time_s;
    c.from_hz = sweep.law.frequency_hz(c.duration_s);
    c.to_hz = sweep.law.from_hz;
  }
  c.offset = config.offset_state;
  c.lambda = config.lambda;
  if (config.pole_radius > 0.0) {
    c.gain = online::GainRule::placed_poles;
    c.pole_radius = config.pole_radius;
  }
  return Tracker::create(c);
}

/// Rotating phasors of one signal at every sample, and what they leave of it.
struct Tracked {
  std::vector<Complex> phasor;
  std::vector<double> residual;
};

Tracked track(std::span<const double> samples, Tracker tracker) {
  Tracked result;
  for (const double x : samples) {
    tracker.step(x);
    result.phasor.push_back(tracker.phasor());
    result.residual.push_back(x - result.phasor.back().real() - tracker.offset());
  }
  return result;
}

/// Mean of both directions: their lags cancel. A reversed signal turns the other way round, hence the
/// conjugate.
Tracked both_ways(std::span<const double> samples, const Tracker& forward, const Tracker& backward) {
  Tracked result = track(samples, forward);
  const std::vector<double> reversed(samples.rbegin(), samples.rend());
  const Tracked other = track(reversed, backward);
  for (std::size_t k = 0; k < samples.size(); ++k) {
    const std::size_t mirror = samples.size() - 1 - k;
    result.phasor[k] = 0.5 * (result.phasor[k] + std::conj(other.phasor[mirror]));
    result.residual[k] = 0.5 * (result.residual[k] + other.residual[mirror]);
  }
  return result;
}

/// Phasor between samples, against the chirp: there it stands nearly still.
Complex phasor_at(const Tracked& tracked, const std::vector<double>& phase_rad, double position) {
  if (tracked.phasor.empty()) return {};
  const auto before = std::min(static_cast<std::size_t>(position), tracked.phasor.size() - 2);
  const double part = position - static_cast<double>(before);
  return (1.0 - part) * tracked.phasor[before] * std::polar(1.0, -phase_rad[before]) +
         part * tracked.phasor[before + 1] * std::polar(1.0, -phase_rad[before + 1]);
}

}  // namespace

expected<std::vector<LineEstimate>, Error> tracked_sweep(const Sweep& sweep, const SweptConfig& config,
                                                         const std::vector<double>& frequencies_hz) {
  const bool two_way = config.method == SweptMethod::forward_backward;
  const auto forward = make_tracker(sweep, config, false);
  if (!forward) return unexpected(forward.error());
  const auto backward = make_tracker(sweep, config, true);
  if (!backward) return unexpected(backward.error());
  const auto samples = static_cast<Eigen::Index>(sweep.phase_rad.size());
  std::array<Tracked, 3> tracked;
  Eigen::MatrixX3d residual = Eigen::MatrixX3d::Zero(samples, 3);
  for (std::size_t i = 0; i < 3; ++i) {
    if (sweep.values[i].empty()) continue;
    // The offset state needs not start from far away.
    const auto values = config.offset_state ? detrended(sweep.values[i], 0) : sweep.values[i];
    tracked[i] = two_way ? both_ways(values, *forward, *backward) : track(values, *forward);
    for (Eigen::Index k = 0; k < samples; ++k)
      residual(k, static_cast<Eigen::Index>(i)) = tracked[i].residual[static_cast<std::size_t>(k)];
  }

  // Two independent halves of the noise; what both share at the sample itself is small.
  const double gain = forward->noise_gain() * forward->noise_gain() * (two_way ? 0.5 : 1.0);
  const double lag = std::max(forward->lag_samples(), 1.0);
  const auto half = static_cast<Eigen::Index>(std::ceil(10.0 * lag));
  const double reach_hz = 1.0 / (kTwoPi * lag * sweep.sample_time_s);  // half-power, of a first-order lag
  std::vector<LineEstimate> lines;
  for (const double f : frequencies_hz) {
    const auto nearest = std::clamp<Eigen::Index>(
        static_cast<Eigen::Index>(std::lround(time_of(sweep.law, f) / sweep.sample_time_s)), 0, samples - 1);
    const auto first = std::max<Eigen::Index>(0, nearest - half);
    const auto count = std::min(samples, nearest + half + 1) - first;
    const SideNoise noise =
        noise_beside(sweep.carrier(first), sweep.sample_time_s, f, residual.middleRows(first, count),
                     Eigen::VectorXd::Ones(count), 2.0 * reach_hz, 5.0 * reach_hz);
    LineEstimate line;
    line.frequency_hz = f;
    const double position =
        std::clamp(time_of(sweep.law, f) / sweep.sample_time_s, 0.0, static_cast<double>(samples - 1));
    line.excitation = phasor_at(tracked[0], sweep.phase_rad, position);
    line.input = phasor_at(tracked[1], sweep.phase_rad, position);
    line.output = phasor_at(tracked[2], sweep.phase_rad, position);
    line.covariance = gain * noise.density;
    line.degrees_of_freedom = noise.averages;
    lines.push_back(line);
  }
  return lines;
}

}  // namespace resonid::response
