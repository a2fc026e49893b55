// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <resonid/base/constants.hpp>
#include <resonid/base/detail/intact.hpp>
#include <resonid/base/expected.hpp>
#include <resonid/online/models/detail/missed_samples.hpp>
#include <resonid/online/models/detail/physical_config.hpp>
#include <resonid/online/models/detail/physical_filter.hpp>
#include <resonid/online/models/detail/physical_run.hpp>
#include <type_traits>

namespace resonid::online {

/// Parameters of the physical tracker, in this order everywhere; PhysicalState less the plant's three states.
enum class PhysicalParameter : std::size_t {
  driven_inertia,
  load_inertia,
  stiffness,
  damping,
  torque_offset,
  stiffness_rate,
  viscous_friction,
  coulomb_friction
};

/// J1, J2, K, D of a two-mass drive sample by sample, directly: extended Kalman filter of the plant's states
/// and the parameters' logarithms.
///
///   J1 v1' = u + T0 - Tc sign v1 - B v1 - K w - D (v1 - v2)     J2 v2' = K w + D (v1 - v2)     w' = v1 - v2
///   y(t) = v1(t - delay) + white noise
///
/// In closed loop with white output noise the measured u is exact, whatever the controller: the filter needs
/// u, y and the known delay only, and is not biased by the feedback. Hardly any noise on the plant's states
/// makes it a recursive maximum-likelihood estimator. Any parameter can be fixed (standard deviation 0). A
/// machine that stays: as long as the record's start fits in the replay buffer, it is gone over again, beside
/// the new samples, whenever the estimate has moved far from where it was linearised. A machine that moves:
/// `stiffness_drift_per_s` gives K a rate of change of its own, and there is no lag; or with
/// `at_best_known_time` the one at which K is known best.
///
/// Limits: two masses, white output noise, delay and sample rate known. From a start several times off it can
/// settle wrongly: `consistent()` tells. Source: Ljung 1979; docs/methods/physical_tracker.md.
template <class Real, std::size_t ReplaySamples = 16384>
class PhysicalTracker {
 public:
  using Scalar = Real;
  static constexpr std::size_t kParameters = kPhysicalStates - ZohTwoMass<Real>::kStates;
  using Covariance = Eigen::Matrix<double, static_cast<int>(kParameters), static_cast<int>(kParameters)>;

  static expected<PhysicalTracker, Error> create(const PhysicalTrackerConfig& config) {
    if (const auto fault = check(config)) return unexpected<Error>(*fault);
    return PhysicalTracker(config);
  }

  void step(Scalar excitation, Scalar u, Scalar y) noexcept;
  /// `count` samples were lost: as so many steps with samples that are not finite. After more than
  /// kMostMissedSteps the machine's motion is unknown, as at the start, the parameters' covariance has grown
  /// by the drift over all of them, and the record's start is no longer gone over again.
  void miss(std::uint64_t count) noexcept;
  void reset() noexcept;
  /// Another `stiffness_drift_per_s` from now on, >= 0 and finite: what is known so far of how fast the
  /// machine moves.
  void set_stiffness_drift(double per_s) noexcept;

  /// Value in SI units: kgm2, kgm2, Nm/rad, Nms/rad, Nm, 1/s, Nms/rad, Nm.
  [[nodiscard]] double value(PhysicalParameter p) const noexcept;
  [[nodiscard]] double standard_deviation(PhysicalParameter p) const noexcept {
    return std::sqrt(covariance()(index(p), index(p)));
  }
  [[nodiscard]] bool estimated(PhysicalParameter p) const noexcept {
    return setup_.deviation[state_of(p)] > Scalar(0);
  }
  [[nodiscard]] Covariance covariance() const noexcept;      ///< Covariance of the values.
  [[nodiscard]] Covariance log_covariance() const noexcept;  ///< The same of the first four's logarithms.

  [[nodiscard]] double resonance_hz() const noexcept;      ///< Undamped, sqrt(K (1/J1 + 1/J2)).
  [[nodiscard]] double antiresonance_hz() const noexcept;  ///< Undamped, sqrt(K/J2).
  [[nodiscard]] double resonance_std_hz() const noexcept;
  [[nodiscard]] double antiresonance_std_hz() const noexcept;

  /// Newest output minus what was predicted for it; 0 for a missing one.
  [[nodiscard]] Scalar residual() const noexcept { return residual_; }
  [[nodiscard]] Scalar innovation() const noexcept { return residual_; }
  [[nodiscard]] Scalar innovation_variance() const noexcept { return run_.filter.innovation_variance(); }
  [[nodiscard]] double noise_rms() const noexcept {
    return std::sqrt(static_cast<double>(run_.noise.variance()));
  }
  /// 0 with a drifting stiffness, whose rate is known (the age at which K is known best with
  /// `at_best_known_time`); else the age of what is known of it, as measured.
  [[nodiscard]] double lag_samples() const noexcept {
    if (!(config_.stiffness_drift_per_s > 0.0)) return stiffness_age_;
    return config_.at_best_known_time ? (best_known_age_s() + config_.delay_s) * config_.sample_rate_hz : 0.0;
  }

  /// All that is estimated of J1, J2, K, D is known twice as well as at the start.
  [[nodiscard]] bool converged() const noexcept;
  /// Innovations are about as large as the filter expects them.
  [[nodiscard]] bool consistent() const noexcept { return run_.nis < 2.0; }
  /// The twist moves enough to tell about the stiffness; while it does not, the estimate is frozen.
  [[nodiscard]] bool excited() const noexcept { return excited_; }
  /// No friction below 0 by more than twice its error, a resonance below half the sample rate and less damped
  /// than critically.
  [[nodiscard]] bool plausible() const noexcept;
  [[nodiscard]] bool ready() const noexcept { return converged() && consistent(); }

  [[nodiscard]] std::uint64_t samples() const noexcept { return samples_; }  ///< Missing ones included.
  [[nodiscard]] std::uint64_t skipped_samples() const noexcept { return skipped_; }
  [[nodiscard]] std::uint64_t replays() const noexcept { return replays_; }  ///< Taken over so far.
  /// Jumps of the load's torque that were seen so far; looked for with a memory, of a machine that stays.
  [[nodiscard]] std::uint64_t load_jumps() const noexcept { return run_.load_jumps; }

  /// For a state of unknown origin (base/detail/intact.hpp).
  [[nodiscard]] bool intact() const noexcept {
    return run_.intact() && candidate_.intact() && remembered_ <= memory_.size() && next_ <= remembered_ &&
           intact_flags(config_.at_best_known_time, run_.watches_load, excited_, started_, resuming_,
                        replaying_, exploring_, memory_full_);
  }

 private:
  static constexpr std::size_t kDelayLine =
      static_cast<std::size_t>(PhysicalTrackerConfig::kMaxDelaySamples) + 2;
  static constexpr bool kReplays = ReplaySamples > 0;
  static constexpr std::size_t kFirstReplay = 256;  // remembered samples
  static constexpr std::size_t kBetweenReplays = 16;
  static constexpr double kLinearityShare = 0.1;
  static constexpr double kLeastEffect = 0.02;
  static constexpr double kEffectPeriods = 2.0;  // of the resonance
  static constexpr double kNoiseInflation = 10.0;
  static constexpr std::size_t kPolishInRow = 2;
  static constexpr double kMostAge_s = 1.0;
  /// A drift at half the rate, remembered for 0.08 s, as a walk: (d/2) sqrt(0.08 s). With 0.28 the bars of D
  /// are 1.4 times its error (docs/methods/physical_tracker.md).
  static constexpr double kDampingShare = 0.14;
  static constexpr double kTrendPeriods = 15.0;                                // of the resonance
  static constexpr std::array<double, 4> kOtherStarts = {0.5, 2.0, 0.7, 1.4};  // times the stiffness given
  using Run = PhysicalRun<Scalar>;

  explicit PhysicalTracker(const PhysicalTrackerConfig& config) noexcept;

  static constexpr std::size_t state_of(PhysicalParameter p) noexcept {
    return ZohTwoMass<Real>::kStates + static_cast<std::size_t>(p);
  }
  static constexpr int index(PhysicalParameter p) noexcept { return static_cast<int>(p); }

  void start(Scalar y) noexcept;
  void advance(Run& run, Scalar previous_u, Scalar u, Scalar y, bool u_known) noexcept;
  void limit_variances(Run& run) noexcept;
  void set_drift_noise(double per_s) noexcept;
  /// The machine may be another one than at the record's start.
  [[nodiscard]] bool changes() const noexcept {
    return config_.stiffness_drift_per_s > 0.0 || config_.memory_s > 0.0;
  }
  [[nodiscard]] TrendWatch trend_watch() const noexcept;
  [[nodiscard]] double best_known_age_s() const noexcept;
  [[nodiscard]] double told_age_s() const noexcept;
  void watch_excitation() noexcept;
  void remember(Scalar previous_u, Scalar u, Scalar y) noexcept;
  void replay() noexcept;
  void begin_replay() noexcept;
  [[nodiscard]] bool moved_far() const noexcept;
  [[nodiscard]] double frequency_std(double load_weight) const noexcept;

  struct Remembered {
    float previous_u, u, y;  // y not a number: missing
  };

  PhysicalTrackerConfig config_{};
  typename PhysicalFilter<Scalar>::Setup setup_{};
  std::uint64_t delay_samples_ = 0;  // from u's sample to the state that an output shows
  Run run_{};
  std::array<Scalar, kDelayLine> inputs_{};
  Scalar last_input_{};
  Scalar input_power_{};
  Scalar residual_{};
  double effect_mean_ = 0.0;
  double effect_power_ = 0.0;
  double effect_gain_ = 0.0;
  double stiffness_age_ = 0.0;
  bool excited_ = false;
  bool started_ = false;
  bool resuming_ = false;  // the first output after a long gap gives the velocity
  std::uint64_t samples_ = 0;
  std::uint64_t skipped_ = 0;

  Run candidate_{};  // goes over the remembered samples again
  typename PhysicalFilter<Scalar>::Vector linearised_about_{};
  typename PhysicalFilter<Scalar>::Vector candidate_about_{};
  std::size_t attempts_ = 0;  // from other starts
  std::size_t polished_ = 0;  // replays in a row about the estimate
  std::array<Remembered, kReplays ? ReplaySamples : 1> memory_{};
  std::size_t remembered_ = 0;
  std::size_t next_ = 0;         // remembered sample that the candidate takes next
  std::size_t next_replay_ = 0;  // remembered samples at which one may begin
  bool replaying_ = false;
  bool exploring_ = false;  // the candidate comes from another start
  bool memory_full_ = false;
  std::uint64_t replays_ = 0;
};

}  // namespace resonid::online

#include <resonid/online/models/detail/physical_tracker_impl.hpp>
