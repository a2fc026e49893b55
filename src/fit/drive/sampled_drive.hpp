// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <resonid/base/constants.hpp>
#include <resonid/base/detail/linear_system.hpp>
#include <resonid/data/record.hpp>
#include <resonid/fit/drive_model.hpp>
#include <span>
#include <type_traits>

// The drive's equations for any scalar type, so that Ceres' automatic differentiation gives exact derivatives
// of the *sampled* model: a continuous model fitted to sampled data errs by 1 % in the resonance (ORACLE F).
namespace resonid::fit::detail {

inline double plain(double x) { return x; }
template <class Jet>
double plain(const Jet& x) {
  return x.a;
}

/// Natural parameters [J1 J2 K D B Td Jm K2 D2] from the fit's coordinates: logarithms of the positive ones,
/// B and Td in units that make them of order one.
struct Coordinates {
  double viscous_unit = 1.0;
  double sample_time_s = 1.0;

  /// The middle mass only for a `three_mass` drive: the others have no such coordinates.
  template <class T>
  [[nodiscard]] data::ThreeMass<T> parameters(const T* x, bool three_mass) const {
    using std::exp;
    const data::TwoMass<T> two{exp(x[kDrivenInertia]), exp(x[kLoadInertia]), exp(x[kStiffness]),
                               exp(x[kDamping]), x[kViscousFriction] * T(viscous_unit)};
    if (!three_mass) return two;
    return {two, exp(x[kMiddleInertia]), exp(x[kStiffness2]), exp(x[kDamping2])};
  }
  template <class T>
  [[nodiscard]] T delay_samples(const T* x) const {
    return x[kDelay];
  }
  [[nodiscard]] std::array<double, kParameterCount> from(const DriveModel& model) const;
  void store(const double* x, DriveModel& model) const;
  /// d(natural)/d(coordinate), diagonal.
  [[nodiscard]] std::array<double, kParameterCount> jacobian(const DriveModel& model) const;
};

inline bool finite(double x) { return std::isfinite(x); }
template <class Jet>
bool finite(const Jet& x) {
  return std::isfinite(x.a) && x.v.allFinite();
}

/// Range of a fitted delay. Negative ones belong to an input that was measured, without a zero-order hold:
/// its samples look up to half a sample ahead of the hold that the model assumes.
inline constexpr double kMinimumDelaySamples = -1.0;
inline constexpr double kMaximumDelaySamples = 50.0;

/// Coordinates that are logarithms.
inline constexpr bool is_logarithm(int parameter) {
  return parameter != kViscousFriction && parameter != kDelay;
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
  static constexpr int kParameters = Masses == 3 ? kParameterCount : kDelay + 1;  ///< Coordinates in use.
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
  } else {
    s.a(0, 0) = -p.viscous_friction / p.driven_inertia;
    s.b(0) = T(1.0) / p.driven_inertia;
  }
  s.a(kOrder, 0) = T(1.0);
  s.c(0) = T(1.0);
  return s;
}

template <int States, class T>
LinearSystem<T, States> hold(const LinearSystem<T, States>& s, const T& step) {
  double norm = 0.0;
  for (int i = 0; i < States; ++i) {
    double row = std::abs(plain(s.b(i)));
    for (int j = 0; j < States; ++j) row += std::abs(plain(s.a(i, j)));
    norm = std::max(norm, row);
  }
  return zero_order_hold<T, States>(s, step, norm * std::abs(plain(step)));
}

/// What the fits simulate: x(j+1) = a x(j) + b u(j),  y(j+1+whole_delay) = c x(j) + d u(j).
template <int Masses, class T>
struct SampledDrive {
  LinearSystem<T, Sizes<Masses>::kStates> system;
  int whole_delay = 0;
};

/// Output delayed by `delay_samples` >= -1 (whole samples and an exact fraction: the state between two
/// samples).
template <int Masses, class T>
SampledDrive<Masses, T> sampled_drive(const data::ThreeMass<T>& p, data::OutputQuantity quantity,
                                      const T& delay_samples, double sample_time_s) {
  constexpr int kStates = Sizes<Masses>::kStates;
  const auto continuous = continuous_drive<Masses>(p);
  SampledDrive<Masses, T> drive;
  drive.system = hold(continuous, T(sample_time_s));
  drive.whole_delay = static_cast<int>(std::floor(plain(delay_samples) + 1e-9));
  const T fraction = delay_samples - T(drive.whole_delay);
  const auto partial = hold(continuous, (T(1.0) - fraction) * T(sample_time_s));
  std::array<T, kStates> row;
  row.fill(T(0.0));
  T feed_through(0.0);
  switch (quantity) {
    case data::OutputQuantity::velocity:
      row[0] = T(1.0);
      break;
    case data::OutputQuantity::position:
      row[kStates - 1] = T(1.0);
      break;
    case data::OutputQuantity::acceleration:  // sampled just before the input changes
      for (int j = 0; j < kStates; ++j) row[static_cast<std::size_t>(j)] = continuous.a(0, j);
      feed_through = continuous.b(0);
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
  return drive;
}

/// Minimal complex arithmetic for automatic-differentiation scalars (std::complex is unspecified for them).
template <class T>
struct Complex {
  T re{};
  T im{};
  friend Complex operator+(const Complex& a, const Complex& b) { return {a.re + b.re, a.im + b.im}; }
  friend Complex operator-(const Complex& a, const Complex& b) { return {a.re - b.re, a.im - b.im}; }
  friend Complex operator*(const Complex& a, const Complex& b) {
    return {a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re};
  }
  friend Complex operator/(const Complex& a, const Complex& b) {
    const T scale = T(1.0) / (b.re * b.re + b.im * b.im);
    return {(a.re * b.re + a.im * b.im) * scale, (a.im * b.re - a.re * b.im) * scale};
  }
};

/// States (zI - A)^-1 b of the first `Order` states, from the differences z - 1 and A - I so that fast
/// sampling does not cancel digits.
template <int Order, int States, class T>
std::array<Complex<T>, Order> state_response(const LinearSystem<T, States>& s, double frequency_hz,
                                             double sample_time_s) {
  const double half = kPi * frequency_hz * sample_time_s;  // z - 1 = 2j sin(w/2) e^{jw/2}
  const double re = -2.0 * std::sin(half) * std::sin(half);
  const double im = 2.0 * std::sin(half) * std::cos(half);
  Complex<T> m[Order][Order];
  std::array<Complex<T>, Order> x;
  for (int i = 0; i < Order; ++i) {
    for (int j = 0; j < Order; ++j) {
      m[i][j].re = -s.a(i, j);
      m[i][j].im = T(0.0);
    }
    m[i][i] = {T(1.0 + re) - s.a(i, i), T(im)};
    x[i] = {s.b(i), T(0.0)};
  }
  for (int i = 0; i < Order; ++i) {  // elimination; zI - A is far from singular pivots off the poles
    for (int r = i + 1; r < Order; ++r) {
      const Complex<T> factor = m[r][i] / m[i][i];
      for (int c = i; c < Order; ++c) m[r][c] = m[r][c] - factor * m[i][c];
      x[r] = x[r] - factor * x[i];
    }
  }
  for (int i = Order - 1; i >= 0; --i) {
    for (int c = i + 1; c < Order; ++c) x[i] = x[i] - m[i][c] * x[c];
    x[i] = x[i] / m[i][i];
  }
  return x;
}

/// Torque to delayed velocity, times exp(j w known delay): what is measured once the known delay is taken
/// out.
///
/// For delays of whole samples that is the velocity's response turned by the rest of the delay. A fraction of
/// a sample is seen through the hold, which near the Nyquist frequency is more than a turn. A negative delay
/// says that the input was measured, without a zero-order hold; then it is a turn and no more.
template <int Masses, class T>
class MeasuredResponse {
 public:
  MeasuredResponse(const data::ThreeMass<T>& p, const T& fitted_delay_samples, double known_delay_samples,
                   double sample_time_s)
      : known_samples_(known_delay_samples), sample_time_s_(sample_time_s) {
    const T delay = fitted_delay_samples + T(known_delay_samples);
    const bool ahead = plain(delay) < 0.0;
    turn_samples_ = ahead ? delay : T(0.0);
    drive_ = sampled_drive<Masses>(p, data::OutputQuantity::velocity, ahead ? T(0.0) : delay, sample_time_s);
  }

  Complex<T> operator()(double frequency_hz) const {
    using std::cos;
    using std::sin;
    Complex<T> sum{drive_.system.d, T(0.0)};
    const auto states = state_response<Sizes<Masses>::kOrder>(drive_.system, frequency_hz, sample_time_s_);
    for (std::size_t i = 0; i < states.size(); ++i) {
      const T& c = drive_.system.c(static_cast<int>(i));
      sum = sum + Complex<T>{c * states[i].re, c * states[i].im};
    }
    const T angle = (T(known_samples_ - drive_.whole_delay - 1) - turn_samples_) *
                    T(kTwoPi * frequency_hz * sample_time_s_);
    return sum * Complex<T>{cos(angle), sin(angle)};
  }

 private:
  double known_samples_;
  double sample_time_s_;
  SampledDrive<Masses, T> drive_;
  T turn_samples_{};
};

}  // namespace resonid::fit::detail
