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
#include "design/ends_of_lines.hpp"

// Gains from a measured response alone (docs/methods/tune.md 7.7): no model, no order, no delay to be known.
namespace resonid::design {

/// A response of which each line is a disk.
struct ResponseDisks {
  std::vector<double> frequencies_hz;
  std::vector<std::complex<double>> centres;  ///< Torque to velocity, every delay inside.
  std::vector<double> radii;
  double sample_time_s = 0.0;
  double known_delay_s = 0.0;  ///< Which is inside of them: no mode makes that turn.
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

/// What the lines tell of a loop's stability.
enum class LinesTell {
  stable,                ///< By the turns of 1 + L.
  unstable,              ///< By the same, or by a controller that pushes the wrong way at standstill.
  wrong_sign,            ///< The response begins with more than a quarter turn away from an inertia's.
  turns_far,             ///< 1 + L turns by more than 90 deg from one line to the next.
  passes_zero,           ///< A response within the disks takes 1 + L to 0.
  passes_zero_between,   ///< The same between lines.
  ends_below_resonance,  ///< ends_too_large(), on its flank or before its anti-resonance.
  ends_large             ///< ends_too_large()
};
struct LineStability {
  LinesTell tells = LinesTell::stable;
  double frequency_hz = 0.0;  ///< Where.
  double value = 0.0;         ///< |L| that may be from the last line on; the turn, deg.
  bool grows = false;         ///< The controller does above the last line, by more than 5 %.
};

/// What a judgement by lines asks of a controller outside them.
struct ControllerByLines {
  int integrators = 0;
  double largest_beyond = 0.0;  ///< |C| from the last line on.
  bool grows = false;           ///< By more than 5 % there.
};
/// Refused: one that is not stable but for integrators, or without a gain at standstill, and a pole pair that
/// is half as wide as the lines are apart where it stands.
[[nodiscard]] expected<ControllerByLines> controller_by_lines(const data::TransferFunction& controller,
                                                              const std::vector<double>& lines_hz);

/// A loop on the lines of a response.
struct ResponseLoop {
  double crossover_hz = 0.0;      ///< The last one.
  std::vector<Peak> worst;        ///< Of every bounded transfer, over all disks of all lines.
  double largest_turn_deg = 0.0;  ///< Of 1 + L from line to line.
  LineStability stability;
  MachineEnd end;
  double largest_beyond = 0.0;  ///< |L| that may be from the last line on.
};
struct ResponseDesign : ResponseLoop {
  FilteredPi controller;
};

/// The largest integral gain that meets the bounds for every response that goes through the disks. The loop
/// is stable by the turns of 1 + L along the lines, for a drive that integrates the torque below the first
/// line and has no unstable poles.
///
/// Between the lines the response goes as between_lines() says: a resonance that shows by what its phase
/// falls from one to the next counts as high as that tells, and the bounds hold there too; one that shows at
/// neither line, or above the last one, is not seen. So that little hides there, |L| stays below 1/2 at the
/// last line, which bounds the gains (2 |L| is that line's Transfer::beyond_band), 1 + L must turn by less
/// than 90 deg from line to line, |L| be above 1 at the first line, and not rise at the last where it is not
/// small; each is refused otherwise. Disks take neighbouring lines for independent, which makes the gains
/// conservative.
[[nodiscard]] expected<ResponseDesign> largest_integral_gain(const ResponseDisks& response,
                                                             std::span<const Biquad> biquads,
                                                             const Bounds& bounds,
                                                             std::optional<AntiResonance> load = {});

/// The same of a controller that is given: stability, which may be untold, and the largest value of each
/// bounded transfer, which may be beyond its bound.
///
/// The controller is known between the lines and below them; where the lines are farther apart than a pole
/// pair of it is wide ("controller" is the field), or do not reach from below a crossover on ("response"), it
/// is refused, and so is one that is not stable but for integrators. |L| at the last line counts as many
/// times larger as the controller becomes beyond it.
[[nodiscard]] expected<ResponseLoop> judged_by_response(const ResponseDisks& response,
                                                        const data::TransferFunction& controller,
                                                        const Bounds& bounds,
                                                        std::optional<AntiResonance> load = {});

}  // namespace resonid::design
