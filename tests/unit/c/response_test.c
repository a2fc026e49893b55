// SPDX-License-Identifier: MIT
#include "check.h"

enum { kLines = 4 };
static const double kRate = 500.0;
static const double kLinesHz[kLines] = {5.0, 20.0, 50.0, 110.0};
static const double kGain = 2.0;  // of the controller

/// Lag in the loop u = ru - kGain (y + noise).
static difference_equation lag(void) {
  const difference_equation e = {1, {0.05}, {-0.9}, {0}, {0}};
  return e;
}
static void run_loop(resonid_handle* handle, int samples, double noise_size) {
  difference_equation plant = lag();
  uint64_t random = 17;
  for (int k = 0; k < samples; ++k) {
    double ru = 0.0;
    for (int i = 0; i < kLines; ++i) ru += cos(kTwoPi * kLinesHz[i] * k / kRate + i * i);
    const double y = next_output(&plant), measured = y + noise_size * noise(&random);
    const double u = ru - kGain * measured;
    CHECK_OK(resonid_step(handle, ru, u, measured));
    push(&plant, u, y);
  }
}
static resonid_handle* make(const resonid_tracker_settings* tracker) {
  static const double numerator[] = {2.0}, denominator[] = {1.0};
  resonid_response_settings c;
  CHECK_OK(resonid_defaults(&c.head, sizeof c, RESONID_RESPONSE));
  c.tracker = tracker;
  c.controller_numerator = numerator;
  c.controller_denominator = denominator;
  c.controller_numerator_count = c.controller_denominator_count = 1;
  resonid_handle* handle = NULL;
  resonid_error error = RESONID_ERROR_INIT;
  CHECK_OK(resonid_create(&c.head, &handle, &error));
  return handle;
}
static resonid_tracker_settings fixed_lines(uint32_t kind) {
  resonid_tracker_settings t;
  CHECK_OK(resonid_defaults(&t.head, sizeof t, kind));
  t.sample_rate_hz = kRate;
  t.frequency_hz = kLinesHz;
  t.lines = kLines;
  t.window_samples = 500;
  return t;
}

static void all_approaches_find_the_plant(uint32_t kind) {
  const resonid_tracker_settings t = fixed_lines(kind);
  resonid_handle* handle = make(&t);
  run_loop(handle, 20000, 0.0);
  const difference_equation plant = lag();
  for (uint32_t i = 0; i < kLines; ++i)
    for (uint32_t approach = RESONID_DIRECT; approach <= RESONID_JOINT; ++approach) {
      resonid_response_line line;
      CHECK_OK(resonid_read_response_line(handle, i, approach, &line, sizeof line));
      const resonid_complex truth = response_of(&plant, kTwoPi * kLinesHz[i] / kRate);
      CHECK_NEAR(distance(line.response, truth), 0.0, 1e-7);
      CHECK(line.settled && line.frequency_hz == kLinesHz[i] && line.coherence > 0.999);
    }
  resonid_response_line line;
  CHECK_STATUS(resonid_read_response_line(handle, 0, 3, &line, sizeof line), RESONID_ERROR_RANGE);
  CHECK_STATUS(resonid_read_response_line(handle, kLines, 0, &line, sizeof line), RESONID_ERROR_RANGE);
  resonid_response_results info;
  CHECK_OK(resonid_read(handle, RESONID_RESPONSE, &info.head, sizeof info));
  CHECK(info.ready && info.lines == kLines && info.samples == 20000);
  resonid_destroy(handle);
}

/// Over many instants of a noisy record, errors are as large as the standard deviation says.
static void standard_deviation_is_that_of_the_errors(void) {
  const resonid_tracker_settings t = fixed_lines(RESONID_SLIDING_DFT);
  const difference_equation plant = lag();
  resonid_handle* handle = make(&t);
  double squares = 0.0;
  int count = 0;
  difference_equation loop = lag();
  uint64_t random = 99;
  for (int k = 0; k < 60000; ++k) {
    double ru = 0.0;
    for (int i = 0; i < kLines; ++i) ru += cos(kTwoPi * kLinesHz[i] * k / kRate + i * i);
    const double y = next_output(&loop), measured = y + 0.2 * noise(&random), u = ru - kGain * measured;
    CHECK_OK(resonid_step(handle, ru, u, measured));
    push(&loop, u, y);
    if (k < 20000 || k % 500 != 0) continue;  // windows that do not overlap
    for (uint32_t i = 0; i < kLines; ++i) {
      resonid_response_line line;
      CHECK_OK(resonid_read_response_line(handle, i, RESONID_JOINT, &line, sizeof line));
      const double error = distance(line.response, response_of(&plant, kTwoPi * kLinesHz[i] / kRate));
      squares += (error / line.standard_deviation) * (error / line.standard_deviation);
      ++count;
    }
  }
  CHECK_NEAR(squares / count, 1.0, 0.25);  // 320 values of chi-square/2 scatter by 0.06
  resonid_destroy(handle);
}

static void chirp_finds_the_plant_on_its_way(void) {
  resonid_tracker_settings t;
  CHECK_OK(resonid_defaults(&t.head, sizeof t, RESONID_CHIRP_TRACKER));
  t.sample_rate_hz = kRate;
  t.from_hz = 40.0;
  t.to_hz = 2.0;
  t.duration_s = 60.0;
  resonid_handle* handle = make(&t);
  difference_equation plant = lag();
  for (int k = 0; k < 15000; ++k) {
    const double time = k / kRate, y = next_output(&plant);
    const double ru = cos(kTwoPi * (40.0 * time - 0.5 * 38.0 / 60.0 * time * time)), u = ru - kGain * y;
    CHECK_OK(resonid_step(handle, ru, u, y));
    push(&plant, u, y);
  }
  resonid_response_line line;
  CHECK_OK(resonid_read_response_line(handle, 0, RESONID_INDIRECT, &line, sizeof line));
  CHECK_NEAR(line.frequency_hz, 40.0 - 38.0 / 60.0 * 14999.0 / kRate, 1e-9);
  const resonid_complex truth = response_of(&plant, kTwoPi * line.frequency_hz / kRate);
  CHECK_NEAR(distance(line.response, truth), 0.0, 0.01 * hypot(truth.re, truth.im));
  resonid_destroy(handle);
}

static void refusals_name_the_field(void) {
  resonid_tracker_settings t = fixed_lines(RESONID_KALMAN_BANK);
  resonid_response_settings c;
  resonid_handle* handle = NULL;
  CHECK_OK(resonid_defaults(&c.head, sizeof c, RESONID_RESPONSE));
  CHECK_REFUSED(resonid_create(&c.head, &handle, &error), "tracker");
  c.tracker = &t;
  c.known_delay_s = -1.0;
  CHECK_REFUSED(resonid_create(&c.head, &handle, &error), "known_delay_s");
  c.known_delay_s = 0.0;
  c.noise_memory_samples = 1.0;
  CHECK_REFUSED(resonid_create(&c.head, &handle, &error), "noise_memory_samples");
  c.noise_memory_samples = 0.0;
  const resonid_complex controller[] = {{1.0, 0.0}, {2.0, 0.0}};
  c.controller_at_line = controller;
  c.controller_lines = 2;
  CHECK_REFUSED(resonid_create(&c.head, &handle, &error), "controller_at_line");
  c.controller_lines = 1000000;
  CHECK_REFUSED(resonid_create(&c.head, &handle, &error), "controller_lines");
  c.controller_lines = 0;
  t.frequency_hz = NULL;
  CHECK_REFUSED(resonid_create(&c.head, &handle, &error), "frequency_hz");
  t.head.kind = RESONID_LINE_BANK;
  CHECK_REFUSED(resonid_create(&c.head, &handle, &error), "kind");
  t.head.struct_size = 0;
  CHECK_REFUSED(resonid_create(&c.head, &handle, &error), "tracker");
  CHECK(handle == NULL);
}

int main(void) {
  all_approaches_find_the_plant(RESONID_KALMAN_BANK);
  all_approaches_find_the_plant(RESONID_SLIDING_DFT);
  standard_deviation_is_that_of_the_errors();
  chirp_finds_the_plant_on_its_way();
  refusals_name_the_field();
  return verdict();
}
