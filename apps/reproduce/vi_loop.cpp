// SPDX-License-Identifier: MIT
#include "reproduce/vi_loop.hpp"

#include <algorithm>
#include <cmath>
#include <resonid/base/constants.hpp>
#include <resonid/diagnostics/margins.hpp>

#include "reproduce/vi_experiment.hpp"

namespace resonid::reproduction::vi {
namespace {

constexpr double kLowHz = 1.8;
constexpr double kHighHz = 33.0;

double degrees(double radians) { return radians * 180.0 / kPi; }

}  // namespace

LoopFigures loop_figures(const data::FrequencyResponse& loop) {
  LoopFigures figures;
  figures.fill(std::numeric_limits<double>::quiet_NaN());
  const auto crossover = diagnostics::loop_margins(loop).crossover_hz();
  if (crossover) {
    figures[kCrossover] = *crossover;
    const double d2 = online::nyquist_distances(loop.at(*crossover)).d2;
    figures[kPhaseMargin] = degrees(std::acos(std::clamp(0.5 * (2.0 - d2 * d2), -1.0, 1.0)));
    figures[kModulusMargin] = d2;
    for (std::size_t i = 0; i < loop.lines(); ++i) {
      if (loop.frequency_hz[i] < *crossover) continue;
      if (!(loop.value[i].real() < 0.0 && loop.value[i].imag() < 0.0)) break;
      figures[kModulusMargin] =
          std::min(figures[kModulusMargin], online::nyquist_distances(loop.value[i]).d2);
    }
  }
  const auto resonance = diagnostics::nyquist_resonance(loop);
  if (resonance.resonance_hz) figures[kResonance] = *resonance.resonance_hz;
  if (resonance.antiresonance_hz) figures[kAntiresonance] = *resonance.antiresonance_hz;
  return figures;
}

std::vector<double> loop_grid_hz(double step_hz) { return grid_hz(kLowHz, kHighHz, step_hz); }

std::vector<double> sample_grid_hz(const online::SweepLaw& sweep, double sample_rate_hz) {
  const double per_sample_hz = (sweep.to_hz - sweep.from_hz) / (sweep.duration_s * sample_rate_hz);
  const auto samples = static_cast<std::size_t>(std::lround(sweep.duration_s * sample_rate_hz));
  constexpr double kRounding = 1e-9;
  std::vector<double> grid;
  for (std::size_t k = 0; k < samples; ++k) {
    const double f = sweep.from_hz + per_sample_hz * static_cast<double>(k);
    if (f >= kLowHz - kRounding && f <= kHighHz + kRounding) grid.push_back(f);
  }
  if (per_sample_hz < 0.0) std::reverse(grid.begin(), grid.end());
  return grid;
}

double phase_margin_as_printed(double phase_margin_deg) {
  const double d2 = 2.0 * std::sin(0.5 * phase_margin_deg * kPi / 180.0);  // chord from L to -1
  return degrees(std::acos(0.5 * (2.0 - d2)));
}

}  // namespace resonid::reproduction::vi
