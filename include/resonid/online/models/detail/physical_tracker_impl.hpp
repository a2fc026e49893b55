// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <resonid/online/models/physical_tracker.hpp>

namespace resonid::online {

template <class Real, std::size_t ReplaySamples>
PhysicalTracker<Real, ReplaySamples>::PhysicalTracker(const PhysicalTrackerConfig& c) noexcept : config_(c) {
  const double ts = 1.0 / c.sample_rate_hz;
  const double delay = c.delay_s * c.sample_rate_hz;
  const double whole = std::floor(delay + 1e-9);
  const double fraction = std::max(0.0, delay - whole);
  const bool between = fraction > 1e-9;
  delay_samples_ = static_cast<std::uint64_t>(whole) + (between ? 1 : 0);
  setup_.sample_time_s = static_cast<Real>(ts);
  setup_.fraction = static_cast<Real>(between ? fraction : 0.0);
  setup_.twist_scale = static_cast<Real>(
      std::sqrt(c.stiffness.value * (1.0 / c.driven_inertia.value + 1.0 / c.load_inertia.value)));
  setup_.refresh_samples = c.refresh_samples;
  const double drift = c.stiffness_drift_per_s;
  set_drift_noise(drift);
  auto& noise = setup_.noise;
  noise.plant_variance = static_cast<Real>(c.plant_noise_variance);
  noise.offset_variance =
      c.torque_offset_std_nm > 0.0
          ? static_cast<Real>(c.torque_offset_drift_nm_rt_s * c.torque_offset_drift_nm_rt_s * ts)
          : Real(0);
  noise.forgetting = c.memory_s > 0.0 ? static_cast<Real>(ts / c.memory_s) : Real(0);
  const auto set = [this](PhysicalParameter p, double value, double deviation) {
    setup_.state[state_of(p)] = static_cast<Real>(value);
    setup_.deviation[state_of(p)] = static_cast<Real>(deviation);
  };
  using P = PhysicalParameter;
  set(P::driven_inertia, std::log(c.driven_inertia.value), c.driven_inertia.relative_std);
  set(P::load_inertia, std::log(c.load_inertia.value), c.load_inertia.relative_std);
  set(P::stiffness, std::log(c.stiffness.value), c.stiffness.relative_std);
  set(P::damping, std::log(c.damping.value), c.damping.relative_std);
  set(P::viscous_friction, c.viscous_friction_nms_rad.value, c.viscous_friction_nms_rad.std);
  set(P::coulomb_friction, c.coulomb_friction_nm.value, c.coulomb_friction_nm.std);
  set(P::torque_offset, 0.0, c.torque_offset_std_nm);
  set(P::stiffness_rate, 0.0, drift);
  for (std::size_t i = 0; i < ZohTwoMass<Real>::kStates; ++i)
    setup_.deviation[i] = static_cast<Real>(c.start_velocity_std);
  effect_gain_ = 1.0 - std::exp(-ts * static_cast<double>(setup_.twist_scale) / (kTwoPi * kEffectPeriods));
  reset();
}

template <class Real, std::size_t ReplaySamples>
void PhysicalTracker<Real, ReplaySamples>::reset() noexcept {
  const double memory = config_.noise_memory_s * config_.sample_rate_hz;
  run_ = Run{};
  run_.filter = PhysicalFilter<Real>(setup_);
  run_.noise = NoiseEstimate<Real>(static_cast<Real>(config_.noise_rms * config_.noise_rms),
                                   static_cast<Real>(memory > 1.0 ? 1.0 / memory : 0.0));
  if (config_.stiffness_drift_per_s > 0.0) run_.trend = trend_watch();
  run_.watches_load = config_.memory_s > 0.0 && !(config_.stiffness_drift_per_s > 0.0);
  candidate_ = run_;
  linearised_about_ = setup_.state;
  inputs_.fill(Real(0));
  last_input_ = input_power_ = residual_ = Real(0);
  effect_mean_ = effect_power_ = stiffness_age_ = 0.0;
  excited_ = started_ = resuming_ = replaying_ = exploring_ = memory_full_ = false;
  samples_ = skipped_ = replays_ = 0;
  remembered_ = next_ = 0;
  next_replay_ = kFirstReplay;
  attempts_ = polished_ = 0;
}

template <class Real, std::size_t ReplaySamples>
TrendWatch PhysicalTracker<Real, ReplaySamples>::trend_watch() const noexcept {
  return TrendWatch(
      std::exp(-static_cast<double>(setup_.twist_scale) / (kTwoPi * kTrendPeriods * config_.sample_rate_hz)));
}

template <class Real, std::size_t ReplaySamples>
void PhysicalTracker<Real, ReplaySamples>::set_drift_noise(double per_s) noexcept {
  const double ts = 1.0 / config_.sample_rate_hz;
  setup_.noise.rate_variance = static_cast<Real>(2.0 * per_s * per_s * per_s * ts);
  setup_.noise.rate_memory = static_cast<Real>(std::exp(-per_s * ts));
  const double damping = std::min(config_.damping_drift_per_rt_s, kDampingShare * per_s);
  setup_.noise.damping_variance = static_cast<Real>(damping * damping * ts);
}

template <class Real, std::size_t ReplaySamples>
void PhysicalTracker<Real, ReplaySamples>::set_stiffness_drift(double per_s) noexcept {
  if (!(per_s >= 0.0) || !std::isfinite(per_s)) return;
  const bool drifted = config_.stiffness_drift_per_s > 0.0;
  config_.stiffness_drift_per_s = per_s;
  set_drift_noise(per_s);
  setup_.deviation[kStiffnessRate] = static_cast<Real>(per_s);
  run_.filter.set_noise(setup_.noise, static_cast<Real>(per_s));
  if (drifted == (per_s > 0.0)) return;
  run_.trend = per_s > 0.0 ? trend_watch() : TrendWatch();
  memory_full_ = true;  // the start of the record belongs to the other law
  replaying_ = exploring_ = false;
}

template <class Real, std::size_t ReplaySamples>
void PhysicalTracker<Real, ReplaySamples>::step(Scalar, Scalar u, Scalar y) noexcept {
  const bool known = std::isfinite(u);
  if (!known || !std::isfinite(y)) ++skipped_;
  if (known) {
    last_input_ = u;
    input_power_ += Real(0.01) * (u * u - input_power_);
  }
  const std::uint64_t k = samples_++;
  inputs_[static_cast<std::size_t>(k % kDelayLine)] = last_input_;
  residual_ = Real(0);
  if (k < delay_samples_) return;
  const Scalar next_u = inputs_[static_cast<std::size_t>((k - delay_samples_) % kDelayLine)];
  if (!started_) {
    if (std::isfinite(y)) start(y);
    if (started_) run_.update(y, next_u);
    if (started_) remember(Real(0), next_u, y);
    return;
  }
  const Scalar previous_u = inputs_[static_cast<std::size_t>((k - delay_samples_ - 1) % kDelayLine)];
  if (resuming_ && std::isfinite(y)) {
    run_.filter.resume(y);
    resuming_ = false;
  }
  advance(run_, previous_u, next_u, y, known);
  if (std::isfinite(y)) residual_ = run_.filter.innovation();
  watch_excitation();
  stiffness_age_ = (1.0 - static_cast<double>(run_.filter.stiffness_news())) * (stiffness_age_ + 1.0);
  remember(previous_u, next_u, y);
  replay();
}

template <class Real, std::size_t ReplaySamples>
void PhysicalTracker<Real, ReplaySamples>::miss(std::uint64_t count) noexcept {
  const std::uint64_t rest = step_missed(*this, count);
  if (rest == 0) return;
  samples_ += rest;
  skipped_ += rest;
  memory_full_ = true;  // what is remembered must have no gap
  replaying_ = exploring_ = false;
  if (!started_) return;
  run_.filter.lose_plant(static_cast<Real>(rest),
                         excited_ ? static_cast<Real>(run_.trend.adaptive_noise()) : Real(0));
  resuming_ = true;
  limit_variances(run_);
  stiffness_age_ += static_cast<double>(rest);
}

/// The machine turns at what is measured first, without twist.
template <class Real, std::size_t ReplaySamples>
void PhysicalTracker<Real, ReplaySamples>::start(Scalar y) noexcept {
  auto setup = setup_;
  setup.state[kDrivenVelocity] = setup.state[kLoadVelocity] = y;
  run_.filter = PhysicalFilter<Real>(setup);
  candidate_ = run_;
  started_ = true;
}

template <class Real, std::size_t ReplaySamples>
void PhysicalTracker<Real, ReplaySamples>::advance(Run& run, Scalar previous_u, Scalar u, Scalar y,
                                                   bool u_known) noexcept {
  run.filter.predict(previous_u, u_known ? Real(0) : input_power_,
                     excited_ ? static_cast<Real>(run.trend.adaptive_noise()) : Real(0));
  if (std::isfinite(y)) run.update(y, u);
  limit_variances(run);
}

template <class Real, std::size_t ReplaySamples>
void PhysicalTracker<Real, ReplaySamples>::limit_variances(Run& run) noexcept {
  const auto limit = [&](std::size_t i, Real least) {
    run.filter.limit_variance(i, std::max(setup_.deviation[i] * setup_.deviation[i], least));
  };
  if (changes()) {
    limit(kLogStiffness, Real(0.25));
    limit(kLogDamping, Real(0.25));
  }
  if (config_.memory_s > 0.0)
    for (const std::size_t i : {kLogDrivenInertia, kLogLoadInertia, kViscousFriction, kCoulombFriction})
      limit(i, Real(0));
  if (config_.torque_offset_std_nm > 0.0)
    run.filter.limit_variance(kTorqueOffset,
                              setup_.deviation[kTorqueOffset] * setup_.deviation[kTorqueOffset]);
}

/// How much the stiffness shows in a sample: rms of the driven velocity's change per relative change of K,
/// without its mean (a constant twist says nothing), against the noise.
template <class Real, std::size_t ReplaySamples>
void PhysicalTracker<Real, ReplaySamples>::watch_excitation() noexcept {
  const double effect = static_cast<double>(run_.filter.stiffness_effect());
  effect_mean_ += effect_gain_ * (effect - effect_mean_);
  effect_power_ += effect_gain_ * ((effect - effect_mean_) * (effect - effect_mean_) - effect_power_);
  if (std::abs(effect_mean_) < 1e-30) effect_mean_ = 0.0;
  excited_ = effect_power_ > kLeastEffect * kLeastEffect * static_cast<double>(run_.noise.variance());
}

template <class Real, std::size_t ReplaySamples>
void PhysicalTracker<Real, ReplaySamples>::remember(Scalar previous_u, Scalar u, Scalar y) noexcept {
  if constexpr (kReplays) {
    if (memory_full_ || config_.replay_speed == 0 || changes()) return;
    if (remembered_ == ReplaySamples) {
      memory_full_ = true;
      replaying_ = false;
      return;
    }
    memory_[remembered_++] = {static_cast<float>(previous_u), static_cast<float>(u), static_cast<float>(y)};
  }
}

template <class Real, std::size_t ReplaySamples>
void PhysicalTracker<Real, ReplaySamples>::replay() noexcept {
  if constexpr (kReplays) {
    if (memory_full_ || remembered_ == 0) return;
    if (!replaying_) {
      if (remembered_ < next_replay_) return;
      begin_replay();
    }
    for (std::uint32_t i = 0; i < config_.replay_speed && next_ < remembered_; ++i) {
      const Remembered& old = memory_[next_++];
      advance(candidate_, static_cast<Real>(old.previous_u), static_cast<Real>(old.u),
              static_cast<Real>(old.y), true);
    }
    if (next_ < remembered_) return;
    replaying_ = false;
    next_replay_ = remembered_ + kBetweenReplays;
    candidate_.filter.thaw();
    if (!candidate_.filter.finite()) {
      exploring_ = false;
    } else if (exploring_) {
      return;  // to be polished before it is judged
    } else if (candidate_.misfit < run_.misfit) {
      run_ = candidate_;
      linearised_about_ = candidate_about_;
      ++replays_;
    }
  }
}

/// Either a Gauss-Newton step about the estimate, while it has moved far from where it was linearised; or, in
/// case it has settled on a wrong one, the filter again from another stiffness and with more noise assumed
/// than there is, which keeps it from trusting its first steps, and then a Gauss-Newton step about what that
/// came to.
template <class Real, std::size_t ReplaySamples>
void PhysicalTracker<Real, ReplaySamples>::begin_replay() noexcept {
  auto setup = setup_;
  setup.state[kDrivenVelocity] = setup.state[kLoadVelocity] = static_cast<Real>(memory_[0].y);
  const auto explored = candidate_.filter.state();
  candidate_ = Run{};
  candidate_.noise = run_.noise;
  const bool polish = exploring_ || (polished_ < kPolishInRow && moved_far());
  if (polish) {
    candidate_about_ = exploring_ ? explored : run_.filter.state();
    if (exploring_) candidate_.noise.forget();
    polished_ = exploring_ ? 0 : polished_ + 1;
    exploring_ = false;
  } else {
    setup.state[kLogStiffness] +=
        static_cast<Real>(std::log(kOtherStarts[attempts_++ % kOtherStarts.size()]));
    candidate_.noise_inflation = Real(kNoiseInflation);
    exploring_ = true;
  }
  candidate_.filter = PhysicalFilter<Real>(setup);
  if (polish) candidate_.filter.freeze(candidate_about_);
  candidate_.update(static_cast<Real>(memory_[0].y), static_cast<Real>(memory_[0].u));
  next_ = 1;
  replaying_ = true;
}

/// The error of linearising grows with the square of the distance; it should stay well below the estimate's
/// own.
template <class Real, std::size_t ReplaySamples>
bool PhysicalTracker<Real, ReplaySamples>::moved_far() const noexcept {
  const auto& x = run_.filter.state();
  const auto& p = run_.filter.covariance();
  for (std::size_t i = kLogDrivenInertia; i <= kLogDamping; ++i) {
    const Real moved = x[i] - linearised_about_[i];
    if (moved * moved > Real(kLinearityShare) * std::sqrt(p[i][i])) return true;
  }
  return false;
}

/// ln K - a rate has the variance P_KK - 2 a P_Kr + a^2 P_rr, least at a = P_Kr/P_rr: corrections of the
/// newest rate move K then and before about the same way, so that some time ago, less is unknown.
template <class Real, std::size_t ReplaySamples>
double PhysicalTracker<Real, ReplaySamples>::best_known_age_s() const noexcept {
  const auto& p = run_.filter.covariance();
  const double rate = static_cast<double>(p[kStiffnessRate][kStiffnessRate]);
  if (!(rate > 0.0)) return 0.0;
  return std::clamp(static_cast<double>(p[kLogStiffness][kStiffnessRate]) / rate, 0.0, kMostAge_s);
}

/// Age of what is told, less the age of the newest output's state.
template <class Real, std::size_t ReplaySamples>
double PhysicalTracker<Real, ReplaySamples>::told_age_s() const noexcept {
  if (!(config_.stiffness_drift_per_s > 0.0)) return 0.0;
  return config_.at_best_known_time ? best_known_age_s() : -config_.delay_s;
}

template <class Real, std::size_t ReplaySamples>
double PhysicalTracker<Real, ReplaySamples>::value(PhysicalParameter p) const noexcept {
  const auto& x = run_.filter.state();
  double value = static_cast<double>(x[state_of(p)]);
  if (p == PhysicalParameter::stiffness)
    value -= static_cast<double>(x[kStiffnessRate]) * told_age_s();  // the state is as old as the output
  return p <= PhysicalParameter::damping ? std::exp(value) : value;
}

template <class Real, std::size_t ReplaySamples>
auto PhysicalTracker<Real, ReplaySamples>::log_covariance() const noexcept -> Covariance {
  Covariance c;
  const auto& p = run_.filter.covariance();
  for (std::size_t i = 0; i < kParameters; ++i)
    for (std::size_t j = 0; j < kParameters; ++j)
      c(static_cast<int>(i), static_cast<int>(j)) =
          static_cast<double>(p[ZohTwoMass<Real>::kStates + i][ZohTwoMass<Real>::kStates + j]);
  if (!config_.at_best_known_time) return c;
  const double age = told_age_s();  // ln K - age rate
  constexpr int k = index(PhysicalParameter::stiffness), rate = index(PhysicalParameter::stiffness_rate);
  c.row(k) -= age * c.row(rate);
  c.col(k) -= age * c.col(rate);
  return c;
}

template <class Real, std::size_t ReplaySamples>
auto PhysicalTracker<Real, ReplaySamples>::covariance() const noexcept -> Covariance {
  Covariance c = log_covariance();
  for (int i = 0; i <= index(PhysicalParameter::damping); ++i) {
    const double scale = value(static_cast<PhysicalParameter>(i));
    c.row(i) *= scale;
    c.col(i) *= scale;
  }
  return c;
}

template <class Real, std::size_t ReplaySamples>
double PhysicalTracker<Real, ReplaySamples>::resonance_hz() const noexcept {
  using P = PhysicalParameter;
  return std::sqrt(value(P::stiffness) * (1.0 / value(P::driven_inertia) + 1.0 / value(P::load_inertia))) /
         kTwoPi;
}

template <class Real, std::size_t ReplaySamples>
double PhysicalTracker<Real, ReplaySamples>::antiresonance_hz() const noexcept {
  using P = PhysicalParameter;
  return std::sqrt(value(P::stiffness) / value(P::load_inertia)) / kTwoPi;
}

/// ln f = (ln K - (1 - w) ln J1 - w ln J2)/2 to first order, w: what J2 contributes to 1/J1 + 1/J2.
template <class Real, std::size_t ReplaySamples>
double PhysicalTracker<Real, ReplaySamples>::frequency_std(double w) const noexcept {
  const Covariance c = log_covariance();
  Eigen::Matrix<double, 3, 1> row(-(1.0 - w), -w, 1.0);
  return 0.5 * std::sqrt(std::max(0.0, row.dot(c.template topLeftCorner<3, 3>() * row)));
}

template <class Real, std::size_t ReplaySamples>
double PhysicalTracker<Real, ReplaySamples>::resonance_std_hz() const noexcept {
  const double j1 = value(PhysicalParameter::driven_inertia);
  const double j2 = value(PhysicalParameter::load_inertia);
  return resonance_hz() * frequency_std(j1 / (j1 + j2));
}

template <class Real, std::size_t ReplaySamples>
double PhysicalTracker<Real, ReplaySamples>::antiresonance_std_hz() const noexcept {
  return antiresonance_hz() * frequency_std(1.0);
}

template <class Real, std::size_t ReplaySamples>
bool PhysicalTracker<Real, ReplaySamples>::converged() const noexcept {
  const auto& p = run_.filter.covariance();
  for (std::size_t i = kLogDrivenInertia; i <= kLogDamping; ++i)
    if (Real(4) * p[i][i] > setup_.deviation[i] * setup_.deviation[i]) return false;
  return started_;
}

template <class Real, std::size_t ReplaySamples>
bool PhysicalTracker<Real, ReplaySamples>::plausible() const noexcept {
  using P = PhysicalParameter;
  if (!run_.filter.finite()) return false;
  for (const P friction : {P::viscous_friction, P::coulomb_friction})
    if (estimated(friction) && value(friction) < -2.0 * standard_deviation(friction)) return false;
  const double omega = kTwoPi * resonance_hz();
  const double compliance = 1.0 / value(P::driven_inertia) + 1.0 / value(P::load_inertia);
  return resonance_hz() < 0.5 * config_.sample_rate_hz && 0.5 * value(P::damping) * compliance < omega;
}

}  // namespace resonid::online
