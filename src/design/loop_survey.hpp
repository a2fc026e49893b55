// SPDX-License-Identifier: MIT
#pragma once

#include <complex>
#include <vector>

#include "design/closed_loop.hpp"
#include "design/rational_response.hpp"

namespace resonid::design {

/// One controller around many machines, on lines that are theirs in common.
class LoopSurvey {
 public:
  /// Keeps a reference to the controller.
  LoopSurvey(const LinearController& controller, std::vector<double> lines_hz, double sample_time_s,
             double known_to_hz);

  /// [transfer], the largest over all frequencies.
  [[nodiscard]] std::vector<Peak> largest_of(const RationalResponse& plant,
                                             const std::vector<Transfer>& transfers) const;
  [[nodiscard]] double size_at(const RationalResponse& plant, Transfer transfer, double frequency_hz) const;

 private:
  struct Line {
    std::complex<double> step;  ///< z - 1
    std::complex<double> controller, reference;
    double beyond = 0.0;  ///< weight_beyond()
  };
  [[nodiscard]] std::vector<Line> lines_at(std::span<const double> frequencies_hz) const;

  const LinearController& controller_;
  std::vector<double> lines_hz_;
  double sample_time_s_, known_to_hz_;
  std::vector<Line> lines_;
};

}  // namespace resonid::design
