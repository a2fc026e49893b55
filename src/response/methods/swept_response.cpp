// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <resonid/base/constants.hpp>
#include <resonid/response/detail/swept_response.hpp>

#include "linalg/parallel.hpp"
#include "response/methods/sweep.hpp"

namespace resonid::response {
namespace {

expected<Sweep, Error> sweep_of(const data::Record& record, const SweptConfig& config, Approach approach) {
  const auto signals = signals_of(record, approach);
  if (!signals) return unexpected(signals.error());
  const online::SweepLaw& law = config.chirp;
  const double nyquist = 0.5 * record.sample_rate_hz;
  if (!(law.duration_s > 0.0)) return refuse("duration_s", "must be > 0", law.duration_s);
  if (!(law.from_hz > 0.0) || law.from_hz >= nyquist)
    return refuse("from_hz", "must lie between 0 and half the sample rate", law.from_hz);
  if (!(law.to_hz > 0.0) || law.to_hz >= nyquist)
    return refuse("to_hz", "must lie between 0 and half the sample rate", law.to_hz);
  if (law.from_hz == law.to_hz) return refuse("to_hz", "must differ from from_hz", law.to_hz);
  const double wanted = std::round(law.duration_s * record.sample_rate_hz);
  const std::size_t samples = std::min(signals->samples, static_cast<std::size_t>(wanted));
  if (static_cast<double>(samples) < 0.9 * wanted)
    return refuse("duration_s", "the recording is shorter than the sweep", law.duration_s);
  Sweep sweep;
  sweep.law = law;
  sweep.sample_time_s = record.sample_time_s();
  sweep.signals = *signals;
  sweep.phase_rad.resize(samples);
  sweep.cosine.reserve(samples);
  sweep.sine.reserve(samples);
  for (std::size_t k = 0; k < samples; ++k) {
    const double t = static_cast<double>(k) * sweep.sample_time_s;
    sweep.phase_rad[k] = kTwoPi * law.cycles(t);
    sweep.cosine.push_back(std::cos(sweep.phase_rad[k]));
    sweep.sine.push_back(std::sin(sweep.phase_rad[k]));
  }
  for (std::size_t i = 0; i < 3; ++i) {
    const auto part = signals->signal[i].first(signals->has(i) ? samples : 0);
    sweep.values[i].assign(part.begin(), part.end());
  }
  return sweep;
}

/// The wanted frequencies that the recorded part of the sweep passes.
expected<std::vector<double>, Error> grid(const Sweep& sweep, const SweptConfig& config) {
  const double low_hz = std::min(sweep.law.from_hz, sweep.law.to_hz);
  const double high_hz = std::max(sweep.law.from_hz, sweep.law.to_hz);
  auto frequencies = config.frequencies_hz;
  for (const double f : frequencies)
    if (f < low_hz || f > high_hz) return refuse("frequencies_hz", "must lie inside the sweep", f);
  if (frequencies.empty())
    for (double tenth = std::ceil(10.0 * low_hz - 1e-6); tenth <= 10.0 * high_hz + 1e-6; ++tenth)
      frequencies.push_back(std::clamp(tenth / 10.0, low_hz, high_hz));
  std::sort(frequencies.begin(), frequencies.end());
  const double end_s = (static_cast<double>(sweep.phase_rad.size()) - 0.5) * sweep.sample_time_s;
  frequencies.erase(
      std::remove_if(frequencies.begin(), frequencies.end(),
                     [&](double f) { return time_of(sweep.law, f) > end_s + sweep.sample_time_s; }),
      frequencies.end());
  return frequencies;
}

}  // namespace

double time_of(const online::SweepLaw& law, double frequency_hz) {
  if (law.sweep == online::Sweep::linear)
    return law.duration_s * (frequency_hz - law.from_hz) / (law.to_hz - law.from_hz);
  return law.duration_s * std::log(frequency_hz / law.from_hz) / std::log(law.to_hz / law.from_hz);
}

std::size_t default_half_width(const online::SweepLaw& chirp, double sample_rate_hz) {
  const double seconds = std::max(
      0.2, std::min(2.5 * chirp.duration_s / std::abs(chirp.to_hz - chirp.from_hz), chirp.duration_s / 6.0));
  return static_cast<std::size_t>(std::lround(seconds * sample_rate_hz));
}

expected<LineEstimates, Error> swept_lines(const data::Record& record, const SweptConfig& config,
                                           Approach approach) {
  const auto sweep = sweep_of(record, config, approach);
  if (!sweep) return unexpected(sweep.error());
  const auto frequencies = grid(*sweep, config);
  if (!frequencies) return unexpected(frequencies.error());
  LineEstimates estimates = empty_estimates(record, sweep->signals);
  if (config.method != SweptMethod::local_cubic) {
    auto lines = tracked_sweep(*sweep, config, *frequencies);
    if (!lines) return unexpected(lines.error());
    estimates.lines = *std::move(lines);
    return estimates;
  }
  const std::size_t half_width = config.half_width_samples > 0
                                     ? config.half_width_samples
                                     : default_half_width(config.chirp, record.sample_rate_hz);
  if (half_width < 16)
    return refuse("half_width_samples", "must be at least 16", static_cast<double>(half_width));
  estimates.lines.resize(frequencies->size());
  linalg::for_each_index(frequencies->size(), 0, [&](std::size_t i) {
    estimates.lines[i] = local_cubic_line(*sweep, config, static_cast<double>(half_width), (*frequencies)[i]);
  });
  return estimates;
}

expected<data::FrequencyResponse, Error> swept_response(const data::Record& record, const SweptConfig& config,
                                                        const ResponseOptions& options) {
  return swept_lines(record, config, options.approach).and_then([&](const LineEstimates& lines) {
    return plant_response(lines, options);
  });
}

}  // namespace resonid::response
