// SPDX-License-Identifier: MIT
// What is injected: a 21-line multisine, made sample by sample as a drive would, and what it asks of the
// drive.
#include <array>
#include <cstdlib>
#include <iostream>
#include <resonid/online/excitation/metrics.hpp>
#include <resonid/online/excitation/multisine.hpp>

using resonid::online::Multisine;
using resonid::online::MultisineConfig;

int main() {
  std::array<double, 21> lines_hz{};
  for (std::size_t i = 0; i < lines_hz.size(); ++i) lines_hz[i] = 20.0 + 5.0 * static_cast<double>(i);
  const std::array<double, 1> amplitude{0.2};  // one value serves all lines

  MultisineConfig config;
  config.sample_rate_hz = 2000.0;
  config.frequency_hz = lines_hz;
  config.amplitude = amplitude;

  // Only create() can fail. It says which field is wrong and what is required of it.
  auto multisine = Multisine<32>::create(config);
  if (!multisine) {
    std::cerr << multisine.error().field << " " << multisine.error().requirement << "\n";
    return EXIT_FAILURE;
  }

  // In a drive, step() is called once per control cycle: it takes no memory and cannot fail.
  std::array<double, 400> torque{};
  for (double& sample : torque) sample = multisine->step();

  const auto metrics = resonid::online::measure(torque);
  std::cout << "period " << multisine->period_samples() << " samples, rms " << metrics.rms
            << " Nm, crest factor " << metrics.crest_factor << "\n";

  // A configuration that cannot work is refused with a reason.
  config.sample_rate_hz = 200.0;
  const auto refused = Multisine<32>::create(config);
  if (refused) return EXIT_FAILURE;
  std::cout << "at 200 Hz: " << refused.error().field << " " << refused.error().requirement << "\n";

  const bool as_published = metrics.crest_factor < 1.83 && multisine->period_samples() == torque.size();
  return as_published ? EXIT_SUCCESS : EXIT_FAILURE;
}
