// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <resonid/base/constants.hpp>
#include <resonid/base/linear_system.hpp>
#include <resonid/data/record.hpp>
#include <resonid/fit/drive_model.hpp>
#include <span>

// The drive's equations for any scalar type, so that Ceres' automatic differentiation gives exact derivatives
// of the *sampled* model: a continuous model fitted to sampled data errs by 1 % in the resonance (ORACLE F).
namespace resonid::fit::detail {

inline double plain(double x) { return x; }
template <class Jet>
double plain(const Jet& x) {
  return x.a;
}

/// Natural parameters [J1 J2 K D B Td] from the fit's coordinates: logarithms of the positive ones, B and Td
/// in units that make them of order one.
struct Coordinates {
  double viscous_unit = 1.0;
  double sample_time_s = 1.0;

  template <class T>
  [[nodiscard]] data::TwoMass<T> parameters(const T* x) const {
    using std::exp;
    return {exp(x[kDrivenInertia]), exp(x[kLoadInertia]), exp(x[kStiffness]), exp(x[kDamping]),
            x[kViscousFriction] * T(viscous_unit)};
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

/// Range of a fitted delay. Negative ones belong to an input that was measured rather than held: its samples
/// look up to half a sample ahead of the hold that the model assumes.
inline constexpr double kMinimumDelaySamples = -1.0;
inline constexpr double kMaximumDelaySamples = 50.0;

/// The fits search inertias, stiffness and damping within a factor of 1000 (damping: 1e5) around their start;
/// a step that leaves it, or is not finite, is refused.
class SearchRange {
 public:
  explicit SearchRange(std::span<const double> start) { std::copy_n(start.begin(), kDelay, start_.begin()); }

  template <class T>
  [[nodiscard]] bool contains(const T* x) const {
    for (int i = 0; i < kViscousFriction; ++i)
      if (!(std::abs(plain(x[i]) - start_[static_cast<std::size_t>(i)]) <= (i == kDamping ? 11.5 : 6.9)))
        return false;
    return std::isfinite(plain(x[kViscousFriction])) && std::isfinite(plain(x[kDelay]));
  }

 private:
  std::array<double, kDelay> start_{};
};

/// States 0 ... 2 are those of data::continuous_system, state 3 is the position. A rigid machine uses 0 and 3
/// only.
inline constexpr int kStates = 4;

template <class T>
LinearSystem<T, kStates> continuous_drive(Structure structure, const data::TwoMass<T>& p) {
  LinearSystem<T, kStates> s;
  s.a.setZero();
  s.b.setZero();
  s.c.setZero();
  if (structure == Structure::two_mass) {
    const auto core = data::continuous_system(p);
    s.a.template topLeftCorner<3, 3>() = core.a;
    s.b.template head<3>() = core.b;
  } else {
    s.a(0, 0) = -p.viscous_friction / p.driven_inertia;
    s.b(0) = T(1.0) / p.driven_inertia;
  }
  s.a(3, 0) = T(1.0);
  s.c(0) = T(1.0);
  return s;
}

template <class T>
LinearSystem<T, kStates> hold(const LinearSystem<T, kStates>& s, const T& step) {
  double norm = 0.0;
  for (int i = 0; i < kStates; ++i) {
    double row = std::abs(plain(s.b(i)));
    for (int j = 0; j < kStates; ++j) row += std::abs(plain(s.a(i, j)));
    norm = std::max(norm, row);
  }
  return zero_order_hold<T, kStates>(s, step, norm * std::abs(plain(step)));
}

/// What the fits simulate: x(j+1) = a x(j) + b u(j),  y(j+1+whole_delay) = c x(j) + d u(j).
template <class T>
struct SampledDrive {
  LinearSystem<T, kStates> system;
  int whole_delay = 0;
};

/// Output delayed by `delay_samples` >= -1 (whole samples and an exact fraction: the state between two
/// samples).
template <class T>
SampledDrive<T> sampled_drive(Structure structure, const data::TwoMass<T>& p, data::OutputQuantity quantity,
                              const T& delay_samples, double sample_time_s) {
  const auto continuous = continuous_drive(structure, p);
  SampledDrive<T> drive;
  drive.system = hold(continuous, T(sample_time_s));
  drive.whole_delay = static_cast<int>(std::floor(plain(delay_samples) + 1e-9));
  const T fraction = delay_samples - T(drive.whole_delay);
  const auto partial = hold(continuous, (T(1.0) - fraction) * T(sample_time_s));
  Eigen::Matrix<T, 1, kStates> row = Eigen::Matrix<T, 1, kStates>::Zero();
  T feed_through(0.0);
  switch (quantity) {
    case data::OutputQuantity::velocity:
      row(0) = T(1.0);
      break;
    case data::OutputQuantity::position:
      row(3) = T(1.0);
      break;
    case data::OutputQuantity::acceleration:  // sampled just before the input changes
      row = continuous.a.row(0);
      feed_through = continuous.b(0);
      break;
  }
  drive.system.c = row * partial.a;
  drive.system.d = (row * partial.b)(0) + feed_through;
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
template <int Order, class T>
std::array<Complex<T>, Order> state_response(const LinearSystem<T, kStates>& s, double frequency_hz,
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

/// Torque to velocity, no delay.
template <class T>
Complex<T> velocity_response(Structure structure, const LinearSystem<T, kStates>& held, double frequency_hz,
                             double sample_time_s) {
  return structure == Structure::two_mass ? state_response<3>(held, frequency_hz, sample_time_s)[0]
                                          : state_response<1>(held, frequency_hz, sample_time_s)[0];
}

/// Torque to delayed velocity, times exp(j w known delay): what is measured once the known delay is taken
/// out.
///
/// For delays of whole samples that is the velocity's response turned by the rest of the delay. A fraction of
/// a sample is seen through the hold, which near the Nyquist frequency is more than a turn. A negative delay
/// says that the input was measured and not held; then it is a turn and no more.
template <class T>
class MeasuredResponse {
 public:
  MeasuredResponse(Structure structure, const data::TwoMass<T>& p, const T& fitted_delay_samples,
                   double known_delay_samples, double sample_time_s)
      : structure_(structure), known_samples_(known_delay_samples), sample_time_s_(sample_time_s) {
    const T delay = fitted_delay_samples + T(known_delay_samples);
    const bool ahead = plain(delay) < 0.0;
    turn_samples_ = ahead ? delay : T(0.0);
    drive_ =
        sampled_drive(structure, p, data::OutputQuantity::velocity, ahead ? T(0.0) : delay, sample_time_s);
  }

  Complex<T> operator()(double frequency_hz) const {
    using std::cos;
    using std::sin;
    Complex<T> sum{drive_.system.d, T(0.0)};
    const auto add = [&](const auto& states) {
      for (std::size_t i = 0; i < states.size(); ++i) {
        const T& c = drive_.system.c(static_cast<int>(i));
        sum = sum + Complex<T>{c * states[i].re, c * states[i].im};
      }
    };
    if (structure_ == Structure::two_mass)
      add(state_response<3>(drive_.system, frequency_hz, sample_time_s_));
    else
      add(state_response<1>(drive_.system, frequency_hz, sample_time_s_));
    const T angle = (T(known_samples_ - drive_.whole_delay - 1) - turn_samples_) *
                    T(kTwoPi * frequency_hz * sample_time_s_);
    return sum * Complex<T>{cos(angle), sin(angle)};
  }

 private:
  Structure structure_;
  double known_samples_;
  double sample_time_s_;
  SampledDrive<T> drive_;
  T turn_samples_{};
};

}  // namespace resonid::fit::detail
