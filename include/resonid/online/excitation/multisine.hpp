// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <resonid/base/constants.hpp>
#include <resonid/base/enum_names.hpp>
#include <resonid/base/expected.hpp>
#include <resonid/online/excitation/detail/phase.hpp>
#include <resonid/online/excitation/detail/splitmix64.hpp>
#include <resonid/online/excitation/metrics.hpp>
#include <span>
#include <string_view>

namespace resonid::online {

enum class Phases { random, schroeder, zero, given };
inline constexpr EnumName<Phases> kPhasesNames[] = {{Phases::random, "random"},
                                                    {Phases::schroeder, "schroeder"},
                                                    {Phases::zero, "zero"},
                                                    {Phases::given, "given"}};
[[nodiscard]] constexpr std::span<const EnumName<Phases>> enum_names(Phases) noexcept { return kPhasesNames; }

/// First phase that serves small crest factors: with it the flat 21-line multisine has 1.79 at any sample
/// rate; with 0, which Schroeder's formula has, 1.835.
inline constexpr double kSchroederStart = kPi / 6.0;

struct MultisineConfig {
  double sample_rate_hz = 0.0;             ///< Rate at which step() is called, > 0.
  std::span<const double> frequency_hz{};  ///< [line], ascending, > 0 and below half the sample rate.
  std::span<const double> amplitude{};     ///< [line], or one value for all lines; > 0.
  Phases phases = Phases::schroeder;
  std::span<const double> phase_rad{};       ///< [line], for Phases::given only.
  std::uint64_t seed = 1;                    ///< For Phases::random only.
  double first_phase_rad = kSchroederStart;  ///< p_1 of Phases::schroeder.
  /// Periods after which new phases are drawn, for Phases::random only; 0: the same phases for ever.
  std::uint64_t periods_per_realisation = 0;
};

/// Refuses what no multisine can be made of; `max_lines` is what the caller has room for.
[[nodiscard]] expected<void, Error> check(const MultisineConfig& config, std::size_t max_lines) noexcept;

/// The phases of all lines in rad: as given, 0, uniform in 0 ... 2π, or Schroeder's for any power
/// distribution,
///
///   p_k = p_1 - 2π sum_{l<k} (k - l) A_l²/sum A²        (flat: p_1 - π k (k-1)/N),
///
/// which spread the signal's energy over time. Source: Schroeder 1970.
void multisine_phases(const MultisineConfig& config, std::span<double> phase_rad) noexcept;

/// What draws the phases of realisation m = 0, 1 ... of so many lines, in ascending frequency: one stream of
/// SplitMix64, cut into parts of `lines` numbers. No part of one seed's stream comes twice.
[[nodiscard]] constexpr SplitMix64 phase_generator(std::uint64_t seed, std::uint64_t realisation,
                                                   std::size_t lines) noexcept {
  return SplitMix64(seed, realisation * lines);
}
[[nodiscard]] constexpr double random_phase_rad(SplitMix64& generator) noexcept {
  return kTwoPi * generator.uniform();
}

/// Shortest time in samples after which all lines repeat, 0 when there is none below 2^24 samples.
[[nodiscard]] std::size_t common_period_samples(std::span<const double> frequency_hz,
                                                double sample_rate_hz) noexcept;

/// Sum of sines at given lines.
///
///   ru(k) = sum_i A_i cos(2π f_i k Ts + p_i)
///
/// Each line is a phasor turned sample by sample and set anew every 256 samples from a 64-bit integer phase,
/// so the error stays below 1e-13 of the amplitude for as long as it runs; when the lines have a common
/// period the signal repeats bit for bit. With periods_per_realisation P it repeats P times, then goes on
/// with the phases of the next realisation: what a best linear approximation needs, each P periods one
/// realisation. O(lines) per sample, no heap. Source: Pintelon and Schoukens 2012, ch. 5.
template <std::size_t MaxLines>
class Multisine {
 public:
  static expected<Multisine, Error> create(const MultisineConfig& config) {
    if (const auto checked = check(config, MaxLines); !checked) return unexpected(checked.error());
    return Multisine(config);
  }

  double step() noexcept {
    if (sample_ % kRefreshSamples == 0) refresh();
    double sum = 0.0;
    for (std::size_t i = 0; i < lines_; ++i) {
      Line& l = line_[i];
      sum += l.re;
      const double re = l.re * l.turn_re - l.im * l.turn_im;
      l.im = l.re * l.turn_im + l.im * l.turn_re;
      l.re = re;
    }
    if (++sample_ == period_samples_) begin_period();
    return sum;
  }
  void reset() noexcept {
    sample_ = 0;
    period_ = 0;
    if (realisation_ != 0) draw(0);
  }
  void fill(std::span<double> out) noexcept {
    for (double& x : out) x = step();
  }

  [[nodiscard]] std::size_t lines() const noexcept { return lines_; }
  [[nodiscard]] double frequency_hz(std::size_t line) const noexcept { return line_[line].frequency_hz; }
  /// Phase in the current realisation.
  [[nodiscard]] double phase_rad(std::size_t line) const noexcept { return line_[line].phase_rad; }
  /// Realisation of the next sample, from 0 on.
  [[nodiscard]] std::uint64_t realisation() const noexcept { return realisation_; }
  [[nodiscard]] std::uint64_t periods_per_realisation() const noexcept { return periods_; }
  /// Common period of the lines, whatever their phases; 0 when they have none.
  [[nodiscard]] std::size_t period_samples() const noexcept { return period_samples_; }
  [[nodiscard]] Band band() const noexcept { return {line_[0].frequency_hz, line_[lines_ - 1].frequency_hz}; }

  /// For a state of unknown origin (base/detail/intact.hpp).
  [[nodiscard]] bool intact() const noexcept { return lines_ >= 1 && lines_ <= MaxLines; }

 private:
  static constexpr std::uint64_t kRefreshSamples = 256;
  struct Line {
    double frequency_hz, phase_rad, amplitude;
    Turns phase, per_sample;
    double re, im, turn_re, turn_im;
  };

  explicit Multisine(const MultisineConfig& config) noexcept
      : lines_(config.frequency_hz.size()),
        seed_(config.seed),
        periods_(config.periods_per_realisation),
        period_samples_(common_period_samples(config.frequency_hz, config.sample_rate_hz)) {
    std::array<double, MaxLines> phases;
    multisine_phases(config, std::span(phases).first(lines_));
    for (std::size_t i = 0; i < lines_; ++i) {
      const double cycles = config.frequency_hz[i] / config.sample_rate_hz;
      const double amplitude = config.amplitude[config.amplitude.size() == 1 ? 0 : i];
      line_[i] = {config.frequency_hz[i],
                  phases[i],
                  amplitude,
                  turns(phases[i] / kTwoPi),
                  turns(cycles),
                  0.0,
                  0.0,
                  std::cos(kTwoPi * cycles),
                  std::sin(kTwoPi * cycles)};
    }
  }
  void begin_period() noexcept {
    sample_ = 0;
    if (periods_ == 0 || ++period_ < periods_) return;
    period_ = 0;
    draw(realisation_ + 1);
  }
  void draw(std::uint64_t realisation) noexcept {
    realisation_ = realisation;
    SplitMix64 generator = phase_generator(seed_, realisation, lines_);
    for (std::size_t i = 0; i < lines_; ++i) {
      line_[i].phase_rad = random_phase_rad(generator);
      line_[i].phase = turns(line_[i].phase_rad / kTwoPi);
    }
  }
  void refresh() noexcept {
    for (std::size_t i = 0; i < lines_; ++i) {
      Line& l = line_[i];
      const double angle = radians(l.phase + l.per_sample * sample_);
      l.re = l.amplitude * std::cos(angle);
      l.im = l.amplitude * std::sin(angle);
    }
  }

  std::array<Line, MaxLines> line_{};
  std::size_t lines_;
  std::uint64_t seed_;
  std::uint64_t periods_;  // of a realisation
  std::size_t period_samples_;
  std::uint64_t sample_ = 0;
  std::uint64_t period_ = 0;  // of the realisation
  std::uint64_t realisation_ = 0;
};

}  // namespace resonid::online
