// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <resonid/data/frequency_response.hpp>
#include <resonid/online/lines/detail/sweep.hpp>
#include <string_view>
#include <vector>

namespace resonid::reproduction::vi {

/// What the source reads off the Nyquist curve by distances (Nevaranta 2016, Pub. VI, eqs. 25-27).
enum LoopQuantity : std::size_t {
  kCrossover,
  kPhaseMargin,
  kModulusMargin,
  kResonance,
  kAntiresonance,
  kLoopQuantities
};
struct LoopQuantityName {
  std::string_view name;
  std::string_view unit;
};
inline constexpr std::array<LoopQuantityName, kLoopQuantities> kLoopNames{{{"crossover fc", "Hz"},
                                                                           {"phase margin Pm", "deg"},
                                                                           {"modulus margin Mm", ""},
                                                                           {"resonance f_res", "Hz"},
                                                                           {"anti-resonance f_ares", "Hz"}}};

/// One value per quantity; not a number where the curve does not show it.
using LoopFigures = std::array<double, kLoopQuantities>;

/// The published rules on a loop given at ascending frequencies.
///
///   fc        first downward crossing of d1 = |L| = 1
///   Pm        acos((2 - d2^2)/2), d2 = |1 + L| at fc (the printed eq. 27 lacks the square)
///   Mm        least d2 from fc on while the curve stays in region I (Im < 0, Re < 0): not the least of the
///             whole curve, which a loop may take later
///   f_ares, f_res   least d1 and largest d2 in region II (Im < 0, Re > 0)
[[nodiscard]] LoopFigures loop_figures(const data::FrequencyResponse& loop);

/// Grids from 1.8 to 33 Hz on which an estimated loop is read. The source shows its curve "sample by sample"
/// (section 3.3); the rules take a first crossing and extremes, so the finer the grid, the more a noisy curve
/// gives them to choose from. Why 0.04 Hz, and what depends on it: section Figure 5 of the page.
inline constexpr double kCleanStepHz = 0.01;
inline constexpr double kNoisyStepHz = 0.04;
[[nodiscard]] std::vector<double> loop_grid_hz(double step_hz);

/// The frequencies within 1.8 ... 33 Hz at which the sweep is at its samples, ascending.
[[nodiscard]] std::vector<double> sample_grid_hz(const online::SweepLaw& sweep, double sample_rate_hz);

/// The literal eq. (27), acos((d2 - 2)/(-2)), for a curve that has this phase margin.
[[nodiscard]] double phase_margin_as_printed(double phase_margin_deg);

}  // namespace resonid::reproduction::vi
