// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>
#include <limits>
#include <resonid/base/constants.hpp>
#include <resonid/base/detail/intact.hpp>
#include <span>
#include <type_traits>

namespace resonid::online {

/// Stability margins of a loop in plain numbers, for servo threads; NaN: the band does not show it. Their
/// meaning is that of LoopMargins (margins.hpp).
template <class Real>
struct LoopMargins {
  static constexpr Real kAbsent = std::numeric_limits<Real>::quiet_NaN();

  Real crossover_hz = kAbsent;            ///< First downward crossing of |L| = 1.
  Real phase_margin_deg = kAbsent;        ///< 180 + arg L there, in (-180, 180].
  Real worst_phase_margin_deg = kAbsent;  ///< Smallest over all crossings of |L| = 1, upward ones too.
  Real modulus_margin = kAbsent;          ///< min |1 + L| over the whole band.
  Real modulus_margin_hz = kAbsent;       ///< Where that is.
  Real gain_margin_db = kAbsent;          ///< Smallest factor > 1 at arg L = -180 deg, in dB.
  Real gain_margin_hz = kAbsent;
  /// Standard deviations, where those of the lines were given; of a model: detail/loop_errors.hpp.
  Real crossover_std_hz = kAbsent, phase_margin_std_deg = kAbsent, modulus_margin_std = kAbsent;
};

/// Margins of the loop L = C Gd, line by line: the work of one line is bounded, so that a servo thread may
/// spread a band over several samples.
///
/// Between neighbouring lines log |L| is interpolated linearly in log f (a slope stays one), arg L linearly
/// in f (so does a delay), and the distance to -1 is that of the chord. A line whose L is 0 or not finite (a
/// tracker that has not settled) makes a gap in the band: nothing is interpolated across it. Trivially
/// copyable, no heap. Source: Astrom and Murray 2008, 9.3; Nevaranta 2016, Pub. VI.
template <class Real>
class MarginScan {
 public:
  using Complex = std::complex<Real>;

  /// The next line, in ascending order. True when |L| has crossed 1 downwards since the line before:
  /// newest_crossover_hz() and newest_phase_margin_deg() are then of this crossing.
  /// `std`: of the loop at this line, its error circular and independent of the other lines', std^2 =
  /// E|error|^2; the margins get standard deviations then.
  bool step(Real frequency_hz, Complex loop, Real std = LoopMargins<Real>::kAbsent) noexcept {
    const bool usable = std::isfinite(loop.real()) && std::isfinite(loop.imag());
    if (usable) {
      if (is_nearest(Real(1) + loop))
        take_modulus(std::abs(Real(1) + loop), frequency_hz, std * std::sqrt(Real(0.5)));
    }
    bool crossed = false;
    if (usable && last_usable_ && last_ != Complex(0) && loop != Complex(0)) {
      const Real step_hz = frequency_hz - last_hz_;
      crossed = look_for_unit_gain(loop, frequency_hz, std);
      look_for_modulus(loop, step_hz, std);
      look_for_negative_real_axis(loop, frequency_hz);
    }
    last_ = loop;
    last_hz_ = frequency_hz;
    last_std_ = std;
    last_usable_ = usable;
    return crossed;
  }
  void reset() noexcept { *this = {}; }

  /// Margins of the lines so far.
  [[nodiscard]] const LoopMargins<Real>& margins() const noexcept { return margins_; }
  [[nodiscard]] Real newest_crossover_hz() const noexcept { return newest_hz_; }
  [[nodiscard]] Real newest_phase_margin_deg() const noexcept { return newest_margin_deg_; }
  /// For a state of unknown origin (base/detail/intact.hpp).
  [[nodiscard]] bool intact() const noexcept { return resonid::intact(last_usable_); }

 private:
  static constexpr Real kHalfTurn = static_cast<Real>(kPi);

  /// A part t of the way from one line to the other: logarithmic in magnitude, the shorter way in phase.
  static Complex between(Complex a, Complex b, Real t) noexcept {
    const Complex ratio = b / a;
    return a * std::polar(std::pow(std::abs(ratio), t), t * std::arg(ratio));
  }
  static Real phase_margin(Complex on_unit_circle) noexcept {
    const Real margin = Real(180) + std::arg(on_unit_circle) * Real(180) / kHalfTurn;
    return margin > Real(180) ? margin - Real(360) : margin;
  }
  /// Point of the chord a-b nearest to -1.
  static Real nearest_on_chord(Complex a, Complex b) noexcept {
    const Complex d = b - a;
    const Real length = std::norm(d);
    if (!(length > Real(0))) return Real(0);
    return std::clamp((std::conj(d) * (Complex(-1) - a)).real() / length, Real(0), Real(1));
  }

  /// Whether a point is nearer to -1 than all before it, `difference` its 1 + L.
  bool is_nearest(Complex difference) const noexcept {
    return !(std::norm(difference) >= margins_.modulus_margin * margins_.modulus_margin);
  }
  bool look_for_unit_gain(Complex loop, Real frequency_hz, Real std) noexcept {
    const bool falls = std::norm(last_) >= Real(1);
    if (falls == (std::norm(loop) >= Real(1))) return false;
    const Real before = std::log(std::abs(last_));
    const Real here = std::log(std::abs(loop));
    const Real t = before == Real(0) ? Real(0) : before / (before - here);
    const Real crossing_hz =
        last_hz_ > Real(0) ? last_hz_ * std::pow(frequency_hz / last_hz_, t) : t * frequency_hz;
    const Real part = (crossing_hz - last_hz_) / (frequency_hz - last_hz_);
    const Real margin = phase_margin(between(last_, loop, part));
    if (!(std::abs(margin) >= std::abs(margins_.worst_phase_margin_deg)))
      margins_.worst_phase_margin_deg = margin;
    if (!falls) return false;
    newest_hz_ = crossing_hz;
    newest_margin_deg_ = margin;
    if (std::isnan(margins_.crossover_hz)) {
      margins_.crossover_hz = newest_hz_;
      margins_.phase_margin_deg = margin;
      take_crossover_errors(loop, frequency_hz, std, t, before - here);
    }
    return true;
  }
  /// At t between two lines whose gains differ by exp(fall): the errors of ln|L| and of arg L have the same
  /// variance and are independent, the crossing moves with those of ln|L|, and arg L with the crossing.
  void take_crossover_errors(Complex loop, Real frequency_hz, Real std, Real t, Real fall) noexcept {
    const Real here = Real(0.5) * std * std / std::norm(loop);
    const Real before = Real(0.5) * last_std_ * last_std_ / std::norm(last_);
    const auto mixed = [&](Real part) {
      return (Real(1) - part) * (Real(1) - part) * before + part * part * here;
    };
    const Real along = last_hz_ > Real(0) ? margins_.crossover_hz * std::log(frequency_hz / last_hz_)
                                          : frequency_hz;  // of the crossing, over t
    margins_.crossover_std_hz = along / fall * std::sqrt(mixed(t));
    const Real step_hz = frequency_hz - last_hz_;
    const Real turn = std::arg(loop / last_) / step_hz * margins_.crossover_std_hz;
    margins_.phase_margin_std_deg =
        Real(180) / kHalfTurn * std::sqrt(mixed((margins_.crossover_hz - last_hz_) / step_hz) + turn * turn);
  }
  void look_for_modulus(Complex loop, Real step_hz, Real std) noexcept {
    const Real nearest = nearest_on_chord(last_, loop);
    const Complex difference = Real(1) + last_ + nearest * (loop - last_);
    if (!is_nearest(difference)) return;
    const Real before = (Real(1) - nearest) * last_std_, here = nearest * std;
    take_modulus(std::abs(difference), last_hz_ + nearest * step_hz,
                 std::sqrt(Real(0.5) * (before * before + here * here)));
  }
  /// Neighbours more than 90 degrees apart say nothing about the crossing.
  void look_for_negative_real_axis(Complex loop, Real frequency_hz) noexcept {
    if (!(last_.real() < Real(0)) || last_.imag() * loop.imag() > Real(0)) return;  // most lines
    const Real turn = std::arg(loop / last_);
    const Real before = std::arg(-last_);
    const Real quarter = Real(0.5) * kHalfTurn;
    if (!(std::abs(turn) < quarter) || (before >= Real(0)) == (before + turn >= Real(0)) ||
        !(std::abs(before) < quarter))
      return;
    const Real crossing_hz = last_hz_ - before / turn * (frequency_hz - last_hz_);
    const Real t = last_hz_ > Real(0) ? std::log(crossing_hz / last_hz_) / std::log(frequency_hz / last_hz_)
                                      : -before / turn;
    const Real gain = Real(-20) * std::log10(std::abs(between(last_, loop, t)));
    if (gain > Real(0) && !(gain >= margins_.gain_margin_db)) {
      margins_.gain_margin_db = gain;
      margins_.gain_margin_hz = crossing_hz;
    }
  }
  void take_modulus(Real distance, Real frequency_hz, Real std) noexcept {
    margins_.modulus_margin = distance;
    margins_.modulus_margin_hz = frequency_hz;
    margins_.modulus_margin_std = std;
  }

  LoopMargins<Real> margins_{};
  Complex last_{};
  Real last_hz_ = Real(0), last_std_ = LoopMargins<Real>::kAbsent;
  Real newest_hz_ = LoopMargins<Real>::kAbsent, newest_margin_deg_ = LoopMargins<Real>::kAbsent;
  bool last_usable_ = false;
};

/// Margins of a loop response at ascending frequencies (as many as there are of both); loop_margins() without
/// heap. Call as loop_margins<float>(...) or <double>.
template <class Real>
[[nodiscard]] LoopMargins<Real> loop_margins(std::span<const Real> frequency_hz,
                                             std::span<const std::complex<Real>> loop) noexcept {
  MarginScan<Real> scan;
  const std::size_t lines = std::min(frequency_hz.size(), loop.size());
  for (std::size_t i = 0; i < lines; ++i) scan.step(frequency_hz[i], loop[i]);
  return scan.margins();
}

/// Distances of the source's Nyquist rules at one line: d1 = |L|, d2 = |1 + L|.
template <class Real>
struct NyquistDistances {
  Real d1 = Real(0);
  Real d2 = Real(0);
};
template <class Real>
[[nodiscard]] NyquistDistances<Real> nyquist_distances(std::complex<Real> loop) noexcept {
  return {std::abs(loop), std::abs(Real(1) + loop)};
}

/// Resonance and anti-resonance by the source's Nyquist rules in plain numbers; NaN: none found.
template <class Real>
struct RunningResonance {
  Real antiresonance_hz = LoopMargins<Real>::kAbsent;
  Real resonance_hz = LoopMargins<Real>::kAbsent;
};

/// Anti-resonance at the local minimum of |L|, resonance at the local maximum of |1 + L|, in the region
/// Im L < 0, Re L > 0; the deepest and the highest where there are several. Grid values. A line that is not
/// finite, and its neighbours, are never either. Source: Nevaranta 2016, Pub. VI.
template <class Real>
[[nodiscard]] RunningResonance<Real> running_resonance(std::span<const Real> frequency_hz,
                                                       std::span<const std::complex<Real>> loop) noexcept {
  RunningResonance<Real> found;
  Real deepest = Real(0), highest = Real(0);
  const std::size_t lines = std::min(frequency_hz.size(), loop.size());
  for (std::size_t i = 1; i + 1 < lines; ++i) {
    const auto before = nyquist_distances(loop[i - 1]);
    const auto here = nyquist_distances(loop[i]);
    const auto after = nyquist_distances(loop[i + 1]);
    if (!(loop[i].imag() < Real(0) && loop[i].real() > Real(0))) continue;
    if (here.d2 >= before.d2 && here.d2 >= after.d2 && here.d2 > highest) {
      highest = here.d2;
      found.resonance_hz = frequency_hz[i];
    }
    if (here.d1 <= before.d1 && here.d1 <= after.d1 &&
        (std::isnan(found.antiresonance_hz) || here.d1 < deepest)) {
      deepest = here.d1;
      found.antiresonance_hz = frequency_hz[i];
    }
  }
  return found;
}

static_assert(std::is_trivially_copyable_v<MarginScan<double>>);
static_assert(std::is_trivially_copyable_v<MarginScan<float>>);

}  // namespace resonid::online
