// SPDX-License-Identifier: MIT
#include <cmath>
#include <resonid/diagnostics/margins.hpp>
#include <span>

namespace resonid::diagnostics {
namespace {

std::optional<double> present(double value) {
  return std::isnan(value) ? std::nullopt : std::optional<double>(value);
}

}  // namespace

std::optional<double> LoopMargins::crossover_hz() const {
  if (crossovers.empty()) return std::nullopt;
  return crossovers.front().frequency_hz;
}

std::optional<double> LoopMargins::phase_margin_deg() const {
  if (crossovers.empty()) return std::nullopt;
  return crossovers.front().phase_margin_deg;
}

LoopMargins loop_margins(const data::FrequencyResponse& loop) {
  LoopMargins margins;
  online::MarginScan<double> scan;
  for (std::size_t i = 0; i < loop.lines(); ++i)
    if (scan.step(loop.frequency_hz[i], loop.value[i]))
      margins.crossovers.push_back({scan.newest_crossover_hz(), scan.newest_phase_margin_deg()});
  const online::LoopMargins<double>& found = scan.margins();
  margins.worst_phase_margin_deg = present(found.worst_phase_margin_deg);
  margins.modulus_margin = present(found.modulus_margin).value_or(0.0);
  margins.modulus_margin_hz = present(found.modulus_margin_hz).value_or(0.0);
  margins.gain_margin_db = present(found.gain_margin_db);
  margins.gain_margin_hz = present(found.gain_margin_hz);
  return margins;
}

NyquistResonance nyquist_resonance(const data::FrequencyResponse& loop) {
  const auto found = online::running_resonance<double>(loop.frequency_hz, loop.value);
  return {present(found.antiresonance_hz), present(found.resonance_hz)};
}

}  // namespace resonid::diagnostics
