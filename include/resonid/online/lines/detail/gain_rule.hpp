// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <span>

namespace resonid::online {

/// How a tracker weighs what it has against the newest sample.
enum class GainRule {
  fixed,         ///< K = Phi H^T/(H H^T + lambda): one number for speed against noise.
  placed_poles,  ///< All observer poles at one radius, on the angles of the lines themselves.
};

/// Settling time of a tracker that does not settle within the bounded search at create().
inline constexpr std::size_t kNeverSettles = static_cast<std::size_t>(-1);

/// A tracker counts as settled when whatever the signal did before the first sample, at a peak value of 1,
/// can change the phasor by no more than this.
inline constexpr double kSettledRemainder = 0.01;

/// Gains of a bank of oscillators p_i(k+1) = e^{j w_i} p_i(k) + gain_i e(k) with signal = sum Re p_i +
/// offset.
template <std::size_t MaxLines>
struct BankGain {
  std::array<std::complex<double>, MaxLines> line{};  ///< [line]
  double offset = 0.0;
};

/// Nevaranta 2016, eq. 3.22: gain = e^{jw}/(n + lambda), n the number of oscillators and offset states.
template <std::size_t MaxLines>
BankGain<MaxLines> fixed_gain(std::span<const double> angle_rad, bool offset, double lambda) {
  BankGain<MaxLines> gain;
  const double weight = 1.0 / (static_cast<double>(angle_rad.size()) + (offset ? 1.0 : 0.0) + lambda);
  for (std::size_t i = 0; i < angle_rad.size(); ++i) gain.line[i] = std::polar(weight, angle_rad[i]);
  gain.offset = offset ? weight : 0.0;
  return gain;
}

/// Gains that put the observer poles on m_j = rho l_j, where l_j are the oscillators' own poles e^{+-jw}
/// and 1.
///
/// In modal coordinates H = [1 ... 1], so det(zI - A + KH) = prod_j (z - l_j) (1 + sum_i k_i/(z - l_i)), and
/// its residues give k_i = prod_j (l_i - m_j) / prod_{j != i} (l_i - l_j). A phasor p is two modal states p/2
/// and conj(p)/2: its gain is 2 k_i.
template <std::size_t MaxLines>
BankGain<MaxLines> placed_gain(std::span<const double> angle_rad, bool offset, double radius) {
  using Complex = std::complex<double>;
  const auto gain_at = [&](Complex l, std::size_t own) {
    Complex gain = l * (1.0 - radius);
    for (std::size_t j = 0; j < angle_rad.size(); ++j) {
      const Complex other = std::polar(1.0, angle_rad[j]);
      if (j != own) gain *= (l - radius * other) / (l - other);
      gain *= (l - radius * std::conj(other)) / (l - std::conj(other));
    }
    return gain;
  };
  BankGain<MaxLines> gain;
  for (std::size_t i = 0; i < angle_rad.size(); ++i) {
    const Complex l = std::polar(1.0, angle_rad[i]);
    gain.line[i] = 2.0 * gain_at(l, i);
    if (offset) gain.line[i] *= (l - radius) / (l - 1.0);
  }
  if (offset) gain.offset = gain_at(Complex(1.0), angle_rad.size()).real();
  return gain;
}

}  // namespace resonid::online
