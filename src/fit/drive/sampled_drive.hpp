// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <resonid/base/detail/linear_system.hpp>
#include <resonid/data/record.hpp>
#include <resonid/fit/drive_model.hpp>
#include <span>
#include <type_traits>

// The drive's equations for any scalar type, so that Ceres' automatic differentiation gives exact derivatives
// of the *sampled* model: a continuous model fitted to sampled data errs by 1 % in the resonance
// (docs/decisions/0003-fit-the-sampled-model.md).
namespace resonid::fit::detail {

inline double plain(double x) { return x; }
template <class Jet>
double plain(const Jet& x) {
  return x.a;
}

/// Natural parameters, in the order of `Parameter`, from the fit's coordinates: logarithms of the positive
/// ones; frictions, springs to the ground, delay and lag in units that make them of order one; the pole of
/// the output filter.
struct Coordinates {
  double viscous_unit = 1.0;
  double sample_time_s = 1.0;
  double ground_unit = 1.0;

  /// The middle mass only for a `three_mass` drive: the others have no such coordinates.
  template <class T>
  [[nodiscard]] data::ThreeMass<T> parameters(const T* x, bool three_mass) const {
    using std::exp;
    data::ThreeMass<T> p{exp(x[kDrivenInertia]), exp(x[kLoadInertia]), exp(x[kStiffness]), exp(x[kDamping]),
                         x[kViscousFriction] * T(viscous_unit)};
    p.load_viscous_friction = x[kLoadViscousFriction] * T(viscous_unit);
    p.motor_ground_stiffness = x[kMotorGroundStiffness] * T(ground_unit);
    p.load_ground_stiffness = x[kLoadGroundStiffness] * T(ground_unit);
    if (!three_mass) return p;
    p.middle_inertia = exp(x[kMiddleInertia]);
    p.stiffness_2 = exp(x[kStiffness2]);
    p.damping_2 = exp(x[kDamping2]);
    return p;
  }
  [[nodiscard]] std::array<double, kParameterCount> from(const DriveModel& model) const;
  void store(const double* x, DriveModel& model) const;
  /// d(natural)/d(coordinate), diagonal.
  [[nodiscard]] std::array<double, kParameterCount> jacobian(const DriveModel& model) const;
};

/// Range of a fitted delay. Negative ones belong to an input that was measured, without a zero-order hold:
/// its samples look up to half a sample ahead of the hold that the model assumes.
inline constexpr double kMinimumDelaySamples = -1.0;
inline constexpr double kMaximumDelaySamples = 50.0;
/// All of the delay, as a part of the record: what is left of it says something.
inline constexpr double kDelayedPart = 0.5;

/// Range of the lag of a torque loop: beyond, it is the drive's own inertia.
inline constexpr double kMaximumLagSamples = 200.0;

/// Pole of the output filter, 0: none; the longest as the longest lag.
inline constexpr double kMaximumFilterPole = 0.995;
[[nodiscard]] inline double filter_pole(double output_filter_s, double sample_time_s) {
  return output_filter_s > 0.0 ? std::exp(-sample_time_s / output_filter_s) : 0.0;
}

/// Coordinates that are logarithms.
inline constexpr bool is_logarithm(int parameter) {
  return parameter < kViscousFriction || parameter > kLoadGroundStiffness;
}

/// The fits search inertias, stiffness and damping within a factor of 1000 (damping: 1e5) around their start;
/// a step that leaves it, or is not finite, is refused.
class SearchRange {
 public:
  explicit SearchRange(std::span<const double> start) {
    std::copy_n(start.begin(), kParameterCount, start_.begin());
  }

  /// Of the first `count` coordinates.
  template <class T>
  [[nodiscard]] bool contains(const T* x, int count) const {
    for (int i = 0; i < count; ++i) {
      if (!is_logarithm(i)) {
        if (!std::isfinite(plain(x[i]))) return false;
        continue;
      }
      const double widest = i == kDamping || i == kDamping2 ? 11.5 : 6.9;
      if (!(std::abs(plain(x[i]) - start_[static_cast<std::size_t>(i)]) <= widest)) return false;
    }
    return true;
  }

 private:
  std::array<double, kParameterCount> start_{};
};

/// Sizes of a drive of so many masses. The first kOrder states are those of data::continuous_system, the last
/// one is the position.
template <int Masses>
struct Sizes {
  static constexpr int kOrder = 2 * Masses - 1;
  static constexpr int kStates = kOrder + 1;
  static constexpr int kParameters = Masses == 3 ? kParameterCount : kMiddleInertia;  ///< Coordinates in use.
};

/// Calls function(std::integral_constant<int, masses>) for the structure.
template <class Function>
decltype(auto) with_masses(Structure structure, Function&& function) {
  switch (structure) {
    case Structure::rigid:
      return function(std::integral_constant<int, 1>());
    case Structure::two_mass:
      return function(std::integral_constant<int, 2>());
    default:
      return function(std::integral_constant<int, 3>());
  }
}

template <int Masses, class T>
LinearSystem<T, Sizes<Masses>::kStates> continuous_drive(const data::ThreeMass<T>& p) {
  constexpr int kOrder = Sizes<Masses>::kOrder;
  LinearSystem<T, Sizes<Masses>::kStates> s;
  const auto put = [&](const auto& core) {
    for (int i = 0; i < kOrder; ++i) {
      for (int j = 0; j < kOrder; ++j) s.a(i, j) = core.a(i, j);
      s.b(i) = core.b(i);
    }
  };
  if constexpr (Masses == 3) {
    put(data::continuous_system(p));
  } else if constexpr (Masses == 2) {
    put(data::continuous_system(static_cast<const data::TwoMass<T>&>(p)));
    s.a(1, 1) -= p.load_viscous_friction / p.load_inertia;
  } else {
    s.a(0, 0) = -p.viscous_friction / p.driven_inertia;
    s.b(0) = T(1.0) / p.driven_inertia;
  }
  s.a(kOrder, 0) = T(1.0);
  s.c(0) = T(1.0);
  s.a(0, kOrder) = -p.motor_ground_stiffness / p.driven_inertia;
  if constexpr (Masses > 1) {  // the load's place is the driven side's less the twists, which are scaled
    const T pull = p.load_ground_stiffness / p.load_inertia;
    s.a(Masses - 1, kOrder) -= pull;
    for (int twist = Masses; twist < kOrder; ++twist)
      s.a(Masses - 1, twist) += pull / s.a(twist, twist - Masses);
  }
  return s;
}

template <int States, class T>
double norm_of(const LinearSystem<T, States>& s) {
  double norm = 0.0;
  for (int i = 0; i < States; ++i) {
    double row = std::abs(plain(s.b(i)));
    for (int j = 0; j < States; ++j) row += std::abs(plain(s.a(i, j)));
    norm = std::max(norm, row);
  }
  return norm;
}

template <int States, class T>
LinearSystem<T, States> hold(const LinearSystem<T, States>& s, const T& step) {
  return zero_order_hold<T, States>(s, step, norm_of(s) * std::abs(plain(step)));
}

/// What an input of 1 that decays with the time constant `lag` leaves after `step`.
template <int States, class T>
Eigen::Matrix<T, States, 1> decayed(const LinearSystem<T, States>& s, const T& lag, const T& step) {
  Eigen::Matrix<T, States + 1, States + 1> m = Eigen::Matrix<T, States + 1, States + 1>::Zero();
  for (int i = 0; i < States; ++i) {
    for (int j = 0; j < States; ++j) m(i, j) = s.a(i, j) * step;
    m(i, States) = s.b(i) * step;
  }
  m(States, States) = -step / lag;
  const double norm =
      std::max(norm_of(s) * std::abs(plain(step)), std::abs(plain(step)) / std::abs(plain(lag)));
  const auto whole = matrix_exponential<T, States + 1>(m, norm);
  Eigen::Matrix<T, States, 1> left;
  for (int i = 0; i < States; ++i) left(i) = whole(i, States);
  return left;
}

/// What the fits simulate: x(j+1) = a x(j) + b u(j) + lag_b e(j),
/// y(j+1+whole_delay) = c x(j) + d u(j) + lag_d e(j). A torque loop of first order lags behind its command by
/// e: e(j+1) = u(j) + decay e(j) - u(j+1). Differences that span two held inputs add past_d (u(j-1) - u(j)).
template <int Masses, class T>
struct SampledDrive {
  static constexpr int kStates = Sizes<Masses>::kStates;
  LinearSystem<T, kStates> system;
  int whole_delay = 0;
  Eigen::Matrix<T, kStates, 1> lag_b = Eigen::Matrix<T, kStates, 1>::Zero();
  T lag_d = T(0.0), decay = T(0.0), past_d = T(0.0);
};

/// Whether the lag of the torque loop has a part in it; without one it costs nothing.
enum class Lag { none, first_order };

/// Output delayed by `delay_samples` >= -1 (whole samples and an exact fraction: the state between two
/// samples). The input is that of `continuous`, wherever it acts. The motion is that of mass number `mass`,
/// 0: driven side.
template <int Masses, class T>
SampledDrive<Masses, T> sampled_drive(const LinearSystem<T, Sizes<Masses>::kStates>& continuous,
                                      data::OutputQuantity quantity, const T& delay_samples,
                                      double sample_time_s, Lag lag, const T& lag_samples, Velocity velocity,
                                      int mass = 0) {
  constexpr int kStates = Sizes<Masses>::kStates;
  SampledDrive<Masses, T> drive;
  drive.system = hold(continuous, T(sample_time_s));
  drive.whole_delay = static_cast<int>(std::floor(plain(delay_samples) + 1e-9));
  const bool differences = quantity == data::OutputQuantity::velocity && velocity == Velocity::differences;
  const T fraction = delay_samples - T(drive.whole_delay);
  const T rest = (T(1.0) - fraction) * T(sample_time_s);
  const auto partial = hold(continuous, rest);
  std::array<T, kStates> row;
  row.fill(T(0.0));
  T feed_through(0.0);
  switch (quantity) {
    case data::OutputQuantity::velocity:
      row[static_cast<std::size_t>(differences ? kStates - 1 : mass)] =
          T(differences ? 1.0 / sample_time_s : 1.0);
      break;
    case data::OutputQuantity::position:
      row[kStates - 1] = T(1.0);  // of the driven side, less the twists, which are scaled
      for (int twist = Masses; twist < Masses + mass; ++twist)
        row[static_cast<std::size_t>(twist)] = -T(1.0) / continuous.a(twist, twist - Masses);
      break;
    case data::OutputQuantity::acceleration:  // sampled just before the input changes
      for (int j = 0; j < kStates; ++j) row[static_cast<std::size_t>(j)] = continuous.a(mass, j);
      feed_through = continuous.b(mass);
      break;
  }
  drive.system.d = feed_through;
  for (int i = 0; i < kStates; ++i) {
    const T& share = row[static_cast<std::size_t>(i)];
    for (int j = 0; j < kStates; ++j) {
      if (i == 0) drive.system.c(j) = T(0.0);
      drive.system.c(j) += share * partial.a(i, j);
    }
    drive.system.d += share * partial.b(i);
  }
  if (differences) {  // less the place one sample before, looked back to from x(j) under u(j-1)
    const auto before = hold(continuous, -fraction * T(sample_time_s));
    const T& share = row[kStates - 1];
    for (int j = 0; j < kStates; ++j) drive.system.c(j) -= share * before.a(kStates - 1, j);
    drive.system.d -= share * before.b(kStates - 1);
    drive.past_d = -share * before.b(kStates - 1);
  }
  if (lag == Lag::none) return drive;
  // Below a part of a sample the lag acts in proportion to itself: the slope at none is that there.
  constexpr double kProportional = 0.02;
  const bool small = plain(lag_samples) < kProportional;
  const T seconds = (small ? T(kProportional) : lag_samples) * T(sample_time_s);
  const T share = small ? lag_samples / T(kProportional) : T(1.0);
  const auto whole = decayed(continuous, seconds, T(sample_time_s));
  const auto part = decayed(continuous, seconds, rest);
  using std::exp;
  if (!small) drive.decay = exp(-T(1.0) / lag_samples);
  drive.lag_d = feed_through * exp(-rest / seconds) * share;
  for (int i = 0; i < kStates; ++i) {
    drive.lag_b(i) = whole(i) * share;
    drive.lag_d += row[static_cast<std::size_t>(i)] * part(i) * share;
  }
  return drive;
}

/// The drive by its parameters, from the torque on the driven side.
template <int Masses, class T>
SampledDrive<Masses, T> sampled_drive(const data::ThreeMass<T>& p, data::OutputQuantity quantity,
                                      const T& delay_samples, double sample_time_s, Lag lag,
                                      const T& lag_samples, Velocity velocity, int mass = 0) {
  return sampled_drive<Masses>(continuous_drive<Masses>(p), quantity, delay_samples, sample_time_s, lag,
                               lag_samples, velocity, mass);
}

}  // namespace resonid::fit::detail
