// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <resonid/base/expected.hpp>
#include <resonid/online/excitation/detail/phase.hpp>
#include <resonid/online/excitation/metrics.hpp>
#include <span>

namespace resonid::online {

struct SteppedSineConfig {
  double sample_rate_hz = 0.0;  ///< Rate at which step() is called, > 0.
  std::span<const double>
      frequency_hz{};             ///< [line], in the order of measuring, > 0 and below half the sample rate.
  double amplitude = 1.0;         ///< Peak value, > 0.
  double settle_periods = 5.0;    ///< Periods at each frequency before measuring, 0 ... 1e6.
  double measure_periods = 10.0;  ///< Periods measured at each frequency, 1 ... 1e6.
};

[[nodiscard]] expected<void, Error> check(const SteppedSineConfig& config, std::size_t max_lines) noexcept;

/// One sine after another: each frequency settles, then is measured. The phase goes on without a jump at the
/// change. The settling time is rounded up, the measuring time to the nearest number of samples. Silent (0)
/// after the last frequency. Source: Pintelon and Schoukens 2012, ch. 5.
template <std::size_t MaxLines>
class SteppedSine {
 public:
  static expected<SteppedSine, Error> create(const SteppedSineConfig& config) {
    if (const auto checked = check(config, MaxLines); !checked) return unexpected(checked.error());
    return SteppedSine(config);
  }

  double step() noexcept {
    if (sample_ == line_[current_].settle + line_[current_].measure && current_ < lines_) {
      sample_ = 0;
      ++current_;
    }
    ++sample_;
    if (current_ == lines_) return 0.0;
    const double value = amplitude_ * std::cos(radians(phase_));
    phase_ += line_[current_].per_sample;
    return value;
  }
  void reset() noexcept {
    current_ = 0;
    sample_ = 0;
    phase_ = 0;
  }
  void fill(std::span<double> out) noexcept {
    for (double& x : out) x = step();
  }

  /// Index into the frequencies of the sample that step() returned last; lines() when all are done.
  [[nodiscard]] std::size_t line() const noexcept { return current_; }
  /// Whether that sample lies in the measuring part.
  [[nodiscard]] bool measuring() const noexcept {
    return current_ < lines_ && sample_ > line_[current_].settle;
  }
  [[nodiscard]] bool done() const noexcept { return current_ == lines_; }

  [[nodiscard]] std::size_t lines() const noexcept { return lines_; }
  [[nodiscard]] double frequency_hz(std::size_t line) const noexcept { return line_[line].frequency_hz; }
  [[nodiscard]] std::size_t length_samples() const noexcept {
    std::size_t sum = 0;
    for (std::size_t i = 0; i < lines_; ++i) sum += line_[i].settle + line_[i].measure;
    return sum;
  }
  [[nodiscard]] Band band() const noexcept {
    Band band{line_[0].frequency_hz, line_[0].frequency_hz};
    for (std::size_t i = 1; i < lines_; ++i) {
      band.low_hz = std::min(band.low_hz, line_[i].frequency_hz);
      band.high_hz = std::max(band.high_hz, line_[i].frequency_hz);
    }
    return band;
  }

  /// For a state of unknown origin (base/detail/intact.hpp).
  [[nodiscard]] bool intact() const noexcept {
    return lines_ >= 1 && lines_ <= MaxLines && current_ <= lines_;
  }

 private:
  struct Line {
    double frequency_hz;
    Turns per_sample;
    std::size_t settle, measure;  // samples
  };

  explicit SteppedSine(const SteppedSineConfig& config) noexcept
      : lines_(config.frequency_hz.size()), amplitude_(config.amplitude) {
    for (std::size_t i = 0; i < lines_; ++i) {
      const double period = config.sample_rate_hz / config.frequency_hz[i];
      line_[i] = {config.frequency_hz[i], turns(1.0 / period),
                  static_cast<std::size_t>(std::ceil(config.settle_periods * period - 1e-9)),
                  static_cast<std::size_t>(std::llround(config.measure_periods * period))};
    }
  }

  std::array<Line, MaxLines + 1> line_{};  // one more, so that line_[lines_] may be read
  std::size_t lines_;
  double amplitude_;
  std::size_t current_ = 0;
  std::size_t sample_ = 0;
  Turns phase_ = 0;
};

}  // namespace resonid::online
