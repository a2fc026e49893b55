// SPDX-License-Identifier: MIT
#include "check.h"

/// L(s) = 2/(s (1 + s)^2) with s in rad/s:  |L| = 2/(w (1 + w^2)) is 1 at w = 1 exactly,  arg L = -90 - 2
/// atan w, -180 at w = 1: phase margin 0, and L = 0.8/(...) has gain margin 1/0.4.
static void margins_of_an_analytic_loop(void) {
  enum { kLines = 4000 };
  static double hz[kLines];
  static resonid_complex loop[kLines];
  const double gain = 0.8;
  double crossover = 0.5;  // w (1 + w^2) = gain, by Newton
  for (int i = 0; i < 50; ++i)
    crossover -= (crossover * (1.0 + crossover * crossover) - gain) / (1.0 + 3.0 * crossover * crossover);
  double modulus = 1e9;
  for (int i = 0; i < kLines; ++i) {
    const double w = 0.05 * pow(200.0, (double)i / (kLines - 1));
    hz[i] = w / kTwoPi;
    const double size = gain / (w * (1.0 + w * w)), angle = -0.25 * kTwoPi - 2.0 * atan(w);
    loop[i].re = size * cos(angle);
    loop[i].im = size * sin(angle);
    modulus = fmin(modulus, hypot(1.0 + loop[i].re, loop[i].im));
  }
  resonid_loop_margins m;
  CHECK_OK(resonid_margins(hz, loop, kLines, &m, sizeof m, NULL));
  CHECK_NEAR(m.crossover_hz, crossover / kTwoPi, 1e-6);
  CHECK_NEAR(m.phase_margin_deg, 90.0 - 2.0 * atan(crossover) * 360.0 / kTwoPi, 1e-3);
  CHECK_NEAR(m.gain_margin_db, 20.0 * log10(2.0 / gain), 1e-4);
  CHECK_NEAR(m.gain_margin_hz, 1.0 / kTwoPi, 1e-6);
  CHECK_NEAR(m.modulus_margin, modulus, 1e-5);
  CHECK(m.struct_size == sizeof m);

  CHECK_OK(resonid_margins(hz, loop, 100, &m, sizeof m, NULL));  // a band without crossover
  CHECK(isnan(m.crossover_hz) && isnan(m.gain_margin_db) && m.modulus_margin > 0.0);
  hz[7] = hz[6];
  CHECK_REFUSED(resonid_margins(hz, loop, kLines, &m, sizeof m, &error), "frequency_hz");
  CHECK_STATUS(resonid_margins(NULL, loop, kLines, &m, sizeof m, NULL), RESONID_ERROR_NULL);
  CHECK_STATUS(resonid_margins(hz, loop, 5, NULL, sizeof m, NULL), RESONID_ERROR_NULL);
}

/// PI controller kp + ki T/(1 - z^-1), a plant response and a delay, multiplied here in polar form.
static void loop_is_controller_times_plant_times_delay(void) {
  const double kp = 2.0, ki = 30.0, rate = 1000.0, delay_s = 0.0035;
  const double numerator[] = {2.0 + 30.0 / 1000.0, -2.0}, denominator[] = {1.0, -1.0};
  const double hz[] = {3.0, 40.0, 222.0};
  const resonid_complex g[] = {{1.0, -2.0}, {0.1, 0.3}, {-0.02, 0.01}};
  resonid_complex loop[3];
  CHECK_OK(resonid_loop_response(numerator, 2, denominator, 2, rate, delay_s, hz, g, loop, 3, NULL));
  for (int i = 0; i < 3; ++i) {
    const double w = kTwoPi * hz[i] / rate;
    // 1/(1 - e^-jw) = 1/2 - j/2 cot(w/2)
    const double cr = kp + 0.5 * ki / rate, ci = -0.5 * ki / rate / tan(0.5 * w);
    const double size = hypot(cr, ci) * hypot(g[i].re, g[i].im);
    const double angle = atan2(ci, cr) + atan2(g[i].im, g[i].re) - kTwoPi * hz[i] * delay_s;
    const resonid_complex truth = {size * cos(angle), size * sin(angle)};
    CHECK_NEAR(distance(loop[i], truth), 0.0, 1e-12 * size);
  }
  CHECK_REFUSED(resonid_loop_response(numerator, 0, denominator, 2, rate, 0.0, hz, g, loop, 3, &error),
                "numerator_count");
  CHECK_REFUSED(resonid_loop_response(numerator, 2, denominator, 2, 0.0, 0.0, hz, g, loop, 3, &error),
                "sample_rate_hz");
  const double zero[] = {0.0, 1.0};
  CHECK_REFUSED(resonid_loop_response(numerator, 2, zero, 2, rate, 0.0, hz, g, loop, 3, &error),
                "denominator");
  CHECK_REFUSED(resonid_loop_response(numerator, 17, denominator, 2, rate, 0.0, hz, g, loop, 3, &error),
                "numerator");
}

static void a_change_is_found_and_none_invented(uint32_t statistic) {
  resonid_change_settings c;
  CHECK_OK(resonid_defaults(&c.head, sizeof c, statistic));
  c.sample_rate_hz = 100.0;
  c.block_s = 0.1;
  c.baseline_s = 20.0;
  c.false_alarm_interval_s = 1e5;
  resonid_handle* detector = NULL;
  CHECK_OK(resonid_create(&c.head, &detector, NULL));
  uint64_t random = 31;
  resonid_change_results info;
  for (int k = 0; k < 20000; ++k) CHECK_OK(resonid_change_step(detector, 15.0 + 0.3 * noise(&random), 1.0));
  CHECK_OK(resonid_read(detector, RESONID_CUSUM, &info.head, sizeof info));
  CHECK(info.ready && !info.alarm && info.reliable && info.samples == 20000);
  CHECK_NEAR(info.baseline, 15.0, 0.01);
  for (int k = 0; k < 4000; ++k) CHECK_OK(resonid_change_step(detector, 14.9 + 0.3 * noise(&random), 1.0));
  CHECK_OK(resonid_read(detector, RESONID_CUSUM, &info.head, sizeof info));
  CHECK(info.alarm);
  CHECK_NEAR(info.time_s, 200.0, 2.0);
  CHECK(info.detected_s >= info.time_s && info.detected_s < 210.0);
  CHECK_NEAR(info.size, -0.1, 4.0 * info.size_std);
  CHECK(info.size_std > 0.0 && info.size_std < 0.03);
  CHECK_OK(resonid_change_relearn(detector));
  CHECK_OK(resonid_read(detector, RESONID_CUSUM, &info.head, sizeof info));
  CHECK(!info.alarm && !info.ready);
  resonid_destroy(detector);
}

static void refusals_name_the_field(void) {
  resonid_handle* detector = NULL;
  resonid_change_settings c;
  CHECK_OK(resonid_defaults(&c.head, sizeof c, RESONID_CUSUM));
  CHECK_REFUSED(resonid_create(&c.head, &detector, &error), "sample_rate_hz");
  c.sample_rate_hz = 100.0;
  CHECK_REFUSED(resonid_create(&c.head, &detector, &error), "block_s");
  c.block_s = 0.1;
  CHECK_REFUSED(resonid_create(&c.head, &detector, &error), "baseline_s");
  c.baseline_s = 10.0;
  CHECK_REFUSED(resonid_create(&c.head, &detector, &error), "false_alarm_interval_s");
  c.false_alarm_interval_s = 1000.0;
  c.window_blocks = 257;
  CHECK_REFUSED(resonid_create(&c.head, &detector, &error), "window_blocks");
  CHECK(detector == NULL);
}

int main(void) {
  margins_of_an_analytic_loop();
  loop_is_controller_times_plant_times_delay();
  a_change_is_found_and_none_invented(RESONID_CUSUM);
  a_change_is_found_and_none_invented(RESONID_LIKELIHOOD_RATIO);
  refusals_name_the_field();
  return verdict();
}
