// SPDX-License-Identifier: MIT
// The line bank's inner loops, compiled once per instruction set by Google Highway.
#include <algorithm>
#include <bit>
#include <cstdint>
#include <limits>
#include <resonid/online/lines/detail/line_kernels.hpp>
#include <type_traits>

// What is left is what machines in the field have (SSE4, AVX2, AVX-512, NEON) and a portable form.
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_AVX3_DL | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "online/lines/line_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#ifdef __clang__
#define RESONID_UNROLL _Pragma("unroll")
#else
#define RESONID_UNROLL _Pragma("GCC unroll 4")
#endif

HWY_BEFORE_NAMESPACE();
namespace resonid::online::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

template <class Real>
using Tag = hn::CappedTag<Real, 8>;  // rows are padded to 8
template <class Real>
using Vector = hn::Vec<Tag<Real>>;
template <class Real>
using Bits = std::conditional_t<sizeof(Real) == 4, std::uint32_t, std::uint64_t>;

/// Rows and single numbers in the table of Oscillators, all from one base; `Padded` 0: known at run time
/// only.
template <class Real, std::size_t Channels, std::size_t Padded = 0>
struct Layout {
  Real* data;
  std::size_t runtime_padded;

  HWY_INLINE explicit Layout(const LineView<Real>& view) : data(view.data), runtime_padded(view.padded) {}
  HWY_INLINE std::size_t padded() const { return Padded != 0 ? Padded : runtime_padded; }
  HWY_INLINE Real* cos() const { return data; }
  HWY_INLINE Real* sin() const { return data + padded(); }
  HWY_INLINE Real* gain_re() const { return data + 2 * padded(); }
  HWY_INLINE Real* gain_im() const { return data + 3 * padded(); }
  HWY_INLINE Real* re(std::size_t channel) const { return data + (4 + 2 * channel) * padded(); }
  HWY_INLINE Real* im(std::size_t channel) const { return data + (5 + 2 * channel) * padded(); }
  HWY_INLINE Real* offset() const { return data + (4 + 2 * Channels) * padded(); }
  HWY_INLINE Real* predicted() const { return offset() + Channels; }
  HWY_INLINE Real* innovation() const { return offset() + 2 * Channels; }
  HWY_INLINE Real offset_gain() const { return offset()[3 * Channels]; }
  HWY_INLINE Real gain_sum() const { return offset()[3 * Channels + 1]; }
};

/// All ones where every channel is finite, else 0; in integers, so that no data becomes a branch.
template <class Real, std::size_t Channels>
HWY_INLINE Bits<Real> finite_mask(const Real* z) {
  constexpr auto kExponent = std::bit_cast<Bits<Real>>(std::numeric_limits<Real>::infinity());
  Bits<Real> mask = ~Bits<Real>(0);
  RESONID_UNROLL
  for (std::size_t c = 0; c < Channels; ++c)
    mask &=
        Bits<Real>(0) - static_cast<Bits<Real>>((std::bit_cast<Bits<Real>>(z[c]) & kExponent) != kExponent);
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

/// The known delay's turn e^{j w Td}, and where the responses go: [line], exactly `lines` are touched.
template <class Real>
struct Outputs {
  const Real *delay_re, *delay_im;
  Real *re, *im;
  std::size_t lines;
};

/// The numbers at `from` that are inside the mask of the first `count`; nothing else is read.
template <class D, class Real = hn::TFromD<D>>
HWY_INLINE hn::Vec<D> load_first(D d, [[maybe_unused]] hn::Mask<D> inside, [[maybe_unused]] std::size_t count,
                                 const Real* from) {
#if HWY_TARGET == HWY_AVX2 || HWY_TARGET == HWY_AVX3
  return hn::MaskedLoad(inside, d, from);
#else  // Highway's MaskedLoad reads a whole aligned vector there
  alignas(64) Real copy[8] = {};
  for (std::size_t i = 0; i < std::min(count, hn::Lanes(d)); ++i) copy[i] = from[i];
  return hn::Load(d, copy);
#endif
}

template <class V>
struct Complex {
  V re, im;
};

/// y/u.
template <class V>
HWY_INLINE Complex<V> quotient(V u_re, V u_im, V y_re, V y_im) {
  const V inverse = inverse_or_zero(hn::MulAdd(u_re, u_re, hn::Mul(u_im, u_im)));
  return {hn::Mul(inverse, hn::MulAdd(y_re, u_re, hn::Mul(y_im, u_im))),
          hn::Mul(inverse, hn::NegMulAdd(y_re, u_im, hn::Mul(y_im, u_re)))};
}
template <class V>
HWY_INLINE Complex<V> product(Complex<V> a, Complex<V> b) {
  return {hn::NegMulAdd(a.im, b.im, hn::Mul(a.re, b.re)), hn::MulAdd(a.im, b.re, hn::Mul(a.re, b.im))};
}

/// y/u e^{j w Td} of the lines from `first` on.
template <class Real>
HWY_INLINE void respond(const Outputs<Real>& out, std::size_t first, Vector<Real> u_re, Vector<Real> u_im,
                        Vector<Real> y_re, Vector<Real> y_im) {
  using V = Vector<Real>;
  const Tag<Real> d;
  const Complex<V> g = quotient(u_re, u_im, y_re, y_im);
  if (first + hn::Lanes(d) <= out.lines) {
    const Complex<V> turn{hn::LoadU(d, out.delay_re + first), hn::LoadU(d, out.delay_im + first)};
    const Complex<V> turned = product(g, turn);
    hn::StoreU(turned.re, d, out.re + first);
    hn::StoreU(turned.im, d, out.im + first);
  } else {
    const auto inside = hn::FirstN(d, out.lines - first);
    const Complex<V> turn{load_first(d, inside, out.lines - first, out.delay_re + first),
                          load_first(d, inside, out.lines - first, out.delay_im + first)};
    const Complex<V> turned = product(g, turn);
    hn::BlendedStore(turned.re, inside, d, out.re + first);
    hn::BlendedStore(turned.im, inside, d, out.im + first);
  }
}

/// One sample. The next prediction is the sum of the turned phasors plus the sum of all gains times the
/// innovation, so that adding up the lines need not wait for the newest sample.
template <class Real, std::size_t Channels, bool Respond, std::size_t Padded = 0>
HWY_INLINE bool step_one(const LineView<Real>& view, const Real* z, const Outputs<Real>& out) {
  using V = Vector<Real>;
  const Tag<Real> d;
  const Layout<Real, Channels, Padded> bank(view);
  const Bits<Real> mask = finite_mask<Real, Channels>(z);
  const V present = hn::Set(d, std::bit_cast<Real>(mask));
  V innovation[Channels], sum[Channels];
  RESONID_UNROLL
  for (std::size_t c = 0; c < Channels; ++c) {
    innovation[c] = hn::And(hn::Sub(hn::Set(d, z[c]), hn::Set(d, bank.predicted()[c])), present);
    sum[c] = hn::Zero(d);
  }
  for (std::size_t i = 0; i < view.lines; i += hn::Lanes(d)) {
    const V cos = hn::LoadU(d, bank.cos() + i), sin = hn::LoadU(d, bank.sin() + i);
    const V gain_re = hn::LoadU(d, bank.gain_re() + i), gain_im = hn::LoadU(d, bank.gain_im() + i);
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
    if constexpr (Respond) respond<Real>(out, i, next_re[0], next_im[0], next_re[1], next_im[1]);
  }
  RESONID_UNROLL
  for (std::size_t c = 0; c < Channels; ++c) {
    const Real e = hn::GetLane(innovation[c]);
    bank.predicted()[c] = (hn::GetLane(hn::SumOfLanes(d, sum[c])) + bank.offset()[c]) + bank.gain_sum() * e;
    bank.offset()[c] += bank.offset_gain() * e;
    bank.innovation()[c] = e;
  }
  return (mask & 1U) != 0;
}

/// A bank for 17 to 24 lines, the published number among them, has its rows at constant distances: fewer
/// instructions.
template <class Real, std::size_t Channels, bool Respond>
HWY_INLINE bool step_any(const LineView<Real>& view, const Real* z, const Outputs<Real>& out) {
  if constexpr (Channels == 2) {
    if (view.padded == 24) return step_one<Real, Channels, Respond, 24>(view, z, out);
  }
  return step_one<Real, Channels, Respond>(view, z, out);
}

template <class Real, std::size_t Channels>
bool step(LineView<Real> view, const Real* z) {
  return step_any<Real, Channels, false>(view, z, Outputs<Real>{});
}
template <class Real, std::size_t Channels>
bool step_responses(LineView<Real> view, const Real* z, const Real* delay, Real* re, Real* im) {
  return step_any<Real, Channels, true>(view, z, {delay, delay + view.delay_stride, re, im, view.lines});
}

template <class Real>
void responses(LineView<const Real> view, const Real* delay, Real* re, Real* im) {
  const Tag<Real> d;
  const Outputs<Real> out{delay, delay + view.delay_stride, re, im, view.lines};
  const Real* u = view.data + 4 * view.padded;
  const Real* y = u + 2 * view.padded;
  for (std::size_t i = 0; i < view.lines; i += hn::Lanes(d))
    respond<Real>(out, i, hn::LoadU(d, u + i), hn::LoadU(d, u + view.padded + i), hn::LoadU(d, y + i),
                  hn::LoadU(d, y + view.padded + i));
}

/// p = C_M x for two vectors of the block's samples from `row` on: d = z - p, stored.
template <class Real, std::size_t Channels>
HWY_INLINE void block_residual(const Layout<Real, Channels>& bank, std::size_t lines,
                               const BlockView<Real>& table, const Real* const* z, std::size_t first,
                               std::size_t row, Real (&residual)[Channels][kBlockSamples]) {
  using V = Vector<Real>;
  const Tag<Real> d;
  const std::size_t lanes = hn::Lanes(d);
  V by_re[Channels][2], by_im[Channels][2];
  RESONID_UNROLL
  for (std::size_t c = 0; c < Channels; ++c) {
    by_re[c][0] = by_re[c][1] = hn::Set(d, bank.offset()[c]);
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
      hn::StoreU(hn::Sub(hn::LoadU(d, z[c] + first + row + half * lanes), p), d,
                 residual[c] + row + half * lanes);
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
  for (std::size_t c = 0; c < Channels; ++c) even[c][0] = even[c][1] = odd[c][0] = odd[c][1] = hn::Zero(d);
  for (std::size_t j = 0; j < row + 2 * lanes; j += 2) {
    const Real* column = table.inverse + j * kBlockSamples + row;
    RESONID_UNROLL
    for (std::size_t half = 0; half < 2; ++half) {
      const V at = hn::LoadU(d, column + half * lanes),
              next = hn::LoadU(d, column + kBlockSamples + half * lanes);
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
HWY_INLINE void block_state(const Layout<Real, Channels>& bank, std::size_t lines,
                            const BlockView<Real>& table, const Real (&innovation)[Channels][kBlockSamples]) {
  using V = Vector<Real>;
  const Tag<Real> d;
  V sum[Channels];
  RESONID_UNROLL
  for (std::size_t c = 0; c < Channels; ++c) sum[c] = hn::Zero(d);
  for (std::size_t i = 0; i < lines; i += hn::Lanes(d)) {
    const V cos = hn::LoadU(d, table.rotation + i), sin = hn::LoadU(d, table.rotation + bank.padded() + i);
    V re[Channels], im[Channels];
    RESONID_UNROLL
    for (std::size_t c = 0; c < Channels; ++c) {
      const V x = hn::LoadU(d, bank.re(c) + i), y = hn::LoadU(d, bank.im(c) + i);
      re[c] = hn::NegMulAdd(sin, y, hn::Mul(cos, x));
      im[c] = hn::MulAdd(sin, x, hn::Mul(cos, y));
    }
    const Real* input = table.input + i;
    for (std::size_t j = 0; j < kBlockSamples; ++j, input += 2 * bank.padded()) {
      const V gain_re = hn::LoadU(d, input), gain_im = hn::LoadU(d, input + bank.padded());
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
  for (std::size_t c = 0; c < Channels; ++c) bank.predicted()[c] = hn::GetLane(hn::SumOfLanes(d, sum[c]));
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

/// The innovations of a block from its samples.
template <class Real, std::size_t Channels>
HWY_INLINE void block_innovations(const Layout<Real, Channels>& bank, std::size_t lines,
                                  const BlockView<Real>& table, const Real* const* z, std::size_t first,
                                  Real (&innovation)[Channels][kBlockSamples]) {
  const std::size_t rows = 2 * hn::Lanes(Tag<Real>());
  alignas(64) Real residual[Channels][kBlockSamples];
  for (std::size_t row = 0; row < kBlockSamples; row += rows)
    block_residual<Real, Channels>(bank, lines, table, z, first, row, residual);
  for (std::size_t row = 0; row < kBlockSamples; row += rows)
    block_innovation<Real, Channels>(table, row, residual, innovation);
}

/// What is left of a block when the phasors are done; their sums are in bank.predicted().
template <class Real, std::size_t Channels>
HWY_INLINE void block_offset(const Layout<Real, Channels>& bank,
                             const Real (&innovation)[Channels][kBlockSamples]) {
  for (std::size_t c = 0; c < Channels; ++c) {
    Real sum = 0;
    for (const Real e : innovation[c]) sum += e;
    bank.offset()[c] += bank.offset_gain() * sum;
    bank.predicted()[c] += bank.offset()[c];
    bank.innovation()[c] = innovation[c][kBlockSamples - 1];
  }
}

template <class Real, std::size_t Channels>
bool block(LineView<Real> view, const BlockView<Real>& table, const Real* const* z, std::size_t first) {
  if (!block_finite<Real, Channels>(z, first)) return false;
  const Layout<Real, Channels> bank(view);
  alignas(64) Real innovation[Channels][kBlockSamples];
  block_innovations<Real, Channels>(bank, view.lines, table, z, first, innovation);
  block_state<Real, Channels>(bank, view.lines, table, innovation);
  block_offset<Real, Channels>(bank, innovation);
  return true;
}

/// One vector of lines through a block, with the response at every sample. Channel 1 is kept turned by the
/// known delay, e^{j w Td} y, so that the quotient is the response. A tail of lines stores under a mask.
template <class Real, std::size_t Channels, bool Tail>
HWY_INLINE void block_line_responses(const Layout<Real, Channels>& bank, std::size_t i,
                                     const Real (&innovation)[Channels][kBlockSamples],
                                     const Outputs<Real>& out, std::size_t row) {
  using V = Vector<Real>;
  const Tag<Real> d;
  const auto inside = hn::FirstN(d, out.lines - i);
  const Complex<V> rotation{hn::LoadU(d, bank.cos() + i), hn::LoadU(d, bank.sin() + i)};
  const Complex<V> delay{load_first(d, inside, out.lines - i, out.delay_re + i),
                         load_first(d, inside, out.lines - i, out.delay_im + i)};
  Complex<V> x[Channels], gain[Channels];
  RESONID_UNROLL
  for (std::size_t c = 0; c < Channels; ++c) {
    gain[c] = {hn::LoadU(d, bank.gain_re() + i), hn::LoadU(d, bank.gain_im() + i)};
    x[c] = {hn::LoadU(d, bank.re(c) + i), hn::LoadU(d, bank.im(c) + i)};
  }
  gain[1] = product(gain[1], delay);
  x[1] = product(x[1], delay);
  Real *re = out.re + i, *im = out.im + i;
  for (std::size_t j = 0; j < kBlockSamples; ++j, re += row, im += row) {
    RESONID_UNROLL
    for (std::size_t c = 0; c < Channels; ++c) {
      const V e = hn::Set(d, innovation[c][j]);  // gain e first: the chain from x to x is two operations
      x[c] = {hn::MulAdd(rotation.re, x[c].re, hn::NegMulAdd(rotation.im, x[c].im, hn::Mul(gain[c].re, e))),
              hn::MulAdd(rotation.re, x[c].im, hn::MulAdd(rotation.im, x[c].re, hn::Mul(gain[c].im, e)))};
    }
    const Complex<V> g = quotient(x[0].re, x[0].im, x[1].re, x[1].im);
    if constexpr (Tail) {
      hn::BlendedStore(g.re, inside, d, re);
      hn::BlendedStore(g.im, inside, d, im);
    } else {
      hn::StoreU(g.re, d, re);
      hn::StoreU(g.im, d, im);
    }
  }
  x[1] = product(x[1], Complex<V>{delay.re, hn::Neg(delay.im)});
  RESONID_UNROLL
  for (std::size_t c = 0; c < Channels; ++c) {
    hn::StoreU(x[c].re, d, bank.re(c) + i);
    hn::StoreU(x[c].im, d, bank.im(c) + i);
    bank.predicted()[c] += hn::GetLane(hn::SumOfLanes(d, x[c].re));
  }
}

template <class Real, std::size_t Channels>
std::size_t run(LineView<Real> view, const BlockView<Real>& table, const Real* const* z, std::size_t count,
                const Real* delay, Real* re, Real* im, std::size_t row) {
  const Layout<Real, Channels> bank(view);
  const std::size_t lanes = hn::Lanes(Tag<Real>());
  alignas(64) Real innovation[Channels][kBlockSamples];
  std::size_t skipped = 0, k = 0;
  while (k < count) {
    const Outputs<Real> out{delay, delay + view.delay_stride, re + k * row, im + k * row, view.lines};
    if (k + kBlockSamples <= count && block_finite<Real, Channels>(z, k)) {
      block_innovations<Real, Channels>(bank, view.lines, table, z, k, innovation);
      for (std::size_t c = 0; c < Channels; ++c) bank.predicted()[c] = 0;
      std::size_t i = 0;
      for (; i + lanes <= view.lines; i += lanes)
        block_line_responses<Real, Channels, false>(bank, i, innovation, out, row);
      if (i < view.lines) block_line_responses<Real, Channels, true>(bank, i, innovation, out, row);
      block_offset<Real, Channels>(bank, innovation);
      k += kBlockSamples;
    } else {
      Real sample[Channels];
      for (std::size_t c = 0; c < Channels; ++c) sample[c] = z[c][k];
      skipped += step_one<Real, Channels, true>(view, sample, out) ? 0 : 1;
      ++k;
    }
  }
  return skipped;
}

template <class Real>
void accumulate(Real* HWY_RESTRICT part, const Real* HWY_RESTRICT turn, Real x, std::size_t columns,
                std::size_t stride) {
  const Tag<Real> d;
  const auto factor = hn::Set(d, x);
  for (std::size_t c = 0; c < columns; c += hn::Lanes(d)) {
    hn::StoreU(hn::MulAdd(factor, hn::LoadU(d, turn + c), hn::LoadU(d, part + c)), d, part + c);
    hn::StoreU(hn::MulAdd(factor, hn::LoadU(d, turn + stride + c), hn::LoadU(d, part + stride + c)), d,
               part + stride + c);
  }
}

template <class Real>
const LineKernels<Real>* kernels() {
  static constexpr LineKernels<Real> kTable{{&step<Real, 1>, &step<Real, 2>, &step<Real, 3>},
                                            {nullptr, &step_responses<Real, 2>, &step_responses<Real, 3>},
                                            {nullptr, &run<Real, 2>, &run<Real, 3>},
                                            {&block<Real, 1>, &block<Real, 2>, &block<Real, 3>},
                                            &responses<Real>,
                                            &accumulate<Real>};
  return &kTable;
}
const LineKernels<float>* kernels_float() { return kernels<float>(); }
const LineKernels<double>* kernels_double() { return kernels<double>(); }

}  // namespace resonid::online::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace resonid::online {

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

}  // namespace resonid::online
#endif  // HWY_ONCE
