// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <resonid/base/constants.hpp>
#include <resonid/base/detail/flushed.hpp>
#include <resonid/base/detail/high_pass.hpp>
#include <resonid/base/detail/intact.hpp>
#include <resonid/base/expected.hpp>
#include <resonid/online/models/discrete_model.hpp>
#include <resonid/online/models/rls.hpp>
#include <span>

namespace resonid::online {

/// What every estimator of a discrete model is told.
struct ModelEstimatorConfig {
  double sample_rate_hz = 0.0;        ///< Rate at which step() is called, > 0.
  std::size_t delay_samples = 0;      ///< d: known delay of the output, at most kMaxDelaySamples.
  std::span<const double> start_b{};  ///< b_1 ... b_n before the first sample; empty: 0.
  std::span<const double> start_a{};  ///< a_1 ... a_n likewise.
  bool fixed_integrator = false;      ///< The machine's integrator, z = 1, is known, not estimated.
  double high_pass_hz = 0.0;          ///< Corner of what takes offsets out of ru, u and y alike; 0: none.
  double freeze_below = 0.05;         ///< Estimates are frozen while the excitation's rms is below this
                                      ///< share of its largest; 0: never.
  /// Forgetting and certainty of the start; `start` and `fixed` must be empty, `scale` is that of b, then a.
  RecursiveLeastSquaresConfig adaptation{};
};

inline constexpr std::size_t kMaxDelaySamples = 63;

/// Past inputs and outputs as the regressor of  y(k) = base + f' theta,  theta = [b, a, extra]:
///
///   free:               f = [u(k-d-1) ..., -y(k-1) ...]                base = 0
///   integrator fixed:   f = [u(k-d-1) ..., -y(k-1) + y(k-2) ..., 0]    base = y(k-1)
///
/// with the fixed integrator, theta holds the n-1 coefficients of A/(1 - z^-1) and a 0.
template <class Real, std::size_t Order, std::size_t Extra = 0>
class Regression {
 public:
  static constexpr std::size_t kParameters = 2 * Order + Extra;
  using Vector = std::array<Real, kParameters>;
  using Model = DiscreteModel<Real, Order>;
  using Matrix = Eigen::Matrix<Real, static_cast<int>(kParameters), static_cast<int>(kParameters)>;

  Regression() = default;
  Regression(std::size_t delay_samples, bool fixed_integrator) noexcept
      : delay_(delay_samples), fixed_(fixed_integrator) {}

  void push(Real input, Real output) noexcept {
    for (std::size_t i = Order - 1; i > 0; --i) input_[i] = input_[i - 1];
    input_[0] = flushed_signal(delayed(input));
    const Real entry = fixed_ ? output - last_ : output;
    for (std::size_t i = Order - 1; i > 0; --i) output_[i] = output_[i - 1];
    output_[0] = flushed_signal(entry);
    last_ = output;
  }
  void reset() noexcept { *this = Regression(delay_, fixed_); }

  [[nodiscard]] std::size_t delay_samples() const noexcept { return delay_; }
  [[nodiscard]] bool fixed_integrator() const noexcept { return fixed_; }
  [[nodiscard]] Real base() const noexcept { return fixed_ ? last_ : Real(0); }
  /// The entries of b and a; the extra ones stay as they are.
  void fill(Vector& f) const noexcept {
    for (std::size_t i = 0; i < Order; ++i) {
      f[i] = input_[i];
      f[Order + i] = -output_[i];
    }
    if (fixed_) f[2 * Order - 1] = Real(0);
  }

  [[nodiscard]] Model model(const Vector& theta) const noexcept {
    Model m;
    for (std::size_t i = 0; i < Order; ++i) {
      m.b[i] = theta[i];
      m.a[i] = theta[Order + i];
    }
    if (fixed_)
      for (std::size_t i = Order; i-- > 0;) m.a[i] -= i > 0 ? m.a[i - 1] : Real(1);
    return m;
  }
  [[nodiscard]] ModelCovariance<Real, Order> covariance(const Matrix& of_theta) const noexcept {
    constexpr int kN = static_cast<int>(Order);
    ModelCovariance<Real, Order> c = of_theta.template topLeftCorner<2 * kN, 2 * kN>();
    if (!fixed_) return c;
    // a = alpha - (alpha shifted by one), the fixed last one left out.
    for (int i = 2 * kN - 1; i > kN; --i)
      for (int j = 0; j < 2 * kN; ++j) c(i, j) -= c(i - 1, j);
    for (int i = 2 * kN - 1; i > kN; --i)
      for (int j = 0; j < 2 * kN; ++j) c(j, i) -= c(j, i - 1);
    return c;
  }
  /// theta of a model, extra ones 0; none when a fixed integrator is not a pole of it.
  static std::optional<std::array<double, kParameters>> parameters(std::span<const double> b,
                                                                   std::span<const double> a, bool fixed) {
    std::array<double, kParameters> theta{};
    for (std::size_t i = 0; i < b.size(); ++i) theta[i] = b[i];
    double sum = 1.0;
    for (std::size_t i = 0; i < a.size(); ++i) {
      sum += a[i];
      theta[Order + i] = fixed ? sum : a[i];
    }
    if (!fixed || a.empty()) return theta;
    if (std::abs(sum) > 1e-6) return std::nullopt;
    theta[2 * Order - 1] = 0.0;
    return theta;
  }

  /// For a state of unknown origin (base/detail/intact.hpp).
  [[nodiscard]] bool intact() const noexcept {
    return delay_ <= kMaxDelaySamples && place_ < std::max<std::size_t>(delay_, 1) && resonid::intact(fixed_);
  }

 private:
  Real delayed(Real input) noexcept {
    if (delay_ == 0) return input;
    const Real oldest = waiting_[place_];
    waiting_[place_] = input;
    place_ = place_ + 1 == delay_ ? 0 : place_ + 1;
    return oldest;
  }

  std::array<Real, kMaxDelaySamples> waiting_{};
  std::array<Real, Order> input_{}, output_{};
  Real last_ = Real(0);
  std::size_t delay_ = 0, place_ = 0;
  bool fixed_ = false;
};

/// The least squares of a regression; `extra_on` tells which of the extra parameters are estimated.
template <class Real, std::size_t Order, std::size_t Extra>
expected<RecursiveLeastSquares<Real, 2 * Order + Extra>, Error> make_least_squares(
    const ModelEstimatorConfig& c, const std::array<bool, Extra>& extra_on) {
  using Rls = RecursiveLeastSquares<Real, 2 * Order + Extra>;
  if (!(c.sample_rate_hz > 0.0) || !std::isfinite(c.sample_rate_hz))
    return refuse("sample_rate_hz", "must be > 0", c.sample_rate_hz);
  if (c.delay_samples > kMaxDelaySamples)
    return refuse("delay_samples", "must be at most 63", static_cast<double>(c.delay_samples));
  if (!c.start_b.empty() && c.start_b.size() != Order)
    return refuse("start_b", "needs as many values as the order", static_cast<double>(c.start_b.size()));
  if (!c.start_a.empty() && c.start_a.size() != Order)
    return refuse("start_a", "needs as many values as the order", static_cast<double>(c.start_a.size()));
  if (!(c.high_pass_hz >= 0.0 && c.high_pass_hz < 0.5 * c.sample_rate_hz))
    return refuse("high_pass_hz", "must be >= 0 and below half the sample rate", c.high_pass_hz);
  if (!(c.freeze_below >= 0.0 && c.freeze_below < 1.0))
    return refuse("freeze_below", "must lie in [0, 1)", c.freeze_below);
  if (!c.adaptation.start.empty())
    return refuse("adaptation.start", "must be empty: give start_b and start_a");
  if (!c.adaptation.fixed.empty()) return refuse("adaptation.fixed", "must be empty");
  if (!c.adaptation.scale.empty() && c.adaptation.scale.size() != 2 * Order)
    return refuse("adaptation.scale", "needs a value per coefficient of b and a",
                  static_cast<double>(c.adaptation.scale.size()));
  const auto start = Regression<Real, Order, Extra>::parameters(c.start_b, c.start_a, c.fixed_integrator);
  if (!start) return refuse("start_a", "must add up to -1 where the integrator is fixed");
  std::array<double, 2 * Order + Extra> scale;
  std::array<bool, 2 * Order + Extra> fixed{};
  scale.fill(1.0);
  for (std::size_t i = 0; i < c.adaptation.scale.size(); ++i) scale[i] = c.adaptation.scale[i];
  fixed[2 * Order - 1] = c.fixed_integrator;
  for (std::size_t i = 0; i < Extra; ++i) fixed[2 * Order + i] = !extra_on[i];
  RecursiveLeastSquaresConfig adaptation = c.adaptation;
  adaptation.start = *start;
  adaptation.scale = scale;
  adaptation.fixed = fixed;
  return Rls::create(adaptation);
}

}  // namespace resonid::online
