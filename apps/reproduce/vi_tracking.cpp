// SPDX-License-Identifier: MIT
#include "reproduce/vi_tracking.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <resonid/base/constants.hpp>
#include <resonid/online/lines/chirp_tracker.hpp>

namespace resonid::reproduction::vi {
namespace {

using Complex = std::complex<double>;
using Tracker = online::ChirpTracker<double>;

Tracker make_filter(const online::SweepLaw& sweep, double sample_rate_hz, double lambda,
                    FilterFrequency frequency) {
  online::ChirpTrackerConfig config;
  config.sample_rate_hz = sample_rate_hz;
  config.from_hz = sweep.from_hz;
  config.to_hz = frequency == FilterFrequency::printed ? 0.5 * (sweep.from_hz + sweep.to_hz) : sweep.to_hz;
  config.duration_s = sweep.duration_s;
  config.lambda = lambda;
  auto filter = Tracker::create(config);
  assert(filter);
  return *filter;
}

}  // namespace

TrackedSweep::TrackedSweep(const data::Record& record, const Known& known, double lambda,
                           FilterFrequency frequency)
    : known_(known), sample_rate_hz_(record.sample_rate_hz) {
  const Tracker pattern = make_filter(known.sweep, record.sample_rate_hz, lambda, frequency);
  std::vector<Complex> turn(record.samples());
  for (std::size_t k = 0; k < turn.size(); ++k) {
    const double cycles = known.sweep.cycles(static_cast<double>(k) / sample_rate_hz_);
    turn[k] = std::polar(1.0, -kTwoPi * (cycles - std::floor(cycles)));
  }
  const std::array<const std::vector<double>*, 3> signals{&record.excitation.samples, &record.input.samples,
                                                          &record.output.samples};
  for (std::size_t i = 0; i < 3; ++i) {
    Tracker filter = pattern;
    for (std::size_t k = 0; k < turn.size(); ++k) {
      filter.step((*signals[i])[k]);
      phasor_[i].push_back(filter.phasor() * turn[k]);
      residual_[i].push_back(filter.innovation());
    }
  }
}

Complex TrackedSweep::phasor(Signal signal, double position) const {
  const auto& p = phasor_[signal];
  const auto before = std::min(static_cast<std::size_t>(position), p.size() - 2);
  const double part = position - static_cast<double>(before);
  return (1.0 - part) * p[before] + part * p[before + 1];
}

data::FrequencyResponse TrackedSweep::response(std::span<const double> frequencies_hz, Approach approach,
                                               double lag_samples) const {
  const auto& law = known_.sweep;
  data::FrequencyResponse g;
  for (const double f : frequencies_hz) {
    const double at_s = law.duration_s * (f - law.from_hz) / (law.to_hz - law.from_hz);
    const double position = std::clamp(at_s * sample_rate_hz_ + lag_samples, 0.0,
                                       static_cast<double>(phasor_[kOutput].size() - 1));
    const Complex y = phasor(kOutput, position);
    Complex value;
    if (approach == Approach::indirect) {
      const Complex closed = y / phasor(kExcitation, position);
      value = closed / (1.0 - known_.controller->response(f) * closed);
    } else {  // the filters are alike: Y/U is (Y/Ru)/(U/Ru)
      value = y / phasor(kInput, position);
    }
    g.frequency_hz.push_back(f);
    g.value.push_back(value * std::polar(1.0, kTwoPi * f * known_.delay_s));
  }
  return g;
}

ResponseErrors errors(const data::FrequencyResponse& found, const data::FrequencyResponse& truth) {
  assert(found.lines() == truth.lines());
  ResponseErrors e;
  double lines_above = 0.0;
  for (std::size_t i = 0; i < truth.lines(); ++i) {
    const Complex ratio = found.value[i] / truth.value[i];
    const double decibel = std::abs(20.0 * std::log10(std::abs(ratio)));
    const double degree = std::abs(std::arg(ratio)) * 180.0 / kPi;
    e.decibel = std::max(e.decibel, decibel);
    e.degree = std::max(e.degree, degree);
    e.rms += std::norm(ratio - 1.0);
    if (truth.frequency_hz[i] < 5.0 + 1e-9) continue;
    e.decibel_above_5hz = std::max(e.decibel_above_5hz, decibel);
    e.degree_above_5hz = std::max(e.degree_above_5hz, degree);
    e.rms_above_5hz += std::norm(ratio - 1.0);
    lines_above += 1.0;
  }
  e.rms = std::sqrt(e.rms / static_cast<double>(std::max<std::size_t>(1, truth.lines())));
  e.rms_above_5hz = std::sqrt(e.rms_above_5hz / std::max(1.0, lines_above));
  return e;
}

}  // namespace resonid::reproduction::vi
