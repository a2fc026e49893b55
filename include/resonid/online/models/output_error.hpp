// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <resonid/base/detail/intact.hpp>
#include <resonid/online/models/detail/damped_gradient.hpp>
#include <resonid/online/models/detail/excitation_gate.hpp>
#include <resonid/online/models/detail/lag.hpp>
#include <resonid/online/models/detail/missed_samples.hpp>
#include <resonid/online/models/detail/predictor_guard.hpp>
#include <resonid/online/models/detail/pseudo_linear.hpp>
#include <resonid/online/models/detail/regression.hpp>

namespace resonid::online {

/// What the parameters of an output-error model move along.
enum class OutputErrorGradient {
  regressor,  ///< The regressor itself: RPLR, Publication II.
  filtered,   ///< The regressor filtered by 1/A, the true gradient: RPEM.
};

struct OutputErrorConfig {
  ModelEstimatorConfig common{};
  OutputErrorGradient gradient = OutputErrorGradient::regressor;
  /// RPEM: 1/A is taken with its poles drawn in by this factor, in (0, 1], so that the integrator leaks.
  double filter_contraction = 0.8;
  /// Bound on the predictor's poles; above 1 leaves room to an estimated integrator.
  double largest_pole_radius = 1.02;
  bool load_torque = false;  ///< Also estimates a constant torque beside u.
  /// The loop's controller in powers of z^-1, up to order 4; empty: none. Only stability() uses it.
  std::span<const double> controller_numerator{}, controller_denominator{};
};

/// Model of a drive from inputs and its own simulated output: direct output error.
///
///   f(k) = [u(k-d-1) ..., -yh(k-1) ..., (1)]   e(k) = y(k) - f' theta(k-1)   yh(k) = f' theta(k)
///
/// with the a-posteriori prediction yh. RPLR moves along f and needs no filter, but is locally stable only
/// where E[f (f/A)'] is positive (positive_real.hpp): not on a lightly damped machine that is sampled fast.
/// Follows changes along the resonance much faster than the memory (lag.hpp).
///
/// Limits: direct, so the noise that feedback brings into u is a bias, small with a soft loop; an unknown
/// load torque hurts unless it is estimated or filtered out. Source: Nevaranta 2016, Pub. II;
/// Ljung and Soderstrom 1983.
template <class Real, std::size_t Order>
class OutputError {
 public:
  using Scalar = Real;
  static constexpr std::size_t kOrder = Order;
  static constexpr std::size_t kExtra = 1;

  static expected<OutputError, Error> create(const OutputErrorConfig& config) {
    if (!(config.filter_contraction > 0.0 && config.filter_contraction <= 1.0))
      return refuse("filter_contraction", "must lie in (0, 1]", config.filter_contraction);
    if (!(config.largest_pole_radius > 0.0 && std::isfinite(config.largest_pole_radius)))
      return refuse("largest_pole_radius", "must be > 0", config.largest_pole_radius);
    auto rls = make_least_squares<Real, Order, kExtra>(config.common, {config.load_torque});
    if (!rls) return unexpected<Error>(rls.error());
    return OutputError(config, *rls);
  }

  void step(Real ru, Real u, Real y) noexcept {
    ++samples_;
    const bool known = std::isfinite(u) && std::isfinite(y);
    if (!known) ++skipped_;
    const Real input = std::isfinite(u) ? input_filter_.step(u) : Real(0);
    gate_.step(ru, std::isfinite(u) ? u : Real(0));
    Vector f;
    simulated_.fill(f);
    f[2 * Order] = Real(1);
    const Real before = simulated_.base() + rls_.predict(f);
    const Real output = std::isfinite(y) ? output_filter_.step(y) : before;
    residual_ = known ? output - before : Real(0);
    if (known && gate_.open()) {
      const Vector former = rls_.parameters();
      rls_.correct(filtered_ ? gradient(f) : f, residual_);
      guard_.keep_stable(rls_, simulated_, former);
    }
    predicted_ = simulated_.base() + rls_.predict(f);
    simulated_.push(input, predicted_);
    measured_.push(input, output);
    if (filtered_) damped_.push(input, predicted_, model());
    if (guard_.lost(output, predicted_)) simulated_ = measured_;
  }

  /// `count` samples were lost: as so many steps with samples that are not finite, in a bounded time
  /// (missed_samples.hpp).
  void miss(std::uint64_t count) noexcept {
    const std::uint64_t rest = step_missed(*this, count);
    samples_ += rest;
    skipped_ += rest;
  }
  void reset() noexcept {
    rls_.reset();
    simulated_.reset();
    measured_.reset();
    damped_.reset();
    gate_.reset();
    guard_.reset();
    input_filter_.reset();
    output_filter_.reset();
    residual_ = predicted_ = Real(0);
    samples_ = skipped_ = 0;
  }

  [[nodiscard]] DiscreteModel<Real, Order> model() const noexcept {
    return simulated_.model(rls_.parameters());
  }
  /// For white residuals and an excitation that is white in its band, by recursion_covariance(). Infinite
  /// where the recursion is not stable. Takes some 60 us.
  [[nodiscard]] ModelCovariance<Real, Order> covariance() const noexcept {
    return pseudo_linear_covariance(rls_, simulated_, recursion());
  }
  [[nodiscard]] double lag_samples() const noexcept {
    return recursion_lag_samples(stability(), rls_.mean_age_samples(), model(), filtered_);
  }
  /// Stability of the recursion at the newest estimate. Takes some 50 us, as does the lag derived from it.
  [[nodiscard]] LocalStability stability() const noexcept { return local_stability(recursion()); }
  [[nodiscard]] bool locally_stable() const noexcept { return stability().stable; }
  [[nodiscard]] Real residual() const noexcept { return residual_; }
  /// Newest output as simulated with the newest estimate.
  [[nodiscard]] Real predicted() const noexcept { return predicted_; }
  [[nodiscard]] bool ready() const noexcept { return started(rls_) && excited(); }
  [[nodiscard]] bool excited() const noexcept { return gate_.open() && rls_.excited(); }
  [[nodiscard]] std::uint64_t samples() const noexcept { return samples_; }
  [[nodiscard]] std::uint64_t skipped_samples() const noexcept { return skipped_ + rls_.skipped_samples(); }
  /// Steps that were shortened to keep the predictor stable, and predictions that were lost all the same.
  [[nodiscard]] const PredictorGuard<Real>& guard() const noexcept { return guard_; }
  /// Constant torque that acts beside u, in its unit; 0 where not estimated.
  [[nodiscard]] Real load_torque() const noexcept {
    Real sum(0);
    for (std::size_t i = 0; i < Order; ++i) sum += rls_.parameters()[i];
    return rls_.parameters()[2 * Order] / sum;
  }
  [[nodiscard]] const RecursiveLeastSquares<Real, 2 * Order + kExtra>& least_squares() const noexcept {
    return rls_;
  }

  /// For a state of unknown origin (base/detail/intact.hpp).
  [[nodiscard]] bool intact() const noexcept {
    return rls_.intact() && simulated_.intact() && measured_.intact() && damped_.intact() &&
           input_filter_.intact() && output_filter_.intact() && resonid::intact(filtered_);
  }

 private:
  using Past = Regression<Real, Order, kExtra>;
  using Vector = typename Past::Vector;

  OutputError(const OutputErrorConfig& c, const RecursiveLeastSquares<Real, 2 * Order + kExtra>& rls)
      : rls_(rls),
        simulated_(c.common.delay_samples, c.common.fixed_integrator),
        measured_(simulated_),
        damped_(c.common.delay_samples, c.common.fixed_integrator, c.filter_contraction),
        gate_(c.common.freeze_below),
        guard_(c.largest_pole_radius),
        input_filter_(c.common.high_pass_hz, c.common.sample_rate_hz),
        output_filter_(c.common.high_pass_hz, c.common.sample_rate_hz),
        controller_(controller_coefficients(c.controller_numerator, c.controller_denominator)),
        filtered_(c.gradient == OutputErrorGradient::filtered) {}

  [[nodiscard]] Vector gradient(Vector psi) const noexcept {
    damped_.fill(psi);
    return psi;
  }

  [[nodiscard]] PseudoLinearRecursion<Order> recursion() const noexcept {
    PseudoLinearRecursion<Order> r;
    r.model = r.gradient_model = widened(model());
    r.delay_samples = simulated_.delay_samples();
    r.fixed_integrator = simulated_.fixed_integrator();
    r.controller = controller_;
    r.error = RegressorFilter::inverse_a;
    r.gradient = filtered_ ? RegressorFilter::inverse_a : RegressorFilter::none;
    r.gradient_contraction = damped_.contraction();
    return r;
  }

  RecursiveLeastSquares<Real, 2 * Order + kExtra> rls_;
  Past simulated_, measured_;  // inputs with simulated and with measured outputs
  DampedGradient<Real, Order, kExtra> damped_;
  InputGate<Real> gate_;
  PredictorGuard<Real> guard_;
  HighPass<Real> input_filter_, output_filter_;
  ControllerCoefficients controller_;
  bool filtered_;
  Real residual_ = Real(0), predicted_ = Real(0);
  std::uint64_t samples_ = 0, skipped_ = 0;
};

static_assert(DiscreteEstimator<OutputError<double, 3>>);
static_assert(DiscreteEstimator<OutputError<float, 3>>);

}  // namespace resonid::online
