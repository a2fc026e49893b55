// SPDX-License-Identifier: MIT
// Uses the installed package as a stranger would: a drive, its sampled response, a resonance.
#include <cmath>
#include <cstdio>
#include <resonid/data/transfer_function.hpp>
#include <resonid/data/two_mass.hpp>

int main() {
  resonid::data::TwoMassParameters drive;
  drive.driven_inertia = 0.032;
  drive.load_inertia = 0.032;
  drive.stiffness = 143.75;
  drive.damping = 0.3;
  const double resonance = resonid::data::resonance_hz(drive);
  std::printf("resonance %.2f Hz\n", resonance);
  return std::abs(resonance - 15.086) < 0.01 ? 0 : 1;
}
