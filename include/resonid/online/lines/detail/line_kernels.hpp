// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace resonid::online {

/// What a kernel works on: the table of Oscillators (see its data()). Small enough for two registers: passed
/// in memory it would cost more than the arithmetic.
template <class Real>
struct LineView {
  Real* data = nullptr;
  std::uint32_t lines = 0;
  std::uint16_t padded = 0;  ///< Lanes per row.
  std::uint16_t delay_stride =
      0;  ///< From the real to the imaginary parts of a `delay` e^{j w Td}, [re, im][line].
};

inline constexpr std::size_t kBlockSamples = 16;   ///< M of the block form (line_bank_block.hpp).
inline constexpr std::size_t kKernelChannels = 3;  ///< Kernels exist for up to so many channels.

/// Tables of the block form, in the order of their use; line_bank_block.hpp has the formulas.
template <class Real>
struct BlockView {
  const Real* output = nullptr;    ///< C_M: [line][re, im][sample]
  const Real* inverse = nullptr;   ///< T: [innovation's sample][sample], lower triangle of a Toeplitz matrix
  const Real* input = nullptr;     ///< B_M: [sample][re, im][lane]
  const Real* rotation = nullptr;  ///< A^M: [cos, sin][lane]
};

/// The line bank's inner loops for one instruction set; null where there is none for so many channels.
/// Samples that are not finite are predicted, without a branch that depends on the data.
template <class Real>
struct LineKernels {
  template <class Function>
  using PerChannels = std::array<Function, kKernelChannels>;  ///< [channels - 1]
  /// One sample of all channels; returns whether it was finite.
  PerChannels<bool (*)(LineView<Real>, const Real* sample)> step;
  /// The same with the responses of channel 1 over channel 0 (LineBank::response), [line]; null for one
  /// channel.
  PerChannels<bool (*)(LineView<Real>, const Real* sample, const Real* delay, Real* re, Real* im)>
      step_responses;
  /// Many samples, [channel][sample], with the responses at every one, [sample][line] in rows
  /// of `row` numbers; returns how many were
  /// not finite.
  PerChannels<std::size_t (*)(LineView<Real>, const BlockView<Real>&, const Real* const* samples,
                              std::size_t count, const Real* delay, Real* re, Real* im, std::size_t row)>
      run;
  /// kBlockSamples samples from `first` on in the block form; false, and nothing done, if one is not finite.
  PerChannels<bool (*)(LineView<Real>, const BlockView<Real>&, const Real* const* samples, std::size_t first)>
      block;
  /// Responses of the state as it is, [line].
  void (*responses)(LineView<const Real>, const Real* delay, Real* re, Real* im);
  /// part += x turn, [re, im][column] with the imaginary parts `stride` behind; columns come in eights.
  void (*accumulate)(Real* part, const Real* turn, Real x, std::size_t columns, std::size_t stride);
};

/// Whether a bank uses the kernels: they are built with the library where CMake's RESONID_SIMD is on.
template <class Real, std::size_t MaxLines, std::size_t Channels>
inline constexpr bool kHasLineKernels =
#ifdef RESONID_SIMD
    (std::is_same_v<Real, float> || std::is_same_v<Real, double>)&&MaxLines > 4 && Channels
                                                                                       <= kKernelChannels;
#else
    false;
#endif

namespace detail {
extern std::atomic<const LineKernels<float>*> chosen_float;  // null until the first use
extern std::atomic<const LineKernels<double>*> chosen_double;
}  // namespace detail

/// Takes the fastest kernels of this processor, or of what hwy::SetSupportedTargetsForTest left of it, for
/// both precisions. Called by create() of the first
/// bank; no state holds the choice, so that snapshots move between processes. A process that only restores
/// snapshots calls it itself, or else its first step does.
void choose_line_kernels() noexcept;

template <class Real>
[[nodiscard]] inline const LineKernels<Real>& line_kernels() noexcept {
  const auto chosen = [] {
    if constexpr (std::is_same_v<Real, float>)
      return detail::chosen_float.load(std::memory_order_acquire);
    else
      return detail::chosen_double.load(std::memory_order_acquire);
  };
  if (chosen() == nullptr) choose_line_kernels();
  return *chosen();
}

}  // namespace resonid::online
