// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <resonid/base/detail/discrete_filter.hpp>
#include <resonid/base/detail/intact.hpp>
#include <resonid/online/models/detail/damped_gradient.hpp>
#include <resonid/online/models/detail/excitation_gate.hpp>
#include <resonid/online/models/detail/lag.hpp>
#include <resonid/online/models/detail/missed_samples.hpp>
#include <resonid/online/models/detail/predictor_guard.hpp>
#include <resonid/online/models/detail/pseudo_linear.hpp>
#include <resonid/online/models/detail/regression.hpp>

namespace resonid::online {

/// Where the predictor's input comes from.
enum class PredictorInput {
  excitation,  ///< uh = ru - C yh: the loop driven by ru alone; a reference must be filtered out.
  measured,    ///< uh = u + C (y - yh), the same but for whatever else drives the loop, such as a reference.
};

/// What the parameters of CLOE move along.
enum class ClosedLoopGradient {
  regressor,      ///< The regressor: CLOE, Publication III.
  fixed_filter,   ///< Filtered by S/A of the start model: F-CLOE.
  damped_filter,  ///< Filtered by 1/A of the current model with its poles drawn in (damped_gradient.hpp).
};

struct ClosedLoopOutputErrorConfig {
  static constexpr std::size_t kMaxControllerOrder = 4;
  ModelEstimatorConfig common{};
  /// C in powers of z^-1, from measured output to -u; up to order 4.
  std::span<const double> controller_numerator{}, controller_denominator{};
  PredictorInput input = PredictorInput::excitation;
  ClosedLoopGradient gradient = ClosedLoopGradient::regressor;
  double filter_contraction = 0.8;  ///< Factor on the poles of `damped_filter`, in (0, 1].
  /// Bound on the poles of A; above 1 leaves room to an estimated integrator.
  double largest_pole_radius = 1.02;
};

/// Model of a drive from the simulated closed loop with the known controller: indirect.
///
///   yh(k) = f(k)' theta(k)    f(k) = [uh(k-d-1) ..., -yh(k-1) ...]    uh(k) = ru(k) - C(z) yh(k)
///
/// No measured signal is in the regressor: consistent under feedback whatever the noise. The delay d is in yh
/// as it is in y. With `measured`, uh = u + C (y - yh) is the same without knowing the reference, because
/// u = C (r - y) + ru: noise cancels in it.
///
/// Limits: needs the true controller; locally stable only where E[f (S f/A)'] is positive
/// (positive_real.hpp). F-CLOE mends that with a filter that must fit the machine; `damped_filter` with one
/// that follows it, and is the most accurate of all: use it unless the published methods are wanted. Source:
/// Nevaranta 2016, Pub. III and eq. 3.13; Landau and Karimi 1997.
template <class Real, std::size_t Order>
class ClosedLoopOutputError {
 public:
  using Scalar = Real;
  static constexpr std::size_t kOrder = Order;

  static expected<ClosedLoopOutputError, Error> create(const ClosedLoopOutputErrorConfig& config) {
    if (!(config.filter_contraction > 0.0 && config.filter_contraction <= 1.0))
      return refuse("filter_contraction", "must lie in (0, 1]", config.filter_contraction);
    if (!(config.largest_pole_radius > 0.0 && std::isfinite(config.largest_pole_radius)))
      return refuse("largest_pole_radius", "must be > 0", config.largest_pole_radius);
    if (config.gradient == ClosedLoopGradient::fixed_filter && config.common.start_a.empty())
      return refuse("start_a", "is needed for the filter of F-CLOE");
    auto controller = Controller::create(config.controller_numerator, config.controller_denominator);
    if (!controller) {
      const bool above = controller.error().field == "numerator";
      return refuse(above ? "controller_numerator" : "controller_denominator", controller.error().requirement,
                    controller.error().value);
    }
    auto rls = make_least_squares<Real, Order, 0>(config.common, {});
    if (!rls) return unexpected<Error>(rls.error());
    return ClosedLoopOutputError(config, *rls, *controller);
  }

  void step(Real ru, Real u, Real y) noexcept {
    ++samples_;
    const bool measured = input_ == PredictorInput::measured;
    const Real driving = measured ? u : ru;
    const bool driven = std::isfinite(driving), known = driven && std::isfinite(y);
    if (!known) ++skipped_;
    gate_.step(ru, std::isfinite(u) ? u : Real(0));
    const Real drive = driven ? input_filter_.step(driving) : Real(0);
    Vector f;
    simulated_.fill(f);
    const Real before = simulated_.base() + rls_.predict(f);
    const Real output = std::isfinite(y) ? output_filter_.step(y) : before;
    residual_ = known ? output - before : Real(0);
    if (known && gate_.open()) {
      const Vector former = rls_.parameters(), direction = filtered() ? gradient() : f;
      watch_motion(direction);
      rls_.correct(direction, residual_);
      guard_.keep_stable(rls_, simulated_, former);
    }
    predicted_ = simulated_.base() + rls_.predict(f);
    const Real input = drive + controller_.step(measured ? output - predicted_ : -predicted_);
    simulated_.push(input, predicted_);
    if (filtered()) push_gradient(input, predicted_);
    if (guard_.lost(output, predicted_)) restart();
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
    restart();
    gate_.reset();
    guard_.reset();
    input_filter_.reset();
    output_filter_.reset();
    residual_ = predicted_ = Real(0);
    motion_ = {};
    since_stiffness_ = 0;
    samples_ = skipped_ = 0;
  }

  [[nodiscard]] DiscreteModel<Real, Order> model() const noexcept {
    return simulated_.model(rls_.parameters());
  }
  /// For white output noise, which the residual holds times S, and an excitation that is white in its band,
  /// by recursion_covariance(). Infinite where the recursion is not stable. Takes some 60 us.
  [[nodiscard]] ModelCovariance<Real, Order> covariance() const noexcept {
    return pseudo_linear_covariance(rls_, simulated_, recursion(), motion_);
  }
  [[nodiscard]] double lag_samples() const noexcept {
    return recursion_lag_samples(stability(), rls_.mean_age_samples(), model(), filtered());
  }
  /// Stability of the recursion at the newest estimate. Takes some 50 us, as does the lag derived from it.
  [[nodiscard]] LocalStability stability() const noexcept { return local_stability(recursion()); }
  [[nodiscard]] bool locally_stable() const noexcept { return stability().stable; }
  [[nodiscard]] Real residual() const noexcept { return residual_; }
  /// Newest output of the simulated loop.
  [[nodiscard]] Real predicted() const noexcept { return predicted_; }
  [[nodiscard]] bool ready() const noexcept { return started(rls_) && excited(); }
  [[nodiscard]] bool excited() const noexcept { return gate_.open() && rls_.excited(); }
  [[nodiscard]] std::uint64_t samples() const noexcept { return samples_; }
  [[nodiscard]] std::uint64_t skipped_samples() const noexcept { return skipped_ + rls_.skipped_samples(); }
  /// Steps that were shortened to keep the predictor stable, and predictions that were lost all the same.
  [[nodiscard]] const PredictorGuard<Real>& guard() const noexcept { return guard_; }
  [[nodiscard]] const RecursiveLeastSquares<Real, 2 * Order>& least_squares() const noexcept { return rls_; }

  /// For a state of unknown origin (base/detail/intact.hpp).
  [[nodiscard]] bool intact() const noexcept {
    return rls_.intact() && simulated_.intact() && smooth_.intact() && damped_.intact() &&
           controller_.intact() && smooth_input_.past.intact() && smooth_input_.controller.intact() &&
           smooth_output_.past.intact() && smooth_output_.controller.intact() && input_filter_.intact() &&
           output_filter_.intact() && resonid::intact(input_, PredictorInput::measured) &&
           resonid::intact(gradient_, ClosedLoopGradient::damped_filter);
  }

 private:
  using Past = Regression<Real, Order>;
  using Vector = typename Past::Vector;
  using Controller = DiscreteFilter<Real, ClosedLoopOutputErrorConfig::kMaxControllerOrder>;

  static constexpr std::uint32_t kStiffnessSamples = 32;  // that the direction stays for

  /// x filtered by S/A: A w = x - z^-d B C w.
  struct SensitivityFilter {
    Regression<Real, Order> past;
    Controller controller;
    Real step(Real x, const DiscreteModel<Real, Order>& m) noexcept {
      Vector f;
      past.fill(f);
      for (std::size_t i = 0; i < Order; ++i) x += m.a[i] * f[Order + i] - m.b[i] * f[i];
      past.push(controller.step(x), x);
      return x;
    }
    void reset() noexcept {
      past.reset();
      controller.reset();
    }
  };

  ClosedLoopOutputError(const ClosedLoopOutputErrorConfig& c,
                        const RecursiveLeastSquares<Real, 2 * Order>& rls, const Controller& controller)
      : rls_(rls),
        simulated_(c.common.delay_samples, c.common.fixed_integrator),
        smooth_(simulated_),
        damped_(c.common.delay_samples, c.common.fixed_integrator, c.filter_contraction),
        controller_(controller),
        coefficients_(controller_coefficients(c.controller_numerator, c.controller_denominator)),
        smooth_input_{Past(c.common.delay_samples, false), controller},
        smooth_output_(smooth_input_),
        gate_(c.common.freeze_below),
        guard_(c.largest_pole_radius),
        input_filter_(c.common.high_pass_hz, c.common.sample_rate_hz),
        output_filter_(c.common.high_pass_hz, c.common.sample_rate_hz),
        input_(c.input),
        gradient_(c.gradient),
        filter_model_(simulated_.model(rls.parameters())) {}

  [[nodiscard]] bool filtered() const noexcept { return gradient_ != ClosedLoopGradient::regressor; }
  [[nodiscard]] Vector gradient() const noexcept {
    Vector psi;
    gradient_ == ClosedLoopGradient::damped_filter ? damped_.fill(psi) : smooth_.fill(psi);
    return psi;
  }
  void push_gradient(Real input, Real output) noexcept {
    if (gradient_ == ClosedLoopGradient::damped_filter) {
      damped_.push(input, output, model());
      return;
    }
    const Real smooth_input = smooth_input_.step(input, filter_model_);
    smooth_.push(smooth_input, smooth_output_.step(output, filter_model_));
  }
  void watch_motion(const Vector& direction) noexcept {
    if (since_stiffness_++ % kStiffnessSamples == 0) {
      const auto g = StiffnessDirection<Real, Order>::of(model());
      Real sum(0);
      for (std::size_t i = 0; i < Order; ++i) {
        along_[i] = g.change.b[i];
        along_[Order + i] = simulated_.fixed_integrator() ? (sum += g.change.a[i]) : g.change.a[i];
      }
      motion_.flush();
    }
    Real moving(0);
    for (std::size_t i = 0; i < 2 * Order; ++i) moving += direction[i] * along_[i];
    motion_.see(moving, moving, residual_, rls_.factor());
  }
  /// The simulated loop from rest.
  void restart() noexcept {
    simulated_.reset();
    smooth_.reset();
    damped_.reset();
    controller_.reset();
    smooth_input_.reset();
    smooth_output_.reset();
  }

  [[nodiscard]] PseudoLinearRecursion<Order> recursion() const noexcept {
    PseudoLinearRecursion<Order> r;
    r.model = widened(model());
    r.delay_samples = simulated_.delay_samples();
    r.fixed_integrator = simulated_.fixed_integrator();
    r.controller = coefficients_;
    r.error = RegressorFilter::sensitivity;
    const bool damped = gradient_ == ClosedLoopGradient::damped_filter;
    r.gradient = damped ? RegressorFilter::inverse_a
                        : (filtered() ? RegressorFilter::sensitivity : RegressorFilter::none);
    r.gradient_model = gradient_ == ClosedLoopGradient::fixed_filter ? widened(filter_model_) : r.model;
    r.gradient_contraction = damped ? damped_.contraction() : 1.0;
    return r;
  }

  RecursiveLeastSquares<Real, 2 * Order> rls_;
  Past simulated_, smooth_;  // of the simulated loop, and of its signals filtered by S/A
  DampedGradient<Real, Order> damped_;
  Controller controller_;
  ControllerCoefficients coefficients_;
  SensitivityFilter smooth_input_, smooth_output_;
  InputGate<Real> gate_;
  PredictorGuard<Real> guard_;
  HighPass<Real> input_filter_, output_filter_;
  PredictorInput input_;
  ClosedLoopGradient gradient_;
  DiscreteModel<Real, Order> filter_model_;
  Vector along_{};  // in which a stiffness moves the parameters
  StiffnessMotion<Real> motion_{};
  std::uint32_t since_stiffness_ = 0;
  Real residual_ = Real(0), predicted_ = Real(0);
  std::uint64_t samples_ = 0, skipped_ = 0;
};

static_assert(DiscreteEstimator<ClosedLoopOutputError<double, 3>>);
static_assert(DiscreteEstimator<ClosedLoopOutputError<float, 3>>);

}  // namespace resonid::online
