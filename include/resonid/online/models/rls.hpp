// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <resonid/base/detail/flushed.hpp>
#include <resonid/base/detail/intact.hpp>
#include <resonid/base/enum_names.hpp>
#include <resonid/base/expected.hpp>
#include <resonid/online/models/detail/rls_config.hpp>
#include <resonid/online/models/detail/ud_factors.hpp>
#include <span>
#include <type_traits>

namespace resonid::online {

/// Recursive least squares whose covariance cannot lose its symmetry:
///
///   e = y - f' theta      L = P f/(lambda/w + f' P f)      theta += L e      P = (P - L f' P)/lambda
///
/// w: weight of the sample. P is per unit residual variance.
///
/// Without excitation, forgetting would make P grow without bound. A parameter whose variance passes its
/// upper limit is therefore told, once more, its present estimate, with the certainty that brings its
/// variance back to the limit: theta stays, the other directions go on being tracked, and excited() turns
/// false. The limits are looked at every kLimitInterval samples.
///
/// P is kept as U D U' (UdFactors, the default), or as itself (SymmetricCovariance): shorter, but only where
/// P is well conditioned. The steps do the same work whatever the data, but for the limits: there each
/// parameter that passes one costs an update more. Sums that fade in silence end at 0, not in denormal
/// numbers; the regressors are the caller's.
///
/// A sample that is not finite counts as missing. Trivially copyable, no heap. Limit: the covariance is right
/// for white equation errors, and for pseudo-linear regressions only near them. Source: Bierman
/// 1977; Fortescue, Kershenbaum and Ydstie 1981; Kulhavy 1985.
template <class Real, std::size_t Parameters, class Factors = UdFactors<Real, Parameters>>
class RecursiveLeastSquares {
 public:
  using Scalar = Real;
  using Factorisation = Factors;
  static constexpr std::size_t kParameters = Parameters;
  static constexpr std::size_t kLimitInterval = 16;
  using Vector = std::array<Real, Parameters>;
  using Matrix = Eigen::Matrix<Real, static_cast<int>(Parameters), static_cast<int>(Parameters)>;

  static expected<RecursiveLeastSquares, Error> create(const RecursiveLeastSquaresConfig& config) {
    if (auto fault = check(config)) return unexpected<Error>(*fault);
    RecursiveLeastSquares rls;
    for (std::size_t i = 0; i < Parameters; ++i) {
      const double scale = config.scale.empty() ? 1.0 : config.scale[i];
      const bool fixed = !config.fixed.empty() && config.fixed[i];
      rls.start_[i] = config.start.empty() ? Real(0) : static_cast<Real>(config.start[i]);
      rls.start_variance_[i] = fixed ? Real(0) : static_cast<Real>(config.start_variance / (scale * scale));
      rls.largest_[i] = rls.start_variance_[i] * static_cast<Real>(config.largest_variance);
      if (!fixed) rls.active_ += Real(1);
      rls.smallest_[i] = rls.start_variance_[i] * static_cast<Real>(config.smallest_variance);
    }
    rls.forgetting_ = config.forgetting;
    rls.factor_ = config.forgetting == Forgetting::none ? Real(1) : static_cast<Real>(config.factor);
    rls.smallest_factor_ = static_cast<Real>(config.smallest_factor);
    rls.noise_variance_ = static_cast<Real>(config.noise_variance);
    rls.reset();
    return rls;
  }

  /// One equation value = regressor' theta + error, `weight` > 0 times as certain as usual. False when it was
  /// skipped because something in it is not finite, or so large that squares overflow.
  bool step(const Vector& regressor, Real value, Real weight = Real(1)) noexcept {
    return correct(regressor, value - predict(regressor), weight);
  }

  /// The same with the error given: for prediction errors that are not linear in theta, `gradient` is then
  /// the derivative of the prediction.
  bool correct(const Vector& gradient, Real error, Real weight = Real(1)) noexcept {
    const auto f = factors_.project(gradient);
    const Real spread = factors_.spread(f);  // f' P f
    if (!std::isfinite(spread + error * error) || !(weight > Real(0))) {
      ++skipped_;
      ++samples_;
      return false;
    }
    error_ = error;
    const Real share = weight_share();
    const Real normalized = weight * error * error / (Real(1) + weight * share * spread);
    const Real forgotten = update(f, spread, error, weight, normalized);
    ages_ = forgotten * (ages_ + weights_);
    weights_ = forgotten * weights_ + Real(1);
    weight_squares_ = forgotten * forgotten * weight_squares_ + Real(1);
    squared_errors_ = flushed(forgotten * squared_errors_ + normalized);
    leverage_ = flushed(factor_ * leverage_ + weight * spread / (Real(1) + weight * spread));
    ++samples_;
    if (++since_limits_ == kLimitInterval) enforce_limits();
    return true;
  }

  /// `count` samples were lost: counted, nothing is forgotten for them.
  void miss(std::uint64_t count) noexcept {
    samples_ += count;
    skipped_ += count;
  }
  void reset() noexcept {
    theta_ = start_;
    factors_.reset(start_variance_);
    weights_ = weight_squares_ = squared_errors_ = error_ = usual_error_ = leverage_ = ages_ = Real(0);
    samples_ = skipped_ = 0;
    since_limits_ = 0;
    limited_ = false;
  }

  [[nodiscard]] Real predict(const Vector& regressor) const noexcept {
    Real sum(0);
    for (std::size_t i = 0; i < Parameters; ++i) sum += regressor[i] * theta_[i];
    return sum;
  }

  [[nodiscard]] const Vector& parameters() const noexcept { return theta_; }
  /// Replaces the estimate and keeps its certainty: for projections.
  void set_parameters(const Vector& theta) noexcept { theta_ = theta; }

  /// P: per unit residual variance, and as if all remembered samples had the same weight.
  [[nodiscard]] Matrix information_inverse() const noexcept { return factors_.dense(); }
  /// Covariance of the parameters: residual variance times P times the loss that unequal weights bring, in
  /// the steady state of constant forgetting 1/(1 + lambda). Infinite until there are more samples than
  /// parameters.
  [[nodiscard]] Matrix covariance() const noexcept {
    const bool known = used_samples() > Parameters;
    const Real variance =
        known ? residual_variance() * weight_share() : std::numeric_limits<Real>::infinity();
    Matrix m = factors_.dense();
    for (int i = 0; i < m.rows(); ++i)  // plain loops: compiled for very many sizes
      for (int j = 0; j < m.cols(); ++j) m(i, j) = known || i == j ? m(i, j) * variance : Real(0);
    return m;
  }
  /// Sum of the squared weights over the sum of the weights: 1 without forgetting, 1/(1 + lambda) with.
  [[nodiscard]] Real weight_share() const noexcept {
    return weights_ > Real(0) ? weight_squares_ / weights_ : Real(1);
  }
  /// Variance of the equation error at weight 1, over the memory; infinite before the first sample.
  [[nodiscard]] Real residual_variance() const noexcept {
    return weights_ > Real(0) ? squared_errors_ / weights_ : std::numeric_limits<Real>::infinity();
  }
  /// Newest value minus its prediction from the estimate before it.
  [[nodiscard]] Real residual() const noexcept { return error_; }
  /// Sum of the weights that forgetting has left: 1/(1 - lambda) in the steady state.
  [[nodiscard]] Real memory_samples() const noexcept { return weights_; }
  /// Mean age of the remembered samples by their weights: lambda/(1 - lambda) in the steady state.
  [[nodiscard]] Real mean_age_samples() const noexcept {
    return weights_ > Real(0) ? ages_ / weights_ : Real(0);
  }
  [[nodiscard]] Real factor() const noexcept { return factor_; }
  /// False while the samples of the memory tell next to nothing new, or some direction of the parameters has
  /// been without excitation for so long that its variance is at the limit. Without forgetting always true.
  [[nodiscard]] bool excited() const noexcept {
    return !limited_ && (factor_ == Real(1) || leverage_ > kLeastLeverage * active_);
  }
  [[nodiscard]] std::uint64_t samples() const noexcept { return samples_; }  ///< Missing ones included.
  [[nodiscard]] std::uint64_t skipped_samples() const noexcept { return skipped_; }

  /// For a state of unknown origin (base/detail/intact.hpp).
  [[nodiscard]] bool intact() const noexcept {
    return resonid::intact(forgetting_, Forgetting::directional) && smallest_factor_ <= Real(1) &&
           since_limits_ < kLimitInterval && resonid::intact(limited_);
  }

 private:
  RecursiveLeastSquares() = default;

  /// The leverages f'Pf/(1 + f'Pf) of a remembered and exciting record add up to the number of parameters.
  static constexpr Real kLeastLeverage = Real(0.1);

  [[nodiscard]] std::uint64_t used_samples() const noexcept { return samples_ - skipped_; }

  /// Changes theta and P; returns the factor by which older samples lost weight.
  Real update(const typename Factors::Direction& f, Real spread, Real error, Real weight,
              Real normalized) noexcept {
    Real noise = Real(1) / weight, growth(1), factor = factor_;
    Real gain;
    switch (forgetting_) {
      case Forgetting::directional: {
        gain = error / (noise + spread);
        // Of the information 1/spread about f' theta, the share 1 - lambda is replaced.
        const Real lost = spread > Real(0) ? (Real(1) - factor_) / spread : Real(0);
        const Real gained = factor_ * weight - lost;
        if (std::abs(gained) <= std::numeric_limits<Real>::epsilon() * weight) {
          move(factors_.image(f), gain);
          return factor_;
        }
        noise = Real(1) / gained;
        break;
      }
      case Forgetting::variable:
        factor = variable_factor(normalized);
        growth = Real(1) / factor;
        gain = error / (noise + spread);
        break;
      default:
        noise = factor_ * noise;
        growth = Real(1) / factor_;
        gain = error / (noise + spread);
    }
    move(factors_.absorb(f, noise, growth), gain);
    return factor;
  }

  void move(const Vector& direction, Real distance) noexcept {
    for (std::size_t i = 0; i < Parameters; ++i) theta_[i] += direction[i] * distance;
  }

  Real variable_factor(Real normalized) noexcept {
    // The learned level moves ten times more slowly than the estimate.
    const Real rate = Real(0.1) * (Real(1) - factor_);
    const Real count = static_cast<Real>(used_samples() + 1);
    const Real level = noise_variance_ > Real(0) ? noise_variance_ : usual_error_;
    usual_error_ = flushed(usual_error_ + std::max(rate, Real(1) / count) * (normalized - usual_error_));
    if (!(level > Real(0))) return factor_;
    return std::clamp(Real(1) - (Real(1) - factor_) * normalized / level, smallest_factor_, Real(1));
  }

  void enforce_limits() noexcept {
    since_limits_ = 0;
    limited_ = false;
    for (std::size_t i = 0; i < Parameters; ++i) {
      const Real variance = factors_.variance(i);
      if (variance > largest_[i]) {
        factors_.lower(i, variance, largest_[i]);
        limited_ = true;
      } else if (variance < smallest_[i]) {
        factors_.raise(i, smallest_[i] - variance);
      }
    }
  }

  static std::optional<Error> check(const RecursiveLeastSquaresConfig& c) {
    if (!c.start.empty() && c.start.size() != Parameters)
      return Error{"start", "needs one value per parameter", static_cast<double>(c.start.size())};
    for (const double x : c.start)
      if (!std::isfinite(x)) return Error{"start", "must be finite", x};
    if (!(c.start_variance > 0.0) || !std::isfinite(c.start_variance))
      return Error{"start_variance", "must be > 0", c.start_variance};
    if (!c.scale.empty() && c.scale.size() != Parameters)
      return Error{"scale", "needs one value per parameter", static_cast<double>(c.scale.size())};
    for (const double x : c.scale)
      if (!(x > 0.0) || !std::isfinite(x)) return Error{"scale", "must be > 0", x};
    if (!c.fixed.empty() && c.fixed.size() != Parameters)
      return Error{"fixed", "needs one value per parameter", static_cast<double>(c.fixed.size())};
    if (!(c.factor > 0.0 && c.factor <= 1.0)) return Error{"factor", "must lie in (0, 1]", c.factor};
    if (c.forgetting == Forgetting::variable && !(c.smallest_factor > 0.0 && c.smallest_factor <= c.factor))
      return Error{"smallest_factor", "must lie in (0, factor]", c.smallest_factor};
    if (!(c.noise_variance >= 0.0)) return Error{"noise_variance", "must be >= 0", c.noise_variance};
    if (!(c.largest_variance >= 1.0) || !std::isfinite(c.largest_variance))
      return Error{"largest_variance", "must be >= 1 and finite", c.largest_variance};
    if (!(c.smallest_variance >= 0.0 && c.smallest_variance <= 1.0))
      return Error{"smallest_variance", "must lie in 0 ... 1", c.smallest_variance};
    return std::nullopt;
  }

  Factors factors_;
  Vector theta_{}, start_{}, start_variance_{}, largest_{}, smallest_{};
  Forgetting forgetting_ = Forgetting::constant;
  Real factor_ = Real(1), smallest_factor_ = Real(1), noise_variance_ = Real(0);
  // Sums over the remembered samples: of their weights, the squares of these, weight times age.
  Real weights_ = Real(0), weight_squares_ = Real(0), ages_ = Real(0);
  Real squared_errors_ = Real(0), usual_error_ = Real(0), error_ = Real(0);
  Real leverage_ = Real(0), active_ = Real(0);  // parameters that are not fixed
  std::uint64_t samples_ = 0, skipped_ = 0;
  std::size_t since_limits_ = 0;
  bool limited_ = false;
};

static_assert(std::is_trivially_copyable_v<RecursiveLeastSquares<double, 6>>);
static_assert(std::is_trivially_copyable_v<RecursiveLeastSquares<float, 6>>);

}  // namespace resonid::online
