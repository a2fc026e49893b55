// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <limits>
#include <resonid/base/constants.hpp>
#include <resonid/base/detail/intact.hpp>
#include <resonid/online/models/detail/line_rows.hpp>
#include <resonid/online/models/detail/weighted_rows.hpp>
#include <resonid/online/models/discrete_model.hpp>
#include <type_traits>

namespace resonid::online {

/// What the output of a sweep is.
enum class SweepQuantity { velocity, position, acceleration };

/// One equation A y - B u = 0 along a sweep: the same narrow filter on u and y and on their differences.
/// d = 1 - q, q = z^-1.
template <class Real>
struct SweepRow {
  using Complex = std::complex<Real>;
  Complex d{};                 ///< 1 - e^{-jw} of the frequency that the row describes.
  std::array<Complex, 3> u{};  ///< q d^2 u, q d u, q u
  std::array<Complex, 3> y{};  ///< q d^2 y, q d y, q y
  Complex lead{};              ///< d^3 y
};

/// Rational model of third order along a sweep, in powers of the difference (DifferenceModel), from rows that
/// hold exactly however fast the sweep is: no row supposes a steady state.
///
///   e = lead + sum alpha_i y_i - sum beta_i u_i = narrow filter of A n           n: noise of the output
///   minimise  sum |e/A|^2 / (c N),      c = sum |h|^2,   N = mean of |A(w + x)/A(w)|^2 over the filter's
///   band
///
/// by Gauss and Newton: d(e/A)/d alpha_i = (y_i - P_i e/A)/A, so that the noise in y biases nothing. The rows
/// stay in memory; every call of work() takes a fixed number of them on, and a pass over all is one step of
/// the iteration. A weak prior (nothing oscillates, the scale of the first row) fills what no row tells.
/// Trivially copyable, no heap. The method is this project's own.
template <class Real, std::size_t Rows>
class SweepFit {
 public:
  using Complex = std::complex<Real>;
  static constexpr std::size_t kParameters = 6;  ///< beta, alpha

  /// Time constant of the narrow filter's three stages and distance of the rows, in samples; largest and
  /// least frequency of the sweep, in rad per sample.
  void configure(double lag, double spacing, double largest_angle, double least_angle,
                 SweepQuantity quantity) noexcept {
    quantity_ = quantity;
    lag_ = static_cast<Real>(lag);
    const double x = spacing / lag;
    double correlated = 1.0;
    for (int k = 1; k < 1000 && k * x < 30.0; ++k)
      correlated += 2.0 * (1.0 + k * x + k * x * k * x / 3.0) * std::exp(-k * x);
    correlated_ = static_cast<Real>(correlated);
    steepest_ = static_cast<Real>(2.0 * std::sin(0.5 * std::min(largest_angle, 2.0)));
    gentlest_ = static_cast<Real>(2.0 * std::sin(0.5 * std::min(least_angle, 2.0)));
    place_nodes(lag);
    reset();
  }
  void reset() noexcept {
    count_ = cursor_ = passes_ = newton_ = 0;
    theta_ = start_ = at_ = {};
    variance_ = {};
    density_ = start_density_ = Real(0);
    begin_pass();
  }

  [[nodiscard]] bool full() const noexcept { return count_ == Rows; }
  void add(const SweepRow<Real>& row, Complex output_factor) noexcept {
    if (full()) return;
    if (count_ == 0) choose_scale(row);
    row_[count_] = row;
    factor_[count_++] = std::norm(output_factor);
  }
  /// Density of the output's noise, per sample, that something else tells; counts as much as few rows.
  void set_start_density(Real density) noexcept { start_density_ = density; }
  /// `rows` rows of the present pass.
  void work(std::size_t rows) noexcept {
    if (count_ == 0) return;
    for (; rows > 0; --rows) {
      absorb(row_[cursor_], factor_[cursor_]);
      if (++cursor_ >= count_) {
        end_pass();
        begin_pass();
        return;
      }
    }
  }

  /// Response without the sweep's error, and its total variance; `row` need not be one that was added.
  struct Value {
    Complex response{};
    Real variance{};
  };
  [[nodiscard]] Value value(const SweepRow<Real>& row, Complex output_factor) const noexcept {
    const auto p = powers(row.d);
    const Complex a = denominator(theta_, row.d), inverse = Complex(1) / a;
    const Complex input = row.u[2] / p[2];
    Complex b{};
    for (std::size_t i = 0; i < 3; ++i) b += theta_[i] * scale_[i] * p[i];
    const Complex g = (b + residual(theta_, row) / input) * inverse;
    std::array<Complex, kParameters> slope;
    for (std::size_t i = 0; i < 3; ++i) {
      slope[i] = scale_[i] * (p[i] - row.u[i] / input) * inverse;
      slope[3 + i] = scale_[3 + i] * (row.y[i] / input - p[i] * g) * inverse;
    }
    Real model(0);
    for (std::size_t i = 0; i < kParameters; ++i)
      for (std::size_t j = 0; j < kParameters; ++j)
        model += variance_[i][j] * (slope[i] * std::conj(slope[j])).real();
    const Real noise = noise_gain() * spread(theta_, row.d, std::norm(a)) / std::norm(input);
    return {g / output_factor, density_ * (noise + correlated_ * model / std::norm(output_factor))};
  }

  /// Whether a pass over at least as many rows as there are parameters has ended.
  [[nodiscard]] bool ready() const noexcept { return passes_ > 0; }
  [[nodiscard]] Real density() const noexcept { return density_; }
  [[nodiscard]] DifferenceModel<Real, 3> model() const noexcept {
    DifferenceModel<Real, 3> m;
    for (std::size_t i = 0; i < 3; ++i) {
      m.beta[i] = theta_[i] * scale_[i];
      m.alpha[i] = theta_[3 + i] * scale_[3 + i];
    }
    return m;
  }
  /// Covariance of [beta, alpha].
  [[nodiscard]] ModelCovariance<Real, 3> covariance() const noexcept {
    ModelCovariance<Real, 3> p;
    for (std::size_t i = 0; i < kParameters; ++i)
      for (std::size_t j = 0; j < kParameters; ++j)
        p(int(i), int(j)) = density_ * correlated_ * variance_[i][j] * scale_[i] * scale_[j];
    return p;
  }

  /// For a state of unknown origin (base/detail/intact.hpp).
  [[nodiscard]] bool intact() const noexcept {
    return count_ <= Rows && cursor_ <= count_ && newton_ <= kNewtonPasses && passes_ <= kMostPasses &&
           taken_ <= Rows && resonid::intact(quantity_, SweepQuantity::acceleration) && sum_.intact();
  }

 private:
  using Parameters = std::array<Real, kParameters>;
  static constexpr std::size_t kNear = 15, kFar = 5, kNodes = kNear + 2 * kFar;
  static constexpr std::size_t kMostPasses = 1000;   // that are counted
  static constexpr std::size_t kNewtonPasses = 2;    // after each one of Sanathanan and Koerner
  static constexpr std::size_t kLeastForNewton = 8;  // rows; before them the denominators are guesses
  static constexpr Real kLargestShare = Real(9);     // of |e/A|^2 over its variance that is taken for noise
  static constexpr Real kFloor = Real(1e-4);         // of |A|^2, in |d|^6
  static constexpr Real kStartRows = Real(3);        // what the start density counts
  static constexpr Parameters kPrior{3, 1, 3, 1, 3, Real(0.3)};  // standard deviations, scaled

  /// Nodes of the integral over the band: near the line x = tan(t)/lag, so that |h|^2 dx is cos(t)^4 dt, and
  /// beyond that in equal ratios up to half the sample rate, where differences are large.
  void place_nodes(double lag) noexcept {
    constexpr double kHalfTurn = 0.5 * kTwoPi;
    const double outermost = std::tan(kHalfTurn * (0.5 - 0.5 / kNear)) / lag;
    std::array<double, kNodes> weight{};
    double sum = 0.0;
    for (std::size_t m = 0; m < kNear; ++m) {
      const double t = kHalfTurn * ((static_cast<double>(m) + 0.5) / kNear - 0.5);
      place(m, std::min(std::max(std::tan(t) / lag, -kHalfTurn), kHalfTurn));
      sum += weight[m] = std::pow(std::cos(t), 4);
    }
    const double ratio = std::max(0.0, std::log(kHalfTurn / outermost)) / kFar;
    tail_ = Real(0);
    for (std::size_t m = 0; m < 2 * kFar; ++m) {
      const std::size_t pair = m / 2;
      const double away = outermost * std::exp(ratio * (static_cast<double>(pair) + 0.5));
      const double gain = 1.0 / (1.0 + std::pow(2.0 * lag * std::sin(0.5 * away), 2));
      place(kNear + m, m % 2 == 0 ? away : -away);
      weight[kNear + m] = std::pow(gain, 3) * away * ratio * lag * kNear / kHalfTurn;
      const double power = std::pow(2.0 * std::sin(0.5 * away), 2);
      const double of_quantity = quantity_ == SweepQuantity::position       ? power
                                 : quantity_ == SweepQuantity::acceleration ? 1.0 / power
                                                                            : 1.0;
      tail_ += static_cast<Real>(weight[kNear + m] / sum * power * power * power * of_quantity);
    }
    for (std::size_t m = 0; m < kNodes; ++m) node_weight_[m] = static_cast<Real>(weight[m] / sum);
  }
  void place(std::size_t m, double away) noexcept {
    const double half = 0.5 * away;
    node_[m] = Complex(2.0 * std::sin(half) * std::complex<double>(std::sin(half), std::cos(half)));
  }

  static std::array<Complex, 3> powers(Complex d) noexcept {
    const Complex q = Complex(1) - d;
    return {q * d * d, q * d, q};
  }

  [[nodiscard]] Real noise_gain() const noexcept { return Real(0.75) / lag_; }
  /// A in powers of d: a cubic whose coefficients do not cancel.
  [[nodiscard]] std::array<Real, 4> cubic(const Parameters& theta) const noexcept {
    const Real a1 = theta[3] * scale_[3], a2 = theta[4] * scale_[4], a3 = theta[5] * scale_[5];
    return {a3, a2 - a3, a1 - a2, Real(1) - a1};
  }
  [[nodiscard]] Complex denominator(const Parameters& theta, Complex d) const noexcept {
    const auto c = cubic(theta);
    return c[0] + d * (c[1] + d * (c[2] + d * c[3]));
  }
  [[nodiscard]] Complex residual(const Parameters& theta, const SweepRow<Real>& row) const noexcept {
    Complex e = row.lead;
    for (std::size_t i = 0; i < 3; ++i)
      e += theta[3 + i] * scale_[3 + i] * row.y[i] - theta[i] * scale_[i] * row.u[i];
    return e;
  }
  /// Mean of |A F|^2 over the filter's band, in that at the line; F brings the measured quantity to a
  /// velocity.
  [[nodiscard]] Real spread(const Parameters& theta, Complex d, Real power) const noexcept {
    const auto c = cubic(theta);
    const Complex q = Complex(1) - d;
    Real sum(0);
    for (std::size_t m = 0; m < kNodes; ++m) {
      const Complex x = d + q * node_[m];
      const Real tilt = quantity_ == SweepQuantity::velocity ? Real(1)
                        : quantity_ == SweepQuantity::position
                            ? std::norm(x) / std::norm(d)
                            : std::norm(d) / std::max(std::norm(x), Real(0.1) * std::norm(d));
      sum += node_weight_[m] * tilt * std::norm(c[0] + x * (c[1] + x * (c[2] + x * c[3])));
    }
    return sum / power;
  }
  /// The same to fourth order in the filter's width, and what lies far from it: for weights.
  [[nodiscard]] Real rough_spread(const Parameters& theta, Complex d, Complex a) const noexcept {
    const auto c = cubic(theta);
    const Complex q = Complex(1) - d, j(0, 1);
    const Complex first = c[1] + d * (Real(2) * c[2] + Real(3) * d * c[3]);
    const Complex second = Real(2) * c[2] + Real(6) * d * c[3];
    const Real third = Real(6) * c[3];
    const Complex inverse = Complex(1) / a;
    const Complex s1 = j * q * first * inverse;
    const Complex s2 = Real(0.5) * (q * first - q * q * second) * inverse;
    const Complex s3 = j * q * (Real(3) * q * second - q * q * third - first) * inverse * Real(1.0 / 6.0);
    const Real narrow = Real(1) / (lag_ * lag_);
    const Real n = Real(1) + (std::norm(s1) + Real(2) * s2.real()) * narrow / Real(3) +
                   (std::norm(s2) + Real(2) * (std::conj(s1) * s3).real()) * narrow * narrow;
    const Real of_quantity = quantity_ == SweepQuantity::position       ? Real(1) / std::norm(d)
                             : quantity_ == SweepQuantity::acceleration ? std::norm(d)
                                                                        : Real(1);
    return std::max(n, Real(0.3)) + tail_ * of_quantity * c[3] * c[3] * std::norm(inverse);
  }

  void choose_scale(const SweepRow<Real>& row) noexcept {
    const Real gain = std::abs(row.lead) / (std::abs(row.u[2]) * std::norm(row.d));  // |G d|
    scale_ = {gain,      gain * steepest_,      gain * steepest_ * steepest_,
              steepest_, steepest_ * steepest_, steepest_ * steepest_ * gentlest_};
    for (Real& s : scale_)
      if (!(s > Real(0)) || !std::isfinite(s)) s = Real(1);
  }

  void begin_pass() noexcept {
    cursor_ = 0;
    sum_.reset();
    squares_ = Real(0);
    taken_ = 0;
  }
  void absorb(const SweepRow<Real>& row, Real factor) noexcept {
    const auto p = powers(row.d);
    const Complex a = denominator(at_, row.d);
    const Real power = std::max(std::norm(a), kFloor * std::norm(row.d * row.d * row.d));
    const Real spread = rough_spread(at_, row.d, a), variance = noise_gain() * spread * factor;
    const Complex e = residual(at_, row);
    squares_ += std::norm(e) / (power * variance);
    Complex noise{};
    if (newton_ > 0) {
      const Complex r = e / a;
      const Real square = std::norm(r), most = kLargestShare * variance * density_;
      noise = square > most ? r * std::sqrt(most / square) : r;
    }
    std::array<Complex, kParameters> x;
    Complex right = e;
    for (std::size_t i = 0; i < 3; ++i) {
      x[i] = scale_[i] * row.u[i];
      x[3 + i] = scale_[3 + i] * (p[i] * noise - row.y[i]);
    }
    typename WeightedRows<Real, kParameters>::Row re, im;
    for (std::size_t i = 0; i < kParameters; ++i) {
      right += x[i] * at_[i];
      re[i] = x[i].real();
      im[i] = x[i].imag();
    }
    const Real weight = Real(2) / (power * variance);
    sum_.add(re, right.real(), weight);
    sum_.add(im, right.imag(), weight);
    ++taken_;
  }
  void end_pass() noexcept {
    const Real known = density_ > Real(0) ? density_ : start_density_;
    for (std::size_t i = 0; i < kParameters; ++i) {
      typename WeightedRows<Real, kParameters>::Row unit{};
      unit[i] = Real(1);
      sum_.add(unit, Real(0), prior_weight(i, known));
    }
    Parameters solution = sum_.solution();
    for (const Real x : solution) {
      if (std::isfinite(x)) continue;
      start_ = at_ = {};
      newton_ = 0;
      return;
    }
    const bool newton = count_ >= kLeastForNewton;
    if (newton_ == 0) start_ = solution;
    if (newton_ == (newton ? kNewtonPasses : 0)) report(solution, known);
    newton_ = newton && newton_ < kNewtonPasses ? newton_ + 1 : 0;
    at_ = newton_ == 0 ? start_ : solution;
  }
  /// Takes the solution over. `squares_` are those of the parameters that the pass began with.
  void report(const Parameters& solution, Real known) noexcept {
    const auto p = sum_.covariance();
    if (!p.allFinite()) return;
    Real determined(0);
    for (std::size_t i = 0; i < kParameters; ++i)
      determined += Real(1) - std::min(Real(1), p(int(i), int(i)) * prior_weight(i, known));
    const Real free = static_cast<Real>(taken_) - Real(0.5) * correlated_ * determined;
    const Real start =
        std::max(Real(0), kStartRows * Real(0.5) * correlated_ - Real(0.5) * std::max(free, Real(0)));
    density_ =
        (start * start_density_ + (free > Real(0) ? squares_ : Real(0))) / (start + std::max(free, Real(0)));
    theta_ = solution;
    for (std::size_t i = 0; i < kParameters; ++i)
      for (std::size_t j = 0; j < kParameters; ++j) variance_[i][j] = p(int(i), int(j));
    if (passes_ < kMostPasses) ++passes_;
  }
  [[nodiscard]] Real prior_weight(std::size_t i, Real density) const noexcept {
    return std::max(density * correlated_, std::numeric_limits<Real>::min()) / (kPrior[i] * kPrior[i]);
  }

  std::array<SweepRow<Real>, Rows> row_{};
  std::array<Real, Rows> factor_{};
  std::size_t count_ = 0, cursor_ = 0, passes_ = 0, taken_ = 0, newton_ = 0;
  WeightedRows<Real, kParameters> sum_{};
  Parameters theta_{}, scale_{};
  Parameters start_{}, at_{};  // Sanathanan and Koerner's; where this pass linearises
  std::array<Parameters, kParameters> variance_{};
  std::array<Complex, kNodes> node_{};
  std::array<Real, kNodes> node_weight_{};
  SweepQuantity quantity_ = SweepQuantity::velocity;
  Real tail_{};  // of the spread, beyond the nodes near the line, for A = d^3
  Real lag_{}, correlated_{}, steepest_{}, gentlest_{};
  Real density_{}, start_density_{}, squares_{};
};

}  // namespace resonid::online
