// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <resonid/base/constants.hpp>
#include <resonid/base/expected.hpp>
#include <span>
#include <type_traits>

namespace resonid::tracking {

enum class DftWindow {
  rectangular,  ///< Exact for periodic excitation.
  hann,         ///< Less leakage from what is not periodic in the window; 1.5 times the noise power.
};

struct SlidingDftConfig {
  double sample_rate_hz = 0.0;             ///< Rate at which step() is called, > 0.
  std::size_t window_samples = 0;          ///< N, from 3 to MaxWindow.
  std::span<const double> frequency_hz{};  ///< Lines k fs/N, whole k, 0 < k < N/2 (Hann: 1 < k).
  DftWindow window = DftWindow::rectangular;
};

/// Complex amplitude of spectral lines over the last N samples: modulated sliding DFT. O(lines) per sample.
///
///   S(n) = S(n-1) + (x(n) - x(n-N)) e^{-j2πkn/N},    amplitude = 2/N S(n)
///   Hann:  amplitude = 2/N ( S_k - (S_{k-1} e^{-jv} + S_{k+1} e^{jv})/2 ),   v = 2π (n+1)/N
///
/// Peak value in the unit of x, phase referred to sample 0. k is whole, so a periodic excitation does not
/// leak, and an offset drops out. S cannot become unstable, and its rounding errors do not add up either: a
/// second sum, begun anew every N samples, replaces it when it holds a whole window; both carry their
/// rounding along. A sample that is not finite is taken to be what it was one window ago. Source: METHOD 4.4.
template <class Real, std::size_t MaxLines, std::size_t MaxWindow>
class SlidingDft {
 public:
  using Scalar = Real;
  static constexpr std::size_t kMaxLines = MaxLines;

  static expected<SlidingDft, ConfigError> create(const SlidingDftConfig& config) {
    if (auto fault = check(config)) return unexpected<ConfigError>(*fault);
    SlidingDft dft;
    dft.sample_rate_hz_ = config.sample_rate_hz;
    dft.window_ = config.window_samples;
    dft.hann_ = config.window == DftWindow::hann;
    dft.lines_ = config.frequency_hz.size();
    for (std::size_t m = 0; m < dft.window_; ++m) {
      const double angle = kTwoPi * static_cast<double>(m) / static_cast<double>(dft.window_);
      dft.cos_[m] = static_cast<Scalar>(std::cos(angle));
      dft.sin_[m] = static_cast<Scalar>(std::sin(angle));
    }
    for (std::size_t i = 0; i < dft.lines_; ++i) {
      const auto k = static_cast<std::size_t>(std::llround(bin(config, i)));
      dft.bins_[i] = k;
      if (!dft.hann_) {
        dft.sums_[i].bin = k;
        continue;
      }
      for (std::size_t part = 0; part < 3; ++part) dft.sums_[3 * i + part].bin = k + part - 1;
    }
    return dft;
  }

  void step(Scalar x) noexcept {
    const Scalar oldest = history_[position_];
    if (!std::isfinite(x)) {
      x = oldest;
      ++skipped_;
    }
    history_[position_] = x;
    const std::size_t sums = hann_ ? 3 * lines_ : lines_;
    const bool whole = position_ + 1 == window_;
    for (std::size_t i = 0; i < sums; ++i) {
      BinSum& sum = sums_[i];
      const Scalar c = cos_[sum.twiddle], s = sin_[sum.twiddle];
      sum.twiddle += sum.bin;
      if (sum.twiddle >= window_) sum.twiddle -= window_;
      sum.fresh_re.add(x * c);
      sum.fresh_im.add(-x * s);
      sum.re.add(x * c);
      sum.im.add(-x * s);
      sum.re.add(-(oldest * c));
      sum.im.add(oldest * s);
      if (!whole) continue;
      sum.re = sum.fresh_re;
      sum.im = sum.fresh_im;
      sum.fresh_re = sum.fresh_im = {};
    }
    position_ = whole ? 0 : position_ + 1;
    ++samples_;
  }
  /// `count` samples were lost: as so many steps with a sample that is not finite. Those repeat the window,
  /// so whole windows change nothing and at most one is stepped.
  void miss(std::uint64_t count) noexcept {
    const std::uint64_t stepped = count % window_;
    for (std::uint64_t i = 0; i < stepped; ++i) step(std::numeric_limits<Scalar>::quiet_NaN());
    samples_ += count - stepped;
    skipped_ += count - stepped;
  }
  void reset() noexcept {
    history_.fill(Scalar(0));
    for (BinSum& sum : sums_) sum = BinSum{.bin = sum.bin};
    position_ = 0;
    samples_ = skipped_ = 0;
  }

  /// Phase referred to sample 0: constant for a constant line.
  [[nodiscard]] std::complex<Scalar> amplitude(std::size_t line) const noexcept {
    const Scalar scale = Scalar(2) / static_cast<Scalar>(window_);
    if (!hann_) return scale * sums_[line].value();
    const Scalar c = cos_[position_], s = sin_[position_];  // v = 2π (n+1)/N
    const auto below = sums_[3 * line].value(), own = sums_[3 * line + 1].value();
    const auto above = sums_[3 * line + 2].value();
    const Scalar half(0.5);
    return {
        scale * (own.real() - half * (c * (below.real() + above.real()) + s * (below.imag() - above.imag()))),
        scale *
            (own.imag() - half * (c * (below.imag() + above.imag()) - s * (below.real() - above.real())))};
  }
  /// Rotating phasor at the newest sample: signal = Re phasor.
  [[nodiscard]] std::complex<Scalar> phasor(std::size_t line) const noexcept {
    const std::size_t newest = position_ == 0 ? window_ - 1 : position_ - 1;
    const std::size_t turn = (newest * bins_[line]) % window_;
    const auto a = amplitude(line);
    return {a.real() * cos_[turn] - a.imag() * sin_[turn], a.real() * sin_[turn] + a.imag() * cos_[turn]};
  }

  /// Whether a whole window has been seen.
  [[nodiscard]] bool settled(std::size_t = 0) const noexcept { return samples_ >= window_; }
  [[nodiscard]] bool ready() const noexcept { return settled(); }
  [[nodiscard]] std::size_t settling_samples(std::size_t = 0) const noexcept { return window_; }
  /// Rms of the complex amplitude's error per unit standard deviation of white noise in the signal.
  [[nodiscard]] double noise_gain(std::size_t = 0) const noexcept {
    return std::sqrt((hann_ ? 6.0 : 4.0) / static_cast<double>(window_));
  }
  /// Age of the window's centre.
  [[nodiscard]] double lag_samples(std::size_t = 0) const noexcept {
    return 0.5 * (static_cast<double>(window_) - 1.0);
  }

  [[nodiscard]] std::size_t lines() const noexcept { return lines_; }
  [[nodiscard]] std::size_t window_samples() const noexcept { return window_; }
  [[nodiscard]] double frequency_hz(std::size_t line) const noexcept {
    return static_cast<double>(bins_[line]) * sample_rate_hz_ / static_cast<double>(window_);
  }
  [[nodiscard]] double sample_rate_hz() const noexcept { return sample_rate_hz_; }
  [[nodiscard]] std::uint64_t samples() const noexcept { return samples_; }  ///< Missing ones included.
  [[nodiscard]] std::uint64_t skipped_samples() const noexcept { return skipped_; }

 private:
  SlidingDft() = default;

  /// A sum that keeps what rounding took from it (two-sum; Knuth).
  struct Sum {
    Scalar high{}, low{};
    void add(Scalar x) noexcept {
      const Scalar sum = high + x;
      const Scalar part = sum - high;
      low += (high - (sum - part)) + (x - part);
      high = sum;
    }
    [[nodiscard]] Scalar value() const noexcept { return high + low; }
  };
  struct BinSum {
    std::size_t bin = 0;
    std::size_t twiddle = 0;  ///< bin * n mod N
    Sum re{}, im{}, fresh_re{}, fresh_im{};
    [[nodiscard]] std::complex<Scalar> value() const noexcept { return {re.value(), im.value()}; }
  };

  static double bin(const SlidingDftConfig& c, std::size_t i) noexcept {
    return c.frequency_hz[i] * static_cast<double>(c.window_samples) / c.sample_rate_hz;
  }

  static std::optional<ConfigError> check(const SlidingDftConfig& c) {
    constexpr double kWhole = 1e-4;  // bins
    if (!(c.sample_rate_hz > 0.0) || !std::isfinite(c.sample_rate_hz))
      return ConfigError{"sample_rate_hz", "must be > 0", c.sample_rate_hz};
    if (c.window_samples < 3)
      return ConfigError{"window_samples", "must be at least 3", double(c.window_samples)};
    if (c.window_samples > MaxWindow)
      return ConfigError{"window_samples", "is longer than the tracker was built for",
                         double(c.window_samples)};
    if (c.frequency_hz.empty()) return ConfigError{"frequency_hz", "needs at least one line", 0.0};
    if (c.frequency_hz.size() > MaxLines)
      return ConfigError{"frequency_hz", "has more lines than the tracker was built for",
                         double(c.frequency_hz.size())};
    const double lowest = c.window == DftWindow::hann ? 2.0 : 1.0;
    for (std::size_t i = 0; i < c.frequency_hz.size(); ++i) {
      const double k = bin(c, i);
      if (!(k > lowest - 0.5 && k < 0.5 * static_cast<double>(c.window_samples) - kWhole))
        return ConfigError{"frequency_hz",
                           "must be above 0 (with a Hann window above bin 1) and below half the sample rate",
                           c.frequency_hz[i]};
      if (std::abs(k - std::round(k)) > kWhole)
        return ConfigError{"frequency_hz", "must be a whole multiple of sample_rate_hz/window_samples",
                           c.frequency_hz[i]};
      for (std::size_t j = 0; j < i; ++j)
        if (std::round(bin(c, j)) == std::round(k))
          return ConfigError{"frequency_hz", "must not hold a line twice", c.frequency_hz[i]};
    }
    return std::nullopt;
  }

  std::array<Scalar, MaxWindow> cos_{}, sin_{};  // [m] of 2π m/N
  std::array<Scalar, MaxWindow> history_{};      // [n mod N]
  std::array<BinSum, 3 * MaxLines> sums_{};      // [line], with a Hann window [3 line + 0, 1, 2]
  std::array<std::size_t, MaxLines> bins_{};     // [line]
  double sample_rate_hz_ = 0.0;
  std::size_t window_ = 0, lines_ = 0, position_ = 0;
  bool hann_ = false;
  std::uint64_t samples_ = 0, skipped_ = 0;
};

static_assert(std::is_trivially_copyable_v<SlidingDft<double, 8, 64>>);
static_assert(std::is_trivially_copyable_v<SlidingDft<float, 8, 64>>);

}  // namespace resonid::tracking
