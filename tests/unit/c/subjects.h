// SPDX-License-Identifier: MIT
// One handle of every kind, for the tests of what holds for all of them.
#ifndef RESONID_TESTS_C_SUBJECTS_H
#define RESONID_TESTS_C_SUBJECTS_H

#include "check.h"

enum { kLargestHandle = 1 << 22 };

/// The signals of sample k: excitation, input and output of a lag in a loop, with noise.
typedef struct signals {
  difference_equation plant;
  uint64_t random;
} signals;
static inline signals first_signals(void) {
  const signals s = {{2, {0.3, 0.1}, {-0.7, 0.2}, {0}, {0}}, 7};
  return s;
}
static inline void next_signals(signals* s, int k, double* ru, double* u, double* y) {
  const double output = next_output(&s->plant);
  *ru = noise(&s->random) + cos(kTwoPi * 20.0 * k / 500.0) + cos(kTwoPi * 50.0 * k / 500.0);
  *y = output + 0.01 * noise(&s->random);
  *u = *ru - 0.2 * *y;
  push(&s->plant, *u, output);
}

/// Settings of any kind, and those that some of them point to.
typedef struct any_settings {
  union {
    resonid_settings head;
    resonid_excitation_settings excitation;
    resonid_line_bank_settings line_bank;
    resonid_tracker_settings tracker;
    resonid_response_settings response;
    resonid_rls_settings rls;
    resonid_model_settings model;
    resonid_physical_settings physical;
    resonid_change_settings change;
    resonid_guard_settings guard;
    resonid_encoder_settings encoder;
    resonid_axis_settings axis;
    resonid_control_settings control;
  } of;
  resonid_tracker_settings pattern;
  resonid_physical_settings physical;
  resonid_change_settings change;
} any_settings;

/// A kind in one of its forms.
typedef struct subject {
  const char* name;
  uint32_t kind;
  int form;
} subject;

static const double kSubjectLines[] = {20.0, 50.0};

static inline void configure_tracker(resonid_tracker_settings* t, uint32_t kind, int longer) {
  CHECK_OK(resonid_defaults(&t->head, sizeof *t, kind));
  t->sample_rate_hz = 500.0;
  t->lines = 2;
  t->frequency_hz = kSubjectLines;
  t->window_samples = longer ? 600 : 50;
  t->window = longer ? RESONID_WINDOW_HANN : RESONID_WINDOW_RECTANGULAR;
  t->from_hz = 5.0;
  t->to_hz = 60.0;
  t->duration_s = 10.0;
}

static inline void configure_model(resonid_model_settings* m) {
  static const double start_b[] = {0.28, 0.12}, start_a[] = {-0.68, 0.22}, controller[] = {0.2},
                      one[] = {1.0};
  m->order = 2;
  m->sample_rate_hz = 500.0;
  m->start_b = start_b;
  m->start_a = start_a;
  m->fixed_integrator = 0;
  m->controller_numerator = controller;
  m->controller_denominator = one;
  m->controller_numerator_count = m->controller_denominator_count = 1;
}

static inline void configure_physical(resonid_physical_settings* p) {
  p->sample_rate_hz = 500.0;
  p->driven_inertia.value = 0.002;
  p->load_inertia.value = 0.003;
  p->stiffness.value = 10.0;
  p->damping.value = 0.05;
}
static inline void configure_change(resonid_change_settings* c) {
  c->sample_rate_hz = 500.0;
  c->block_s = 0.01;
  c->baseline_s = 0.5;
  c->false_alarm_interval_s = 100.0;
}
/// A row every 25th sample, its work spread in form 1; with margins, gap and a watched figure.
static inline void configure_axis(any_settings* a, int form) {
  static const double b[] = {0.28, 0.12, 0.001}, poles[] = {-0.68, 0.22, 0.001}, controller[] = {0.2},
                      one[] = {1.0};
  resonid_axis_settings* x = &a->of.axis;
  x->sample_rate_hz = 500.0;
  x->controller_numerator = controller;
  x->controller_denominator = one;
  x->controller_numerator_count = x->controller_denominator_count = 1;
  x->lines_hz = kSubjectLines;
  x->lines = 2;
  x->window_samples = 50;
  x->from_hz = 5.0;
  x->to_hz = 60.0;
  x->duration_s = 10.0;
  x->start_b = x->baseline_b = b;
  x->start_a = x->baseline_a = poles;
  x->baseline_order = 3;
  x->row_every_samples = 25;
  x->spread_samples = form == 1 ? 25 : 1;
  x->injects = 1;
  CHECK_OK(resonid_defaults(&a->physical.head, sizeof a->physical, RESONID_PHYSICAL));
  configure_physical(&a->physical);
  x->physical = &a->physical;
  CHECK_OK(resonid_defaults(&a->change.head, sizeof a->change, RESONID_CUSUM));
  configure_change(&a->change);
  a->change.block_s = 0.1;
  a->change.baseline_s = 2.0;
  x->change = &a->change;
  x->change_of = RESONID_FIGURE_RESONANCE;
}

/// Form 0: a filtered PI; 1: a cascade with a schedule over the summed position, in float.
static inline void configure_control(resonid_control_settings* c, int form) {
  static const resonid_biquad notches[] = {{20.0, 0.2, 0.6}, {60.0, 0.9, 0.5}};
  static const resonid_gain_node nodes[] = {{-0.1, 0.2, 1.0}, {0.1, 0.5, 4.0}};
  c->sample_rate_hz = 500.0;
  c->biquads = notches;
  c->biquad_count = 2;
  c->torque_limit = 3.0;
  if (form == 0) {
    c->kp = 0.3;
    c->ki = 2.0;
    return;
  }
  c->precision = RESONID_FLOAT;
  c->kv = 5.0;
  c->sums_velocity = 1;
  c->schedule = nodes;
  c->node_count = 2;
}

static inline void configure(const subject* s, any_settings* a) {
  const int form = s->form;
  memset(a, 0, sizeof *a);
  CHECK_OK(resonid_defaults(&a->of.head, sizeof a->of, s->kind));
  switch (s->kind >> 8) {
    case RESONID_PRBS >> 8:
      a->of.excitation.sample_rate_hz = 500.0;
      a->of.excitation.lines = 2;
      a->of.excitation.lines_hz = kSubjectLines;
      a->of.excitation.from_hz = 5.0;
      a->of.excitation.to_hz = 60.0;
      a->of.excitation.duration_s = 1.7;
      a->of.excitation.repeat = 1;
      break;
    case RESONID_LINE_BANK >> 8:
      a->of.line_bank.sample_rate_hz = 500.0;
      a->of.line_bank.lines = 2;
      a->of.line_bank.frequency_hz = kSubjectLines;
      a->of.line_bank.precision = (uint32_t)form % 2;
      a->of.line_bank.channels = form < 2 ? 2 : 3;
      break;
    case RESONID_KALMAN_BANK >> 8:
      configure_tracker(&a->of.tracker, s->kind, form);
      break;
    case RESONID_RESPONSE >> 8:
      configure_tracker(&a->pattern, form == 3 ? RESONID_SLIDING_DFT : RESONID_KALMAN_BANK + (uint32_t)form,
                        form == 3);
      a->of.response.tracker = &a->pattern;
      break;
    case RESONID_RLS >> 8:
      a->of.rls.precision = (uint32_t)form % 2;
      a->of.rls.parameters = 3;
      a->of.rls.forgetting = (uint32_t)form / 2;
      break;
    case RESONID_ARX >> 8:
      configure_model(&a->of.model);
      break;
    case RESONID_PHYSICAL >> 8:
      configure_physical(&a->of.physical);
      if (form == 0) a->of.physical.replay_speed = 0;
      break;
    case RESONID_CUSUM >> 8:
      configure_change(&a->of.change);
      break;
    case RESONID_AXIS_ARX >> 8:
      configure_axis(a, form);
      break;
    case RESONID_CONTROL >> 8:
      configure_control(&a->of.control, form);
      break;
    case RESONID_GUARD >> 8:
      a->of.guard.sample_rate_hz = 500.0;
      a->of.guard.amplitude = 1.0;
      a->of.guard.torque_limit = 50.0;
      a->of.guard.velocity_limit = 100.0;
      a->of.guard.oscillation_from_hz = 5.0;
      a->of.guard.oscillation_least = 10.0;
      break;
    default:
      a->of.encoder.sample_rate_hz = 500.0;
      a->of.encoder.counts_per_turn = 4096;
      a->of.encoder.bits = 16;
      a->of.encoder.largest_velocity = 700.0;
  }
}
static inline size_t subject_size(const subject* s) {
  any_settings a;
  configure(s, &a);
  return resonid_size(&a.of.head);
}
static inline resonid_status subject_init(const subject* s, void* memory, size_t size, resonid_error* error) {
  any_settings a;
  resonid_handle* handle = NULL;
  configure(s, &a);
  const resonid_status status = resonid_init(memory, size, &a.of.head, &handle, error);
  return status == RESONID_OK && (void*)handle != memory ? RESONID_ERROR_HANDLE : status;
}

/// One sample by whatever step the kind has.
static inline resonid_status subject_step(const subject* s, void* memory, double ru, double u, double y) {
  resonid_handle* h = (resonid_handle*)memory;
  double x;
  switch (s->kind >> 8) {
    case RESONID_PRBS >> 8:
      return resonid_generate(h, &x, 1);
    case RESONID_RLS >> 8: {
      const double f[3] = {1.0, ru, u};
      return resonid_rls_step(h, f, 3, y, 1.0);
    }
    case RESONID_CUSUM >> 8:
      return resonid_change_step(h, y, 1.0);
    case RESONID_GUARD >> 8:
      return resonid_guard_step(h, ru, u, y, 0.0, &x);
    case RESONID_CONTROL >> 8:
      return resonid_control_step(h, ru, y, 0.1 * y, 0.0, 0.01 * u, &x);
    case RESONID_ENCODER_COUNTER >> 8:
      if (isnan(y)) return resonid_miss(h, 1);
      return resonid_encoder_step(h, (uint64_t)(2048 + (int)(300.0 * y)), NULL);
    default:
      return resonid_step(h, ru, u, y);
  }
}

/// All that a handle says about itself: what must be equal bit for bit. Padding in its memory need not be.
typedef struct told {
  uint64_t results[128];
  double parameters[12], covariance[144];
  resonid_complex phasor[2];
  resonid_tracker_line tracker_line;
  resonid_response_line response_line;
  resonid_axis_line_info axis_line;
  resonid_complex axis_response;
  double next_sample;
} told;
static inline told tell(const void* memory) {
  const resonid_handle* h = (const resonid_handle*)memory;
  RESONID_MEMORY(copy, 8192);  // whose next sample may be taken
  told t;
  memset(&t, 0, sizeof t);
  CHECK_OK(resonid_read(h, resonid_kind(h), (resonid_results*)(void*)t.results, sizeof t.results));
  for (size_t n = 1; n <= 12; ++n)
    if (resonid_parameters(h, t.parameters, n) == RESONID_OK)
      CHECK_OK(resonid_covariance(h, t.covariance, n * n));
  for (size_t n = 1; n <= 2; ++n) (void)resonid_phasors(h, 0, t.phasor, n);
  (void)resonid_read_tracker_line(h, 0, &t.tracker_line, sizeof t.tracker_line);
  (void)resonid_read_response_line(h, 0, RESONID_JOINT, &t.response_line, sizeof t.response_line);
  (void)resonid_axis_line(h, 0, &t.axis_line, sizeof t.axis_line);
  (void)resonid_axis_response(h, 20.0, &t.axis_response);
  if (resonid_kind(h) >> 8 == RESONID_PRBS >> 8) {
    unsigned char taken[sizeof copy];
    resonid_handle* other = NULL;
    CHECK_OK(resonid_snapshot(h, taken, sizeof taken, NULL));
    CHECK_OK(resonid_restore(copy, sizeof copy, taken, sizeof taken, 0, &other, NULL));
    CHECK_OK(resonid_generate(other, &t.next_sample, 1));
  }
  return t;
}
/// Whether two handles say the same, bit for bit.
static inline int tell_the_same(const void* one, const void* other) {
  const told first = tell(one), second = tell(other);
  return memcmp(&first, &second, sizeof first) == 0;
}

static const subject kSubjects[] = {
    {"prbs", RESONID_PRBS, 0},
    {"multisine", RESONID_MULTISINE, 0},
    {"chirp", RESONID_CHIRP, 0},
    {"stepped sine", RESONID_STEPPED_SINE, 0},
    {"line bank", RESONID_LINE_BANK, 0},
    {"line bank, float", RESONID_LINE_BANK, 1},
    {"line bank of three", RESONID_LINE_BANK, 2},
    {"line bank of three, float", RESONID_LINE_BANK, 3},
    {"Kalman bank", RESONID_KALMAN_BANK, 0},
    {"sliding DFT", RESONID_SLIDING_DFT, 0},
    {"sliding DFT, long", RESONID_SLIDING_DFT, 1},
    {"chirp tracker", RESONID_CHIRP_TRACKER, 0},
    {"response of a Kalman bank", RESONID_RESPONSE, 0},
    {"response of a sliding DFT", RESONID_RESPONSE, 1},
    {"response of a chirp tracker", RESONID_RESPONSE, 2},
    {"response of a sliding DFT, long", RESONID_RESPONSE, 3},
    {"least squares", RESONID_RLS, 2 * RESONID_FORGETTING_CONSTANT},
    {"least squares, float", RESONID_RLS, 2 * RESONID_FORGETTING_CONSTANT + 1},
    {"least squares, variable", RESONID_RLS, 2 * RESONID_FORGETTING_VARIABLE},
    {"least squares, directional", RESONID_RLS, 2 * RESONID_FORGETTING_DIRECTIONAL},
    {"ARX", RESONID_ARX, 0},
    {"output error", RESONID_OE, 0},
    {"output error, filtered", RESONID_OE_FILTERED, 0},
    {"CLOE", RESONID_CLOE, 0},
    {"F-CLOE", RESONID_F_CLOE, 0},
    {"CLOE, damped", RESONID_CLOE_DAMPED, 0},
    {"instrumental variables", RESONID_IV, 0},
    {"physical", RESONID_PHYSICAL, 0},
    {"physical, replaying", RESONID_PHYSICAL, 1},
    {"CUSUM", RESONID_CUSUM, 0},
    {"likelihood ratio", RESONID_LIKELIHOOD_RATIO, 0},
    {"guard", RESONID_GUARD, 0},
    {"encoder", RESONID_ENCODER_COUNTER, 0},
    {"encoder, absolute", RESONID_ENCODER_ABSOLUTE, 0},
    {"axis: ARX", RESONID_AXIS_ARX, 0},
    {"axis: output error", RESONID_AXIS_OE, 0},
    {"axis: output error, filtered", RESONID_AXIS_OE_FILTERED, 1},
    {"axis: CLOE", RESONID_AXIS_CLOE, 0},
    {"axis: F-CLOE", RESONID_AXIS_F_CLOE, 0},
    {"axis: CLOE, damped", RESONID_AXIS_CLOE_DAMPED, 1},
    {"axis: instrumental variables", RESONID_AXIS_IV, 0},
    {"axis: physical", RESONID_AXIS_PHYSICAL, 0},
    {"axis: lines", RESONID_AXIS_LINES, 0},
    {"axis: lines in turn", RESONID_AXIS_LINES, 1},
    {"axis: sliding DFT", RESONID_AXIS_SLIDING_DFT, 0},
    {"axis: chirp", RESONID_AXIS_CHIRP, 0},
    {"control", RESONID_CONTROL, 0},
    {"control: cascade with a schedule, float", RESONID_CONTROL, 1},
};
enum { kSubjectCount = sizeof kSubjects / sizeof kSubjects[0] };

#endif
