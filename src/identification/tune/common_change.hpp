// SPDX-License-Identifier: MIT
#pragma once

#include <complex>
#include <cstddef>
#include <optional>
#include <resonid/data/estimate.hpp>
#include <span>
#include <vector>

namespace resonid::identification {

/// What all lines together say of one factor (1 + g) exp(-j w tau) between two loops (docs/methods/tune.md
/// 17, step 8). By least squares in the logarithm of their ratio, each line by the variance of its noise: an
/// error e of variance s^2 of a line of size |L| makes one of s^2/(2 |L|^2) in each of both parts.
class CommonChange {
 public:
  /// Of each line its frequency, the loop that was promised and the total standard deviation of what is
  /// measured.
  void add(double frequency_hz, std::complex<double> promised, double std);

  struct Change {
    double gain = 0.0, delay_s = 0.0;
  };
  /// Of loops at the same lines.
  [[nodiscard]] Change of(std::span<const std::complex<double>> loop) const;
  /// Standard deviations by the noise of the lines.
  [[nodiscard]] Change noise() const;
  [[nodiscard]] std::size_t lines() const { return lines_.size(); }

 private:
  struct Line {
    double omega = 0.0;
    std::complex<double> promised;
    double weight = 0.0;
  };
  std::vector<Line> lines_;
};

/// A difference is surely seen where it stands `sure` standard deviations out, and by more than `matters`
/// beyond two of them.
struct Criterion {
  double sure = 0.0, matters = 0.0;

  [[nodiscard]] double threshold(double std) const;
  /// What 90 % of such recordings would show.
  [[nodiscard]] double detectable(double std) const;
};

}  // namespace resonid::identification
