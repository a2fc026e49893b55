// SPDX-License-Identifier: MIT
#include <resonid/base/constants.hpp>
#include <resonid/data/two_mass.hpp>

namespace resonid::data {

double resonance_hz(const TwoMassParameters& p) {
  return std::sqrt(p.stiffness * (1.0 / p.driven_inertia + 1.0 / p.load_inertia)) / kTwoPi;
}

double antiresonance_hz(const TwoMassParameters& p) {
  return std::sqrt(p.stiffness / p.load_inertia) / kTwoPi;
}

double resonance_damping_ratio(const TwoMassParameters& p) {
  return 0.5 * p.damping * (1.0 / p.driven_inertia + 1.0 / p.load_inertia) / (kTwoPi * resonance_hz(p));
}

double antiresonance_damping_ratio(const TwoMassParameters& p) {
  return 0.5 * p.damping / (p.load_inertia * kTwoPi * antiresonance_hz(p));
}

}  // namespace resonid::data
