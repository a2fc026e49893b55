// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <resonid/base/detail/intact.hpp>
#include <resonid/online/models/detail/zoh_two_mass.hpp>

namespace resonid::online {

/// State of the physical filter: three of the plant, then what is estimated.
enum PhysicalState : std::size_t {
  kDrivenVelocity,
  kLoadVelocity,
  kScaledTwist,       ///< twist times a constant, in the unit of a velocity
  kLogDrivenInertia,  ///< ln J1
  kLogLoadInertia,    ///< ln J2
  kLogStiffness,      ///< ln K
  kLogDamping,        ///< ln D
  kTorqueOffset,      ///< T0, constant torque at the input that is not in u
  kStiffnessRate,     ///< d(ln K)/dt, 1/s
  kViscousFriction,   ///< B
  kCoulombFriction,   ///< Tc
  kPhysicalStates
};

/// How the filter's states wander between two samples.
template <class Real>
struct PhysicalNoise {
  Real plant_variance{};       ///< Process noise of each plant state, per sample.
  Real damping_variance{};     ///< Process noise of ln D, per sample.
  Real rate_variance{};        ///< Process noise of the rate, per sample.
  Real rate_memory = Real(1);  ///< What of the rate is left after a sample.
  Real offset_variance{};      ///< Process noise of the torque offset, per sample.
  Real forgetting{};  ///< What the covariance of ln J1 ... ln D and of friction gains per sample, as a part
                      ///< of itself.
};

/// Extended Kalman filter of a two-mass drive's states and parameters together; the engine of
/// PhysicalTracker.
///
///   x+ = A(p) x + b(p) (u + T0 - Tc sign v1)        y = v1, a fraction of a sample earlier where asked for
///   ln K+ = ln K + Ts rate
///
/// A, b and their derivatives are refreshed every few samples and corrected to first order in between. With
/// `freeze()` the derivatives are those along a trajectory of fixed parameters: the filter then solves the
/// linear least-squares problem of one Gauss-Newton step, exactly and in one pass.
///
/// Measurement updates in Joseph's form on a symmetric matrix: it stays positive. Source: Ljung
/// 1979 (extended Kalman filter as a parameter estimator).
template <class Real>
class PhysicalFilter {
 public:
  static constexpr std::size_t kN = kPhysicalStates;
  static constexpr std::size_t kX = ZohTwoMass<Real>::kStates;
  using Vector = std::array<Real, kN>;
  using Matrix = std::array<Vector, kN>;

  struct Setup {
    Real sample_time_s{};
    Real fraction{};  ///< Part of a sample, [0, 1), by which the output was sampled earlier than the state.
    Real twist_scale{};  ///< rad/s
    std::uint32_t refresh_samples = 10;
    PhysicalNoise<Real> noise;
    Vector state{};
    Vector deviation{};  ///< Standard deviations at the start; 0: known, stays as it is.
  };

  PhysicalFilter() = default;
  explicit PhysicalFilter(const Setup& setup) noexcept
      : setup_(setup), state_(setup.state), along_(setup.state) {
    for (std::size_t i = 0; i < kN; ++i) p_[i][i] = setup.deviation[i] * setup.deviation[i];
    if (p_[kViscousFriction][kViscousFriction] == Real(0) &&
        p_[kCoulombFriction][kCoulombFriction] == Real(0))
      estimated_ = setup.noise.rate_variance > Real(0) ? kWithoutFriction : kWithoutRate;
    refresh();
  }

  /// Linearises about the given parameters from here on, instead of about the estimate.
  void freeze(const Vector& about) noexcept {
    along_ = about;
    std::copy_n(state_.begin(), kX, along_.begin());
    frozen_ = true;
    refresh();
  }
  /// Linearises about the estimate again.
  void thaw() noexcept {
    frozen_ = false;
    along_ = state_;
    refresh();
  }

  /// From one sample to the next under the torque u. `adaptive_noise` multiplies the noise of the drift rate;
  /// 0: nothing is to be seen of the stiffness, and it is frozen with what is known of it.
  void predict(Real u, Real extra_torque_variance, Real adaptive_noise) noexcept {
    if (!frozen_ && ++since_refresh_ >= setup_.refresh_samples && stale()) refresh();
    const Real sign = sign_of(state_[kDrivenVelocity]);
    linearise(u, sign);
    Vector next = state_;
    for (std::size_t i = 0; i < kX; ++i) next[i] = normal(deviated(zoh_, gradient_, i, u, sign));
    propagate_covariance(extra_torque_variance);
    p_[kTorqueOffset][kTorqueOffset] += setup_.noise.offset_variance;
    if (adaptive_noise > Real(0) && setup_.noise.forgetting > Real(0)) forget(setup_.noise.forgetting);
    if (frozen_)
      for (std::size_t i = 0; i < kX; ++i) along_[i] = reference_[i];
    if (adaptive_noise > Real(0) && setup_.noise.rate_variance > Real(0)) {
      next[kLogStiffness] += setup_.sample_time_s * state_[kStiffnessRate];
      next[kStiffnessRate] *= setup_.noise.rate_memory;
      drift(adaptive_noise);
    }
    state_ = next;
  }

  /// After many samples without torque and output nothing is known of the plant's states, which resume()
  /// brings back; the parameters have wandered on.
  void lose_plant(Real samples, Real adaptive_noise) noexcept {
    for (std::size_t i = 0; i < kX; ++i) {
      for (std::size_t j = 0; j < kN; ++j) p_[i][j] = p_[j][i] = Real(0);
      p_[i][i] = setup_.deviation[i] * setup_.deviation[i];
    }
    p_[kTorqueOffset][kTorqueOffset] += samples * setup_.noise.offset_variance;
    if (adaptive_noise > Real(0) && setup_.noise.forgetting > Real(0))
      forget(samples * setup_.noise.forgetting);
    if (!(adaptive_noise > Real(0)) || !(setup_.noise.rate_variance > Real(0))) return;
    const Real time = samples * setup_.sample_time_s;
    p_[kLogStiffness][kLogStiffness] += time * time * p_[kStiffnessRate][kStiffnessRate];
    p_[kLogDamping][kLogDamping] += samples * setup_.noise.damping_variance;
  }
  /// Another noise from now on; `rate_deviation`: of the drift rate, which begins or ends with it.
  void set_noise(const PhysicalNoise<Real>& noise, Real rate_deviation) noexcept {
    const bool drifted = setup_.noise.rate_variance > Real(0), drifts = noise.rate_variance > Real(0);
    setup_.noise = noise;
    if (drifted == drifts) return;
    for (std::size_t j = 0; j < kN; ++j) p_[kStiffnessRate][j] = p_[j][kStiffnessRate] = Real(0);
    p_[kStiffnessRate][kStiffnessRate] = drifts ? rate_deviation * rate_deviation : Real(0);
    state_[kStiffnessRate] = Real(0);
    if (estimated_ != kN) estimated_ = drifts ? kWithoutFriction : kWithoutRate;
  }
  /// What is known at one sample.
  struct Known {
    Vector state{};
    Matrix covariance{};
  };
  [[nodiscard]] Known known() const noexcept { return {state_, p_}; }
  /// The load has jumped since `before`: of the parameters that holds which was known then, of the plant's
  /// states and the torque offset nothing but what is measured.
  void load_jumped(const Known& before, Real velocity) noexcept {
    for (std::size_t i = kX; i < kN; ++i) state_[i] = before.state[i];
    p_ = before.covariance;
    forget_plant(velocity);
  }
  /// From here on it is another machine: but for friction, no more is known of it than of the first one at
  /// the start.
  void machine_changed(Real velocity) noexcept {
    for (std::size_t i = kLogDrivenInertia; i <= kLogDamping; ++i) {
      state_[i] = setup_.state[i];
      forget(i, setup_.deviation[i]);
    }
    forget_plant(velocity);
  }
  [[nodiscard]] bool frozen() const noexcept { return frozen_; }
  /// As at the start: the machine turns at what is measured, without twist.
  void resume(Real velocity) noexcept {
    state_[kDrivenVelocity] = state_[kLoadVelocity] = velocity;
    state_[kScaledTwist] = Real(0);
  }

  /// Takes in an output, unless its innovation is more than `most_deviations` times what is expected; false
  /// then. With a fraction it belongs between this state and the next, which u leads to.
  bool update(Real y, Real u, Real variance, Real most_deviations) noexcept {
    Vector row{};
    Real expected;
    if (setup_.fraction > Real(0)) {
      const Real sign = sign_of(state_[kDrivenVelocity]);
      linearise(u, sign);
      const auto g = gradient_of(partial_, u, sign);
      for (std::size_t j = 0; j < kX; ++j) row[j] = partial_.ab[0][j];
      for (std::size_t j = 0; j < kGradient; ++j) row[kX + j] = g[0][j];
      expected = deviated(partial_, g, 0, u, sign);
    } else {
      row[kDrivenVelocity] = Real(1);
      expected = state_[kDrivenVelocity];
    }
    return correct(row, y - expected, variance, most_deviations);
  }

  [[nodiscard]] const Vector& state() const noexcept { return state_; }
  [[nodiscard]] const Matrix& covariance() const noexcept { return p_; }
  [[nodiscard]] const Vector& linearised_about() const noexcept { return along_; }
  [[nodiscard]] Real innovation() const noexcept { return innovation_; }
  [[nodiscard]] Real innovation_variance() const noexcept { return innovation_variance_; }
  /// Change of the driven velocity within the last sample per relative change of the stiffness.
  [[nodiscard]] Real stiffness_effect() const noexcept { return gradient_[0][kLogStiffness - kX]; }
  /// Share of what is known of the stiffness that came with the newest output.
  [[nodiscard]] Real stiffness_news() const noexcept { return stiffness_news_; }
  /// Correction of ln K per innovation.
  [[nodiscard]] Real stiffness_gain() const noexcept { return stiffness_gain_; }
  [[nodiscard]] bool finite() const noexcept {
    for (std::size_t i = 0; i < kN; ++i)
      if (!std::isfinite(state_[i]) || !std::isfinite(p_[i][i])) return false;
    return true;
  }

  /// Keeps a variance below a limit, correlations kept.
  void limit_variance(std::size_t i, Real limit) noexcept {
    if (!(p_[i][i] > limit)) return;
    const Real scale = std::sqrt(limit / p_[i][i]);
    for (std::size_t j = 0; j < kN; ++j) {
      p_[i][j] *= scale;
      p_[j][i] = p_[i][j];
    }
    p_[i][i] = limit;
  }

  /// For a state of unknown origin (base/detail/intact.hpp).
  [[nodiscard]] bool intact() const noexcept { return estimated_ <= kN && resonid::intact(frozen_); }

 private:
  static constexpr std::size_t kGradient = kN - kX;  // the rate's part is 0
  static constexpr std::size_t kLogs = 4;
  static constexpr std::size_t kWithoutRate = kStiffnessRate;
  static constexpr std::size_t kWithoutFriction = kViscousFriction;
  using Gradient = std::array<std::array<Real, kGradient>, kX>;

  /// What dies away would end in subnormal numbers, which take twenty times as long.
  static Real normal(Real v) noexcept {
    return std::abs(v) < (sizeof(Real) > 4 ? Real(1e-30) : Real(1e-20)) ? Real(0) : v;
  }
  static Real sign_of(Real v) noexcept { return v > Real(0) ? Real(1) : v < Real(0) ? Real(-1) : Real(0); }

  /// Whether the first-order correction between discretisations is no longer exact enough.
  [[nodiscard]] bool stale() const noexcept {
    for (std::size_t i = kX; i < kX + kLogs; ++i)
      if (std::abs(state_[i] - along_[i]) > Real(1e-3)) return true;
    return std::abs(state_[kViscousFriction] - along_[kViscousFriction]) >
           Real(1e-3) * std::exp(along_[kLogDamping]);
  }
  void refresh() noexcept {
    const Vector& about = frozen_ ? along_ : state_;
    const TwoMassPoint<Real> point{std::exp(about[kLogDrivenInertia]), std::exp(about[kLogLoadInertia]),
                                   std::exp(about[kLogStiffness]), std::exp(about[kLogDamping]),
                                   about[kViscousFriction]};
    const std::size_t derivatives = estimated_ == kN ? kLogs + 1 : kLogs;
    zoh_ = ZohTwoMass<Real>::over(point, setup_.twist_scale, setup_.sample_time_s, derivatives);
    if (setup_.fraction > Real(0))
      partial_ = ZohTwoMass<Real>::over(point, setup_.twist_scale,
                                        (Real(1) - setup_.fraction) * setup_.sample_time_s, derivatives);
    for (std::size_t j = kX; j < kX + kLogs; ++j) along_[j] = about[j];
    along_[kViscousFriction] = about[kViscousFriction];
    since_refresh_ = 0;
  }

  /// The trajectory that derivatives are taken along, and its next plant state.
  void linearise(Real u, Real sign) noexcept {
    if (!frozen_) {
      for (std::size_t i = 0; i < kX; ++i) along_[i] = state_[i];
      along_[kCoulombFriction] = state_[kCoulombFriction];
      along_[kTorqueOffset] = state_[kTorqueOffset];
    }
    gradient_ = gradient_of(zoh_, u, sign);
    const Real torque = torque_along(u, sign);
    for (std::size_t i = 0; i < kX; ++i) reference_[i] = step_of(zoh_.ab[i], torque);
  }
  [[nodiscard]] Real torque_along(Real u, Real sign) const noexcept {
    return u + along_[kTorqueOffset] - along_[kCoulombFriction] * sign;
  }
  [[nodiscard]] Real step_of(const std::array<Real, kX + 1>& row, Real torque) const noexcept {
    return row[0] * along_[0] + row[1] * along_[1] + row[2] * along_[2] + row[3] * torque;
  }
  [[nodiscard]] Gradient gradient_of(const ZohTwoMass<Real>& zoh, Real u, Real sign) const noexcept {
    Gradient g;
    const Real torque = torque_along(u, sign);
    for (std::size_t i = 0; i < kX; ++i) {
      for (std::size_t j = 0; j < kLogs; ++j) g[i][j] = step_of(zoh.by_log[j][i], torque);
      g[i][kStiffnessRate - kX] = Real(0);
      g[i][kViscousFriction - kX] = step_of(zoh.by_log[kLogs][i], torque);
      g[i][kCoulombFriction - kX] = -sign * zoh.ab[i][kX];
      g[i][kTorqueOffset - kX] = zoh.ab[i][kX];
    }
    return g;
  }
  /// Row i of the step, to first order about the trajectory.
  [[nodiscard]] Real deviated(const ZohTwoMass<Real>& zoh, const Gradient& g, std::size_t i, Real u,
                              Real sign) const noexcept {
    Real value = step_of(zoh.ab[i], torque_along(u, sign));
    for (std::size_t j = 0; j < kX; ++j) value += zoh.ab[i][j] * (state_[j] - along_[j]);
    for (std::size_t j = 0; j < kGradient; ++j) value += g[i][j] * (state_[kX + j] - along_[kX + j]);
    return value;
  }

  /// P = F P F^T + Q with F = [A G; 0 T]: only the plant's rows move here. `N`: states that are estimated,
  /// the others' covariance is 0.
  template <std::size_t N>
  void propagate(Real extra_torque_variance) noexcept {
    std::array<Vector, kX> moved;  // [A G] P
    for (std::size_t i = 0; i < kX; ++i) {
      for (std::size_t j = 0; j < N; ++j)
        moved[i][j] = zoh_.ab[i][0] * p_[0][j] + zoh_.ab[i][1] * p_[1][j] + zoh_.ab[i][2] * p_[2][j];
      for (std::size_t l = kX; l < N; ++l)
        for (std::size_t j = 0; j < N; ++j) moved[i][j] += gradient_[i][l - kX] * p_[l][j];
    }
    for (std::size_t i = 0; i < kX; ++i) {
      for (std::size_t j = i; j < kX; ++j) {
        Real sum = moved[i][0] * zoh_.ab[j][0] + moved[i][1] * zoh_.ab[j][1] + moved[i][2] * zoh_.ab[j][2];
        for (std::size_t l = kX; l < N; ++l) sum += moved[i][l] * gradient_[j][l - kX];
        p_[i][j] = p_[j][i] = sum + zoh_.ab[i][kX] * zoh_.ab[j][kX] * extra_torque_variance;
      }
      p_[i][i] += setup_.noise.plant_variance;
      for (std::size_t j = kX; j < N; ++j) p_[j][i] = p_[i][j] = normal(moved[i][j]);
    }
  }
  void propagate_covariance(Real extra_torque_variance) noexcept {
    if (estimated_ == kWithoutRate)
      propagate<kWithoutRate>(extra_torque_variance);
    else if (estimated_ == kWithoutFriction)
      propagate<kWithoutFriction>(extra_torque_variance);
    else
      propagate<kN>(extra_torque_variance);
  }

  /// A state of which only the deviation is known.
  void forget(std::size_t i, Real deviation) noexcept {
    for (std::size_t j = 0; j < kN; ++j) p_[i][j] = p_[j][i] = Real(0);
    p_[i][i] = deviation * deviation;
  }
  /// Nothing is known of the plant's states and the torque offset but what is measured.
  void forget_plant(Real velocity) noexcept {
    const Real offset = setup_.deviation[kTorqueOffset];
    const Real twist = offset * setup_.twist_scale * std::exp(-state_[kLogStiffness]);  // by that offset
    for (std::size_t i = 0; i < kX; ++i) forget(i, std::max(setup_.deviation[i], twist));
    forget(kTorqueOffset, offset);
    state_[kDrivenVelocity] = state_[kLoadVelocity] = velocity;
  }

  /// Friction is forgotten kFrictionMemories times as slowly: a motion that goes on says little of it, and
  /// all margins hang on it, which would wander with it for minutes.
  void forget(Real part) noexcept {
    constexpr Real kFrictionMemories = Real(300);
    for (std::size_t i = kX; i < kX + kLogs; ++i)
      for (std::size_t j = kX; j < kX + kLogs; ++j) p_[i][j] += part * p_[i][j];
    for (const std::size_t i : {kViscousFriction, kCoulombFriction})
      p_[i][i] += part / kFrictionMemories * p_[i][i];
  }

  void drift(Real adaptive_noise) noexcept {
    const Real ts = setup_.sample_time_s;
    const Real keep = setup_.noise.rate_memory;
    for (std::size_t j = 0; j < kN; ++j) p_[kLogStiffness][j] += ts * p_[kStiffnessRate][j];
    p_[kLogStiffness][kLogStiffness] += ts * p_[kLogStiffness][kStiffnessRate];
    for (std::size_t j = 0; j < kN; ++j) p_[kStiffnessRate][j] *= keep;
    p_[kStiffnessRate][kStiffnessRate] *= keep;
    p_[kStiffnessRate][kLogStiffness] = p_[kLogStiffness][kStiffnessRate] * keep;
    for (std::size_t j = 0; j < kN; ++j) {
      p_[j][kLogStiffness] = p_[kLogStiffness][j];
      p_[j][kStiffnessRate] = p_[kStiffnessRate][j];
    }
    p_[kLogStiffness][kStiffnessRate] = p_[kStiffnessRate][kLogStiffness];
    p_[kLogDamping][kLogDamping] += setup_.noise.damping_variance;
    p_[kStiffnessRate][kStiffnessRate] += adaptive_noise * setup_.noise.rate_variance;
  }

  bool correct(const Vector& row, Real innovation, Real variance, Real most) noexcept {
    if (estimated_ == kWithoutRate) return correct<kWithoutRate>(row, innovation, variance, most);
    if (estimated_ == kWithoutFriction) return correct<kWithoutFriction>(row, innovation, variance, most);
    return correct<kN>(row, innovation, variance, most);
  }
  template <std::size_t N>
  bool correct(const Vector& row, Real innovation, Real variance, Real most) noexcept {
    Vector ph;
    times<N>(row, ph);
    Real s = variance;
    for (std::size_t j = 0; j < N; ++j) s += row[j] * ph[j];
    innovation_ = innovation;
    innovation_variance_ = s;
    if (!(s > Real(0)) || !std::isfinite(s) || !(std::abs(innovation) <= most * std::sqrt(s))) return false;
    Vector gain;
    for (std::size_t i = 0; i < N; ++i) gain[i] = ph[i] / s;
    const Real before = p_[kLogStiffness][kLogStiffness];
    // Joseph: (I - K h) P (I - K h)^T + K r K^T, the upper half, mirrored
    for (std::size_t i = 0; i < N; ++i)
      for (std::size_t j = 0; j < N; ++j) p_[i][j] -= gain[i] * ph[j];
    times<N>(row, ph);
    for (std::size_t i = 0; i < N; ++i) ph[i] -= variance * gain[i];
    for (std::size_t i = 0; i < N; ++i)
      for (std::size_t j = i; j < N; ++j) p_[i][j] = p_[j][i] = p_[i][j] - ph[i] * gain[j];
    stiffness_gain_ = gain[kLogStiffness];
    stiffness_news_ = before > Real(0) ? Real(1) - p_[kLogStiffness][kLogStiffness] / before : Real(0);
    for (std::size_t i = 0; i < N; ++i) state_[i] += gain[i] * innovation;
    return true;
  }
  /// P h^T
  template <std::size_t N>
  void times(const Vector& row, Vector& product) const noexcept {
    for (std::size_t i = 0; i < N; ++i) {
      product[i] = p_[i][kDrivenVelocity] * row[kDrivenVelocity];
      if (!(setup_.fraction > Real(0))) continue;
      for (std::size_t j = 1; j < N; ++j) product[i] += p_[i][j] * row[j];
    }
  }

  Setup setup_{};
  Vector state_{};
  Vector along_{};  // what derivatives are taken at: plant states of the trajectory, parameters of the model
  Matrix p_{};
  ZohTwoMass<Real> zoh_{};
  ZohTwoMass<Real> partial_{};  // over the part of a sample until the output was sampled
  Gradient gradient_{};
  std::array<Real, kX> reference_{};
  Real innovation_{};
  Real innovation_variance_{};
  Real stiffness_gain_{};
  Real stiffness_news_{};
  std::uint32_t since_refresh_ = 0;
  std::size_t estimated_ = kN;
  bool frozen_ = false;
};

}  // namespace resonid::online
