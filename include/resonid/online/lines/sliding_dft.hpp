// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <resonid/base/constants.hpp>
#include <resonid/base/detail/intact.hpp>
#include <resonid/base/expected.hpp>
#include <resonid/online/lines/detail/dft_window.hpp>
#include <resonid/online/lines/detail/line_kernels.hpp>
#include <span>
#include <type_traits>

namespace resonid::online {

struct SlidingDftConfig {
  double sample_rate_hz = 0.0;             ///< Rate at which step() is called, > 0.
  std::size_t window_samples = 0;          ///< N, from 3 to MaxWindow.
  std::span<const double> frequency_hz{};  ///< Lines k fs/N, whole k, 0 < k < N/2 (Hann: 1 < k).
  DftWindow window = DftWindow::rectangular;
};

/// Complex amplitude of spectral lines over the last N samples: modulated sliding DFT. O(lines) per sample.
///
///   S(n) = Σ_{m = n-N+1 ... n} x(m) e^{-j2πkm/N},    amplitude = 2/N S(n)
///   Hann:  amplitude = 2/N ( S_k - (S_{k-1} e^{-jv} + S_{k+1} e^{jv})/2 ),   v = 2π (n+1)/N
///
/// Peak value in the unit of x, phase referred to sample 0. k is whole, so a periodic excitation does not
/// leak, and an offset drops out. Blocks of kBlock samples are summed by themselves, newest minus oldest, and
/// added to S with their rounding error kept (Kahan):
///
///   e^{-j2πkm/N} = e^{-j2πka/N} e^{-j2πkb/N},   a: first sample of the block, b < kBlock
///
/// is one table for all samples and one factor per block. What a sample leaves behind in S when it has come
/// and gone is at most its rounding; eight columns after the other are summed afresh over one window in every
/// kRest, and take the place of theirs: no rounding error lives for ever, a spike's neither. The last step of
/// a block adds the block, as much again as about a step. Nothing fades, so nothing becomes denormal. A
/// sample that is not finite is taken to be what it was one window ago. Source: Duda 2010.
template <class Real, std::size_t MaxLines, std::size_t MaxWindow>
class SlidingDft {
 public:
  using Scalar = Real;
  static constexpr std::size_t kMaxLines = MaxLines;

  static expected<SlidingDft, Error> create(const SlidingDftConfig& config) {
    if (auto fault = check(config)) return unexpected<Error>(*fault);
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
    const std::size_t parts = dft.hann_ ? 3 : 1;
    for (std::size_t i = 0; i < dft.lines_; ++i) {
      const auto k = static_cast<std::size_t>(std::llround(bin(config, i)));
      dft.bins_[i] = k;
      for (std::size_t part = 0; part < parts; ++part)
        dft.make_column(parts * i + part, dft.hann_ ? k + part - 1 : k);
    }
    dft.columns_ = (parts * dft.lines_ + kGroup - 1) / kGroup * kGroup;
    if constexpr (kHasLineKernels<Scalar, MaxLines, 1>)
      static_cast<void>(line_kernels<Scalar>());  // chosen here
    dft.reset();
    return dft;
  }

  void step(Scalar x) noexcept {
    const Scalar oldest = history_[position_];
    if (!std::isfinite(x)) {
      x = oldest;
      ++skipped_;
    }
    history_[position_] = x;
    const Rows& turn = twiddle_[position_ % kBlock];
    accumulate(part_, turn, x - oldest, columns_);
    if (renewing()) accumulate_group(fresh_part_, turn, x, group_);
    prepare_next_block();
    ++position_;
    ++samples_;
    if (position_ % kBlock != 0 && position_ < window_) return;
    close_block();
    if (position_ == window_) close_window();
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
    part_ = {};
    sums_ = {};
    fresh_part_ = {};
    fresh_ = {};
    group_ = rest_ = 0;
    first_block();
    samples_ = skipped_ = 0;
  }

  /// Phase referred to sample 0: constant for a constant line.
  [[nodiscard]] std::complex<Scalar> amplitude(std::size_t line) const noexcept {
    const Scalar scale = Scalar(2) / static_cast<Scalar>(window_);
    if (!hann_) return scale * sum(line);
    const Scalar c = cos_[position_], s = sin_[position_];  // v = 2π (n+1)/N
    const auto below = sum(3 * line), own = sum(3 * line + 1), above = sum(3 * line + 2);
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

  /// For a state of unknown origin (base/detail/intact.hpp).
  [[nodiscard]] bool intact() const noexcept {
    const bool sizes = window_ >= 3 && window_ <= MaxWindow && lines_ >= 1 && lines_ <= MaxLines &&
                       columns_ <= kColumns && position_ < window_ && columns_ % kGroup == 0 &&
                       group_ < columns_ && group_ % kGroup == 0 && resonid::intact(hann_);
    return sizes && lines_ * (hann_ ? 3 : 1) <= columns_ &&
           all_below<std::uint32_t>(std::span(place_).first(columns_), window_) &&
           all_below<std::uint32_t>(std::span(advance_).first(columns_), window_);
  }

 private:
  SlidingDft() = default;

  // With vectors all but the samples' own work weighs; a table of 256 bytes per column stays in the cache.
  static constexpr std::size_t kBlock = kHasLineKernels<Scalar, MaxLines, 1> ? 256 / sizeof(Scalar) : 16;
  static constexpr std::size_t kGroup = 8;  // columns that are summed afresh at a time
  static constexpr std::size_t kRest = 3;   // windows from one group to the next
  static constexpr std::size_t kColumns = (3 * MaxLines + kGroup - 1) / kGroup * kGroup;
  template <std::size_t Columns>
  struct alignas(64) RowsOf {
    std::array<Scalar, Columns> re{}, im{};
  };
  using Row = std::array<Scalar, kColumns>;
  using Rows = RowsOf<kColumns>;  // [line], with a Hann window [3 line + 0, 1, 2]
  using Group = RowsOf<kGroup>;
  template <class R>
  struct SumsOf {
    R sum, lost;  // what rounding gave to the sum
  };

  void make_column(std::size_t column, std::size_t k) noexcept {
    for (std::size_t b = 0; b < kBlock; ++b) {
      twiddle_[b].re[column] = cos_[k * b % window_];
      twiddle_[b].im[column] = -sin_[k * b % window_];
    }
    advance_[column] = static_cast<std::uint32_t>(k * kBlock % window_);
  }

  static void accumulate(Rows& __restrict part, const Rows& __restrict turn, Scalar x,
                         std::size_t columns) noexcept {
    if constexpr (kHasLineKernels<Scalar, MaxLines, 1>) {
      constexpr std::size_t kStride = sizeof(Row) / sizeof(Scalar);
      line_kernels<Scalar>().accumulate(part.re.data(), turn.re.data(), x, columns, kStride);
    } else {
      for (std::size_t c = 0; c < columns; ++c) {
        part.re[c] += x * turn.re[c];
        part.im[c] += x * turn.im[c];
      }
    }
  }
  static void accumulate_group(Group& __restrict part, const Rows& __restrict turn, Scalar x,
                               std::size_t first) noexcept {
    for (std::size_t i = 0; i < kGroup; ++i) {
      part.re[i] += x * turn.re[first + i];
      part.im[i] += x * turn.im[first + i];
    }
  }
  [[nodiscard]] bool renewing() const noexcept { return rest_ == 0; }
  /// The factor of the next block, as many columns per sample as make all of them within a block.
  void prepare_next_block() noexcept {
    for (std::size_t c = position_ % kBlock; c < columns_; c += kBlock) {
      std::uint32_t place = place_[c] + advance_[c];
      if (place >= window_) place -= static_cast<std::uint32_t>(window_);
      place_[c] = place;
      next_.re[c] = cos_[place];
      next_.im[c] = -sin_[place];
    }
  }
  void close_block() noexcept {
    if (renewing()) {
      for (std::size_t i = 0; i < kGroup; ++i) {
        const Scalar re = block_.re[group_ + i], im = block_.im[group_ + i];
        add(fresh_.sum.re[i], fresh_.lost.re[i], fresh_part_.re[i] * re - fresh_part_.im[i] * im);
        add(fresh_.sum.im[i], fresh_.lost.im[i], fresh_part_.re[i] * im + fresh_part_.im[i] * re);
      }
      fresh_part_ = {};
    }
    add_block(sums_, part_, block_, next_, columns_);
  }
  /// sums += part turn; the next block begins.
  static void add_block(SumsOf<Rows>& __restrict sums, Rows& __restrict part, Rows& __restrict turn,
                        const Rows& __restrict next, std::size_t columns) noexcept {
    for (std::size_t c = 0; c < columns; ++c) {
      add(sums.sum.re[c], sums.lost.re[c], part.re[c] * turn.re[c] - part.im[c] * turn.im[c]);
      add(sums.sum.im[c], sums.lost.im[c], part.re[c] * turn.im[c] + part.im[c] * turn.re[c]);
      part.re[c] = part.im[c] = Scalar(0);
      turn.re[c] = next.re[c];
      turn.im[c] = next.im[c];
    }
  }
  /// sum += x, what rounding gave to the sum before taken off again (Kahan).
  static void add(Scalar& sum, Scalar& lost, Scalar x) noexcept {
    const Scalar corrected = x - lost, after = sum + corrected;
    lost = (after - sum) - corrected;
    sum = after;
  }
  void close_window() noexcept {
    if (renewing()) {
      for (std::size_t i = 0; i < kGroup; ++i) {
        sums_.sum.re[group_ + i] = fresh_.sum.re[i];
        sums_.sum.im[group_ + i] = fresh_.sum.im[i];
        sums_.lost.re[group_ + i] = fresh_.lost.re[i];
        sums_.lost.im[group_ + i] = fresh_.lost.im[i];
      }
      fresh_ = {};
      group_ = group_ + kGroup < columns_ ? group_ + kGroup : 0;
    }
    rest_ = rest_ + 1 < kRest ? rest_ + 1 : 0;
    first_block();
  }
  void first_block() noexcept {
    position_ = 0;
    for (std::size_t c = 0; c < columns_; ++c) {
      place_[c] = 0;
      block_.re[c] = Scalar(1);
      block_.im[c] = Scalar(0);
    }
  }

  [[nodiscard]] std::complex<Scalar> sum(std::size_t c) const noexcept {
    const Scalar re = part_.re[c], im = part_.im[c];
    return {sums_.sum.re[c] + ((block_.re[c] * re - block_.im[c] * im) - sums_.lost.re[c]),
            sums_.sum.im[c] + ((block_.re[c] * im + block_.im[c] * re) - sums_.lost.im[c])};
  }

  static double bin(const SlidingDftConfig& c, std::size_t i) noexcept {
    return c.frequency_hz[i] * static_cast<double>(c.window_samples) / c.sample_rate_hz;
  }

  static std::optional<Error> check(const SlidingDftConfig& c) {
    constexpr double kWhole = 1e-4;  // bins
    if (!(c.sample_rate_hz > 0.0) || !std::isfinite(c.sample_rate_hz))
      return Error{"sample_rate_hz", "must be > 0", c.sample_rate_hz};
    if (c.window_samples < 3) return Error{"window_samples", "must be at least 3", double(c.window_samples)};
    if (c.window_samples > MaxWindow)
      return Error{"window_samples", "is longer than the tracker was built for", double(c.window_samples)};
    if (c.frequency_hz.empty()) return Error{"frequency_hz", "needs at least one line", 0.0};
    if (c.frequency_hz.size() > MaxLines)
      return Error{"frequency_hz", "has more lines than the tracker was built for",
                   double(c.frequency_hz.size())};
    const double lowest = c.window == DftWindow::hann ? 2.0 : 1.0;
    for (std::size_t i = 0; i < c.frequency_hz.size(); ++i) {
      const double k = bin(c, i);
      if (!(k > lowest - 0.5 && k < 0.5 * static_cast<double>(c.window_samples) - kWhole))
        return Error{"frequency_hz",
                     "must be above 0 (with a Hann window above bin 1) and below half the sample rate",
                     c.frequency_hz[i]};
      if (std::abs(k - std::round(k)) > kWhole)
        return Error{"frequency_hz", "must be a whole multiple of sample_rate_hz/window_samples",
                     c.frequency_hz[i]};
      for (std::size_t j = 0; j < i; ++j)
        if (std::round(bin(c, j)) == std::round(k))
          return Error{"frequency_hz", "must not hold a line twice", c.frequency_hz[i]};
    }
    return std::nullopt;
  }

  std::array<Scalar, MaxWindow> cos_{}, sin_{};  // [m] of 2π m/N
  std::array<Scalar, MaxWindow> history_{};      // [n mod N]
  std::array<Rows, kBlock> twiddle_{};           // [sample of the block] e^{-j2πkb/N}
  Rows block_{}, next_{};                        // e^{-j2πka/N} of this block and of the next
  Rows part_{};                                  // sum of the block, without its factor
  SumsOf<Rows> sums_{};                          // S without the block
  Group fresh_part_{};                           // the same of the group that is summed afresh
  SumsOf<Group> fresh_{};
  std::array<std::uint32_t, kColumns> place_{}, advance_{};  // ka mod N, and its growth per block
  std::array<std::size_t, MaxLines> bins_{};                 // [line]
  double sample_rate_hz_ = 0.0;
  std::size_t window_ = 0, lines_ = 0, columns_ = 0, position_ = 0;
  std::size_t group_ = 0, rest_ = 0;  // first column that is summed afresh; windows since it began
  bool hann_ = false;
  std::uint64_t samples_ = 0, skipped_ = 0;
};

static_assert(std::is_trivially_copyable_v<SlidingDft<double, 8, 64>>);
static_assert(std::is_trivially_copyable_v<SlidingDft<float, 8, 64>>);

}  // namespace resonid::online
