// SPDX-License-Identifier: MIT
// The C interface: inertias, stiffness and damping of a two-mass drive in closed loop, with error bars, and a
// detector that watches the stiffness.
#include <math.h>
#include <resonid/c/resonid.h>
#include <stdio.h>

static const double kRateHz = 1000.0;

/// A motor and a load on a shaft, integrated in short steps (semi-implicit Euler), torque held for a sample.
typedef struct drive {
  double motor, load, twist, stiffness;
} drive;
static void advance(drive* d, double torque) {
  enum { kSteps = 200 };
  const double step_s = 1.0 / (kRateHz * kSteps);
  for (int i = 0; i < kSteps; ++i) {
    const double shaft = d->stiffness * d->twist + 0.2 * (d->motor - d->load);
    d->motor += step_s * (torque - shaft) / 0.02;
    d->load += step_s * shaft / 0.03;
    d->twist += step_s * (d->motor - d->load);
  }
}

int main(void) {
  resonid_physical_settings settings;
  resonid_defaults(&settings.head, sizeof settings, RESONID_PHYSICAL);
  settings.sample_rate_hz = kRateHz;
  settings.replay_speed = 0;  // the machine will change
  settings.driven_inertia.value = 0.025;
  settings.load_inertia.value = 0.025;
  settings.stiffness.value = 150.0;
  settings.damping.value = 0.1;
  settings.stiffness_drift_per_s = 0.05;
  resonid_handle* tracker;
  resonid_error error = RESONID_ERROR_INIT;
  if (resonid_create(&settings.head, &tracker, &error) != RESONID_OK) {
    fprintf(stderr, "%s %s (%g)\n", error.field, error.requirement, error.value);
    return 1;
  }
  resonid_change_settings watched;
  resonid_defaults(&watched.head, sizeof watched, RESONID_CUSUM);
  watched.sample_rate_hz = kRateHz;
  watched.block_s = 0.5;
  watched.baseline_s = 15.0;
  watched.false_alarm_interval_s = 3600.0;
  resonid_handle* detector;
  if (resonid_create(&watched.head, &detector, &error) != RESONID_OK) return 1;
  resonid_excitation_settings injected;
  resonid_defaults(&injected.head, sizeof injected, RESONID_PRBS);
  injected.sample_rate_hz = kRateHz;
  injected.clock_divider = 4;
  injected.register_length = 12;
  resonid_handle* excitation;
  if (resonid_create(&injected.head, &excitation, &error) != RESONID_OK) return 1;

  drive machine = {0.0, 0.0, 0.0, 120.0};
  resonid_physical_results found;
  resonid_change_results change;
  for (int k = 0; k < 60000; ++k) {
    double ru;
    resonid_generate(excitation, &ru, 1);
    const double y = machine.motor, u = ru - 0.3 * y;
    resonid_step(tracker, ru, u, y);
    resonid_read(tracker, RESONID_PHYSICAL, &found.head, sizeof found);
    // What has not converged yet is no baseline.
    resonid_change_step(detector, k < 5000 ? NAN : found.value[RESONID_STIFFNESS],
                        found.standard_deviation[RESONID_STIFFNESS]);
    if (k == 40000) {
      printf("J1 %.4f kgm2, J2 %.4f kgm2, K %.1f +- %.1f Nm/rad, D %.3f Nms/rad, resonance %.2f Hz\n",
             found.value[RESONID_DRIVEN_INERTIA], found.value[RESONID_LOAD_INERTIA],
             found.value[RESONID_STIFFNESS], found.standard_deviation[RESONID_STIFFNESS],
             found.value[RESONID_DAMPING], found.resonance_hz);
      if (fabs(found.value[RESONID_STIFFNESS] - 120.0) > 3.0) return 1;
      machine.stiffness = 105.0;  // the shaft cracks
    }
    advance(&machine, u);
  }
  resonid_read(detector, RESONID_CUSUM, &change.head, sizeof change);
  printf("now K %.1f Nm/rad; change of %.1f found, from %.1f s on\n", found.value[RESONID_STIFFNESS],
         change.size, change.time_s);
  resonid_destroy(excitation);
  resonid_destroy(detector);
  resonid_destroy(tracker);
  return change.alarm && fabs(change.time_s - 40.0) < 2.0 &&
                 fabs(found.value[RESONID_STIFFNESS] - 105.0) < 3.0
             ? 0
             : 1;
}
