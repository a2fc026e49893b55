// SPDX-License-Identifier: MIT
#include "check.h"

static const double kRate = 1000.0, kJ1 = 0.032, kJ2 = 0.02, kK = 110.0, kD = 0.25;

/// Two masses and a shaft with the torque held for a sample: Runge-Kutta in steps a hundred times shorter.
typedef struct drive {
  double v1, v2, twist;
} drive;
static void slope(const drive* x, double torque, drive* out) {
  const double shaft = kK * x->twist + kD * (x->v1 - x->v2);
  out->v1 = (torque - shaft) / kJ1;
  out->v2 = shaft / kJ2;
  out->twist = x->v1 - x->v2;
}
static void advance(drive* x, double torque) {
  enum { kSteps = 20 };
  const double h = 1.0 / (kRate * kSteps);
  for (int i = 0; i < kSteps; ++i) {
    drive a, b, c, d, m;
    slope(x, torque, &a);
    m = (drive){x->v1 + 0.5 * h * a.v1, x->v2 + 0.5 * h * a.v2, x->twist + 0.5 * h * a.twist};
    slope(&m, torque, &b);
    m = (drive){x->v1 + 0.5 * h * b.v1, x->v2 + 0.5 * h * b.v2, x->twist + 0.5 * h * b.twist};
    slope(&m, torque, &c);
    m = (drive){x->v1 + h * c.v1, x->v2 + h * c.v2, x->twist + h * c.twist};
    slope(&m, torque, &d);
    x->v1 += h / 6.0 * (a.v1 + 2.0 * b.v1 + 2.0 * c.v1 + d.v1);
    x->v2 += h / 6.0 * (a.v2 + 2.0 * b.v2 + 2.0 * c.v2 + d.v2);
    x->twist += h / 6.0 * (a.twist + 2.0 * b.twist + 2.0 * c.twist + d.twist);
  }
}

static resonid_physical_settings configuration(uint32_t replay) {
  resonid_physical_settings c;
  CHECK_OK(resonid_defaults(&c.head, sizeof c, RESONID_PHYSICAL));
  c.sample_rate_hz = kRate;
  if (!replay) c.replay_speed = 0;
  c.driven_inertia.value = 1.2 * kJ1;
  c.load_inertia.value = 0.85 * kJ2;
  c.stiffness.value = 1.25 * kK;
  c.damping.value = 0.7 * kD;
  return c;
}

static void finds_the_drive(uint32_t replay) {
  const resonid_physical_settings c = configuration(replay);
  resonid_handle* tracker = NULL;
  CHECK_OK(resonid_create(&c.head, &tracker, NULL));
  CHECK(resonid_handle_size(tracker) == resonid_size(&c.head));
  drive machine = {0.0, 0.0, 0.0};
  uint64_t random = 77;
  double u = 0.0;
  for (int k = 0; k < 12000; ++k) {
    const double y = machine.v1 + 0.005 * noise(&random);
    if (k % 5 == 0) u = noise(&random) > 0.0 ? 1.0 : -1.0;
    const double torque = u - 0.3 * y;
    CHECK_OK(resonid_step(tracker, u, torque, y));
    advance(&machine, torque);
  }
  resonid_physical_results info;
  CHECK_OK(resonid_read(tracker, RESONID_PHYSICAL, &info.head, sizeof info));
  const double truth[4] = {kJ1, kJ2, kK, kD};
  for (int i = 0; i < 4; ++i) {
    CHECK_NEAR(info.value[i], truth[i], 4.0 * info.standard_deviation[i]);
    CHECK(info.standard_deviation[i] > 0.0 && info.standard_deviation[i] < (i == 3 ? 0.05 : 0.01) * truth[i]);
  }
  const double resonance_hz = sqrt(kK * (1.0 / kJ1 + 1.0 / kJ2)) / kTwoPi,
               antiresonance_hz = sqrt(kK / kJ2) / kTwoPi;
  CHECK_NEAR(info.resonance_hz, resonance_hz, 4.0 * info.resonance_std_hz);
  CHECK_NEAR(info.resonance_hz, resonance_hz, 0.01 * resonance_hz);
  CHECK_NEAR(info.antiresonance_hz, antiresonance_hz, 4.0 * info.antiresonance_std_hz);
  CHECK_NEAR(info.noise_rms, 0.005 / sqrt(3.0), 0.1 * 0.005 / sqrt(3.0));
  CHECK(info.ready && info.converged && info.consistent && info.excited && info.plausible &&
        info.samples == 12000);
  CHECK(info.standard_deviation[RESONID_VISCOUS_FRICTION] == 0.0);
  double covariance[64];
  CHECK_OK(resonid_covariance(tracker, covariance, 64));
  CHECK_NEAR(sqrt(covariance[8 * RESONID_STIFFNESS + RESONID_STIFFNESS]),
             info.standard_deviation[RESONID_STIFFNESS], 1e-12);
  CHECK_STATUS(resonid_covariance(tracker, covariance, 16), RESONID_ERROR_RANGE);
  CHECK_OK(resonid_miss(tracker, 10));
  CHECK_OK(resonid_read(tracker, RESONID_PHYSICAL, &info.head, sizeof info));
  CHECK(info.samples == 12010 && info.skipped_samples == 10);
  CHECK_NEAR(info.value[RESONID_STIFFNESS], kK, 0.01 * kK);
  CHECK_OK(resonid_reset(tracker));
  CHECK_OK(resonid_read(tracker, RESONID_PHYSICAL, &info.head, sizeof info));
  CHECK_NEAR(info.value[RESONID_STIFFNESS], 1.25 * kK, 1e-9);
  resonid_destroy(tracker);
}

static void refusals_name_the_field(void) {
  resonid_handle* tracker = NULL;
  resonid_physical_settings c;
  CHECK_OK(resonid_defaults(&c.head, sizeof c, RESONID_PHYSICAL));
  CHECK_REFUSED(resonid_create(&c.head, &tracker, &error), "sample_rate_hz");
  c = configuration(0);
  c.load_inertia.value = 0.0;
  CHECK_REFUSED(resonid_create(&c.head, &tracker, &error), "load_inertia");
  c = configuration(1);
  c.delay_s = 1.0;
  CHECK_REFUSED(resonid_create(&c.head, &tracker, &error), "delay_s");
  c = configuration(1);
  c.coulomb_friction_nm.std = -1.0;
  CHECK_REFUSED(resonid_create(&c.head, &tracker, &error), "coulomb_friction_nm");
  CHECK(tracker == NULL);
}

int main(void) {
  finds_the_drive(0);
  finds_the_drive(1);
  refusals_name_the_field();
  return verdict();
}
