// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cmath>
#include <resonid/base/constants.hpp>
#include <resonid/online/excitation/chirp.hpp>

namespace resonid::online {

expected<Chirp, Error> Chirp::create(const ChirpConfig& c) {
  constexpr double kMaxSamples = 1e12;
  if (!(c.sample_rate_hz > 0.0)) return refuse("sample_rate_hz", "must be > 0", c.sample_rate_hz);
  if (!(c.amplitude > 0.0)) return refuse("amplitude", "must be > 0", c.amplitude);
  const double nyquist = 0.5 * c.sample_rate_hz;
  if (!(c.from_hz > 0.0 && c.from_hz < nyquist))
    return refuse("from_hz", "must be > 0 and below half the sample rate", c.from_hz);
  if (!(c.to_hz > 0.0 && c.to_hz < nyquist))
    return refuse("to_hz", "must be > 0 and below half the sample rate", c.to_hz);
  if (c.from_hz == c.to_hz) return refuse("to_hz", "must differ from from_hz: the band is empty", c.to_hz);
  const double samples = c.duration_s * c.sample_rate_hz;
  if (!(samples >= 2.0 && samples <= kMaxSamples))
    return refuse("duration_s", "must be a time of at least two samples", c.duration_s);
  return Chirp(c, static_cast<std::size_t>(std::llround(samples)));
}

double Chirp::step() noexcept {
  if (sample_ >= length_) {
    if (!config_.repeat) return 0.0;
    sample_ = 0;
  }
  const double t = static_cast<double>(sample_++) / config_.sample_rate_hz;
  const auto& [rate, amplitude, f0, f1, duration, sweep, repeat, phase] = config_;
  double cycles = 0.0;
  if (sweep == Sweep::linear) {
    cycles = t * (f0 + 0.5 * (f1 - f0) / duration * t);
  } else {
    const double q = std::log(f1 / f0);
    cycles = f0 * duration / q * std::expm1(q * t / duration);
  }
  return amplitude * std::cos(kTwoPi * (cycles - std::floor(cycles)) + phase);
}

double Chirp::frequency_hz(double time_s) const noexcept {
  const double part = std::clamp(time_s / config_.duration_s, 0.0, 1.0);
  if (config_.sweep == Sweep::linear) return config_.from_hz + (config_.to_hz - config_.from_hz) * part;
  return config_.from_hz * std::exp(std::log(config_.to_hz / config_.from_hz) * part);
}

Band Chirp::band() const noexcept {
  return {std::min(config_.from_hz, config_.to_hz), std::max(config_.from_hz, config_.to_hz)};
}

}  // namespace resonid::online
