// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstdint>
#include <resonid/base/constants.hpp>
#include <resonid/online/excitation/detail/phase.hpp>
#include <resonid/online/lines/chirp_tracker.hpp>
#include <resonid/online/lines/line_bank.hpp>
#include <resonid/online/lines/sliding_dft.hpp>
#include <vector>

/// Trackers in single precision over so many samples of exactly known signals: how far off they are at the
/// end, and at the worst within the last tenth, where drift would be. The signals come from integer phases,
/// so that the truth is exact at any sample; they are rounded to float once.
namespace resonid::test {

inline constexpr double kEnduranceRateHz = 8000.0;
inline constexpr std::size_t kEndurancePeriod = 4000;  ///< Samples; lines lie on multiples of 2 Hz.
inline constexpr std::array<double, 8> kEnduranceLines{20.0, 66.0, 128.0, 250.0, 410.0, 622.0, 840.0, 1100.0};

/// Relative errors of amplitudes and responses.
struct Endurance {
  double early = 0.0;  ///< Largest one in the tenth that follows settling.
  double late = 0.0;   ///< Largest one in the last tenth.
};

/// One period of u, and of y = G u with |G| and its phase different at every line.
struct EnduranceSignals {
  std::vector<float> u, y;
  std::array<std::complex<double>, kEnduranceLines.size()> amplitude, gain;

  EnduranceSignals() : u(kEndurancePeriod), y(kEndurancePeriod) {
    for (std::size_t i = 0; i < kEnduranceLines.size(); ++i) {
      const double x = static_cast<double>(i);
      amplitude[i] = std::polar(1.0 + 0.1 * x, 0.7 * x * x);
      gain[i] = std::polar(2.0 / (1.0 + x), -0.4 * x);
    }
    for (std::size_t k = 0; k < kEndurancePeriod; ++k) {
      double input = 0.2, output = -0.3;
      for (std::size_t i = 0; i < kEnduranceLines.size(); ++i) {
        const auto turned = amplitude[i] * turn(i, k);
        input += turned.real();
        output += (gain[i] * turned).real();
      }
      u[k] = static_cast<float>(input);
      y[k] = static_cast<float>(output);
    }
  }
  /// e^{j w k} of a line, from whole numbers.
  static std::complex<double> turn(std::size_t line, std::uint64_t k) {
    const auto cycles = static_cast<std::uint64_t>(kEnduranceLines[line] / 2.0);
    const std::uint64_t part = cycles * (k % kEndurancePeriod) % kEndurancePeriod;
    return std::polar(1.0, kTwoPi * static_cast<double>(part) / static_cast<double>(kEndurancePeriod));
  }
};

/// Calls `step(k)` for every sample and, now and then, `error()` for the largest relative error.
template <class Step, class Error>
Endurance endure(std::uint64_t samples, Step&& step, Error&& error) {
  constexpr std::uint64_t kEvery = 9973;
  Endurance result;
  const std::uint64_t settled = samples / 20;
  for (std::uint64_t k = 0; k < samples; ++k) {
    step(k);
    if (k % kEvery != 0 && k + 1 != samples) continue;
    if (k > settled && k < settled + samples / 10) result.early = std::max(result.early, error(k));
    if (k > samples - samples / 10) result.late = std::max(result.late, error(k));
  }
  return result;
}

inline Endurance line_bank_endurance(std::uint64_t samples) {
  const EnduranceSignals s;
  auto bank =
      online::LineBank<float, 8>::create(
          {.bank = {.sample_rate_hz = kEnduranceRateHz, .frequency_hz = kEnduranceLines, .lambda = 200.0}})
          .value();
  return endure(
      samples, [&](std::uint64_t k) { bank.step(s.u[k % kEndurancePeriod], s.y[k % kEndurancePeriod]); },
      [&](std::uint64_t k) {
        double worst = 0.0;
        for (std::size_t i = 0; i < kEnduranceLines.size(); ++i) {
          const std::complex<double> phasor(bank.phasor(0, i)), response(bank.response(i));
          const auto truth = s.amplitude[i] * EnduranceSignals::turn(i, k);
          worst = std::max({worst, std::abs(phasor - truth) / std::abs(truth),
                            std::abs(response - s.gain[i]) / std::abs(s.gain[i])});
        }
        return worst;
      });
}

inline Endurance sliding_dft_endurance(std::uint64_t samples) {
  const EnduranceSignals s;
  auto dft = online::SlidingDft<float, 8, kEndurancePeriod>::create({.sample_rate_hz = kEnduranceRateHz,
                                                                     .window_samples = kEndurancePeriod,
                                                                     .frequency_hz = kEnduranceLines})
                 .value();
  return endure(
      samples, [&](std::uint64_t k) { dft.step(s.u[k % kEndurancePeriod]); },
      [&](std::uint64_t k) {
        double worst = 0.0;
        for (std::size_t i = 0; i < kEnduranceLines.size(); ++i) {
          const std::complex<double> amplitude(dft.amplitude(i)), phasor(dft.phasor(i));
          const auto truth = s.amplitude[i];
          worst = std::max({worst, std::abs(amplitude - truth) / std::abs(truth),
                            std::abs(phasor - truth * EnduranceSignals::turn(i, k)) / std::abs(truth)});
        }
        return worst;
      });
}

/// One sweep from 20 to 300 Hz over all of the samples, at its end only as far as the tracker lags behind:
/// the rest is the line that stays.
inline Endurance chirp_tracker_endurance(std::uint64_t samples) {
  constexpr double kFrom = 20.0, kTo = 300.0;
  const auto swept = static_cast<double>(samples) * 0.8;
  auto tracker = online::ChirpTracker<float>::create({.sample_rate_hz = kEnduranceRateHz,
                                                      .from_hz = kFrom,
                                                      .to_hz = kTo,
                                                      .duration_s = swept / kEnduranceRateHz,
                                                      .lambda = 200.0})
                     .value();
  // Frequency and its change as whole numbers of 2^-64 turns: what they are rounded to moves the line by less
  // than 1e-9 of its frequency over 1e9 samples.
  using online::Turns;
  const Turns slope = online::turns((kTo - kFrom) / kEnduranceRateHz / swept);
  Turns phase = 0, frequency = online::turns(kFrom / kEnduranceRateHz) + slope / 2;
  Turns newest = 0;
  const auto end = static_cast<std::uint64_t>(swept);
  return endure(
      samples,
      [&](std::uint64_t k) {
        newest = phase;
        tracker.step(static_cast<float>(std::cos(online::radians(phase))));
        phase += frequency;
        if (k < end) frequency += slope;
      },
      [&](std::uint64_t) {
        return std::abs(std::complex<double>(tracker.phasor()) - std::polar(1.0, online::radians(newest)));
      });
}

}  // namespace resonid::test
