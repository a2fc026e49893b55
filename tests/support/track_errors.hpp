// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <resonid/base/error_text.hpp>
#include <resonid/data/transfer_function.hpp>
#include <resonid/identification/track.hpp>
#include <resonid/plant/experiment.hpp>
#include <stdexcept>

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

/// What the user of such an experiment knows.
inline identification::TrackOptions known_to_track(const plant::ExperimentConfig& c) {
  identification::TrackOptions o;
  o.common.delay_s = c.measurement.delay_s;
  o.common.controller =
      data::pi_controller(c.controller.gain, c.controller.integral_time_s, 1.0 / c.run.sample_rate_hz);
  return o;
}

}  // namespace resonid::test
