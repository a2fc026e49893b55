// SPDX-License-Identifier: MIT
#include "check.h"

RESONID_MEMORY(memory, RESONID_CONTROL_SIZE);

static resonid_control_settings plain_settings(void) {
  resonid_control_settings s;
  CHECK_OK(resonid_defaults(&s.head, sizeof s, RESONID_CONTROL));
  s.sample_rate_hz = 1000.0;
  s.kp = 0.6;
  s.ki = 25.0;
  return s;
}
static resonid_handle* made(const resonid_control_settings* s) {
  resonid_handle* control = NULL;
  CHECK_OK(resonid_init(memory, sizeof memory, &s->head, &control, NULL));
  return control;
}
static resonid_control_results said_by(const resonid_handle* control) {
  resonid_control_results r;
  memset(&r, 0, sizeof r);
  CHECK_OK(resonid_read(control, RESONID_CONTROL, &r.head, sizeof r));
  return r;
}
static double stepped(resonid_handle* control, double reference, double velocity, double position) {
  double torque = NAN;
  CHECK_OK(resonid_control_step(control, reference, velocity, position, 0.0, 0.0, &torque));
  return torque;
}

/// The law with one biquad by its difference equation, which stands here.
static void it_is_its_difference_equation(uint32_t precision) {
  const double w = kTwoPi * 54.0, q = w / tan(0.5 * w / 1000.0), zn = 0.2, zd = 0.6;
  const double b[3] = {q * q + 2.0 * zn * w * q + w * w, 2.0 * (w * w - q * q),
                       q * q - 2.0 * zn * w * q + w * w};
  const double a[3] = {q * q + 2.0 * zd * w * q + w * w, b[1], q * q - 2.0 * zd * w * q + w * w};
  const resonid_biquad notch = {54.0, 0.2, 0.6};
  resonid_control_settings s = plain_settings();
  s.biquads = &notch;
  s.biquad_count = 1;
  s.set_point_weight = 0.5;
  s.precision = precision;
  resonid_handle* control = made(&s);
  double x1 = 0.0, x2 = 0.0, y1 = 0.0, y2 = 0.0, sum = 0.0;
  uint64_t random = 4;
  for (int k = 0; k < 1000; ++k) {
    const double r = k < 500 ? 2.0 : -1.0, y = (double)(float)noise(&random);
    sum += 25.0 / 1000.0 * (r - y);
    const double x = 0.6 * (0.5 * r - y) + sum;
    const double u = (b[0] * x + b[1] * x1 + b[2] * x2 - a[1] * y1 - a[2] * y2) / a[0];
    x2 = x1;
    x1 = x;
    y2 = y1;
    y1 = u;
    double torque = NAN;
    CHECK_OK(resonid_control_step(control, r, y, NAN, NAN, 0.25, &torque));
    CHECK_NEAR(torque, u + 0.25, precision == RESONID_FLOAT ? 1e-3 : 1e-10);
  }
  const resonid_control_results said = said_by(control);
  CHECK(said.samples == 1000 && said.skipped_samples == 0 && !said.limited && !said.in_gap);
  CHECK_NEAR(said.integral, sum, 1e-3);
  CHECK_NEAR(said.ki, 25.0, 1e-5);
}

/// A cascade, its position measured or summed: P over PI by hand.
static void it_is_a_cascade(uint32_t sums) {
  resonid_control_settings s = plain_settings();
  s.kv = 10.0;
  s.sums_velocity = sums;
  resonid_handle* control = made(&s);
  double x = 0.0, sum = 0.0;
  if (sums) {
    x = 0.5;
    CHECK_OK(resonid_control_set_position(control, x));
  }
  for (int k = 0; k < 300; ++k) {
    const double y = sin(0.1 * k);
    x += y / 1000.0;
    const double r = 10.0 * (1.0 - x) + 0.3;
    sum += 25.0 / 1000.0 * (r - y);
    double torque = NAN;
    CHECK_OK(resonid_control_step(control, 1.0, y, sums ? NAN : x, 0.3, 0.0, &torque));
    CHECK_NEAR(torque, 0.6 * (r - y) + sum, 1e-11);
  }
  CHECK_NEAR(said_by(control).position, x, 1e-14);
}

/// Gains, schedules and filters that are exchanged in motion leave a constant torque alone.
static void changes_make_no_jump(void) {
  const resonid_gain_node nodes[] = {{0.0, 0.5, 0.0}, {1.0, 3.0, 0.0}};
  const resonid_biquad notches[] = {{54.0, 0.2, 0.6}, {120.0, 0.05, 0.9}};
  resonid_control_settings s = plain_settings();
  s.ki = 0.0;
  resonid_handle* control = made(&s);
  for (int k = 0; k < 1000; ++k) {
    if (k == 100) CHECK_OK(resonid_control_set_gains(control, 4.0, 0.0, NULL));
    if (k == 200) CHECK_OK(resonid_control_set_schedule(control, nodes, 2, NULL));
    if (k == 400) CHECK_OK(resonid_control_exchange_filters(control, notches, 2, 20, 100, NULL));
    if (k == 600) CHECK_OK(resonid_control_exchange_filters(control, NULL, 0, 0, 1, NULL));
    CHECK_NEAR(stepped(control, 5.0, 1.0, 0.002 * k), 0.6 * 4.0, 1e-11);
    CHECK(said_by(control).exchanging == (k >= 400 && k < 519));
  }
  CHECK_NEAR(said_by(control).kp, 3.0, 1e-15);
}

static void the_limit_winds_nothing_up_and_gaps_bring_rest(void) {
  resonid_control_settings s = plain_settings();
  s.torque_limit = 2.0;
  s.longest_gap_samples = 3;
  resonid_handle* control = made(&s);
  for (int k = 0; k < 5000; ++k) CHECK(stepped(control, 1.0, 0.0, NAN) <= 2.0);
  CHECK(said_by(control).limited && said_by(control).integral <= 1.4);
  CHECK(stepped(control, 0.0, 0.5, NAN) < 2.0);
  const double torque = said_by(control).torque;
  CHECK(stepped(control, NAN, 0.5, NAN) == torque);
  CHECK_OK(resonid_miss(control, 2));
  CHECK(said_by(control).torque == torque && !said_by(control).in_gap);
  CHECK_OK(resonid_miss(control, 1));
  CHECK(said_by(control).torque == 0.0 && said_by(control).in_gap && said_by(control).skipped_samples == 4);
}

static void refusals_name_the_field(void) {
  resonid_control_settings s = plain_settings();
  resonid_handle* control = NULL;
  const resonid_biquad bad[] = {{54.0, 0.2, 0.6}, {600.0, 0.2, 0.6}};
  const resonid_gain_node falling[] = {{1.0, 0.5, 0.0}, {0.0, 3.0, 0.0}};
  s.biquad_count = 1;
  CHECK_REFUSED(resonid_create(&s.head, &control, &error), "biquads");
  s.biquads = bad;
  s.biquad_count = 2;
  CHECK_REFUSED(resonid_create(&s.head, &control, &error), "biquads");
  s.biquad_count = RESONID_CONTROL_MAX_BIQUADS + 1;
  CHECK_REFUSED(resonid_create(&s.head, &control, &error), "biquads");
  s.biquad_count = 0;
  s.precision = 2;
  CHECK_REFUSED(resonid_create(&s.head, &control, &error), "precision");
  s.precision = 0;
  s.schedule = falling;
  s.node_count = 2;
  CHECK_REFUSED(resonid_create(&s.head, &control, &error), "kp");
  s.kp = s.ki = 0.0;
  CHECK_REFUSED(resonid_create(&s.head, &control, &error), "schedule");
  s.node_count = RESONID_CONTROL_MAX_NODES + 1;
  CHECK_REFUSED(resonid_create(&s.head, &control, &error), "schedule");
  s.node_count = 0;
  s.torque_limit = 0.0;
  CHECK_REFUSED(resonid_create(&s.head, &control, &error), "torque_limit");
  CHECK(control == NULL);
  s = plain_settings();
  control = made(&s);
  CHECK_REFUSED(resonid_control_set_gains(control, -1.0, 0.0, &error), "kp");
  CHECK_REFUSED(resonid_control_set_schedule(control, falling, 2, &error), "schedule");
  CHECK_REFUSED(resonid_control_set_schedule(control, NULL, 0, &error), "schedule");
  CHECK_REFUSED(resonid_control_exchange_filters(control, bad, 2, 0, 1, &error), "biquads");
  CHECK_REFUSED(resonid_control_exchange_filters(control, bad, 1, 0, 0, &error), "fade_samples");
  CHECK_OK(resonid_control_exchange_filters(control, bad, 1, 0, 1, NULL));
  CHECK_REFUSED(resonid_control_exchange_filters(control, bad, 1, 0, 1, &error), "biquads");
  double torque = 5.0;
  CHECK_STATUS(resonid_control_step(control, 0, 0, 0, 0, 0, NULL), RESONID_ERROR_NULL);
  CHECK_STATUS(resonid_control_step(NULL, 0, 0, 0, 0, 0, &torque), RESONID_ERROR_NULL);
  CHECK(torque == 0.0);
}

int main(void) {
  it_is_its_difference_equation(RESONID_DOUBLE);
  it_is_its_difference_equation(RESONID_FLOAT);
  it_is_a_cascade(0);
  it_is_a_cascade(1);
  changes_make_no_jump();
  the_limit_winds_nothing_up_and_gaps_bring_rest();
  refusals_name_the_field();
  return verdict();
}
