// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <complex>
#include <cstddef>
#include <resonid/online/lines/detail/line_kernels.hpp>
#include <resonid/online/lines/line_bank.hpp>
#include <span>

namespace resonid::online {

/// Moves a LineBank over many recorded samples at once: the same numbers to rounding, in less time.
///
///   d = z - C_M x      e = T d      x(k+M) = A^M x(k) + B_M e      M = 16 samples
///
/// The innovations e of a block follow from its start, so that no sample waits for the one before; x are a
/// channel's phasors and offset. Rows of C_M are c A^m, columns of B_M are A^{M-1-j} g, and T is the inverse
/// of I + L, L(m, j) = c A^{m-1-j} g below the diagonal, c the sum over the lines and g the gains. Blocks
/// with a sample that is not finite are stepped sample by sample, and so is everything in a library built
/// without RESONID_SIMD. Holds only tables: about 14 KB for 21 lines in double. Source:
/// docs/methods/line_bank.md.
template <class Real, std::size_t MaxLines, std::size_t Channels = 2>
class LineBankBlock {
 public:
  using Bank = LineBank<Real, MaxLines, Channels>;
  using Signals = std::array<std::span<const Real>, Channels>;  ///< [channel][sample], all of one length.

  /// Tables for this bank, and for every copy of it.
  explicit LineBankBlock(const Bank& bank) noexcept {
    const auto& oscillators = bank.oscillators_;
    std::array<double, kBlockSamples> impulse;  // c A^m g
    impulse.fill(static_cast<double>(oscillators.offset_gain()));
    for (std::size_t i = 0; i < bank.lines(); ++i) {
      const std::complex<double> turn(oscillators.rotation(i)), gain(oscillators.gain(i));
      std::complex<double> power = 1.0;  // A^m
      for (std::size_t m = 0; m < kBlockSamples; ++m, power *= turn) {
        output_[i * 2 * kBlockSamples + m] = static_cast<Real>(power.real());
        output_[(i * 2 + 1) * kBlockSamples + m] = static_cast<Real>(-power.imag());
        const std::complex<double> input = power * gain;
        impulse[m] += input.real();
        const std::size_t row = (kBlockSamples - 1 - m) * 2 * kPadded;
        input_[row + i] = static_cast<Real>(input.real());
        input_[row + kPadded + i] = static_cast<Real>(input.imag());
      }
      rotation_[i] = static_cast<Real>(power.real());
      rotation_[kPadded + i] = static_cast<Real>(power.imag());
    }
    std::array<double, kBlockSamples> inverse{1.0};  // first column of T
    for (std::size_t m = 1; m < kBlockSamples; ++m)
      for (std::size_t j = 0; j < m; ++j) inverse[m] -= impulse[m - 1 - j] * inverse[j];
    for (std::size_t j = 0; j < kBlockSamples; ++j)
      for (std::size_t m = j; m < kBlockSamples; ++m)
        inverse_[j * kBlockSamples + m] = static_cast<Real>(inverse[m - j]);
  }

  /// Steps the bank, of which these are the tables, through the signals.
  void run(Bank& bank, const Signals& signals) const noexcept {
    const std::size_t count = length(signals);
    advance(bank, pointers(signals), 0, count);
  }
  /// The same with the responses after every `stride` samples, >= 1: response_re and response_im,
  /// [row][line], in rows of `row_length` numbers, >= lines() (0: lines()), with room for whole rows. Returns
  /// the rows, samples/stride. Quickest where rows begin at multiples of 64 bytes; what is behind a row's
  /// lines stays.
  std::size_t run(Bank& bank, const Signals& signals, std::size_t stride, std::span<Real> response_re,
                  std::span<Real> response_im, std::size_t row_length = 0) const noexcept
      requires(Channels >= 2) {
    const std::size_t count = length(signals), rows = count / stride, lines = bank.lines();
    const std::size_t apart = row_length == 0 ? lines : row_length;
    const Pointers z = pointers(signals);
    if constexpr (kVectors) {
      if (stride == 1) {
        bank.skipped_ +=
            line_kernels<Real>().run[Channels - 1](bank.view(), tables(), z.data(), count, bank.delay_.data(),
                                                   response_re.data(), response_im.data(), apart);
        bank.samples_ += count;
        return rows;
      }
    }
    for (std::size_t row = 0; row < rows; ++row) {
      advance(bank, z, row * stride, (row + 1) * stride);
      bank.responses(response_re.subspan(row * apart, lines), response_im.subspan(row * apart, lines));
    }
    advance(bank, z, rows * stride, count);
    return rows;
  }

 private:
  using Pointers = std::array<const Real*, Channels>;
  static constexpr std::size_t kPadded = Bank::kPadded;
  static constexpr bool kVectors = Bank::kVectors;

  [[nodiscard]] BlockView<Real> tables() const noexcept {
    return {output_.data(), inverse_.data(), input_.data(), rotation_.data()};
  }
  static std::size_t length(const Signals& signals) noexcept {
    std::size_t count = signals[0].size();
    for (const auto& signal : signals) count = std::min(count, signal.size());
    return count;
  }
  static Pointers pointers(const Signals& signals) noexcept {
    Pointers z;
    for (std::size_t c = 0; c < Channels; ++c) z[c] = signals[c].data();
    return z;
  }
  void advance(Bank& bank, const Pointers& z, std::size_t first, std::size_t end) const noexcept {
    if constexpr (kVectors) {
      const BlockView<Real> view = tables();
      for (; first + kBlockSamples <= end; first += kBlockSamples) {
        if (line_kernels<Real>().block[Channels - 1](bank.view(), view, z.data(), first))
          bank.samples_ += kBlockSamples;
        else
          step(bank, z, first, first + kBlockSamples);
      }
    }
    step(bank, z, first, end);
  }
  static void step(Bank& bank, const Pointers& z, std::size_t first, std::size_t end) noexcept {
    for (std::size_t k = first; k < end; ++k) {
      typename Bank::Sample sample;
      for (std::size_t c = 0; c < Channels; ++c) sample[c] = z[c][k];
      bank.step(sample);
    }
  }

  std::array<Real, MaxLines * 2 * kBlockSamples> output_{};    // C_M: [line][re, im][sample]
  std::array<Real, kBlockSamples * kBlockSamples> inverse_{};  // T: [innovation's sample][sample]
  std::array<Real, kBlockSamples * 2 * kPadded> input_{};      // B_M: [sample][re, im][line]
  std::array<Real, 2 * kPadded> rotation_{};                   // A^M: [cos, sin][line]
};

static_assert(std::is_trivially_copyable_v<LineBankBlock<double, 21>>);

}  // namespace resonid::online
