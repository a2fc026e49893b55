// SPDX-License-Identifier: MIT
#include "identification/tune/common_change.hpp"

#include <algorithm>
#include <cmath>
#include <resonid/base/constants.hpp>

namespace resonid::identification {

void CommonChange::add(double frequency_hz, std::complex<double> promised, double std) {
  constexpr double kLeast = 1e-3;  // of a line: nothing is known better, with whatever error bar
  const double size = std::abs(promised), relative = std::max(std / size, kLeast);
  lines_.push_back({kTwoPi * frequency_hz, promised, 2.0 / (relative * relative)});
}

CommonChange::Change CommonChange::of(std::span<const std::complex<double>> loop) const {
  double gain = 0.0, gain_weight = 0.0, turn = 0.0, turn_weight = 0.0;
  for (std::size_t i = 0; i < lines_.size(); ++i) {
    const auto& line = lines_[i];
    if (!(std::abs(loop[i]) > 0.0)) continue;
    const auto ratio = std::log(loop[i] / line.promised);
    gain += line.weight * ratio.real();
    gain_weight += line.weight;
    turn -= line.weight * line.omega * ratio.imag();
    turn_weight += line.weight * line.omega * line.omega;
  }
  if (!(gain_weight > 0.0)) return {};
  return {std::expm1(gain / gain_weight), turn / turn_weight};
}

CommonChange::Change CommonChange::noise() const {
  double gain = 0.0, turn = 0.0;
  for (const auto& line : lines_) {
    gain += line.weight;
    turn += line.weight * line.omega * line.omega;
  }
  return {1.0 / std::sqrt(gain), 1.0 / std::sqrt(turn)};
}

double Criterion::threshold(double std) const { return std::max(sure * std, matters + 2.0 * std); }

double Criterion::detectable(double std) const {
  constexpr double kNinety = 1.2816;  // 90 % quantile of the normal distribution
  return threshold(std) + kNinety * std;
}

}  // namespace resonid::identification
