// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "plant/few.hpp"

namespace resonid::plant {

struct ValueSlope {
  double value, slope;
};

/// Where in [0, high] `f`, >= 0 at 0 and < 0 at `high`, turns negative, to rounding; f(s) -> ValueSlope.
/// Newton's method, within the bracket.
template <class F>
[[nodiscard]] double crossing(const F& f, double high, double guess) noexcept {
  double low = 0.0;
  double s = guess > 0.0 && guess < high ? guess : 0.5 * high;
  for (int i = 0; i < 80; ++i) {
    const ValueSlope at = f(s);
    (at.value >= 0.0 ? low : high) = s;
    const double next = s - at.value / at.slope;
    const bool newton = next >= low && next <= high && (i <= 8 || i % 2 == 0);
    const double step = (newton ? next : 0.5 * (low + high)) - s;
    s += step;
    if (std::abs(step) <= (newton ? 1e-9 : 1e-16)) break;  // its error is of the order of the step's square
  }
  return s;
}

/// First s in [0, 1] at which `f` turns negative; above 1: nowhere. It may dip once below 0 and come back.
/// `start` is f(0), `bend` half its second derivative there, `end` the value at 1.
template <class F>
[[nodiscard]] double first_crossing(const F& f, ValueSlope start, double bend, double end) noexcept {
  constexpr double kNowhere = 2.0;
  if (start.value <= 0.0 && start.slope < 0.0) return 0.0;
  if (end < 0.0) {  // guess: start.value + start.slope s + bend s^2 = 0
    const double root = std::sqrt(std::max(0.0, start.slope * start.slope - 4.0 * bend * start.value));
    return crossing(f, 1.0, start.slope < 0.0 ? 2.0 * start.value / (root - start.slope) : 0.5);
  }
  if (start.slope >= 0.0 || f(1.0).slope <= 0.0) return kNowhere;
  double falls = 0.0;
  double rises = 1.0;
  for (int i = 0; i < 50; ++i) {  // to its least value
    const double middle = 0.5 * (falls + rises);
    const ValueSlope at = f(middle);
    if (at.value < 0.0) return crossing(f, middle, 0.5 * middle);
    if (at.value + at.slope * (at.slope < 0.0 ? rises - middle : falls - middle) >= 0.0 && i > 3)
      return kNowhere;  // the tangent stays above 0, and the curve above it
    (at.slope < 0.0 ? falls : rises) = middle;
  }
  return kNowhere;
}

/// Whether the cubic through values and slopes at 0 and 1 comes near or below 0 between them, falling first
/// and rising last.
[[nodiscard]] inline bool may_dip(ValueSlope start, ValueSlope end) noexcept {
  if (start.slope >= 0.0 || end.slope <= 0.0) return false;
  // v(s) = value + slope s + b s^2 + a s^3; its least value where slope + 2 b s + 3 a s^2 = 0
  const double rise = end.value - start.value;
  const double b = 3.0 * rise - 2.0 * start.slope - end.slope;
  const double a = start.slope + end.slope - 2.0 * rise;
  const double s = -start.slope / (b + std::sqrt(std::max(0.0, b * b - 3.0 * a * start.slope)));
  return start.value + s * (start.slope + s * (b + s * a)) < 0.01 * (end.slope - start.slope);
}

/// As first_crossing() of offset + sum of p_k s^k, p_k known up to `last`, the next one 0.
template <std::size_t Size>
[[nodiscard]] double first_crossing_of(const std::array<double, Size>& p, std::size_t last,
                                       double end) noexcept {
  const auto value = [&](double s) {
    const double square = s * s;
    ValueSlope even{0.0, 0.0}, odd{0.0, 0.0};  // by the square
    for (std::size_t k = last | 1U;; k -= 2) {
      odd.slope = odd.slope * square + odd.value;
      even.slope = even.slope * square + even.value;
      odd.value = odd.value * square + p[k];
      even.value = even.value * square + p[k - 1];
      if (k == 1) break;
    }
    return ValueSlope{even.value + s * odd.value, odd.value + 2.0 * s * (even.slope + s * odd.slope)};
  };
  return first_crossing(value, {p[0], p[1]}, last > 1 ? p[2] : 0.0, end);
}

/// Motion of dx/dt = a x + const over a time in which |a| grows to no more than 1, as the Taylor polynomial
/// in s = time/duration, 0 <= s <= 1: to machine precision.
template <int States>
class TaylorMotion {
 public:
  using State = Few<States>;
  struct Cubic {
    std::size_t twist;         ///< Which state.
    double per_twist, offset;  ///< d = per_twist x_twist - offset
    State effect;              ///< On the rates, by d^3.
  };

  /// `rate`: dx/dt at the start. `a` by columns; `norm`: not below its infinity norm. Where `locked` is 0,
  /// the state stays as it is.
  void expand(const State& start, const State& rate, const double* a, const State& locked, double norm,
              double duration_s) noexcept {
    FewColumns<States, States> scaled;
    for (std::size_t j = 0; j < kStates; ++j)
      for (std::size_t i = 0; i < kStates; ++i)
        scaled.entry[j * kStates + i] = duration_s * (locked[i] * a[j * kStates + i]);
    const double growth = norm * duration_s;
    count_ = 1;
    // `left`: bound of what the terms so far leave out
    for (double left = 0.5 * growth * growth; left > 1e-16 && count_ < kTerms; ++count_)
      left *= growth * kInverse[count_ + 2];
    terms_[0] = start;
    for (std::size_t i = 0; i < kStates; ++i) {
      terms_[1][i] = duration_s * rate[i] * locked[i];
      end_[i] = terms_[0][i] + terms_[1][i];
    }
    if constexpr (States <= 5) {  // even and odd terms side by side: no product waits for the one before
      FewColumns<States, States> squared;
      for (std::size_t j = 0; j < kStates; ++j) {
        State column;
        std::copy_n(scaled.column(j), kStates, column.begin());
        column = times(scaled, column);
        std::copy(column.begin(), column.end(),
                  squared.entry.begin() + static_cast<std::ptrdiff_t>(j * kStates));
      }
      if (count_ > 1) put(2, times(scaled, terms_[1]), 0.5);
      for (std::size_t k = 3; k <= count_; ++k)
        put(k, times(squared, terms_[k - 2]), kInverse[k] * kInverse[k - 1]);
    } else {
      for (std::size_t k = 2; k <= count_; ++k) put(k, times(scaled, terms_[k - 1]), kInverse[k]);
    }
    terms_[count_ + 1].fill(0.0);
  }
  /// The same of dx/dt = a x + effect d^3 + const with d = per_twist x_twist - offset, by the recursion of
  /// the terms. False where the terms do not fall to rounding: the duration is too long then.
  [[nodiscard]] bool expand_cubic(const State& start, const State& rate, const double* a, const State& locked,
                                  double duration_s, const Cubic& cubic) noexcept {
    std::array<double, kTerms + 2> d{}, square{};
    cube_.fill(0.0);
    terms_[0] = end_ = start;
    double size = 0.0;  // of all but the angle, which acts on little
    for (std::size_t i = 0; i + 1 < kStates; ++i) size = std::max(size, std::abs(start[i]));
    bool small_before = false;
    for (count_ = 0; count_ + 1 < kTerms;) {
      const std::size_t k = count_;
      d[k] = cubic.per_twist * terms_[k][cubic.twist] - (k == 0 ? cubic.offset : 0.0);
      for (std::size_t j = 0; j <= k; ++j) square[k] += d[j] * d[k - j];
      for (std::size_t j = 0; j <= k; ++j) cube_[k] += square[j] * d[k - j];
      State slope = rate;
      if (k > 0) {
        slope = times(a, terms_[k]);
        add(slope, cubic.effect.data(), cube_[k]);
      }
      for (std::size_t i = 0; i < kStates; ++i) slope[i] *= duration_s * locked[i];
      put(++count_, slope, kInverse[k + 1]);
      double term = 0.0;
      for (std::size_t i = 0; i + 1 < kStates; ++i) term = std::max(term, std::abs(terms_[count_][i]));
      size = std::max(size, term);
      const bool small = term <= 1e-16 * size;
      if (small && small_before) {
        terms_[count_ + 1].fill(0.0);
        return true;
      }
      small_before = small;
    }
    return false;
  }
  [[nodiscard]] const State& end() const noexcept { return end_; }
  [[nodiscard]] State at(double s) const noexcept {
    const double square = s * s;  // even and odd powers apart: two short chains of products
    State even{}, odd{};
    for (std::size_t k = count_ | 1U;; k -= 2) {
      for (std::size_t i = 0; i < kStates; ++i) {
        odd[i] = square * odd[i] + terms_[k][i];
        even[i] = square * even[i] + terms_[k - 1][i];
      }
      if (k == 1) break;
    }
    add(even, odd.data(), s);
    return even;
  }
  /// First s at which offset + row x(s) turns negative, `end` being its value at 1: see first_crossing().
  [[nodiscard]] double crossing_of(const State& row, double offset, double end) const noexcept {
    std::array<double, kTerms + 2> p{};
    for (std::size_t k = 0; k <= count_; ++k)
      for (std::size_t i = 0; i < kStates; ++i) p[k] += row[i] * terms_[k][i];
    p[0] += offset;
    return first_crossing_of(p, count_, end);
  }
  /// The same with `weight` d^3(s) added, after expand_cubic().
  [[nodiscard]] double crossing_of(const State& row, double offset, double weight,
                                   double end) const noexcept {
    std::array<double, kTerms + 2> p{};
    for (std::size_t k = 0; k <= count_; ++k) {
      for (std::size_t i = 0; i < kStates; ++i) p[k] += row[i] * terms_[k][i];
      p[k] += weight * cube_[k];
    }
    p[0] += offset;
    return first_crossing_of(p, count_, end);
  }
  /// The same of sign x_i(s).
  [[nodiscard]] double crossing_of(std::size_t i, double sign, double end) const noexcept {
    std::array<double, kTerms + 2> p{};
    for (std::size_t k = 0; k <= count_; ++k) p[k] = sign * terms_[k][i];
    return first_crossing_of(p, count_, end);
  }

 private:
  static constexpr std::size_t kStates = States;
  static constexpr std::size_t kTerms = 18;  // 1/19! = 8e-18
  static constexpr std::array<double, kTerms + 3> kInverse = [] {
    std::array<double, kTerms + 3> result{};
    for (std::size_t k = 1; k < result.size(); ++k) result[k] = 1.0 / static_cast<double>(k);
    return result;
  }();

  void put(std::size_t k, const State& term, double by) noexcept {
    for (std::size_t i = 0; i < kStates; ++i) {
      terms_[k][i] = by * term[i];
      end_[i] += terms_[k][i];
    }
  }

  std::size_t count_ = 0;                // of the last term
  std::array<State, kTerms + 2> terms_;  // 0 above count_
  State end_{};
  std::array<double, kTerms + 2> cube_{};  // of d^3, after expand_cubic()
};

}  // namespace resonid::plant
