// SPDX-License-Identifier: MIT
// The line bank's inner loops, compiled once per instruction set by Google Highway.
#include <bit>
#include <cstdint>
#include <limits>
#include <resonid/tracking/line_kernels.hpp>
#include <type_traits>

// What is left is what machines in the field have (SSE4, AVX2, AVX-512, NEON) and a portable form.
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_AVX3_DL | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tracking/line_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#ifdef __clang__
#define RESONID_UNROLL _Pragma("unroll")
#else
#define RESONID_UNROLL _Pragma("GCC unroll 4")
#endif

HWY_BEFORE_NAMESPACE();
namespace resonid::tracking::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

template <class Real>
using Tag = hn::CappedTag<Real, 8>;  // rows are padded to 8
template <class Real>
using Vector = hn::Vec<Tag<Real>>;
template <class Real>
using Bits = std::conditional_t<sizeof(Real) == 4, std::uint32_t, std::uint64_t>;

/// Rows and single numbers in the table of Oscillators.
template <class Real, std::size_t Channels>
struct Layout {
  Real *cos, *sin, *gain_re, *gain_im, *state, *offset, *predicted, *innovation;
  Real offset_gain, gain_sum;
  std::size_t padded;

  HWY_INLINE explicit Layout(const LineView<Real>& view)
      : cos(view.data),
        sin(cos + view.padded),
        gain_re(sin + view.padded),
        gain_im(gain_re + view.padded),
        state(gain_im + view.padded),
        offset(state + 2 * Channels * view.padded),
        predicted(offset + Channels),
        innovation(predicted + Channels),
        offset_gain(innovation[Channels]),
        gain_sum(innovation[Channels + 1]),
        padded(view.padded) {}
  HWY_INLINE Real* re(std::size_t channel) const { return state + 2 * channel * padded; }
  HWY_INLINE Real* im(std::size_t channel) const { return re(channel) + padded; }
};

/// All ones where every channel is finite, else 0; in integers, so that no data becomes a branch.
template <class Real, std::size_t Channels>
HWY_INLINE Bits<Real> finite_mask(const Real* z) {
  constexpr auto kExponent = std::bit_cast<Bits<Real>>(std::numeric_limits<Real>::infinity());
  Bits<Real> mask = ~Bits<Real>(0);
  RESONID_UNROLL
  for (std::size_t c = 0; c < Channels; ++c)
    mask &= Bits<Real>(0) - static_cast<Bits<Real>>((std::bit_cast<Bits<Real>>(z[c]) & kExponent) != kExponent);
  return mask;
}

/// 1/power; 0 where power is below the smallest normal number.
template <class V>
HWY_INLINE V inverse_or_zero(V power) {
  const hn::DFromV<V> d;
  using Real = hn::TFromV<V>;
  const auto usable = hn::Ge(power, hn::Set(d, std::numeric_limits<Real>::min()));
#if HWY_TARGET <= HWY_AVX3 && HWY_ARCH_X86
  if constexpr (sizeof(V) == 64 && sizeof(Real) == 8) {
    // 14 bits, then all of them: r (1 + e + e^2 + e^3), e = 1 - power r. A division of eight takes 16 cycles.
    const V r{_mm512_maskz_rcp14_pd(usable.raw, power.raw)};
    const V e = hn::NegMulAdd(power, r, hn::Set(d, Real(1)));
    return hn::MulAdd(hn::MulAdd(e, hn::MulAdd(e, e, e), e), r, r);
  }
#endif
  return hn::IfThenElseZero(usable, hn::Div(hn::Set(d, Real(1)), power));
}

/// y/u e^{j w Td} of the lines from `first` on.
template <class Real>
HWY_INLINE void respond(std::size_t lines, const ResponseView<Real>& out, std::size_t first, Vector<Real> u_re,
                        Vector<Real> u_im, Vector<Real> y_re, Vector<Real> y_im) {
  const Tag<Real> d;
  const auto inverse = inverse_or_zero(hn::MulAdd(u_re, u_re, hn::Mul(u_im, u_im)));
  const auto re = hn::Mul(inverse, hn::MulAdd(y_re, u_re, hn::Mul(y_im, u_im)));
  const auto im = hn::Mul(inverse, hn::NegMulAdd(y_re, u_im, hn::Mul(y_im, u_re)));
  if (first + hn::Lanes(d) <= lines) {
    const auto cos = hn::LoadU(d, out.delay_re + first), sin = hn::LoadU(d, out.delay_im + first);
    hn::StoreU(hn::NegMulAdd(im, sin, hn::Mul(re, cos)), d, out.re + first);
    hn::StoreU(hn::MulAdd(im, cos, hn::Mul(re, sin)), d, out.im + first);
  } else {
    const auto inside = hn::FirstN(d, lines - first);
    const auto cos = hn::MaskedLoad(inside, d, out.delay_re + first);
    const auto sin = hn::MaskedLoad(inside, d, out.delay_im + first);
    hn::BlendedStore(hn::NegMulAdd(im, sin, hn::Mul(re, cos)), inside, d, out.re + first);
    hn::BlendedStore(hn::MulAdd(im, cos, hn::Mul(re, sin)), inside, d, out.im + first);
  }
}

/// One sample. The next prediction is the sum of the turned phasors plus the sum of all gains times the
/// innovation, so that adding up the lines need not wait for the newest sample.
template <class Real, std::size_t Channels, bool Respond>
HWY_INLINE bool step_one(const LineView<Real>& view, const Real* z, const ResponseView<Real>& out) {
  using V = Vector<Real>;
  const Tag<Real> d;
  const Layout<Real, Channels> bank(view);
  const Bits<Real> mask = finite_mask<Real, Channels>(z);
  const V present = hn::Set(d, std::bit_cast<Real>(mask));
  V innovation[Channels], sum[Channels];
  RESONID_UNROLL
  for (std::size_t c = 0; c < Channels; ++c) {
    innovation[c] = hn::And(hn::Sub(hn::Set(d, z[c]), hn::Set(d, bank.predicted[c])), present);
    sum[c] = hn::Zero(d);
  }
  for (std::size_t i = 0; i < view.lines; i += hn::Lanes(d)) {
    const V cos = hn::LoadU(d, bank.cos + i), sin = hn::LoadU(d, bank.sin + i);
    const V gain_re = hn::LoadU(d, bank.gain_re + i), gain_im = hn::LoadU(d, bank.gain_im + i);
    V next_re[Channels], next_im[Channels];
    RESONID_UNROLL
    for (std::size_t c = 0; c < Channels; ++c) {
      const V re = hn::LoadU(d, bank.re(c) + i), im = hn::LoadU(d, bank.im(c) + i);
      const V turned = hn::NegMulAdd(sin, im, hn::Mul(cos, re));
      sum[c] = hn::Add(sum[c], turned);
      next_re[c] = hn::MulAdd(gain_re, innovation[c], turned);
      next_im[c] = hn::MulAdd(gain_im, innovation[c], hn::MulAdd(sin, re, hn::Mul(cos, im)));
      hn::StoreU(next_re[c], d, bank.re(c) + i);
      hn::StoreU(next_im[c], d, bank.im(c) + i);
    }
    if constexpr (Respond) respond<Real>(view.lines, out, i, next_re[0], next_im[0], next_re[1], next_im[1]);
  }
  RESONID_UNROLL
  for (std::size_t c = 0; c < Channels; ++c) {
    const Real e = hn::GetLane(innovation[c]);
    bank.predicted[c] = (hn::GetLane(hn::SumOfLanes(d, sum[c])) + bank.offset[c]) + bank.gain_sum * e;
    bank.offset[c] += bank.offset_gain * e;
    bank.innovation[c] = e;
  }
  return (mask & 1U) != 0;
}

template <class Real, std::size_t Channels>
bool step(LineView<Real> view, const Real* z) {
  return step_one<Real, Channels, false>(view, z, {});
}
template <class Real, std::size_t Channels>
bool step_responses(LineView<Real> view, const Real* z, ResponseView<Real> out) {
  return step_one<Real, Channels, true>(view, z, out);
}
template <class Real, std::size_t Channels>
std::size_t run(LineView<Real> view, const Real* const* z, std::size_t count, ResponseView<Real> out) {
  std::size_t skipped = 0;
  for (std::size_t k = 0; k < count; ++k) {
    Real sample[Channels];
    RESONID_UNROLL
    for (std::size_t c = 0; c < Channels; ++c) sample[c] = z[c][k];
    skipped += step_one<Real, Channels, true>(view, sample, out) ? 0 : 1;
    out.re += view.lines;
    out.im += view.lines;
  }
  return skipped;
}

template <class Real>
void responses(LineView<const Real> view, ResponseView<Real> out) {
  const Tag<Real> d;
  const Real* u = view.data + 4 * view.padded;
  const Real* y = u + 2 * view.padded;
  for (std::size_t i = 0; i < view.lines; i += hn::Lanes(d))
    respond<Real>(view.lines, out, i, hn::LoadU(d, u + i), hn::LoadU(d, u + view.padded + i),
                  hn::LoadU(d, y + i), hn::LoadU(d, y + view.padded + i));
}

/// p = C_M x for two vectors of the block's samples from `row` on: d = z - p, stored.
template <class Real, std::size_t Channels>
HWY_INLINE void block_residual(const Layout<Real, Channels>& bank, std::size_t lines, const BlockView<Real>& table,
                               const Real* const* z, std::size_t first, std::size_t row,
                               Real (&residual)[Channels][kBlockSamples]) {
  using V = Vector<Real>;
  const Tag<Real> d;
  const std::size_t lanes = hn::Lanes(d);
  V by_re[Channels][2], by_im[Channels][2];
  RESONID_UNROLL
  for (std::size_t c = 0; c < Channels; ++c) {
    by_re[c][0] = by_re[c][1] = hn::Set(d, bank.offset[c]);
    by_im[c][0] = by_im[c][1] = hn::Zero(d);
  }
  const Real* output = table.output + row;
  for (std::size_t i = 0; i < lines; ++i, output += 2 * kBlockSamples) {
    const V re0 = hn::LoadU(d, output), re1 = hn::LoadU(d, output + lanes);
    const V im0 = hn::LoadU(d, output + kBlockSamples), im1 = hn::LoadU(d, output + kBlockSamples + lanes);
    RESONID_UNROLL
    for (std::size_t c = 0; c < Channels; ++c) {
      const V re = hn::Set(d, bank.re(c)[i]), im = hn::Set(d, bank.im(c)[i]);
      by_re[c][0] = hn::MulAdd(re0, re, by_re[c][0]);
      by_re[c][1] = hn::MulAdd(re1, re, by_re[c][1]);
      by_im[c][0] = hn::MulAdd(im0, im, by_im[c][0]);
      by_im[c][1] = hn::MulAdd(im1, im, by_im[c][1]);
    }
  }
  RESONID_UNROLL
  for (std::size_t c = 0; c < Channels; ++c) {
    RESONID_UNROLL
    for (std::size_t half = 0; half < 2; ++half) {
      const V p = hn::Add(by_re[c][half], by_im[c][half]);
      hn::StoreU(hn::Sub(hn::LoadU(d, z[c] + first + row + half * lanes), p), d, residual[c] + row + half * lanes);
    }
  }
}

/// e = T d for two vectors of the block's samples from `row` on; T is lower triangular.
template <class Real, std::size_t Channels>
HWY_INLINE void block_innovation(const BlockView<Real>& table, std::size_t row,
                                 const Real (&residual)[Channels][kBlockSamples],
                                 Real (&innovation)[Channels][kBlockSamples]) {
  using V = Vector<Real>;
  const Tag<Real> d;
  const std::size_t lanes = hn::Lanes(d);
  V even[Channels][2], odd[Channels][2];
  RESONID_UNROLL
  for (std::size_t c = 0; c < Channels; ++c)
    even[c][0] = even[c][1] = odd[c][0] = odd[c][1] = hn::Zero(d);
  for (std::size_t j = 0; j < row + 2 * lanes; j += 2) {
    const Real* column = table.inverse + j * kBlockSamples + row;
    RESONID_UNROLL
    for (std::size_t half = 0; half < 2; ++half) {
      const V at = hn::LoadU(d, column + half * lanes), next = hn::LoadU(d, column + kBlockSamples + half * lanes);
      RESONID_UNROLL
      for (std::size_t c = 0; c < Channels; ++c) {
        even[c][half] = hn::MulAdd(at, hn::Set(d, residual[c][j]), even[c][half]);
        odd[c][half] = hn::MulAdd(next, hn::Set(d, residual[c][j + 1]), odd[c][half]);
      }
    }
  }
  RESONID_UNROLL
  for (std::size_t c = 0; c < Channels; ++c) {
    hn::StoreU(hn::Add(even[c][0], odd[c][0]), d, innovation[c] + row);
    hn::StoreU(hn::Add(even[c][1], odd[c][1]), d, innovation[c] + row + lanes);
  }
}

/// x = A^M x + B_M e, and the sum of the new phasors.
template <class Real, std::size_t Channels>
HWY_INLINE void block_state(const Layout<Real, Channels>& bank, std::size_t lines, const BlockView<Real>& table,
                            const Real (&innovation)[Channels][kBlockSamples]) {
  using V = Vector<Real>;
  const Tag<Real> d;
  V sum[Channels];
  RESONID_UNROLL
  for (std::size_t c = 0; c < Channels; ++c) sum[c] = hn::Zero(d);
  for (std::size_t i = 0; i < lines; i += hn::Lanes(d)) {
    const V cos = hn::LoadU(d, table.rotation + i), sin = hn::LoadU(d, table.rotation + bank.padded + i);
    V re[Channels], im[Channels];
    RESONID_UNROLL
    for (std::size_t c = 0; c < Channels; ++c) {
      const V x = hn::LoadU(d, bank.re(c) + i), y = hn::LoadU(d, bank.im(c) + i);
      re[c] = hn::NegMulAdd(sin, y, hn::Mul(cos, x));
      im[c] = hn::MulAdd(sin, x, hn::Mul(cos, y));
    }
    const Real* input = table.input + i;
    for (std::size_t j = 0; j < kBlockSamples; ++j, input += 2 * bank.padded) {
      const V gain_re = hn::LoadU(d, input), gain_im = hn::LoadU(d, input + bank.padded);
      RESONID_UNROLL
      for (std::size_t c = 0; c < Channels; ++c) {
        const V e = hn::Set(d, innovation[c][j]);
        re[c] = hn::MulAdd(gain_re, e, re[c]);
        im[c] = hn::MulAdd(gain_im, e, im[c]);
      }
    }
    RESONID_UNROLL
    for (std::size_t c = 0; c < Channels; ++c) {
      hn::StoreU(re[c], d, bank.re(c) + i);
      hn::StoreU(im[c], d, bank.im(c) + i);
      sum[c] = hn::Add(sum[c], re[c]);
    }
  }
  RESONID_UNROLL
  for (std::size_t c = 0; c < Channels; ++c)
    bank.predicted[c] = hn::GetLane(hn::SumOfLanes(d, sum[c]));
}

template <class Real, std::size_t Channels>
HWY_INLINE bool block_finite(const Real* const* z, std::size_t first) {
  const Tag<Real> d;
  auto nought = hn::Zero(d);  // x - x, NaN unless x is finite
  for (std::size_t k = first; k < first + kBlockSamples; k += hn::Lanes(d)) {
    RESONID_UNROLL
    for (std::size_t c = 0; c < Channels; ++c) {
      const auto x = hn::LoadU(d, z[c] + k);
      nought = hn::Add(nought, hn::Sub(x, x));
    }
  }
  return hn::AllTrue(d, hn::Eq(nought, hn::Zero(d)));
}

template <class Real, std::size_t Channels>
bool block(LineView<Real> view, const BlockView<Real>& table, const Real* const* z, std::size_t first) {
  if (!block_finite<Real, Channels>(z, first)) return false;
  const Layout<Real, Channels> bank(view);
  const std::size_t rows = 2 * hn::Lanes(Tag<Real>());
  alignas(64) Real residual[Channels][kBlockSamples];
  alignas(64) Real innovation[Channels][kBlockSamples];
  for (std::size_t row = 0; row < kBlockSamples; row += rows)
    block_residual<Real, Channels>(bank, view.lines, table, z, first, row, residual);
  for (std::size_t row = 0; row < kBlockSamples; row += rows)
    block_innovation<Real, Channels>(table, row, residual, innovation);
  block_state<Real, Channels>(bank, view.lines, table, innovation);
  for (std::size_t c = 0; c < Channels; ++c) {
    Real sum = 0;
    for (const Real e : innovation[c]) sum += e;
    bank.offset[c] += bank.offset_gain * sum;
    bank.predicted[c] += bank.offset[c];
    bank.innovation[c] = innovation[c][kBlockSamples - 1];
  }
  return true;
}

template <class Real>
const LineKernels<Real>* kernels() {
  static constexpr LineKernels<Real> kTable{
      {&step<Real, 1>, &step<Real, 2>, &step<Real, 3>},
      {nullptr, &step_responses<Real, 2>, &step_responses<Real, 3>},
      {nullptr, &run<Real, 2>, &run<Real, 3>},
      {&block<Real, 1>, &block<Real, 2>, &block<Real, 3>},
      &responses<Real>};
  return &kTable;
}
const LineKernels<float>* kernels_float() { return kernels<float>(); }
const LineKernels<double>* kernels_double() { return kernels<double>(); }

}  // namespace resonid::tracking::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace resonid::tracking {

HWY_EXPORT(kernels_float);
HWY_EXPORT(kernels_double);

namespace detail {
constinit std::atomic<const LineKernels<float>*> chosen_float{nullptr};
constinit std::atomic<const LineKernels<double>*> chosen_double{nullptr};
}  // namespace detail

void choose_line_kernels() noexcept {
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
  detail::chosen_float.store(HWY_DYNAMIC_DISPATCH(kernels_float)(), std::memory_order_release);
  detail::chosen_double.store(HWY_DYNAMIC_DISPATCH(kernels_double)(), std::memory_order_release);
}

}  // namespace resonid::tracking
#endif  // HWY_ONCE
