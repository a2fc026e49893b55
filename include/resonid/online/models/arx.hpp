// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <resonid/online/models/detail/excitation_gate.hpp>
#include <resonid/online/models/detail/lag.hpp>
#include <resonid/online/models/detail/missed_samples.hpp>
#include <resonid/online/models/detail/regression.hpp>
#include <type_traits>

namespace resonid::online {

struct ArxConfig {
  ModelEstimatorConfig common{};
  bool load_torque = false;  ///< Also estimates a constant torque beside u.
  bool coulomb = false;      ///< Also estimates a torque that opposes the sign of the velocity.
};

/// Model of a drive by recursive least squares on measured inputs and outputs: direct, one equation error.
///
///   y(k) = -a_1 y(k-1) - ... + b_1 u(k-d-1) + ... [+ c + f_1 sign y(k-1) + ...] + e(k)
///
/// Constant load torque: c/sum b_i; Coulomb torque: -sum f_i/sum b_i. Viscous friction is part of the model.
///
/// Limits: biased by output noise, which is no equation error, and the more so the faster the sampling;
/// sluggish: lags by the whole memory. ru is not used, but tells whether there is excitation, where it is
/// given (else u does). Source: Nevaranta 2016, eqs. 3.9-3.12.
template <class Real, std::size_t Order>
class Arx {
 public:
  using Scalar = Real;
  static constexpr std::size_t kOrder = Order;
  static constexpr std::size_t kExtra = 1 + Order;  ///< c, f_1 ... f_n

  static expected<Arx, Error> create(const ArxConfig& config) {
    auto rls = make_least_squares<Real, Order, kExtra>(config.common, extra_on(config));
    if (!rls) return unexpected<Error>(rls.error());
    return Arx(config, *rls);
  }

  void step(Real ru, Real u, Real y) noexcept {
    ++samples_;
    if (!std::isfinite(u) || !std::isfinite(y)) {
      bridge(u, y);
      return;
    }
    gate_.step(ru, u);
    const Real input = input_filter_.step(u), output = output_filter_.step(y);
    Vector f = regressor();
    if (gate_.open() && stale_ == 0) {
      rls_.step(f, output - past_.base());
      residual_ = rls_.residual();
    } else {
      residual_ = output - past_.base() - rls_.predict(f);
    }
    if (stale_ > 0) --stale_;
    predicted_ = past_.base() + rls_.predict(f);
    past_.push(input, output);
    for (std::size_t i = Order - 1; i > 0; --i) sign_[i] = sign_[i - 1];
    sign_[0] = static_cast<Real>((y > Real(0)) - (y < Real(0)));
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
    past_.reset();
    gate_.reset();
    input_filter_.reset();
    output_filter_.reset();
    residual_ = predicted_ = Real(0);
    sign_.fill(Real(0));
    samples_ = skipped_ = 0;
    stale_ = 0;
  }

  [[nodiscard]] DiscreteModel<Real, Order> model() const noexcept { return past_.model(rls_.parameters()); }
  /// Right for white equation errors. Output noise adds a bias that is not in it.
  [[nodiscard]] ModelCovariance<Real, Order> covariance() const noexcept {
    return past_.covariance(rls_.covariance());
  }
  [[nodiscard]] double lag_samples() const noexcept {
    return static_cast<double>(rls_.mean_age_samples()) + oscillation_memory_samples(model());
  }
  [[nodiscard]] Real residual() const noexcept { return residual_; }
  /// Newest output as predicted from the newest estimate.
  [[nodiscard]] Real predicted() const noexcept { return predicted_; }
  [[nodiscard]] bool ready() const noexcept { return started(rls_) && excited(); }
  [[nodiscard]] bool excited() const noexcept { return gate_.open() && rls_.excited(); }
  [[nodiscard]] std::uint64_t samples() const noexcept { return samples_; }
  [[nodiscard]] std::uint64_t skipped_samples() const noexcept { return skipped_ + rls_.skipped_samples(); }

  /// Constant torque that acts beside u, and Coulomb friction, in the unit of u; 0 where not estimated.
  [[nodiscard]] Real load_torque() const noexcept { return rls_.parameters()[2 * Order] / gain(); }
  [[nodiscard]] Real coulomb_torque() const noexcept {
    Real sum(0);
    for (std::size_t i = 0; i < Order; ++i) sum += rls_.parameters()[2 * Order + 1 + i];
    return -sum / gain();
  }
  [[nodiscard]] const RecursiveLeastSquares<Real, 2 * Order + kExtra>& least_squares() const noexcept {
    return rls_;
  }

  /// For a state of unknown origin (base/detail/intact.hpp).
  [[nodiscard]] bool intact() const noexcept {
    return rls_.intact() && past_.intact() && input_filter_.intact() && output_filter_.intact();
  }

 private:
  using Past = Regression<Real, Order, kExtra>;
  using Vector = typename Past::Vector;

  Arx(const ArxConfig& c, const RecursiveLeastSquares<Real, 2 * Order + kExtra>& rls)
      : rls_(rls),
        past_(c.common.delay_samples, c.common.fixed_integrator),
        gate_(c.common.freeze_below),
        input_filter_(c.common.high_pass_hz, c.common.sample_rate_hz),
        output_filter_(c.common.high_pass_hz, c.common.sample_rate_hz),
        spoiled_samples_(Order + c.common.delay_samples) {}

  static std::array<bool, kExtra> extra_on(const ArxConfig& c) {
    std::array<bool, kExtra> on;
    on.fill(c.coulomb);
    on[0] = c.load_torque;
    return on;
  }
  [[nodiscard]] Vector regressor() const noexcept {
    Vector f;
    past_.fill(f);
    f[2 * Order] = Real(1);
    for (std::size_t i = 0; i < Order; ++i) f[2 * Order + 1 + i] = sign_[i];
    return f;
  }
  /// A missing output is taken as predicted, a missing input as 0; nothing is learned while they are in use.
  void bridge(Real u, Real y) noexcept {
    ++skipped_;
    const Real input = std::isfinite(u) ? input_filter_.step(u) : Real(0);
    const Real output = std::isfinite(y) ? output_filter_.step(y) : past_.base() + rls_.predict(regressor());
    residual_ = Real(0);
    past_.push(input, std::isfinite(output) ? output : Real(0));
    stale_ = spoiled_samples_;
  }
  [[nodiscard]] Real gain() const noexcept {
    Real sum(0);
    for (std::size_t i = 0; i < Order; ++i) sum += rls_.parameters()[i];
    return sum;
  }

  RecursiveLeastSquares<Real, 2 * Order + kExtra> rls_;
  Past past_;
  InputGate<Real> gate_;
  HighPass<Real> input_filter_, output_filter_;
  Real residual_ = Real(0), predicted_ = Real(0);
  std::array<Real, Order> sign_{};  // of the last outputs
  std::uint64_t samples_ = 0, skipped_ = 0;
  std::size_t spoiled_samples_, stale_ = 0;
};

static_assert(DiscreteEstimator<Arx<double, 3>>);
static_assert(DiscreteEstimator<Arx<float, 3>>);

}  // namespace resonid::online
