// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <resonid/base/expected.hpp>
#include <resonid/online/excitation/chirp.hpp>
#include <resonid/online/excitation/multisine.hpp>
#include <resonid/online/excitation/prbs.hpp>
#include <span>

#include "core.h"

namespace resonid::linuxcnc {

/// The excitations that an axis can be given, each with the peak value that is asked for.
class Generator {
 public:
  static expected<Generator, Error> create(std::span<const double> frequency_hz, double sample_rate_hz) {
    constexpr double kWatched_s = 30.0;
    constexpr double kBandOverBits = 0.3;  // up to which a PRBS is flat
    const std::array<double, 1> amplitude{1.0};
    const auto lines = Lines::create(
        {.sample_rate_hz = sample_rate_hz, .frequency_hz = frequency_hz, .amplitude = amplitude});
    if (!lines) return unexpected<Error>(lines.error());
    const double bits_hz = frequency_hz.back() / kBandOverBits;
    const auto prbs = online::Prbs::create(
        {.sample_rate_hz = sample_rate_hz,
         .amplitude = 1.0,
         .register_length = kRegister,
         .clock_divider = static_cast<std::size_t>(std::max(1.0, std::floor(sample_rate_hz / bits_hz)))});
    if (!prbs) return unexpected<Error>(prbs.error());
    const auto chirp = online::Chirp::create(chirp_config(frequency_hz, sample_rate_hz, kDefaultSweep_s));
    if (!chirp) return unexpected<Error>(chirp.error());
    Generator g(*lines, *prbs, *chirp);
    Lines watched = *lines;
    const auto longest = static_cast<std::size_t>(kWatched_s * sample_rate_hz);
    const std::size_t period = lines->period_samples();
    for (std::size_t k = period > 0 ? std::min(period, longest) : longest; k > 0; --k)
      g.lines_peak_ = std::max(g.lines_peak_, std::abs(watched.step()));
    return g;
  }

  /// From the first sample; false, and the sweep as it was, where the chirp cannot be made.
  bool start(int kind, double amplitude, double sweep_s) noexcept {
    kind_ = kind;
    amplitude_ = kind == RESONID_MULTISINE ? amplitude / lines_peak_ : amplitude;
    lines_.reset();
    prbs_.reset();
    if (kind == RESONID_CHIRP) {
      auto config = chirp_.config();
      config.duration_s = sweep_s;
      const auto chirp = online::Chirp::create(config);
      if (!chirp) return false;
      chirp_ = *chirp;
    }
    return kind == RESONID_MULTISINE || kind == RESONID_CHIRP || kind == RESONID_PRBS;
  }
  double step() noexcept {
    return amplitude_ * (kind_ == RESONID_CHIRP  ? chirp_.step()
                         : kind_ == RESONID_PRBS ? prbs_.step()
                                                 : lines_.step());
  }

 private:
  using Lines = online::Multisine<RESONID_MAX_LINES>;
  static constexpr std::size_t kRegister = 13;
  static constexpr double kDefaultSweep_s = 5.0;

  Generator(const Lines& lines, const online::Prbs& prbs, const online::Chirp& chirp) noexcept
      : lines_(lines), prbs_(prbs), chirp_(chirp) {}
  static online::ChirpConfig chirp_config(std::span<const double> frequency_hz, double sample_rate_hz,
                                          double sweep_s) noexcept {
    return {.sample_rate_hz = sample_rate_hz,
            .amplitude = 1.0,
            .from_hz = frequency_hz.front(),
            .to_hz = frequency_hz.back(),
            .duration_s = sweep_s,
            .repeat = true};
  }

  Lines lines_;
  online::Prbs prbs_;
  online::Chirp chirp_;
  double lines_peak_ = 0.0;
  double amplitude_ = 0.0;
  int kind_ = RESONID_MULTISINE;
};

}  // namespace resonid::linuxcnc
