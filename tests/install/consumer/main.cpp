// SPDX-License-Identifier: MIT
// Uses the installed package as a stranger would: makes an excitation and tracks one of its lines.
#include <array>
#include <cmath>
#include <cstdio>
#include <resonid/online/excitation/multisine.hpp>
#include <resonid/online/lines/kalman_bank.hpp>

int main() {
  const std::array lines_hz{10.0, 15.0};
  const std::array amplitude{1.0, 0.5};
  resonid::online::MultisineConfig excitation;
  excitation.sample_rate_hz = 500.0;
  excitation.frequency_hz = lines_hz;
  excitation.amplitude = amplitude;
  auto multisine = resonid::online::Multisine<2>::create(excitation).value();

  resonid::online::KalmanBankConfig config;
  config.sample_rate_hz = 500.0;
  config.frequency_hz = lines_hz;
  auto bank = resonid::online::KalmanBank<double, 2>::create(config).value();

  for (int k = 0; k < 20000; ++k) bank.step(multisine.step());
  const double found = std::abs(bank.phasor(1));
  std::printf("amplitude at 15 Hz: %.6f\n", found);
  return bank.ready() && std::abs(found - 0.5) < 1e-6 ? 0 : 1;
}
