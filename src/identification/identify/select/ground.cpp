// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <complex>
#include <identification/criteria.hpp>
#include <identification/identify/select/ground.hpp>
#include <resonid/base/constants.hpp>
#include <resonid/base/detail/statistics.hpp>
#include <utility>
#include <vector>

namespace resonid::identification::detail {

double ground_stiffness_of(const data::FrequencyResponse& g) {
  std::vector<double> stiffness;
  const std::size_t few = std::max<std::size_t>(3, g.lines() / 20);
  for (std::size_t i = 0; i < g.lines() && stiffness.size() < few; ++i) {
    if (!(g.std[i] < kCriteria.usable_line * std::abs(g.value[i]))) continue;
    stiffness.push_back((std::complex<double>(0.0, kTwoPi * g.frequency_hz[i]) / g.value[i]).real());
  }
  return stiffness.empty() ? 0.0 : std::max(0.0, median(std::move(stiffness)));
}

bool leads_at_first(const data::FrequencyResponse& g) {
  constexpr std::size_t kFewest = 3;
  constexpr double kOctave = 2.0;
  std::vector<double> phase;
  double first_hz = 0.0;
  for (std::size_t i = 0; i < g.lines(); ++i) {
    if (!(g.std[i] < kCriteria.usable_line * std::abs(g.value[i]))) continue;
    if (phase.empty()) first_hz = g.frequency_hz[i];
    if (phase.size() >= kFewest && g.frequency_hz[i] > kOctave * first_hz) break;
    phase.push_back(std::arg(g.value[i]));
    if (phase.size() == kFewest && median(phase) > 0.0) return true;
  }
  return !phase.empty() && median(std::move(phase)) > 0.0;
}

fit::DriveModel with_spring_on_other_side(fit::DriveModel model) {
  auto& p = model.parameters;
  // The driven side feels the stiffness J1 s^2 + K1 - c/(s^2 + wa^2), either way of the same K1, c and wa.
  const double k = p.stiffness;
  if (p.motor_ground_stiffness != 0.0) {
    const double ground = std::exchange(p.motor_ground_stiffness, 0.0);
    p.stiffness = k + ground;
    p.load_ground_stiffness = ground * p.stiffness / k;
  } else {
    const double ground = std::exchange(p.load_ground_stiffness, 0.0);
    p.stiffness = k * k / (k + ground);
    p.motor_ground_stiffness = k - p.stiffness;
  }
  const double load = std::pow(p.stiffness / k, 2);
  p.load_inertia *= load;
  p.damping *= load;
  return model;
}

data::FrequencyResponse released(data::FrequencyResponse g, double stiffness) {
  for (std::size_t i = 0; i < g.lines(); ++i) {
    const std::complex<double> spring = stiffness / std::complex<double>(0.0, kTwoPi * g.frequency_hz[i]);
    const auto value = 1.0 / (1.0 / g.value[i] - spring);
    g.std[i] *= std::norm(value / g.value[i]);
    g.value[i] = value;
  }
  return g;
}

}  // namespace resonid::identification::detail
