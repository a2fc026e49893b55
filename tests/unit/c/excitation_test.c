// SPDX-License-Identifier: MIT
#include "check.h"

static void prbs_is_a_maximum_length_sequence(void) {
  resonid_excitation_settings c;
  CHECK_OK(resonid_defaults(&c.head, sizeof c, RESONID_PRBS));
  c.sample_rate_hz = 1000.0;
  c.amplitude = 2.5;
  c.register_length = 7;
  resonid_handle* e = NULL;
  CHECK_OK(resonid_create(&c.head, &e, NULL));
  resonid_excitation_results info;
  CHECK_OK(resonid_read(e, RESONID_PRBS, &info.head, sizeof info));
  CHECK(info.period_samples == 127 && info.length_samples == 127);
  double x[254];
  CHECK_OK(resonid_generate(e, x, 254));
  double sum = 0.0;
  for (int k = 0; k < 127; ++k) {
    CHECK(fabs(x[k]) == 2.5 && x[k] == x[k + 127]);
    sum += x[k];
  }
  CHECK_NEAR(sum, 2.5, 1e-12);
  for (int lag = 1; lag < 127; ++lag) {  // of +-1 the circular autocorrelation is -1 everywhere but at 0
    double r = 0.0;
    for (int k = 0; k < 127; ++k) r += x[k] * x[(k + lag) % 127];
    CHECK_NEAR(r / 6.25, -1.0, 1e-9);
  }
  resonid_destroy(e);
}

static void multisine_is_the_sum_of_its_lines(void) {
  const double lines_hz[] = {10.0, 15.0, 40.0}, amplitudes[] = {1.0, 0.5, 0.25}, phases[] = {0.1, -2.0, 1.3};
  resonid_excitation_settings c;
  CHECK_OK(resonid_defaults(&c.head, sizeof c, RESONID_MULTISINE));
  c.sample_rate_hz = 500.0;
  c.lines = 3;
  c.lines_hz = lines_hz;
  c.line_amplitudes = amplitudes;
  c.phases_rad = phases;
  c.phases = RESONID_PHASES_GIVEN;
  resonid_handle* e = NULL;
  CHECK_OK(resonid_create(&c.head, &e, NULL));
  resonid_excitation_results info;
  CHECK_OK(resonid_read(e, RESONID_PRBS, &info.head, sizeof info));
  CHECK(info.lines == 3 && info.period_samples == 100 && info.low_hz == 10.0 && info.high_hz == 40.0);
  for (int k = 0; k < 1000; ++k) {
    double expected = 0.0, x = 0.0;
    for (int i = 0; i < 3; ++i) expected += amplitudes[i] * cos(kTwoPi * lines_hz[i] * k / 500.0 + phases[i]);
    CHECK_OK(resonid_generate(e, &x, 1));
    CHECK_NEAR(x, expected, 1e-12);
  }
  resonid_destroy(e);
}

static void chirp_sweeps(void) {
  resonid_excitation_settings c;
  CHECK_OK(resonid_defaults(&c.head, sizeof c, RESONID_CHIRP));
  c.sample_rate_hz = 1000.0;
  c.from_hz = 35.0;
  c.to_hz = 1.5;
  c.duration_s = 2.0;
  c.phase_rad = 0.3;
  resonid_handle* e = NULL;
  CHECK_OK(resonid_create(&c.head, &e, NULL));
  for (int k = 0; k < 2000; ++k) {
    const double t = k / 1000.0, slope = (1.5 - 35.0) / 2.0;
    double x = 0.0;
    CHECK_OK(resonid_generate(e, &x, 1));
    CHECK_NEAR(x, cos(kTwoPi * (35.0 * t + 0.5 * slope * t * t) + 0.3), 1e-9);
  }
  double after = 1.0;
  CHECK_OK(resonid_generate(e, &after, 1));
  CHECK(after == 0.0);
  resonid_destroy(e);
}

static void stepped_sine_tells_what_to_measure(void) {
  const double lines_hz[] = {20.0, 50.0};
  resonid_excitation_settings c;
  CHECK_OK(resonid_defaults(&c.head, sizeof c, RESONID_STEPPED_SINE));
  c.sample_rate_hz = 1000.0;
  c.lines = 2;
  c.lines_hz = lines_hz;
  c.settle_periods = 2.0;
  c.measure_periods = 4.0;
  resonid_handle* e = NULL;
  CHECK_OK(resonid_create(&c.head, &e, NULL));
  resonid_excitation_results info;
  CHECK_OK(resonid_read(e, RESONID_PRBS, &info.head, sizeof info));
  CHECK(info.length_samples == 300 + 120);
  int measured[2] = {0, 0};
  for (int k = 0; k < 500; ++k) {
    double x;
    CHECK_OK(resonid_generate(e, &x, 1));
    CHECK_OK(resonid_read(e, RESONID_PRBS, &info.head, sizeof info));
    if (info.measuring) ++measured[info.line];
  }
  CHECK(measured[0] == 200 && measured[1] == 80 && info.line == 2);
  resonid_destroy(e);
}

static void refusals_name_the_field(void) {
  const double lines_hz[] = {10.0, 15.0}, wrong[] = {1.0, -1.0};
  resonid_excitation_settings c;
  resonid_handle* e = NULL;
  CHECK_STATUS(resonid_defaults(&c.head, sizeof c, RESONID_STEPPED_SINE + 1), RESONID_ERROR_RANGE);
  CHECK_OK(resonid_defaults(&c.head, sizeof c, RESONID_MULTISINE));
  CHECK_REFUSED(resonid_create(&c.head, &e, &error), "sample_rate_hz");
  c.sample_rate_hz = 500.0;
  CHECK_REFUSED(resonid_create(&c.head, &e, &error), "lines_hz");
  c.lines = 2;
  CHECK_REFUSED(resonid_create(&c.head, &e, &error), "lines_hz");  // NULL
  c.lines_hz = lines_hz;
  c.lines = RESONID_EXCITATION_MAX_LINES + 1;
  CHECK_REFUSED(resonid_create(&c.head, &e, &error), "lines_hz");
  c.lines = 2;
  c.line_amplitudes = wrong;
  CHECK_REFUSED(resonid_create(&c.head, &e, &error), "line_amplitudes");
  c.line_amplitudes = NULL;
  c.phases = RESONID_PHASES_GIVEN;
  CHECK_REFUSED(resonid_create(&c.head, &e, &error), "phases_rad");
  c.phases = 9;
  CHECK_REFUSED(resonid_create(&c.head, &e, &error), "phases");
  CHECK_OK(resonid_defaults(&c.head, sizeof c, RESONID_CHIRP));
  c.sample_rate_hz = 500.0;
  c.from_hz = 1.0;
  c.to_hz = 300.0;
  c.duration_s = 1.0;
  CHECK_REFUSED(resonid_create(&c.head, &e, &error), "to_hz");
  resonid_error error = RESONID_ERROR_INIT;
  CHECK_STATUS(resonid_create(&c.head, &e, &error), RESONID_ERROR_SETTINGS);
  CHECK(error.value == 300.0);
  CHECK(e == NULL);
}

int main(void) {
  prbs_is_a_maximum_length_sequence();
  multisine_is_the_sum_of_its_lines();
  chirp_sweeps();
  stepped_sine_tells_what_to_measure();
  refusals_name_the_field();
  return verdict();
}
