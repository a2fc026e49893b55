// SPDX-License-Identifier: MIT
// The C interface: an axis that excites a two-mass drive within limits, follows its lines in closed loop, and
// tells resonance and margins with error bars until it is stopped.
#include <math.h>
#include <resonid/c/resonid.h>
#include <stdio.h>

enum { kLines = 24 };
static const double kRateHz = 1000.0;
static const double kGain[] = {0.6}, kOne[] = {1.0};

/// A motor and a load on a shaft, integrated in short steps (semi-implicit Euler), torque held for a sample.
typedef struct drive {
  double motor, load, twist;
} drive;
static void advance(drive* d, double torque) {
  enum { kSteps = 200 };
  const double step_s = 1.0 / (kRateHz * kSteps);
  for (int i = 0; i < kSteps; ++i) {
    const double shaft = 120.0 * d->twist + 0.2 * (d->motor - d->load);
    d->motor += step_s * (torque - shaft) / 0.02;
    d->load += step_s * shaft / 0.03;
    d->twist += step_s * (d->motor - d->load);
  }
}

int main(void) {
  double lines_hz[kLines];
  for (int i = 0; i < kLines; ++i) lines_hz[i] = 2.0 + i;
  resonid_axis_settings settings;
  resonid_defaults(&settings.head, sizeof settings, RESONID_AXIS_LINES);
  settings.sample_rate_hz = kRateHz;
  settings.lines_hz = lines_hz;
  settings.lines = kLines;
  settings.controller_numerator = kGain;
  settings.controller_denominator = kOne;
  settings.controller_numerator_count = settings.controller_denominator_count = 1;
  settings.row_every_samples = 100;
  settings.injects = 1;
  resonid_handle* axis;
  resonid_error error = RESONID_ERROR_INIT;
  if (resonid_create(&settings.head, &axis, &error) != RESONID_OK) {
    fprintf(stderr, "%s %s (%g)\n", error.field, error.requirement, error.value);
    return 1;
  }
  resonid_guard_settings limits;
  resonid_defaults(&limits.head, sizeof limits, RESONID_GUARD);
  limits.amplitude = 0.5;
  limits.torque_limit = 5.0;
  limits.velocity_limit = 20.0;
  if (resonid_axis_start(axis, RESONID_INJECT_MULTISINE, 0.0, &limits, &error) != RESONID_OK) {
    fprintf(stderr, "%s %s (%g)\n", error.field, error.requirement, error.value);
    return 1;
  }

  drive machine = {0.0, 0.0, 0.0};
  resonid_axis_results found;
  for (int k = 0; k < 20000; ++k) {  // the servo thread
    const double y = machine.motor, control = -kGain[0] * y;
    double ru;
    uint32_t row;
    resonid_axis_excite(axis, control, y, NAN, 0.0, &ru);
    resonid_axis_step(axis, ru, control + ru, y, &row);
    if (row != 0) resonid_read(axis, RESONID_AXIS_LINES, &found.head, sizeof found);
    if (k == 15000) resonid_stop(axis);
    advance(&machine, control + ru);
    if (k == 15000) {
      printf("%s: resonance %.2f +- %.2f Hz, anti-resonance %.2f Hz\n", resonid_verdict_string(found.verdict),
             found.resonance_hz.value, found.resonance_hz.std, found.antiresonance_hz.value);
      printf("crossover %.2f Hz, phase margin %.1f deg, modulus margin %.2f\n", found.crossover_hz.value,
             found.phase_margin_deg.value, found.modulus_margin.value);
      if (found.verdict != RESONID_VERDICT_TRUSTED || fabs(found.resonance_hz.value - 15.92) > 0.1) return 1;
    }
  }
  resonid_read(axis, RESONID_AXIS_LINES, &found.head, sizeof found);
  printf("then %s\n", resonid_stop_reason_string(found.stop_reason));
  resonid_destroy(axis);
  return found.injecting == 0 && found.stop_reason == RESONID_STOP_REQUESTED ? 0 : 1;
}
