// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstdint>
#include <memory>
#include <resonid/base/error_text.hpp>
#include <resonid/io/shipped_experiments.hpp>
#include <resonid/online/lines/response_tracker.hpp>
#include <resonid/online/lines/sliding_dft.hpp>
#include <resonid/online/models/detail/response_fit.hpp>
#include <resonid/online/models/modes.hpp>
#include <resonid/online/models/recursive_response_fit.hpp>
#include <resonid/plant/experiment.hpp>
#include <stdexcept>
#include <vector>

namespace resonid::test {

/// Publication V, experiments/v_tooth_multisine.toml with 0.1 rad/s of noise: sliding DFT over 400 samples,
/// indirect, and what is fitted to its lines, at every sample.
struct TrackedTooth {
  double step_hz = 10.0;  ///< Of the lines, 20 ... 120 Hz.
  online::DftWindow window = online::DftWindow::hann;
  bool levy = false;          ///< Published: no weights, no fixed integrator.
  bool line_by_line = false;  ///< One line per sample.
};

struct ResonanceErrors {
  double at_label = 0.0;   ///< rms in % against the resonance at the time that the estimate describes
  double at_centre = 0.0;  ///< against that in the middle of the window
  double at_end = 0.0;     ///< against that at the newest sample
  double largest = 0.0;    ///< of the first
};

/// Over the part of the run in which the whole window lies where the cart goes at 0.38 m/s.
inline ResonanceErrors resonance_errors(const TrackedTooth& what, std::uint64_t first_seed, int seeds) {
  using Dft = online::SlidingDft<double, 21, 400>;
  constexpr double kRate = 2000.0;
  constexpr std::size_t kWindow = 400;
  ResonanceErrors errors;
  double count = 0.0;
  for (int s = 0; s < seeds; ++s) {
    auto config = io::shipped_experiment("v_tooth_multisine");
    config.measurement.noise_rms = 0.1;
    config.run.seed = first_seed + static_cast<std::uint64_t>(s);
    std::vector<double> lines;
    for (double f = 20.0; f < 120.5; f += what.step_hz) lines.push_back(f);
    config.excitation.lines_hz.assign(lines);
    const auto run = plant::simulate_closed_loop(config);
    if (!run) throw std::runtime_error(message_of(run.error()));
    const auto& record = run->record;
    const auto& truth = *run->truth.over_time;

    online::ResponseTrackerConfig known;
    known.known_delay_s = run->truth.delay_s;
    known.controller_numerator = run->truth.controller->numerator;
    known.controller_denominator = run->truth.controller->denominator;
    auto tracker = std::make_unique<online::ResponseTracker<Dft>>(
        online::ResponseTracker<Dft>::create(Dft::create({kRate, kWindow, lines, what.window}).value(), known)
            .value());
    auto fit = online::ResponseFit<double, 3, 21>::create({.sample_rate_hz = kRate,
                                                           .frequency_hz = lines,
                                                           .integrator = !what.levy,
                                                           .iterations = what.levy ? 0U : 1U})
                   .value();
    auto by_line = online::RecursiveResponseFit<double, 3, 21>::create(
                       {.sample_rate_hz = kRate, .frequency_hz = lines, .correlated_steps = double(kWindow)})
                       .value();

    // r is the velocity reference: at its greatest value between the ramps.
    const auto& r = record.reference.samples;
    const double greatest = *std::max_element(r.begin(), r.end());
    const auto steady = [&](double reference) { return reference > 0.999999 * greatest; };
    const auto from = static_cast<std::size_t>(std::find_if(r.begin(), r.end(), steady) - r.begin());
    const auto to = static_cast<std::size_t>(r.rend() - std::find_if(r.rbegin(), r.rend(), steady));
    const auto true_hz = [&](double sample) {
      const double t = sample / kRate;
      const auto above = std::upper_bound(truth.time_s.begin(), truth.time_s.end(), t);
      const auto i = static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(
          above - truth.time_s.begin(), 1, std::ptrdiff_t(truth.time_s.size()) - 1));
      const double part = (t - truth.time_s[i - 1]) / (truth.time_s[i] - truth.time_s[i - 1]);
      return truth.resonance_hz[i - 1] + part * (truth.resonance_hz[i] - truth.resonance_hz[i - 1]);
    };
    std::vector<std::complex<double>> response(lines.size());
    for (std::size_t k = 0; k < to; ++k) {
      tracker->step(record.excitation.samples[k], record.input.samples[k], record.output.samples[k]);
      if (!tracker->ready()) continue;
      if (what.line_by_line) {
        by_line.step(tracker->response(by_line.next_line(), Approach::indirect));
      } else {
        for (std::size_t l = 0; l < lines.size(); ++l) response[l] = tracker->response(l, Approach::indirect);
        fit.step(response);
      }
      if (k + 1 < from + kWindow) continue;
      const auto model = what.line_by_line ? by_line.model() : fit.model();
      const auto modes = online::SampledModes<3>(model, kRate).resonances();
      const double found = modes.empty() ? 0.0 : modes[0].frequency_hz;
      const double own = what.line_by_line ? by_line.lag_samples() : fit.lag_samples();
      const auto now = static_cast<double>(k), centre = now - tracker->lag_samples(0);
      const auto squared = [&](double sample) {
        return std::pow(100.0 * (found / true_hz(sample) - 1.0), 2);
      };
      const double label = squared(centre - own);
      errors.at_label += label;
      errors.at_centre += squared(centre);
      errors.at_end += squared(now);
      errors.largest = std::max(errors.largest, std::sqrt(label));
      count += 1.0;
    }
  }
  for (double* sum : {&errors.at_label, &errors.at_centre, &errors.at_end}) *sum = std::sqrt(*sum / count);
  return errors;
}

}  // namespace resonid::test
