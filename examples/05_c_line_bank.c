// SPDX-License-Identifier: MIT
// The C interface: tracks the response of a drive at five lines from input and output, sample by sample, in
// memory that this program gives; takes the margins of the loop from it, and continues from a snapshot.
#include <math.h>
#include <resonid/c/resonid.h>
#include <stdio.h>
#include <string.h>

enum { kLines = 5, kSamples = 20000 };
static const double kRateHz = 1000.0;
static const double kLinesHz[kLines] = {10.0, 20.0, 40.0, 80.0, 160.0};

/// A drive: y(k) = 0.98 y(k-1) + 0.05 u(k-1), and what a P controller makes of it.
typedef struct drive {
  double y, u;
} drive;
static double next_velocity(drive* d) { return d->y = 0.98 * d->y + 0.05 * d->u; }

int main(void) {
  // What is injected: a sum of sines at the lines.
  resonid_excitation_settings injected;
  resonid_defaults(&injected.head, sizeof injected, RESONID_MULTISINE);
  injected.sample_rate_hz = kRateHz;
  injected.amplitude = 0.5;
  injected.lines_hz = kLinesHz;
  injected.lines = kLines;
  resonid_handle* excitation;
  if (resonid_create(&injected.head, &excitation, NULL) != RESONID_OK) return 1;

  resonid_line_bank_settings settings;
  resonid_defaults(&settings.head, sizeof settings, RESONID_LINE_BANK);
  settings.sample_rate_hz = kRateHz;
  settings.frequency_hz = kLinesHz;
  settings.lines = kLines;

  static RESONID_MEMORY(memory, RESONID_LINE_BANK_SIZE);
  resonid_handle* bank;
  resonid_error error = RESONID_ERROR_INIT;
  if (resonid_init(memory, sizeof memory, &settings.head, &bank, &error) != RESONID_OK) {
    fprintf(stderr, "%s %s (%g)\n", error.field, error.requirement, error.value);
    return 1;
  }

  // The servo thread.
  static RESONID_MEMORY(copy, RESONID_LINE_BANK_SIZE);
  const double gain = 8.0;
  drive machine = {0.0, 0.0};
  for (int k = 0; k < kSamples; ++k) {
    double ru;
    const double y = next_velocity(&machine);
    resonid_generate(excitation, &ru, 1);
    machine.u = ru - gain * y;
    resonid_step(bank, 0.0, machine.u, y);
    if (k == kSamples / 2) memcpy(copy, bank, resonid_handle_size(bank));
  }

  // What it knows now, against what the drive's equation says.
  resonid_complex response[kLines], loop[kLines];
  double worst = 0.0;
  resonid_ratios(bank, RESONID_CHANNEL_Y, RESONID_CHANNEL_U, response, kLines);
  for (int i = 0; i < kLines; ++i) {
    const double w = 6.283185307179586 * kLinesHz[i] / kRateHz;
    const double re = cos(w) - 0.98, im = sin(w), power = re * re + im * im;  // G = 0.05/(z - 0.98)
    const double off = hypot(response[i].re - 0.05 * re / power, response[i].im + 0.05 * im / power);
    worst = fmax(worst, off);
    printf("%5.0f Hz  |G| = %.4f  arg G = %7.2f deg\n", kLinesHz[i], hypot(response[i].re, response[i].im),
           57.29577951308232 * atan2(response[i].im, response[i].re));
  }
  printf("largest error: %.1e\n", worst);

  const double numerator[] = {8.0}, denominator[] = {1.0};
  resonid_loop_margins margins;
  resonid_loop_response(numerator, 1, denominator, 1, kRateHz, 0.0, kLinesHz, response, loop, kLines, NULL);
  resonid_margins(kLinesHz, loop, kLines, &margins, sizeof margins, NULL);
  printf("crossover %.1f Hz, phase margin %.1f deg\n", margins.crossover_hz, margins.phase_margin_deg);

  // Outside the servo thread its copy is made a snapshot, for a file; restored, were this another process.
  static unsigned char snapshot[RESONID_LINE_BANK_SIZE];
  resonid_line_bank_results info;
  resonid_snapshot((const resonid_handle*)(void*)copy, snapshot, sizeof snapshot, NULL);
  if (resonid_restore(memory, sizeof memory, snapshot, sizeof snapshot, RESONID_LINE_BANK, &bank, &error) !=
      RESONID_OK) {
    fprintf(stderr, "%s %s\n", error.field, error.requirement);
    return 1;
  }
  resonid_read(bank, RESONID_LINE_BANK, &info.head, sizeof info);
  printf("restored at sample %llu\n", (unsigned long long)info.samples);

  resonid_destroy(excitation);
  return worst < 1e-6 && info.samples == kSamples / 2 + 1 && margins.phase_margin_deg > 60.0 ? 0 : 1;
}
