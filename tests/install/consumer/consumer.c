// SPDX-License-Identifier: MIT
// Uses the installed C interface as a stranger would, found by CMake or by pkg-config.
#include <math.h>
#include <resonid/c/resonid.h>
#include <stdio.h>

int main(void) {
  const double lines_hz[] = {10.0, 15.0};
  resonid_line_bank_config config;
  resonid_line_bank* bank;
  resonid_complex response[2];
  if (resonid_line_bank_defaults(&config, sizeof config) != RESONID_OK) return 1;
  config.sample_rate_hz = 500.0;
  config.frequency_hz = lines_hz;
  config.lines = 2;
  if (resonid_line_bank_create(&config, &bank, NULL) != RESONID_OK) return 1;
  for (int k = 0; k < 20000; ++k) {
    const double x = cos(0.04 * 3.14159265358979 * k) + cos(0.06 * 3.14159265358979 * k);
    resonid_line_bank_step(bank, x, 0.25 * x);
  }
  resonid_line_bank_responses(bank, response, 2);
  resonid_destroy(bank);
  printf("resonid %s, gain at 15 Hz: %.6f\n", resonid_version(), response[1].re);
  return fabs(response[1].re - 0.25) < 1e-6 && fabs(response[1].im) < 1e-6 ? 0 : 1;
}
