// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

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

/// Motion of dx/dt = a x + const over a time in which |a| grows to no more than 1, as the Taylor polynomial
/// in s = time/duration, 0 <= s <= 1: to machine precision.
template <int States>
class TaylorMotion {
 public:
  using State = Eigen::Matrix<double, States, 1>;

  /// `rate`: dx/dt at the start. `norm`: not below the infinity norm of a. Where `locked` is 0, the state
  /// stays as it is.
  template <class Matrix>
  void expand(const State& start, const State& rate, const Matrix& a, const State& locked, double norm,
              double duration_s) noexcept {
    terms_[0] = start;
    terms_[1] = duration_s * rate.cwiseProduct(locked);
    count_ = 1;
    const double growth = norm * duration_s;
    for (double rest = growth; rest > 1e-17 && count_ < kTerms;) {
      const double share = 1.0 / (count_ + 1);
      State& next = terms_[static_cast<std::size_t>(count_ + 1)];
      next.noalias() = a * terms_[static_cast<std::size_t>(count_)];
      next = (share * duration_s) * next.cwiseProduct(locked);
      rest *= growth * share;
      ++count_;
    }
  }
  [[nodiscard]] State at(double s) const noexcept {
    State x = terms_[static_cast<std::size_t>(count_)];
    for (int k = count_ - 1; k >= 0; --k) x = s * x + terms_[static_cast<std::size_t>(k)];
    return x;
  }
  /// First s at which offset + row x(s) turns negative, `end` being its value at 1: see first_crossing().
  template <class Row>
  [[nodiscard]] double crossing_of(const Row& row, double offset, double end) const noexcept {
    std::array<double, kTerms + 1> p{};
    for (int k = 0; k <= count_; ++k)
      p[static_cast<std::size_t>(k)] = row.dot(terms_[static_cast<std::size_t>(k)]);
    p[0] += offset;
    return crossing_of(p, end);
  }
  /// The same of sign x_i(s).
  [[nodiscard]] double crossing_of(int i, double sign, double end) const noexcept {
    std::array<double, kTerms + 1> p{};
    for (int k = 0; k <= count_; ++k)
      p[static_cast<std::size_t>(k)] = sign * terms_[static_cast<std::size_t>(k)](i);
    return crossing_of(p, end);
  }

 private:
  static constexpr int kTerms = 18;  // 1/19! = 8e-18

  [[nodiscard]] double crossing_of(const std::array<double, kTerms + 1>& p, double end) const noexcept {
    const auto value = [&](double s) {
      ValueSlope at{p[static_cast<std::size_t>(count_)], 0.0};
      for (int k = count_ - 1; k >= 0; --k) {
        at.slope = at.slope * s + at.value;
        at.value = at.value * s + p[static_cast<std::size_t>(k)];
      }
      return at;
    };
    return first_crossing(value, {p[0], p[1]}, count_ > 1 ? p[2] : 0.0, end);
  }

  int count_ = 0;
  std::array<State, kTerms + 1> terms_;
};

}  // namespace resonid::plant
