// SPDX-License-Identifier: MIT
#include "check.h"

static const double kRate = 1000.0;

static resonid_guard_settings configuration(void) {
  resonid_guard_settings c;
  CHECK_OK(resonid_defaults(&c.head, sizeof c, RESONID_GUARD));
  c.sample_rate_hz = kRate;
  c.amplitude = 2.0;
  c.ramp_in_s = 0.1;
  c.ramp_out_s = 0.1;
  c.velocity_limit = 50.0;
  c.torque_limit = 10.0;
  return c;
}

/// An inertia of 0.01 kgm2 under a constant excitation runs away: it is stopped below the machine's own
/// limit.
static void velocity_trips_below_the_limit(void) {
  const resonid_guard_settings c = configuration();
  resonid_handle* guard = NULL;
  CHECK_OK(resonid_create(&c.head, &guard, NULL));
  double velocity = 0.0, fastest = 0.0, before = 0.0;
  resonid_guard_results info;
  for (int k = 0; k < 3000; ++k) {
    double injected;
    CHECK_OK(resonid_guard_step(guard, 1.0, 0.0, velocity, 0.0, &injected));
    if (k < 100) {  // raised cosine
      CHECK_NEAR(injected, 0.5 * (1.0 - cos(0.5 * kTwoPi * (k + 1) / 100.0)), 0.02);
      CHECK(injected >= before);
    }
    before = injected;
    velocity += injected / 0.01 / kRate;
    fastest = fmax(fastest, velocity);
  }
  CHECK_OK(resonid_read(guard, RESONID_GUARD, &info.head, sizeof info));
  CHECK(info.tripped && info.stopped && info.reason == RESONID_STOP_VELOCITY && info.injected == 0.0);
  CHECK(fastest > 40.0 && fastest < c.velocity_limit);
  CHECK(info.stop_value >= info.stop_limit && info.stop_limit <= c.margin * c.velocity_limit);
  CHECK(info.stop_sample > 0 && info.stop_sample < 3000);
  uint32_t accepted = 0;
  CHECK_OK(resonid_acknowledge(guard, &accepted));
  CHECK(accepted == 1);
  CHECK_OK(resonid_read(guard, RESONID_GUARD, &info.head, sizeof info));
  CHECK(!info.tripped && info.reason == RESONID_STOP_NONE);
  resonid_destroy(guard);
}

/// The command with the excitation would pass the limit's margin: cut at once, and then taken away.
static void torque_trips_below_the_limit(void) {
  const resonid_guard_settings c = configuration();
  resonid_handle* guard = NULL;
  CHECK_OK(resonid_create(&c.head, &guard, NULL));
  resonid_guard_results info;
  for (int k = 0; k < 500; ++k) {
    double injected;
    CHECK_OK(resonid_guard_step(guard, 2.0, 8.5, 0.0, 0.0, &injected));
    CHECK(8.5 + injected <= c.margin * c.torque_limit + 1e-12);
  }
  CHECK_OK(resonid_read(guard, RESONID_GUARD, &info.head, sizeof info));
  CHECK(info.tripped && info.stopped && info.reason == RESONID_STOP_TORQUE);
  CHECK_NEAR(info.stop_limit, 9.0, 1e-12);
  resonid_destroy(guard);
}

static void a_requested_stop_ramps_out(void) {
  const resonid_guard_settings c = configuration();
  resonid_handle* guard = NULL;
  CHECK_OK(resonid_create(&c.head, &guard, NULL));
  double injected = 0.0;
  for (int k = 0; k < 500; ++k) CHECK_OK(resonid_guard_step(guard, 1.0, 3.0, 0.0, 0.0, &injected));
  CHECK(injected == 1.0);
  CHECK_OK(resonid_stop(guard));
  for (int k = 0; k < 200; ++k) {
    const double before = injected;
    CHECK_OK(resonid_guard_step(guard, 1.0, 3.0, 0.0, 0.0, &injected));
    CHECK(injected <= before && before - injected < 0.02);
  }
  resonid_guard_results info;
  CHECK_OK(resonid_read(guard, RESONID_GUARD, &info.head, sizeof info));
  CHECK(info.reason == RESONID_STOP_REQUESTED && info.stopped && !info.tripped && injected == 0.0);
  resonid_destroy(guard);
}

static void a_failed_step_injects_nothing(void) {
  double injected = 7.0;
  CHECK_STATUS(resonid_guard_step(NULL, 1.0, 0.0, 0.0, 0.0, &injected), RESONID_ERROR_NULL);
  CHECK(injected == 0.0);
  for (uint32_t i = 0; i <= RESONID_STOP_WATCHDOG_SILENT; ++i)
    CHECK(strlen(resonid_stop_reason_string(i)) > 3 && strcmp(resonid_stop_reason_string(i), "unknown") != 0);
  CHECK(strcmp(resonid_stop_reason_string(10), "unknown") == 0);
}

/// A 16-bit counter of 4096 counts per turn at constant speed wraps many times; a gap and a bit error do no
/// harm.
static void encoder_follows_the_wraps(void) {
  resonid_encoder_settings c;
  CHECK_OK(resonid_defaults(&c.head, sizeof c, RESONID_ENCODER_COUNTER));
  c.sample_rate_hz = kRate;
  c.bits = 16;
  c.counts_per_turn = 4096;
  c.largest_velocity = 200.0;
  resonid_handle* encoder = NULL;
  CHECK_OK(resonid_create(&c.head, &encoder, NULL));
  const int64_t per_sample = -37;
  resonid_encoder_results info;
  for (int64_t k = 0; k < 20000; ++k) {
    const uint64_t raw = (uint64_t)(5000 + per_sample * k) & 0xFFFF;
    double velocity;
    if (k >= 100 && k < 110) {
      if (k == 100) CHECK_OK(resonid_miss(encoder, 10));
      continue;
    }
    CHECK_OK(resonid_encoder_step(encoder, k == 500 ? raw ^ 0x4000 : raw, &velocity));
    if (k == 0 || k == 500)
      CHECK(isnan(velocity));
    else
      CHECK_NEAR(velocity, (double)per_sample * kRate * kTwoPi / 4096.0, 1e-9);
  }
  CHECK_OK(resonid_read(encoder, RESONID_ENCODER_COUNTER, &info.head, sizeof info));
  CHECK(info.position_counts == per_sample * 19999 && info.certain);
  CHECK_NEAR(info.position, (double)(per_sample * 19999) * kTwoPi / 4096.0, 1e-9);
  CHECK(info.samples == 20000 && info.skipped_samples == 11 && info.implausible_samples == 1);
  CHECK_OK(resonid_encoder_set_position(encoder, 12));
  CHECK_OK(resonid_read(encoder, RESONID_ENCODER_COUNTER, &info.head, sizeof info));
  CHECK(info.position_counts == 12);
  resonid_destroy(encoder);
}

static void refusals_name_the_field(void) {
  resonid_handle* guard = NULL;
  resonid_guard_settings c = configuration();
  c.margin = 1.5;
  CHECK_REFUSED(resonid_create(&c.head, &guard, &error), "margin");
  c = configuration();
  c.position_high = 1.0;
  CHECK_REFUSED(resonid_create(&c.head, &guard, &error), "deceleration");
  c.oscillation_signal = 2;
  CHECK_REFUSED(resonid_create(&c.head, &guard, &error), "oscillation_signal");
  resonid_handle* encoder = NULL;
  resonid_encoder_settings e;
  CHECK_OK(resonid_defaults(&e.head, sizeof e, RESONID_ENCODER_COUNTER));
  e.sample_rate_hz = kRate;
  CHECK_REFUSED(resonid_create(&e.head, &encoder, &error), "counts_per_turn");
  CHECK(guard == NULL && encoder == NULL);
}

int main(void) {
  velocity_trips_below_the_limit();
  torque_trips_below_the_limit();
  a_requested_stop_ramps_out();
  a_failed_step_injects_nothing();
  encoder_follows_the_wraps();
  refusals_name_the_field();
  return verdict();
}
