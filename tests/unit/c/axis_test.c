// SPDX-License-Identifier: MIT
// An axis against the loop that it follows: rows, margins, injection within limits, refusals.
#include "check.h"

enum { kRate = 1000 };

/// A rigid machine with viscous friction under u = -kp y + ru: Gd = b z^-1/(1 + a z^-1).
static const double kA = -0.98, kB = 0.05, kGain = 4.0;
static const double kOne[] = {1.0};

typedef struct loop {
  double y, u;
  uint64_t random;
} loop;
static double feed(loop* l, double ru) {  // returns the torque of this sample, y moves to the next
  l->u = ru - kGain * l->y;
  return l->u;
}
static void move(loop* l) { l->y = kB * l->u - kA * l->y; }

/// |L| = 1 and the phase there of L = kGain b z^-1/(1 + a z^-1), by bisection.
static void truth(double* crossover_hz, double* phase_margin_deg) {
  double low = 0.1, high = 400.0, re = 0, im = 0;
  for (int i = 0; i < 80; ++i) {
    const double f = 0.5 * (low + high), w = kTwoPi * f / kRate;
    const double nr = kGain * kB * cos(w), ni = -kGain * kB * sin(w), dr = 1 + kA * cos(w), di = -kA * sin(w);
    const double d = dr * dr + di * di;
    re = (nr * dr + ni * di) / d;
    im = (ni * dr - nr * di) / d;
    if (re * re + im * im > 1.0)
      low = f;
    else
      high = f;
  }
  *crossover_hz = low;
  *phase_margin_deg = 180.0 + 360.0 / kTwoPi * atan2(im, re);
}

static resonid_axis_settings settings(uint32_t kind) {
  static const double lines[] = {5.0, 10.0, 20.0, 40.0, 80.0}, b[] = {0.04}, a[] = {-0.97};
  resonid_axis_settings s;
  CHECK_OK(resonid_defaults(&s.head, sizeof s, kind));
  s.sample_rate_hz = kRate;
  s.controller_numerator = &kGain;
  s.controller_denominator = kOne;
  s.controller_numerator_count = s.controller_denominator_count = 1;
  s.lines_hz = lines;
  s.lines = 5;
  s.start_b = b;
  s.start_a = a;
  s.order = 1;
  s.row_every_samples = 10;
  s.memory_s = 0.5;
  s.centre_hz = 20.0;
  s.injects = 1;
  return s;
}

static resonid_guard_settings limits(double amplitude) {
  resonid_guard_settings g;
  CHECK_OK(resonid_defaults(&g.head, sizeof g, RESONID_GUARD));
  g.amplitude = amplitude;
  g.torque_limit = 10.0 * amplitude;
  return g;
}

static void rows_hold_the_margins(uint32_t kind, uint32_t inject, double tolerance) {
  const resonid_axis_settings s = settings(kind);
  resonid_error error = RESONID_ERROR_INIT;
  resonid_handle* axis = NULL;
  CHECK_OK(resonid_create(&s.head, &axis, &error));
  const resonid_guard_settings g = limits(1.0);
  CHECK_OK(resonid_axis_start(axis, inject, 2.0, &g, &error));
  loop l = {0, 0, 7};
  uint64_t rows = 0;
  for (int k = 0; k < 8 * kRate; ++k) {
    double ru = 0;
    uint32_t row = 0;
    CHECK_OK(resonid_axis_excite(axis, -kGain * l.y, l.y, NAN, 0.0, &ru));
    const double y = l.y + 1e-4 * noise(&l.random);
    CHECK_OK(resonid_axis_step(axis, ru, feed(&l, ru), y, &row));
    rows += row;
    move(&l);
  }
  resonid_axis_results r;
  double crossover_hz, phase_margin_deg;
  truth(&crossover_hz, &phase_margin_deg);
  CHECK_OK(resonid_read(axis, kind, &r.head, sizeof r));
  CHECK(r.samples == 8 * kRate && r.skipped_samples == 0);
  CHECK(rows > 100 && r.rows == rows && r.trusted_rows > rows / 2 && r.row_sample == 8 * kRate - 1);
  CHECK(r.trusted == 1 && r.verdict == RESONID_VERDICT_TRUSTED);
  CHECK(r.gates == 127 && r.injecting == 1 && r.settled == 1 && r.stop_reason == RESONID_STOP_NONE);
  CHECK(fabs(r.crossover_hz.value - crossover_hz) < tolerance * crossover_hz);
  CHECK(fabs(r.phase_margin_deg.value - phase_margin_deg) < 60.0 * tolerance);
  CHECK(r.crossover_hz.std > 0.0 && r.phase_margin_deg.std > 0.0 && r.modulus_margin.std > 0.0);
  CHECK(r.controller_differs == 0);

  CHECK_OK(resonid_stop(axis));
  for (int k = 0; k < kRate; ++k) {
    double ru = 0;
    CHECK_OK(resonid_axis_excite(axis, -kGain * l.y, l.y, NAN, 0.0, &ru));
    CHECK_OK(resonid_step(axis, ru, feed(&l, ru), l.y));
    move(&l);
  }
  CHECK_OK(resonid_read(axis, kind, &r.head, sizeof r));
  CHECK(r.injecting == 0 && r.stop_reason == RESONID_STOP_REQUESTED);
  resonid_destroy(axis);
}

static void parameters_lines_and_response(void) {
  resonid_axis_settings s = settings(RESONID_AXIS_ARX);
  s.start_variance = 100.0;  // next to nothing is known beforehand
  resonid_handle* axis = NULL;
  CHECK_OK(resonid_create(&s.head, &axis, NULL));
  CHECK(strcmp(resonid_axis_parameter_name(axis, 0), "b1") == 0);
  CHECK(strcmp(resonid_axis_parameter_name(axis, 1), "a1") == 0);
  CHECK(strcmp(resonid_axis_parameter_name(axis, 2), "") == 0);
  CHECK(strcmp(resonid_axis_parameter_name(NULL, 0), "") == 0);
  enum { kSamples = 3000 };
  static double ru[kSamples], u[kSamples], y[kSamples];
  loop l = {0, 0, 3};
  for (int k = 0; k < kSamples; ++k) {
    ru[k] = noise(&l.random);
    y[k] = l.y;
    u[k] = feed(&l, ru[k]);
    move(&l);
  }
  uint64_t rows = 0;
  for (size_t at = 0, taken = 0; at < kSamples; at += taken) {
    uint32_t row = 0;
    CHECK_OK(resonid_axis_run(axis, ru + at, u + at, y + at, kSamples - at, &taken, &row));
    CHECK(taken == 10 && row == 1);  // row_every_samples
    rows += row;
  }
  resonid_axis_results r;
  CHECK_OK(resonid_read(axis, RESONID_AXIS_ARX, &r.head, sizeof r));
  CHECK(rows == kSamples / 10 && r.rows == rows && r.has_model == 1 && r.lines == 0);
  CHECK(fabs(r.parameter[0].value - kB) < 1e-3 * kB && fabs(r.parameter[1].value - kA) < 1e-3);
  resonid_complex g;
  CHECK_OK(resonid_axis_response(axis, 0.001, &g));
  CHECK(fabs(g.re - kB / (1.0 + kA)) < 0.02 * kB / (1.0 + kA));
  resonid_axis_line_info line;
  CHECK_STATUS(resonid_axis_line(axis, 0, &line, sizeof line), RESONID_ERROR_RANGE);
  // Twice the gain: the crossover moves at the next row.
  const double doubled = 2.0 * kGain, before_hz = r.crossover_hz.value;
  CHECK_OK(resonid_axis_set_loop(axis, &doubled, 1, kOne, 1, 0, RESONID_LOOP_CONTROLLER, 0.0, NULL));
  size_t taken = 0;
  uint32_t row = 0;
  CHECK_OK(resonid_axis_run(axis, ru, u, y, kSamples, &taken, &row));
  CHECK_OK(resonid_read(axis, RESONID_AXIS_ARX, &r.head, sizeof r));
  CHECK(row == 1 && r.crossover_hz.value > 1.5 * before_hz);
  resonid_axis_criteria none = s.criteria;
  none.gain_std = 0.0;  // nothing is that certain
  none.line_std = none.resonance_std = 0.0;
  CHECK_OK(resonid_axis_set_criteria(axis, &none));
  CHECK_OK(resonid_axis_run(axis, ru, u, y, kSamples, &taken, &row));
  CHECK_OK(resonid_read(axis, RESONID_AXIS_ARX, &r.head, sizeof r));
  CHECK(r.trusted == 0 && r.verdict == RESONID_VERDICT_NOT_CONVERGED);
  CHECK(strcmp(resonid_verdict_string(r.verdict), "not-converged") == 0);
  CHECK(strcmp(resonid_verdict_string(99), "unknown") == 0);
  resonid_destroy(axis);
}

static void refused(const resonid_axis_settings* s, const char* field) {
  resonid_handle* axis = NULL;
  resonid_error error = RESONID_ERROR_INIT;
  CHECK_STATUS(resonid_create(&s->head, &axis, &error), RESONID_ERROR_SETTINGS);
  CHECK(axis == NULL && error.requirement[0] != 0);
  if (strcmp(error.field, field) != 0) printf("'%s' instead of '%s'\n", error.field, field);
  CHECK(strcmp(error.field, field) == 0);
}

static void settings_are_checked(void) {
  resonid_axis_settings s = settings(RESONID_AXIS_LINES);
  s.sample_rate_hz = 0.0;
  refused(&s, "sample_rate_hz");
  s = settings(RESONID_AXIS_LINES);
  s.lines = 0;
  refused(&s, "lines_hz");
  s = settings(RESONID_AXIS_LINES);
  s.output = 3;
  refused(&s, "output");
  s = settings(RESONID_AXIS_LINES);
  s.change_of = RESONID_FIGURE_GAP;
  refused(&s, "change");
  s.change_of = RESONID_FIGURE_GAP + 1;
  refused(&s, "change_of");
  s = settings(RESONID_AXIS_PHYSICAL);
  refused(&s, "physical");
  s = settings(RESONID_AXIS_CLOE);  // of order 3 alone
  refused(&s, "method");
  s = settings(RESONID_AXIS_ARX);
  s.baseline_lines = RESONID_AXIS_MAX_BASELINE + 1;
  refused(&s, "baseline_lines");

  s = settings(RESONID_AXIS_ARX);
  s.injects = 0;
  resonid_handle* axis = NULL;
  resonid_error error = RESONID_ERROR_INIT;
  CHECK_OK(resonid_create(&s.head, &axis, NULL));
  resonid_guard_settings g = limits(1.0);
  CHECK_STATUS(resonid_axis_start(axis, RESONID_INJECT_PRBS, 1.0, &g, &error), RESONID_ERROR_SETTINGS);
  CHECK(strcmp(error.field, "kind") == 0);
  CHECK_STATUS(resonid_axis_start(axis, RESONID_INJECT_GIVEN, 1.0, NULL, &error), RESONID_ERROR_NULL);
  g.amplitude = -1.0;
  CHECK_STATUS(resonid_axis_start(axis, RESONID_INJECT_GIVEN, 1.0, &g, &error), RESONID_ERROR_SETTINGS);
  CHECK(strcmp(error.field, "amplitude") == 0);
  CHECK_STATUS(resonid_axis_set_loop(axis, kOne, 1, kOne, 1, 0, 9, 0.0, &error), RESONID_ERROR_SETTINGS);
  CHECK(strcmp(error.field, "loop") == 0);
  CHECK_STATUS(resonid_axis_set_loop(axis, kOne, 1, kOne, 1, 0, 1, -1.0, &error), RESONID_ERROR_SETTINGS);
  CHECK(strcmp(error.field, "known_delay_s") == 0);
  double x = 1.0;
  CHECK_STATUS(resonid_axis_excite(NULL, 0, 0, 0, 0, &x), RESONID_ERROR_NULL);
  CHECK(x == 0.0);
  resonid_destroy(axis);
}

/// What passes a limit ends the injection, and the row says so.
static void a_limit_stops_it(void) {
  const resonid_axis_settings s = settings(RESONID_AXIS_LINES);
  resonid_handle* axis = NULL;
  CHECK_OK(resonid_create(&s.head, &axis, NULL));
  resonid_guard_settings g = limits(1.0);
  g.velocity_limit = 0.01;
  CHECK_OK(resonid_axis_start(axis, RESONID_INJECT_MULTISINE, 1.0, &g, NULL));
  loop l = {0, 0, 7};
  for (int k = 0; k < 2 * kRate; ++k) {
    double ru = 0;
    CHECK_OK(resonid_axis_excite(axis, -kGain * l.y, l.y, NAN, 0.0, &ru));
    CHECK_OK(resonid_step(axis, ru, feed(&l, ru), l.y));
    move(&l);
  }
  resonid_axis_results r;
  CHECK_OK(resonid_read(axis, RESONID_AXIS_LINES, &r.head, sizeof r));
  CHECK(r.stop_reason == RESONID_STOP_VELOCITY && r.trusted == 0 && r.verdict == RESONID_VERDICT_STOPPED);
  resonid_destroy(axis);
}

int main(void) {
  rows_hold_the_margins(RESONID_AXIS_LINES, RESONID_INJECT_MULTISINE, 0.02);
  rows_hold_the_margins(RESONID_AXIS_ARX, RESONID_INJECT_PRBS, 0.02);
  rows_hold_the_margins(RESONID_AXIS_IV, RESONID_INJECT_PRBS, 0.02);
  parameters_lines_and_response();
  settings_are_checked();
  a_limit_stops_it();
  return verdict();
}
