// SPDX-License-Identifier: MIT
#pragma once

#include <complex>
#include <optional>
#include <resonid/base/expected.hpp>
#include <resonid/data/frequency_response.hpp>
#include <resonid/design/detail/bounds.hpp>
#include <span>
#include <vector>

#include "design/closed_loop.hpp"
#include "design/controller.hpp"

// Gains from a measured response alone (docs/methods/tune.md 7.7): no model, no order, no delay to be known.
namespace resonid::design {

/// A response of which each line is a disk.
struct ResponseDisks {
  std::vector<double> frequencies_hz;
  std::vector<std::complex<double>> centres;  ///< Torque to velocity, every delay inside.
  std::vector<double> radii;
  double sample_time_s = 0.0;
};

/// The disks that hold the truth on *all* lines with a probability of at least `confidence`: each errs with
/// (1 - confidence)/lines, rho = std sqrt(-ln((1 - confidence)/lines)). The response must still have its
/// delay.
[[nodiscard]] expected<ResponseDisks> response_disks(const data::FrequencyResponse& measured,
                                                     double confidence, double sample_time_s);

/// The load's velocity over the motor's, by two numbers: N = (2 za s/wa + 1)/(s^2/wa^2 + 2 za s/wa + 1)
/// (docs/methods/tune.md 2.4). It leaves out the hold and the delay: 2 % below 40 Hz at 500 Hz.
struct AntiResonance {
  double frequency_hz = 0.0, damping_ratio = 0.0;
};

struct ResponseDesign {
  FilteredPi controller;
  double crossover_hz = 0.0;      ///< The last one.
  std::vector<Peak> worst;        ///< Of every bounded transfer, over all disks of all lines.
  double largest_turn_deg = 0.0;  ///< Of 1 + L between neighbouring lines.
  bool stable = true;             ///< By the turns; false: they do not tell it, or that it is unstable.
};

/// The largest integral gain that meets the bounds for every response that goes through the disks. The loop
/// is stable by the turns of 1 + L along the lines, for a drive that integrates the torque below the first
/// line and has no unstable poles.
///
/// Nothing is known between the lines or beyond them: a resonance narrower than their distance, or above the
/// last, is not seen. So that little hides there, |L| stays below 1/2 at the last line, which bounds the
/// gains (2 |L| is that line's Transfer::beyond_band), 1 + L must turn by less than 90 deg from line to line,
/// |L| be above 1 at the first line, and not rise at the last where it is not small; each is refused
/// otherwise. Disks take neighbouring lines for independent, which makes the gains conservative.
[[nodiscard]] expected<ResponseDesign> largest_integral_gain(const ResponseDisks& response,
                                                             std::span<const Biquad> biquads,
                                                             const Bounds& bounds,
                                                             std::optional<AntiResonance> load = {});

/// The same of a controller that is given: stability and the largest value of each bounded transfer, which
/// may be beyond its bound. Refused: lines that are no response from below a crossover on.
[[nodiscard]] expected<ResponseDesign> judged_by_response(const ResponseDisks& response,
                                                          const FilteredPi& controller, const Bounds& bounds,
                                                          std::optional<AntiResonance> load = {});

}  // namespace resonid::design
