// SPDX-License-Identifier: MIT
#include "check.h"

enum { kLines = 5 };
static const double kRate = 1000.0;
static const double kLinesHz[kLines] = {5.0, 20.0, 50.0, 110.0, 240.0};

/// First-order lag in open loop; what the lines' response is, is known from its equation.
static difference_equation lag(void) {
  const difference_equation e = {1, {0.05}, {-0.9}, {0}, {0}};
  return e;
}
static double excitation_at(int k) {
  double x = 0.3;
  for (int i = 0; i < kLines; ++i) x += cos(kTwoPi * kLinesHz[i] * k / kRate + i * i);
  return x;
}

static resonid_line_bank_settings bank_config(uint32_t precision, uint32_t channels) {
  resonid_line_bank_settings c;
  CHECK_OK(resonid_defaults(&c.head, sizeof c, RESONID_LINE_BANK));
  c.sample_rate_hz = kRate;
  c.frequency_hz = kLinesHz;
  c.lines = kLines;
  c.precision = precision;
  c.channels = channels;
  c.lambda = 30.0;
  return c;
}

static void line_bank_finds_the_response(uint32_t precision, double tolerance) {
  const resonid_line_bank_settings c = bank_config(precision, 2);
  RESONID_MEMORY(memory, RESONID_LINE_BANK_SIZE);
  resonid_handle* bank = NULL;
  CHECK(resonid_size(&c.head) <= sizeof memory);
  CHECK_OK(resonid_init(memory, sizeof memory, &c.head, &bank, NULL));
  difference_equation plant = lag();
  for (int k = 0; k < 8000; ++k) {
    const double u = excitation_at(k), y = next_output(&plant);
    CHECK_OK(resonid_step(bank, 0.0, u, k == 500 ? NAN : y));
    push(&plant, u, y);
  }
  resonid_complex g[kLines], u[kLines];
  const double innovation = 0.0;
  CHECK_OK(resonid_ratios(bank, RESONID_CHANNEL_Y, RESONID_CHANNEL_U, g, kLines));
  CHECK_OK(resonid_phasors(bank, RESONID_CHANNEL_U, u, kLines));
  for (uint32_t i = 0; i < kLines; ++i) {
    const resonid_complex truth = response_of(&plant, kTwoPi * kLinesHz[i] / kRate);
    CHECK_NEAR(distance(g[i], truth), 0.0, tolerance * hypot(truth.re, truth.im));
    CHECK_NEAR(hypot(u[i].re, u[i].im), 1.0, tolerance);
  }
  resonid_line_bank_results info;
  CHECK_OK(resonid_read(bank, RESONID_LINE_BANK, &info.head, sizeof info));
  CHECK(info.ready && info.samples == 8000 && info.skipped_samples == 1 && info.lines == kLines &&
        info.channels == 2);
  CHECK_STATUS(resonid_ratios(bank, RESONID_CHANNEL_Y, RESONID_CHANNEL_U, g, kLines - 1),
               RESONID_ERROR_RANGE);
  CHECK_STATUS(resonid_phasors(bank, 0, g, kLines + 1), RESONID_ERROR_RANGE);
  CHECK_STATUS(resonid_phasors(bank, RESONID_CHANNEL_RU, g, kLines), RESONID_ERROR_RANGE);
  CHECK_STATUS(resonid_ratios(bank, RESONID_CHANNEL_RU, 0, g, kLines), RESONID_ERROR_RANGE);
  CHECK_STATUS(resonid_ratios(bank, 0, RESONID_CHANNEL_RU, g, kLines), RESONID_ERROR_RANGE);
  CHECK_STATUS(resonid_run(bank, NULL, NULL, &innovation, 1), RESONID_ERROR_NULL);
}

/// With the excitation, and feedback u = ru - 2 y: Y/RU is the closed loop, and runs are steps.
static void line_bank_of_three_channels_shows_the_closed_loop(void) {
  enum { kSamples = 8000 };
  static double ru[kSamples], u[kSamples], y[kSamples];
  difference_equation plant = lag();
  for (int k = 0; k < kSamples; ++k) {
    y[k] = next_output(&plant);
    ru[k] = excitation_at(k);
    u[k] = ru[k] - 2.0 * y[k];
    push(&plant, u[k], y[k]);
  }
  const resonid_line_bank_settings c = bank_config(RESONID_DOUBLE, 3);
  resonid_handle *bank = NULL, *stepped = NULL;
  CHECK_OK(resonid_create(&c.head, &bank, NULL));
  CHECK_OK(resonid_create(&c.head, &stepped, NULL));
  CHECK_STATUS(resonid_run(bank, NULL, u, y, kSamples), RESONID_ERROR_NULL);
  CHECK_OK(resonid_run(bank, ru, u, y, kSamples));
  for (int k = 0; k < kSamples; ++k) CHECK_OK(resonid_step(stepped, ru[k], u[k], y[k]));
  resonid_complex all_closed[kLines], all_open[kLines], all_other[kLines];
  CHECK_OK(resonid_ratios(bank, RESONID_CHANNEL_Y, RESONID_CHANNEL_RU, all_closed, kLines));
  CHECK_OK(resonid_ratios(bank, RESONID_CHANNEL_Y, RESONID_CHANNEL_U, all_open, kLines));
  CHECK_OK(resonid_ratios(stepped, RESONID_CHANNEL_Y, RESONID_CHANNEL_RU, all_other, kLines));
  for (uint32_t i = 0; i < kLines; ++i) {
    const resonid_complex closed = all_closed[i], open = all_open[i], other = all_other[i];
    const resonid_complex g = response_of(&plant, kTwoPi * kLinesHz[i] / kRate);
    const double dr = 1.0 + 2.0 * g.re, di = 2.0 * g.im, power = dr * dr + di * di;  // G/(1 + 2 G)
    const resonid_complex truth = {(g.re * dr + g.im * di) / power, (g.im * dr - g.re * di) / power};
    CHECK_NEAR(distance(open, g), 0.0, 1e-8);
    CHECK_NEAR(distance(closed, truth), 0.0, 1e-8);
    CHECK_NEAR(distance(closed, other), 0.0, 1e-11);
  }
  resonid_destroy(bank);
  resonid_destroy(stepped);
}

/// Lost samples, told in one call, are as many missing ones.
static void lost_samples_are_missing_ones(void) {
  const resonid_line_bank_settings c = bank_config(RESONID_DOUBLE, 2);
  resonid_handle *told = NULL, *stepped = NULL;
  CHECK_OK(resonid_create(&c.head, &told, NULL));
  CHECK_OK(resonid_create(&c.head, &stepped, NULL));
  difference_equation plant = lag();
  for (int k = 0; k < 3000; ++k) {
    const double u = excitation_at(k), y = next_output(&plant);
    const int lost = k >= 2000 && k < 2777;
    if (k == 2000) CHECK_OK(resonid_miss(told, 777));
    if (!lost) CHECK_OK(resonid_step(told, 0.0, u, y));
    CHECK_OK(resonid_step(stepped, 0.0, lost ? NAN : u, y));
    push(&plant, u, y);
  }
  resonid_complex g[kLines], h[kLines];
  resonid_line_bank_results info;
  CHECK_OK(resonid_ratios(told, RESONID_CHANNEL_Y, RESONID_CHANNEL_U, g, kLines));
  CHECK_OK(resonid_ratios(stepped, RESONID_CHANNEL_Y, RESONID_CHANNEL_U, h, kLines));
  for (int i = 0; i < kLines; ++i) CHECK_NEAR(distance(g[i], h[i]), 0.0, 1e-9);
  CHECK_OK(resonid_read(told, RESONID_LINE_BANK, &info.head, sizeof info));
  CHECK(info.samples == 3000 && info.skipped_samples == 777);
  resonid_destroy(told);
  resonid_destroy(stepped);
}

static void float_signals_serve_a_float_bank(void) {
  enum { kSamples = 4000 };
  static float u[kSamples], y[kSamples];
  difference_equation plant = lag();
  for (int k = 0; k < kSamples; ++k) {
    const double in = excitation_at(k), out = next_output(&plant);
    u[k] = (float)in;
    y[k] = (float)out;
    push(&plant, in, out);
  }
  const resonid_line_bank_settings c = bank_config(RESONID_FLOAT, 2);
  resonid_handle* bank = NULL;
  CHECK_OK(resonid_create(&c.head, &bank, NULL));
  CHECK_OK(resonid_run_float(bank, NULL, u, y, kSamples));
  resonid_complex g[kLines];
  CHECK_OK(resonid_ratios(bank, RESONID_CHANNEL_Y, RESONID_CHANNEL_U, g, kLines));
  for (int i = 0; i < kLines; ++i)
    CHECK_NEAR(distance(g[i], response_of(&plant, kTwoPi * kLinesHz[i] / kRate)), 0.0, 2e-4);
  resonid_destroy(bank);
}

/// Each kind finds amplitude and phase of the lines of a sum of cosines, phase against sample 0.
static void trackers_find_amplitude_and_phase(void) {
  const double lines_hz[] = {20.0, 50.0}, amplitude[] = {2.0, 0.7}, phase[] = {0.5, -1.1};
  for (uint32_t window = 0; window < 4; ++window) {
    resonid_tracker_settings c;
    CHECK_OK(resonid_defaults(&c.head, sizeof c, window == 0 ? RESONID_KALMAN_BANK : RESONID_SLIDING_DFT));
    c.sample_rate_hz = kRate;
    c.frequency_hz = lines_hz;
    c.lines = 2;
    c.window_samples = window == 3 ? 1000 : 200;
    c.window = window == 2 ? RESONID_WINDOW_HANN : RESONID_WINDOW_RECTANGULAR;
    resonid_handle* t = NULL;
    CHECK_OK(resonid_create(&c.head, &t, NULL));
    for (int k = 0; k < 5000; ++k) {
      double x = 0.0;
      for (int i = 0; i < 2; ++i) x += amplitude[i] * cos(kTwoPi * lines_hz[i] * k / kRate + phase[i]);
      CHECK_OK(resonid_step(t, 0.0, 0.0, x));
    }
    resonid_complex phasor[2];
    CHECK_OK(resonid_phasors(t, 0, phasor, 2));
    for (uint32_t i = 0; i < 2; ++i) {
      resonid_tracker_line line;
      CHECK_OK(resonid_read_tracker_line(t, i, &line, sizeof line));
      const resonid_complex truth = {amplitude[i] * cos(phase[i]), amplitude[i] * sin(phase[i])};
      CHECK_NEAR(distance(line.amplitude, truth), 0.0, 1e-8);
      CHECK(line.settled && line.frequency_hz > 0.0 && distance(line.phasor, phasor[i]) == 0.0);
      CHECK_NEAR(line.frequency_hz, lines_hz[i], 1e-9);
    }
    resonid_tracker_results info;
    CHECK_OK(resonid_read(t, RESONID_KALMAN_BANK, &info.head, sizeof info));
    CHECK(info.ready && info.samples == 5000 && info.lines == 2);
    CHECK(window == 0 ? fabs(info.innovation) < 1e-8 : isnan(info.innovation));
    resonid_destroy(t);
  }
}

static void chirp_tracker_follows_the_chirp(void) {
  resonid_excitation_settings e;
  CHECK_OK(resonid_defaults(&e.head, sizeof e, RESONID_CHIRP));
  e.sample_rate_hz = kRate;
  e.amplitude = 1.5;
  e.from_hz = 40.0;
  e.to_hz = 10.0;
  e.duration_s = 20.0;
  resonid_handle* chirp = NULL;
  CHECK_OK(resonid_create(&e.head, &chirp, NULL));
  resonid_tracker_settings c;
  CHECK_OK(resonid_defaults(&c.head, sizeof c, RESONID_CHIRP_TRACKER));
  c.sample_rate_hz = kRate;
  c.from_hz = e.from_hz;
  c.to_hz = e.to_hz;
  c.duration_s = e.duration_s;
  resonid_handle* t = NULL;
  CHECK_OK(resonid_create(&c.head, &t, NULL));
  for (int k = 0; k < 15000; ++k) {
    double x;
    CHECK_OK(resonid_generate(chirp, &x, 1));
    CHECK_OK(resonid_step(t, 0.0, 0.0, x));
  }
  resonid_tracker_line line;
  CHECK_OK(resonid_read_tracker_line(t, 0, &line, sizeof line));
  CHECK_NEAR(line.frequency_hz, 40.0 - 30.0 * 14.999 / 20.0, 1e-9);
  CHECK_NEAR(line.amplitude.re, 1.5, 1e-3);  // it meets the chirp's own phase
  CHECK_NEAR(line.amplitude.im, 0.0, 1e-3);
  CHECK_STATUS(resonid_read_tracker_line(t, 1, &line, sizeof line), RESONID_ERROR_RANGE);
  resonid_destroy(chirp);
  resonid_destroy(t);
}

static void refusals_name_the_field(void) {
  resonid_handle* bank = NULL;
  resonid_line_bank_settings b = bank_config(RESONID_DOUBLE, 2);
  b.channels = 4;
  CHECK_REFUSED(resonid_create(&b.head, &bank, &error), "channels");
  b = bank_config(2, 2);
  CHECK_REFUSED(resonid_create(&b.head, &bank, &error), "precision");
  b = bank_config(0, 2);
  b.frequency_hz = NULL;
  CHECK_REFUSED(resonid_create(&b.head, &bank, &error), "frequency_hz");
  b = bank_config(0, 2);
  b.lines = RESONID_LINE_BANK_MAX_LINES + 1;
  CHECK_REFUSED(resonid_create(&b.head, &bank, &error), "frequency_hz");
  b = bank_config(0, 2);
  b.known_delay_s = -1.0;
  CHECK_REFUSED(resonid_create(&b.head, &bank, &error), "known_delay_s");
  b = bank_config(0, 2);
  b.gain = 2;
  CHECK_REFUSED(resonid_create(&b.head, &bank, &error), "gain");

  resonid_handle* tracker = NULL;
  resonid_tracker_settings c;
  CHECK_STATUS(resonid_defaults(&c.head, sizeof c, RESONID_CHIRP_TRACKER + 1), RESONID_ERROR_RANGE);
  CHECK_OK(resonid_defaults(&c.head, sizeof c, RESONID_SLIDING_DFT));
  c.sample_rate_hz = kRate;
  c.window_samples = RESONID_TRACKER_MAX_WINDOW + 1;
  CHECK_REFUSED(resonid_create(&c.head, &tracker, &error), "window_samples");
  c.head.kind = RESONID_KALMAN_BANK + 5;
  CHECK(resonid_size(&c.head) == 0);
  CHECK_OK(resonid_defaults(&c.head, sizeof c, RESONID_CHIRP_TRACKER));
  c.sample_rate_hz = kRate;
  c.from_hz = 10.0;
  c.to_hz = 20.0;
  CHECK_REFUSED(resonid_create(&c.head, &tracker, &error), "duration_s");
  c.duration_s = 1.0;
  c.sweep = 2;
  CHECK_REFUSED(resonid_create(&c.head, &tracker, &error), "sweep");
  CHECK(bank == NULL && tracker == NULL);
}

int main(void) {
  line_bank_finds_the_response(RESONID_DOUBLE, 1e-9);
  line_bank_finds_the_response(RESONID_FLOAT, 5e-4);
  line_bank_of_three_channels_shows_the_closed_loop();
  lost_samples_are_missing_ones();
  float_signals_serve_a_float_bank();
  trackers_find_amplitude_and_phase();
  chirp_tracker_follows_the_chirp();
  refusals_name_the_field();
  return verdict();
}
