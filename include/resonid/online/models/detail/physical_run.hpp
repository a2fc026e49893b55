// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <resonid/base/detail/intact.hpp>
#include <resonid/online/models/detail/physical_filter.hpp>
#include <type_traits>

namespace resonid::online {

/// Variance of the output noise, from the innovations e and their expected variance s = h P h^T + r:
///
///   r <- r + g (e^2 r/s - r)        g = max(2/(n + 10), 1/memory)
///
/// Unbiased once the filter is consistent; samples that tell about the parameters rather than about the noise
/// hardly weigh. Starts from the output's second differences, which hold the machine's motion as well: too
/// large a noise only wastes some of the first samples, too small a one makes the filter overconfident.
template <class Real>
class NoiseEstimate {
 public:
  NoiseEstimate() = default;
  NoiseEstimate(Real given, Real slowest_gain) noexcept
      : variance_(given), slowest_gain_(slowest_gain), given_(given > Real(0)) {}

  /// Before the update; y as measured.
  void see(Real y) noexcept {
    if (given_ || seen_ >= kFirst) return;
    if (seen_ >= 2) {
      const Real second = y - Real(2) * before_ + last_;
      if (!std::isfinite(second * second)) return;
      curvature_ += second * second / Real(6);
      variance_ = std::max(curvature_ / static_cast<Real>(seen_ - 1), kLeast);
    }
    last_ = before_;
    before_ = y;
    ++seen_;
  }
  void learn(Real innovation, Real expected_variance) noexcept {
    if (given_ || seen_ < kFirst) return;
    ++learnt_;
    const Real gain = std::max(Real(2) / (static_cast<Real>(learnt_) + Real(10)), slowest_gain_);
    const Real next =
        variance_ + gain * variance_ * (innovation * (innovation / expected_variance) - Real(1));
    if (std::isfinite(next)) variance_ = std::max(next, kLeast);  // not what a spike makes of it
  }
  /// Keeps the value, but believes in it little.
  void forget() noexcept { learnt_ = std::min(learnt_, kForgotten); }
  [[nodiscard]] bool usable() const noexcept { return given_ || seen_ > 2; }
  [[nodiscard]] Real variance() const noexcept { return variance_; }

  /// For a state of unknown origin (base/detail/intact.hpp).
  [[nodiscard]] bool intact() const noexcept { return resonid::intact(given_); }

 private:
  static constexpr std::uint32_t kFirst = 32;
  static constexpr std::uint64_t kForgotten = 50;
  static constexpr Real kLeast = Real(1e-30);
  Real variance_{};
  Real slowest_gain_{};
  Real curvature_{};
  Real last_{};
  Real before_{};
  std::uint32_t seen_ = 0;
  std::uint64_t learnt_ = 0;
  bool given_ = false;
};

/// How much faster than expected a drifting stiffness drifts now, from the corrections that it gets:
///
///   m <- l m + g e      V <- l^2 V + g^2 s      z^2 = m^2/V      adaptive_noise = min(max(1, z^2), 100)^2
///
/// with g the gain for ln K, e the innovation and s its expected variance. As long as the filter follows, the
/// corrections are as often up as down and z^2 is about 1; corrections that all go one way say that the
/// machine has begun to move, or moves otherwise than before. The process noise of the drift rate is
/// multiplied by it, and so the noise estimate never takes for noise what is lag.
class TrendWatch {
 public:
  TrendWatch() = default;
  explicit TrendWatch(double keep) noexcept : keep_(keep) {}

  void see(double gain, double innovation, double expected_variance) noexcept {
    if (!(keep_ > 0.0)) return;
    sum_ = keep_ * sum_ + gain * innovation;
    variance_ = keep_ * keep_ * variance_ + gain * gain * expected_variance + kLeast;
    const double ratio = sum_ * sum_ / variance_;
    const double factor = std::clamp(ratio, 1.0, kMost);
    adaptive_noise_ = factor * factor;
  }
  [[nodiscard]] double adaptive_noise() const noexcept { return adaptive_noise_; }

 private:
  static constexpr double kMost = 100.0;
  static constexpr double kLeast = 1e-60;
  double keep_ = 0.0;
  double sum_ = 0.0;
  double variance_ = 0.0;
  double adaptive_noise_ = 1.0;
};

/// Tells from the innovations that the load's torque has jumped, which the filter would take for other
/// inertias: CUSUM of z^2 = e^2/s,
///
///   g <- max(0, g + min(z^2, 16) - 3.5)        jumped: g > 20
///
/// which white innovations reach once in some 1e5 samples (then a few samples tell nothing), a changed
/// parameter hardly ever unless much, a spike never. What a jump could move before it is found is 3 standard
/// deviations. At most three jumps in a row: what does not end is another machine, which is told with ever
/// longer waits where that does not help either.
class LoadWatch {
 public:
  enum class Finding { none, load_jumped, machine_changed };
  /// With every output.
  void pass() noexcept {
    if (since_change_ < kForgotten) ++since_change_;
  }
  Finding see(double z_square) noexcept {
    if (jumps_ > 0 && ++since_ >= kRefill) {
      since_ = 0;
      --jumps_;
    }
    cusum_ = std::max(0.0, cusum_ + std::min(z_square, kMost) - kUsual);
    if (cusum_ <= kLimit || (jumps_ >= kInRow && !may_change())) return Finding::none;
    cusum_ = 0.0;
    since_ = 0;
    if (jumps_ < kInRow) {
      ++jumps_;
      return Finding::load_jumped;
    }
    change();
    return Finding::machine_changed;
  }
  void reset() noexcept { cusum_ = 0.0; }
  [[nodiscard]] bool calm() const noexcept { return !(cusum_ > 0.0); }
  /// Whether the wait after the last change is over.
  [[nodiscard]] bool may_change() const noexcept {
    return since_change_ >= std::uint32_t{kRefill} << doublings_;
  }
  void change() noexcept {
    doublings_ = static_cast<std::uint8_t>(
        since_change_ < kForgotten ? std::min(doublings_ + 1, int{kMostDoublings}) : 0);
    since_change_ = 0;
  }

 private:
  static constexpr double kUsual = 3.5, kMost = 16.0, kLimit = 20.0;
  static constexpr std::uint8_t kInRow = 3, kMostDoublings = 5;
  static constexpr std::uint16_t kRefill = 250;  // samples without one
  static constexpr std::uint32_t kForgotten = 100'000;
  double cusum_ = 0.0;
  std::uint32_t since_change_ = kForgotten;
  std::uint16_t since_ = 0;
  std::uint8_t jumps_ = 0, doublings_ = 0;  // those of the wait between two changes
};

/// A filter on its way through the samples, with its noise and its likelihood.
///
/// An output far from what a filter expects that was right so far is an outlier (a spike of the encoder) and
/// is left out; several in a row are the machine. Where the load jumps, what was learned from it so far is
/// taken back; where that does not help, the machine has changed and is found anew.
template <class Real>
struct PhysicalRun {
  PhysicalFilter<Real> filter;
  NoiseEstimate<Real> noise;
  TrendWatch trend;
  Real noise_inflation{1};    ///< How much more noise is assumed than there is.
  double misfit = 0.0;        ///< sum of e^2/s + ln s: -2 ln likelihood.
  double nis = 1.0;           ///< Mean of e^2/s over the last samples: 1 when all is well.
  std::uint64_t outputs = 0;  ///< Taken in.
  std::uint32_t outliers_in_row = 0;
  /// In double only: what watches a machine for hours is no firmware, whose room is small.
  static constexpr bool kWatchesLoad = sizeof(Real) > sizeof(float);
  bool watches_load = false;
  LoadWatch load;
  struct Nothing {};
  struct Calm {
    typename PhysicalFilter<Real>::Known filter{};
    NoiseEstimate<Real> noise{};
    double nis = 1.0;
  };
  std::conditional_t<kWatchesLoad, Calm, Nothing> older{}, newer{};
  /// While a machine that has changed is looked for: the noise before. A filter that is wrong takes what it
  /// cannot tell for noise, and is content.
  std::conditional_t<kWatchesLoad, NoiseEstimate<Real>, Nothing> usual_noise{};
  bool searches = false;
  std::uint32_t since_newer = 0, remembered = 0;
  std::uint64_t load_jumps = 0;
  static constexpr std::uint32_t kBetween = 16;  // samples from `older` to `newer`, at least
  static constexpr double kNisGain = 0.005;
  static constexpr Real kFound = Real(9);              // a variance above is no noise
  static constexpr double kCalm = 2.0;                 // of nis: the filter was right so far
  static constexpr std::uint64_t kLeastOutputs = 200;  // outputs from which on that can be said
  static constexpr std::uint32_t kOutliersInRow = 3;
  static constexpr Real kOutlier = Real(10);  // standard deviations
  static constexpr Real kAbsurd = Real(1e8);  // never taken in: its square would drown everything

  [[nodiscard]] bool intact() const noexcept { return filter.intact() && noise.intact(); }
  /// y at the state that the filter is in; u: torque that follows.
  void update(Real y, Real u) noexcept {
    noise.see(y);
    if (!noise.usable()) return;
    const bool consistent = outputs >= kLeastOutputs && nis < kCalm && outliers_in_row < kOutliersInRow;
    const bool taken =
        filter.update(y, u, noise_inflation * noise.variance(), consistent ? kOutlier : kAbsurd);
    const Real e = filter.innovation();
    const Real s = filter.innovation_variance();
    const double ratio = static_cast<double>(e) * static_cast<double>(e) / static_cast<double>(s);
    if constexpr (kWatchesLoad) {
      const auto found = watch_load(ratio);
      if (found != LoadWatch::Finding::none) {
        if (remembered >= 2) {
          noise = older.noise;
          nis = older.nis;
        }
        since_newer = outliers_in_row = 0;
        if (found == LoadWatch::Finding::machine_changed) {
          if (!searches) usual_noise = noise;
          searches = true;
          noise = usual_noise;
          nis = 1.0;
          remembered = 0;
          filter.machine_changed(y);
        } else {
          newer = older;
          ++load_jumps;
          filter.load_jumped(older.filter, y);
        }
        return;
      }
    }
    if (!taken) {
      ++outliers_in_row;
      return;
    }
    outliers_in_row = 0;
    if (noise_inflation == Real(1)) noise.learn(e, s);
    misfit += ratio + std::log(static_cast<double>(s));
    nis += kNisGain * (ratio - nis);
    ++outputs;
    trend.see(static_cast<double>(filter.stiffness_gain()), static_cast<double>(e), static_cast<double>(s));
  }

 private:
  [[nodiscard]] LoadWatch::Finding watch_load(double z_square) noexcept {
    using Finding = LoadWatch::Finding;
    if (!watches_load) return Finding::none;
    load.pass();
    if (searches && load.may_change()) {
      searches = noise.variance() > kFound * usual_noise.variance();
      if (searches) {
        load.change();
        return Finding::machine_changed;
      }
    }
    const bool watches = load.calm() ? outputs >= kLeastOutputs && nis < kCalm : true;
    if (filter.frozen() || !watches || !std::isfinite(z_square)) {
      load.reset();
      since_newer = remembered = 0;
      return Finding::none;
    }
    const auto found = load.see(z_square);
    if (found == Finding::load_jumped && remembered < 2) return Finding::none;  // nothing to go back to
    if (found != Finding::none) return found;
    if (load.calm() && ++since_newer >= kBetween) {
      older = newer;
      newer = {filter.known(), noise, nis};
      since_newer = 0;
      remembered = std::min<std::uint32_t>(remembered + 1, 2);
    }
    return Finding::none;
  }
};

}  // namespace resonid::online
