// SPDX-License-Identifier: MIT
// Uses the installed C interface as a stranger would, found by CMake or by pkg-settings.
#include <math.h>
#include <resonid/c/resonid.h>
#include <stdio.h>

int main(void) {
  const double lines_hz[] = {10.0, 15.0};
  resonid_line_bank_settings settings;
  resonid_handle* bank;
  resonid_complex response[2];
  if (resonid_defaults(&settings.head, sizeof settings, RESONID_LINE_BANK) != RESONID_OK) return 1;
  settings.sample_rate_hz = 500.0;
  settings.frequency_hz = lines_hz;
  settings.lines = 2;
  if (resonid_create(&settings.head, &bank, NULL) != RESONID_OK) return 1;
  for (int k = 0; k < 20000; ++k) {
    const double x = cos(0.04 * 3.14159265358979 * k) + cos(0.06 * 3.14159265358979 * k);
    resonid_step(bank, 0.0, x, 0.25 * x);
  }
  resonid_ratios(bank, RESONID_CHANNEL_Y, RESONID_CHANNEL_U, response, 2);
  resonid_destroy(bank);
  printf("resonid %s, gain at 15 Hz: %.6f\n", resonid_version(), response[1].re);
  return fabs(response[1].re - 0.25) < 1e-6 && fabs(response[1].im) < 1e-6 ? 0 : 1;
}
