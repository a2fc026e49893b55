// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <resonid/base/detail/intact.hpp>
#include <resonid/base/expected.hpp>
#include <resonid/online/models/detail/auxiliary_loop.hpp>
#include <resonid/online/models/detail/instrumental_regressors.hpp>
#include <resonid/online/models/detail/instrumental_sums.hpp>
#include <resonid/online/models/detail/instrumental_variables_config.hpp>
#include <resonid/online/models/detail/missed_samples.hpp>
#include <resonid/online/models/detail/stiffness_motion.hpp>
#include <resonid/online/models/discrete_model.hpp>
#include <resonid/online/models/modes.hpp>
#include <type_traits>

namespace resonid::online {

/// Closed-loop instrumental variables: linear in theta, consistent under feedback whatever the noise, without
/// a positive-real condition.
///
///   t = f' theta + error       theta = (sum lambda^i z f')^-1 sum lambda^i z t
///
/// f holds the measured u and y (differences of y when the integrator is fixed), z the same entries of the
/// AuxiliaryLoop, which knows nothing of the noise. Refined: t, f and z are filtered by 1/A of the auxiliary
/// model, with a leaky integrator, which makes white output noise white again. The auxiliary model follows
/// the estimate every few periods of the resonance, while it and its loop are stable. Offsets, loads and slow
/// motion are taken off all signals by one high-pass (EquationTerms).
///
/// For a missing sample (anything in it not finite) the prediction is put in its place, and equations that
/// would hold it are left out. Trivially copyable, no heap. Limits: needs ru and the controller, and a start
/// whose resonance is right within about 15 %, since the first instruments come from it. Source:
/// Young 2011, ch. 9; Gilson and Van den Hof 2005; the rules for memory, refresh and lag are this project's
/// (docs/methods/instrumental_variables.md).
template <class Real, std::size_t Order>
class InstrumentalVariables {
 public:
  using Scalar = Real;
  using Model = DiscreteModel<Real, Order>;
  using Covariance = ModelCovariance<Real, Order>;
  static constexpr std::size_t kOrder = Order;

  static expected<InstrumentalVariables, Error> create(const InstrumentalVariablesConfig<Order>& config) {
    if (auto fault = fault_of(config)) return unexpected<Error>(*fault);
    auto loop =
        Loop::create(config.controller_numerator, config.controller_denominator, config.delay_samples);
    if (!loop) return unexpected<Error>(loop.error());
    Model start;
    for (std::size_t i = 0; i < Order; ++i) {
      start.b[i] = static_cast<Real>(config.start.b[i]);
      start.a[i] = static_cast<Real>(config.start.a[i]);
    }
    InstrumentalVariables iv(*loop, Regressors(config.terms, config.delay_samples, start));
    iv.start_model_ = start;
    if (!iv.usable(iv.start_model_)) return refuse("start", "must be a model whose loop and 1/A are stable");
    const double memory =
        config.memory_samples > 0.0 ? config.memory_samples : default_memory_samples(config.start);
    iv.factor_ = std::isinf(memory) ? Real(1) : static_cast<Real>(1.0 - 1.0 / memory);
    iv.long_factor_ = Real(1) - Real(0.5) * (Real(1) - iv.factor_);
    iv.refresh_ = config.refresh_samples > 0 ? config.refresh_samples : default_refresh_samples(config.start);
    iv.refined_ = config.refined;
    iv.extrapolate_ = config.extrapolate;
    iv.sums_ = iv.long_sums_ = Sums(iv.regressors_.error_correlation(config.refined));
    iv.start_ = iv.regressors_.parameters(iv.start_model_);
    const Vector size = iv.regressors_.sizes(iv.start_model_);
    for (std::size_t i = 0; i < kParameters; ++i) {
      iv.adjusted_[i] = size[i] > Real(0);
      iv.estimated_ += iv.adjusted_[i] ? 1 : 0;
      const Real off = static_cast<Real>(config.start_deviation) * size[i];
      const Real loose = static_cast<Real>(config.largest_deviation) * size[i];
      iv.unit_prior_.start[i] = iv.adjusted_[i] ? Real(1) / (off * off) : Real(1);
      iv.unit_prior_.frozen[i] = iv.adjusted_[i] ? Real(1) / (loose * loose) : Real(1);
    }
    iv.noise_variance_ = static_cast<Real>(config.noise_rms * config.noise_rms);
    const double forgotten = std::isinf(memory) ? 0.0 : (config.extrapolate ? 6.0 : 3.0) * memory;
    iv.settling_ = static_cast<std::uint64_t>(
        std::max(forgotten, (std::isinf(memory) ? 20.0 : 4.0) * static_cast<double>(iv.estimated_)));
    iv.reset();
    return iv;
  }

  /// One sample of excitation, input and output.
  void step(Real ru, Real u, Real y) noexcept {
    ++samples_;
    const bool whole = std::isfinite(ru + u + y);
    auto sample = whole ? regressors_.without_offsets({ru, u, y}) : regressors_.missing(theta_);
    if (!whole) {
      ++skipped_;
      paused_ = regressors_.span() + 1;
    }
    const auto equation = regressors_.step(loop_, sample.input, sample.output);
    loop_.step(sample.excitation);
    if (paused_ > 0) {
      --paused_;
      residual_ = Real(0);
    } else {
      learn(equation);
    }
    if (++since_refresh_ >= refresh_) refresh();
  }

  /// `count` samples were lost: as so many steps with samples that are not finite, in a bounded time
  /// (missed_samples.hpp).
  void miss(std::uint64_t count) noexcept {
    const std::uint64_t rest = step_missed(*this, count);
    samples_ += rest;
    skipped_ += rest;
  }
  void reset() noexcept {
    loop_.reset();
    regressors_.reset();
    follow(start_model_);
    sums_.reset(start_);
    long_sums_.reset(start_);
    theta_ = start_;
    residual_ = squared_errors_ = error_weight_ = Real(0);
    motion_ = {};
    samples_ = skipped_ = 0;
    paused_ = since_refresh_ = unusable_ = 0;
    excited_ = following_ = true;
  }

  /// The newest estimate, or while that is unstable the last one that was not: a short memory makes the
  /// equations nearly singular for single samples.
  [[nodiscard]] Model model() const noexcept {
    const Model estimate = regressors_.model(newest());
    return usable(estimate) ? estimate : loop_.model();
  }
  [[nodiscard]] Covariance covariance() const noexcept {
    Covariance result = Covariance::Identity() * std::numeric_limits<Real>::infinity();
    if (!(error_weight_ > Real(0)) || samples_ - skipped_ <= estimated_) return result;
    const auto gradient = regressors_.gradient();
    const auto inner = sums_.covariance(prior());
    for (const Real x : inner)
      if (!std::isfinite(x)) return result;
    const Real variance = residual_variance() * variance_growth();
    for (std::size_t i = 0; i < 2 * Order; ++i) {
      Vector row{};
      for (std::size_t k = 0; k < kParameters; ++k)
        for (std::size_t l = 0; l < kParameters; ++l) row[l] += gradient[i][k] * inner[k * kParameters + l];
      for (std::size_t j = 0; j < 2 * Order; ++j) {
        Real sum(0);
        for (std::size_t l = 0; l < kParameters; ++l) sum += row[l] * gradient[j][l];
        result(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) = sum * variance;
      }
    }
    add_motion(result, stiffness_, motion_variance(motion_.moved(), sums_.share(), stiffness_.decay));
    return result;
  }
  /// The equations' mean age (none when extrapolated), the known delay, half a sample of the zero-order hold,
  /// and what the oscillation remembers: the equation of k weighs the machine of k - i by e^{-2 i zeta w}(i +
  /// 1/(2 zeta w)), of mean age 0.75/(zeta w).
  [[nodiscard]] double lag_samples() const noexcept {
    const Real equations = extrapolate_ ? Real(2) * sums_.age() - long_sums_.age() : sums_.age();
    const double age = static_cast<double>(equations) + static_cast<double>(loop_.delay_samples()) + 0.5;
    const auto modes = SampledModes<Order>(loop_.model(), 1.0).resonances();
    if (modes.empty()) return age;
    return age + kOscillationLag / (modes[0].damping_ratio * kTwoPi * modes[0].frequency_hz);
  }
  /// Error of the newest equation, filtered so that white output noise is white, before it had an effect. 0
  /// for a missing one.
  [[nodiscard]] Real residual() const noexcept { return residual_; }
  /// Variance of the filtered equations' errors: about that of white output noise.
  [[nodiscard]] Real residual_variance() const noexcept {
    if (!(error_weight_ > Real(0))) return std::numeric_limits<Real>::infinity();
    return squared_errors_ / error_weight_;
  }
  /// Coulomb friction, positive against the motion; 0 when it is not estimated.
  [[nodiscard]] Real coulomb_torque() const noexcept { return newest()[2 * Order + 1]; }

  /// The start is forgotten (without forgetting: outweighed), all directions are excited, the model is
  /// stable.
  [[nodiscard]] bool ready() const noexcept {
    return excited_ && following_ && samples_ - skipped_ >= settling_;
  }
  /// False while some direction of the parameters has been without excitation for so long that it is frozen.
  [[nodiscard]] bool excited() const noexcept { return excited_; }
  /// Whether the auxiliary model is the newest estimate, and not an older one because that was unstable.
  [[nodiscard]] bool following() const noexcept { return following_; }
  [[nodiscard]] std::uint64_t samples() const noexcept { return samples_; }  ///< Missing ones included.
  [[nodiscard]] std::uint64_t skipped_samples() const noexcept { return skipped_; }

  /// For a state of unknown origin (base/detail/intact.hpp).
  [[nodiscard]] bool intact() const noexcept {
    for (const bool& adjusted : adjusted_)
      if (!resonid::intact(adjusted)) return false;
    return loop_.intact() && regressors_.intact() &&
           intact_flags(refined_, extrapolate_, excited_, following_);
  }

 private:
  using Loop = AuxiliaryLoop<Real, Order>;
  using Regressors = InstrumentalRegressors<Real, Order>;
  using Vector = typename Regressors::Vector;
  static constexpr std::size_t kParameters = Regressors::kParameters;
  using Sums = InstrumentalSums<Real, kParameters>;
  using Prior = typename Sums::Prior;
  static constexpr Real kLeastVariance = Real(1e-20);
  static constexpr Real kLeastGain = Real(2);      // half the limit's variance
  static constexpr double kOscillationLag = 0.75;  // of 1/(zeta w)

  InstrumentalVariables(const Loop& loop, const Regressors& regressors) noexcept
      : loop_(loop), regressors_(regressors) {}

  [[nodiscard]] bool usable(const Model& model) const noexcept {
    return Regressors::filter_stable(model) && loop_.stable(model);
  }

  void learn(const typename Regressors::Equation& equation) noexcept {
    Real error = equation.target;
    for (std::size_t i = 0; i < kParameters; ++i) error -= equation.regressor[i] * theta_[i];
    residual_ = error;
    // The estimate's own error is in it too, theta being older than the equation.
    const Real share = static_cast<Real>(estimated_) * sums_.share();
    const Real slow = Real(1) - Real(0.125) * (Real(1) - factor_);
    Real instrument(0), regressor(0);
    for (std::size_t i = 0; i < kParameters; ++i) {
      instrument += equation.instrument[i] * along_[i];
      regressor += equation.regressor[i] * along_[i];
    }
    const Real still = motion_.see(instrument, regressor, error, factor_);
    squared_errors_ = slow * squared_errors_ + still * still / (Real(1) + share);
    error_weight_ = slow * error_weight_ + Real(1);
    sums_.add(equation.instrument, equation.regressor, equation.target, factor_);
    if (extrapolate_) long_sums_.add(equation.instrument, equation.regressor, equation.target, long_factor_);
  }

  void refresh() noexcept {
    since_refresh_ = 0;
    const auto solution = sums_.solve(prior());
    theta_ = solution.theta;
    sums_.freeze(theta_);
    if (extrapolate_) {
      const Vector older = long_sums_.solve(prior()).theta;
      long_sums_.freeze(older);
      theta_ = extrapolated(theta_, older);
    }
    Real gain = std::numeric_limits<Real>::infinity();
    for (std::size_t i = 0; i < 2 * Order; ++i)
      if (adjusted_[i]) gain = std::min(gain, solution.gain[i]);
    excited_ = gain > kLeastGain;
    sums_.flush();
    long_sums_.flush();
    motion_.flush();
    regressors_.flush();
    loop_.flush();
    const Model model = regressors_.model(solution.theta);
    following_ = usable(model);
    if (following_) {
      follow(model);
      unusable_ = 0;
    } else if (++unusable_ * refresh_ >
               settling_) {  // lost: starts again from the last model that was usable
      sums_.reset(regressors_.parameters(loop_.model()));
      long_sums_.reset(regressors_.parameters(loop_.model()));
      unusable_ = 0;
    }
  }
  void follow(const Model& model) noexcept {
    loop_.set_model(model);
    regressors_.set_gain(model);
    if (refined_) regressors_.set_filter(model);
    stiffness_ = StiffnessDirection<Real, Order>::of(model);
    Model moved = model;
    for (std::size_t i = 0; i < Order; ++i) {
      moved.b[i] += stiffness_.change.b[i];
      moved.a[i] += stiffness_.change.a[i];
    }
    along_ = regressors_.parameters(moved);
    const Vector here = regressors_.parameters(model);
    for (std::size_t i = 0; i < kParameters; ++i) along_[i] -= here[i];
  }

  [[nodiscard]] Vector newest() const noexcept {
    const Vector theta = sums_.solve(prior()).theta;
    return extrapolate_ ? extrapolated(theta, long_sums_.solve(prior()).theta) : theta;
  }
  /// In units of the noise, so that deviations of the parameters are meant.
  [[nodiscard]] Prior prior() const noexcept {
    const Real learned = error_weight_ > Real(0) ? squared_errors_ / error_weight_ : Real(1);
    const Real variance = std::max(noise_variance_ > Real(0) ? noise_variance_ : learned, kLeastVariance);
    Prior scaled = unit_prior_;
    for (std::size_t i = 0; i < kParameters; ++i) {
      scaled.start[i] *= adjusted_[i] ? variance : Real(1);
      scaled.frozen[i] *= adjusted_[i] ? variance : Real(1);
    }
    return scaled;
  }
  static Vector extrapolated(const Vector& newer, const Vector& older) noexcept {
    Vector theta;
    for (std::size_t i = 0; i < kParameters; ++i) theta[i] = Real(2) * newer[i] - older[i];
    return theta;
  }

  /// Variance of the extrapolated estimate over that of the shorter memory: 4 + v_l/v_s - 4 c/v_s with the
  /// weights' v = (1-l)/(1+l), c = (1-s)(1-l)/(1-s l).
  [[nodiscard]] Real variance_growth() const noexcept {
    if (!extrapolate_ || factor_ == Real(1)) return Real(1);
    const Real s = Real(1) - factor_, l = Real(1) - long_factor_;
    const Real both = s * l / (s + l - s * l), ours = s / (Real(1) + factor_);
    return Real(4) + (l / (Real(1) + long_factor_) - Real(4) * both) / ours;
  }

  Loop loop_;
  Regressors regressors_;
  Sums sums_, long_sums_;
  Prior unit_prior_{};
  Vector theta_{}, start_{};
  StiffnessDirection<Real, Order> stiffness_{};
  Vector along_{};  // the same in theta
  StiffnessMotion<Real> motion_{};
  std::array<bool, kParameters> adjusted_{};
  Model start_model_{};
  Real factor_ = Real(1), long_factor_ = Real(1);
  Real noise_variance_ = Real(0), residual_ = Real(0), squared_errors_ = Real(0), error_weight_ = Real(0);
  std::uint64_t samples_ = 0, skipped_ = 0, settling_ = 0;
  std::size_t paused_ = 0, since_refresh_ = 0, unusable_ = 0, estimated_ = 0, refresh_ = 10;
  bool refined_ = true, extrapolate_ = false, excited_ = true, following_ = true;
};

static_assert(DiscreteEstimator<InstrumentalVariables<double, 3>>);
static_assert(DiscreteEstimator<InstrumentalVariables<float, 3>>);

}  // namespace resonid::online
