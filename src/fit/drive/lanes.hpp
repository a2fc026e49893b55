// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <complex>
#include <resonid/base/constants.hpp>
#include <span>
#include <vector>

// Complex numbers of several frequencies side by side, so that the processor works them out together.
namespace resonid::fit::detail {

constexpr int kLanes = 4;
using Lanes = Eigen::Array<double, kLanes, 1>;

/// Products without the checks for infinities that std::complex makes.
struct ComplexLanes {
  Lanes real = Lanes::Zero(), imag = Lanes::Zero();

  ComplexLanes() = default;
  ComplexLanes(const Lanes& re, const Lanes& im) : real(re), imag(im) {}
  ComplexLanes(double re) : real(Lanes::Constant(re)) {}  // NOLINT(google-explicit-constructor): a number

  [[nodiscard]] std::complex<double> at(int lane) const { return {real(lane), imag(lane)}; }
  void set(int lane, const std::complex<double>& value) {
    real(lane) = value.real();
    imag(lane) = value.imag();
  }

  [[gnu::always_inline]] ComplexLanes& operator+=(const ComplexLanes& o) {
    real += o.real;
    imag += o.imag;
    return *this;
  }
  [[gnu::always_inline]] ComplexLanes& operator-=(const ComplexLanes& o) {
    real -= o.real;
    imag -= o.imag;
    return *this;
  }
  [[gnu::always_inline]] ComplexLanes operator-() const { return {-real, -imag}; }
  [[gnu::always_inline]] friend ComplexLanes operator+(ComplexLanes a, const ComplexLanes& b) {
    return a += b;
  }
  [[gnu::always_inline]] friend ComplexLanes operator-(ComplexLanes a, const ComplexLanes& b) {
    return a -= b;
  }
  [[gnu::always_inline]] friend ComplexLanes operator*(double s, const ComplexLanes& a) {
    return {s * a.real, s * a.imag};
  }
  [[gnu::always_inline]] friend ComplexLanes operator*(const ComplexLanes& a, double s) { return s * a; }
};

[[gnu::always_inline]] inline ComplexLanes product(const ComplexLanes& a, const ComplexLanes& b) {
  return {a.real * b.real - a.imag * b.imag, a.real * b.imag + a.imag * b.real};
}
[[gnu::always_inline]] inline ComplexLanes inverse(const ComplexLanes& a) {
  const Lanes scale = 1.0 / (a.real * a.real + a.imag * a.imag);
  return {a.real * scale, -a.imag * scale};
}

/// Some frequencies of a sampled response.
struct Abscissa {
  Lanes frequency_hz;
  Lanes omega;        ///< rad per sample
  ComplexLanes step;  ///< z - 1 = 2j sin(w/2) e^{jw/2}
};

/// The last one is filled up with the last frequency.
inline std::vector<Abscissa> abscissae_of(std::span<const double> frequencies_hz, double sample_time_s) {
  std::vector<Abscissa> found;
  for (std::size_t i = 0; i < frequencies_hz.size(); i += kLanes) {
    Abscissa a;
    for (int l = 0; l < kLanes; ++l) {
      const double f = frequencies_hz[std::min(i + static_cast<std::size_t>(l), frequencies_hz.size() - 1)];
      const double half = kPi * f * sample_time_s;
      a.frequency_hz(l) = f;
      a.omega(l) = kTwoPi * f * sample_time_s;
      a.step.set(l, {-2.0 * std::sin(half) * std::sin(half), 2.0 * std::sin(half) * std::cos(half)});
    }
    found.push_back(a);
  }
  return found;
}

}  // namespace resonid::fit::detail
