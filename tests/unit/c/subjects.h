// SPDX-License-Identifier: MIT
// One handle of every kind behind the same few functions, for the tests of what holds for all of them.
#ifndef RESONID_TESTS_C_SUBJECTS_H
#define RESONID_TESTS_C_SUBJECTS_H

#include "check.h"

enum { kLargestHandle = 1 << 20 };

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

/// All that a handle says about itself: what must be equal bit for bit. Padding in its memory need not be.
typedef struct told {
  unsigned char bytes[2048];
} told;

typedef struct subject {
  const char* name;
  uint32_t family;
  uint32_t kind;  ///< Kind, method or precision.
  size_t (*size)(uint32_t kind);
  resonid_status (*init)(uint32_t kind, void* memory, size_t size, resonid_error* error);
  resonid_status (*step)(void* handle, double ru, double u, double y);
  resonid_status (*reset)(void* handle);
  void (*tell)(const void* handle, told* out);
} subject;

static const double kSubjectLines[] = {20.0, 50.0};

#define SUBJECT_FUNCTIONS(name, configure)                                                   \
  static inline size_t name##_subject_size(uint32_t kind) {                                  \
    resonid_##name##_config c;                                                               \
    configure;                                                                               \
    return resonid_##name##_size(&c);                                                        \
  }                                                                                          \
  static inline resonid_status name##_subject_init(uint32_t kind, void* memory, size_t size, \
                                                   resonid_error* e) {                       \
    resonid_##name##_config c;                                                               \
    resonid_##name* handle = NULL;                                                           \
    configure;                                                                               \
    const resonid_status status = resonid_##name##_init(memory, size, &c, &handle, e);       \
    if (status == RESONID_OK && (void*)handle != memory) return RESONID_ERROR_HANDLE;        \
    return status;                                                                           \
  }                                                                                          \
  static inline resonid_status name##_subject_reset(void* h) {                               \
    return resonid_##name##_reset((resonid_##name*)h);                                       \
  }

static inline void configure_excitation(resonid_excitation_config* c, uint32_t kind) {
  CHECK_OK(resonid_excitation_defaults(c, sizeof *c, kind));
  c->sample_rate_hz = 500.0;
  c->lines = 2;
  c->lines_hz = kSubjectLines;
  c->from_hz = 5.0;
  c->to_hz = 60.0;
  c->duration_s = 1.7;
  c->repeat = 1;
}
SUBJECT_FUNCTIONS(excitation, configure_excitation(&c, kind))
static inline void excitation_subject_tell(const void* h, told* out) {
  resonid_excitation_info info;
  RESONID_MEMORY(copy, 8192);  // whose next sample may be taken
  double x = 0.0;
  CHECK_OK(resonid_excitation_get_info((const resonid_excitation*)h, &info, sizeof info));
  CHECK_OK(resonid_restore(copy, sizeof copy, h, resonid_handle_size(h), RESONID_FAMILY_EXCITATION, NULL));
  CHECK_OK(resonid_excitation_step((resonid_excitation*)(void*)copy, &x));
  memcpy(out->bytes, &info, sizeof info);
  memcpy(out->bytes + sizeof info, &x, sizeof x);
}
static inline resonid_status excitation_subject_step(void* h, double ru, double u, double y) {
  double x;
  (void)ru, (void)u, (void)y;
  return resonid_excitation_step((resonid_excitation*)h, &x);
}

static inline void configure_line_bank(resonid_line_bank_config* c, uint32_t kind) {
  CHECK_OK(resonid_line_bank_defaults(c, sizeof *c));
  c->sample_rate_hz = 500.0;
  c->lines = 2;
  c->frequency_hz = kSubjectLines;
  c->precision = kind % 2;
  c->channels = kind < 2 ? 2 : 3;
}
SUBJECT_FUNCTIONS(line_bank, configure_line_bank(&c, kind))
static inline void line_bank_subject_tell(const void* h, told* out) {
  resonid_line_bank_info info;
  resonid_complex g[4];
  CHECK_OK(resonid_line_bank_get_info((const resonid_line_bank*)h, &info, sizeof info));
  CHECK_OK(resonid_line_bank_responses((const resonid_line_bank*)h, g, 2));
  CHECK_OK(resonid_line_bank_phasor((const resonid_line_bank*)h, 0, RESONID_CHANNEL_Y, &g[2]));
  CHECK_OK(resonid_line_bank_phasor((const resonid_line_bank*)h, 1, info.channels - 1, &g[3]));
  memcpy(out->bytes, &info, sizeof info);
  memcpy(out->bytes + sizeof info, g, sizeof g);
}
static inline resonid_status line_bank_subject_step(void* h, double ru, double u, double y) {
  resonid_line_bank* bank = (resonid_line_bank*)h;
  const resonid_status status = resonid_line_bank_step(bank, u, y);
  return status == RESONID_ERROR_UNSUPPORTED ? resonid_line_bank_step_excited(bank, ru, u, y) : status;
}

static inline void configure_tracker(resonid_tracker_config* c, uint32_t kind) {
  CHECK_OK(resonid_tracker_defaults(c, sizeof *c, kind == 3 ? RESONID_SLIDING_DFT : kind));
  c->sample_rate_hz = 500.0;
  c->lines = 2;
  c->frequency_hz = kSubjectLines;
  c->window_samples = kind == 3 ? 600 : 50;
  c->window = kind == 3 ? RESONID_WINDOW_HANN : RESONID_WINDOW_RECTANGULAR;
  c->from_hz = 5.0;
  c->to_hz = 60.0;
  c->duration_s = 10.0;
}
SUBJECT_FUNCTIONS(tracker, configure_tracker(&c, kind))
static inline void tracker_subject_tell(const void* h, told* out) {
  resonid_tracker_info info;
  resonid_tracker_line line;
  CHECK_OK(resonid_tracker_get_info((const resonid_tracker*)h, &info, sizeof info));
  CHECK_OK(resonid_tracker_get_line((const resonid_tracker*)h, info.lines - 1, &line, sizeof line));
  memcpy(out->bytes, &info, sizeof info);
  memcpy(out->bytes + sizeof info, &line, sizeof line);
}
static inline resonid_status tracker_subject_step(void* h, double ru, double u, double y) {
  (void)ru, (void)u;
  return resonid_tracker_step((resonid_tracker*)h, y);
}

static inline void configure_response(resonid_response_config* c, resonid_tracker_config* tracker,
                                      uint32_t kind) {
  configure_tracker(tracker, kind);
  CHECK_OK(resonid_response_defaults(c, sizeof *c));
  c->tracker = tracker;
}
SUBJECT_FUNCTIONS(response, resonid_tracker_config t; configure_response(&c, &t, kind))
static inline void response_subject_tell(const void* h, told* out) {
  resonid_response_info info;
  resonid_response_line line;
  CHECK_OK(resonid_response_get_info((const resonid_response*)h, &info, sizeof info));
  CHECK_OK(resonid_response_get_line((const resonid_response*)h, 0, RESONID_JOINT, &line, sizeof line));
  memcpy(out->bytes, &info, sizeof info);
  memcpy(out->bytes + sizeof info, &line, sizeof line);
}
static inline resonid_status response_subject_step(void* h, double ru, double u, double y) {
  return resonid_response_step((resonid_response*)h, ru, u, y);
}

static inline void configure_rls(resonid_rls_config* c, uint32_t kind) {
  CHECK_OK(resonid_rls_defaults(c, sizeof *c));
  c->precision = kind % 2;
  c->parameters = 3;
  c->forgetting = kind / 2;
}
SUBJECT_FUNCTIONS(rls, configure_rls(&c, kind))
static inline void rls_subject_tell(const void* h, told* out) {
  resonid_rls_info info;
  double x[12];
  CHECK_OK(resonid_rls_get_info((const resonid_rls*)h, &info, sizeof info));
  CHECK_OK(resonid_rls_parameters((const resonid_rls*)h, x, 3));
  CHECK_OK(resonid_rls_covariance((const resonid_rls*)h, x + 3, 9));
  memcpy(out->bytes, &info, sizeof info);
  memcpy(out->bytes + sizeof info, x, sizeof x);
}
static inline resonid_status rls_subject_step(void* h, double ru, double u, double y) {
  const double f[3] = {1.0, ru, u};
  return resonid_rls_step((resonid_rls*)h, f, y, 1.0);
}

static inline void configure_model(resonid_model_config* c, uint32_t kind) {
  static const double start_b[] = {0.28, 0.12}, start_a[] = {-0.68, 0.22}, controller[] = {0.2},
                      one[] = {1.0};
  CHECK_OK(resonid_model_defaults(c, sizeof *c, kind));
  c->order = 2;
  c->sample_rate_hz = 500.0;
  c->delay_samples = 0;
  c->start_b = start_b;
  c->start_a = start_a;
  c->fixed_integrator = 0;
  c->controller_numerator = controller;
  c->controller_denominator = one;
  c->controller_numerator_count = c->controller_denominator_count = 1;
}
SUBJECT_FUNCTIONS(model, configure_model(&c, kind))
static inline void model_subject_tell(const void* h, told* out) {
  resonid_model_info info;
  double x[20];
  CHECK_OK(resonid_model_get_info((const resonid_model*)h, &info, sizeof info));
  CHECK_OK(resonid_model_coefficients((const resonid_model*)h, x, x + 2, 2));
  CHECK_OK(resonid_model_covariance((const resonid_model*)h, x + 4, 16));
  memcpy(out->bytes, &info, sizeof info);
  memcpy(out->bytes + sizeof info, x, sizeof x);
}
static inline resonid_status model_subject_step(void* h, double ru, double u, double y) {
  return resonid_model_step((resonid_model*)h, ru, u, y);
}

static inline void configure_physical(resonid_physical_config* c, uint32_t kind) {
  CHECK_OK(resonid_physical_defaults(c, sizeof *c));
  c->sample_rate_hz = 500.0;
  c->replay = kind;
  c->driven_inertia.value = 0.002;
  c->load_inertia.value = 0.003;
  c->stiffness.value = 10.0;
  c->damping.value = 0.05;
}
SUBJECT_FUNCTIONS(physical, configure_physical(&c, kind))
static inline void physical_subject_tell(const void* h, told* out) {
  resonid_physical_info info;
  double x[64];
  CHECK_OK(resonid_physical_get_info((const resonid_physical*)h, &info, sizeof info));
  CHECK_OK(resonid_physical_covariance((const resonid_physical*)h, x, 64));
  memcpy(out->bytes, &info, sizeof info);
  memcpy(out->bytes + sizeof info, x, sizeof x);
}
static inline resonid_status physical_subject_step(void* h, double ru, double u, double y) {
  return resonid_physical_step((resonid_physical*)h, ru, u, y);
}

static inline void configure_change(resonid_change_config* c, uint32_t kind) {
  CHECK_OK(resonid_change_defaults(c, sizeof *c));
  c->statistic = kind;
  c->sample_rate_hz = 500.0;
  c->block_s = 0.01;
  c->baseline_s = 0.5;
  c->false_alarm_interval_s = 100.0;
}
SUBJECT_FUNCTIONS(change, configure_change(&c, kind))
static inline void change_subject_tell(const void* h, told* out) {
  resonid_change_info info;
  CHECK_OK(resonid_change_get_info((const resonid_change*)h, &info, sizeof info));
  memcpy(out->bytes, &info, sizeof info);
}
static inline resonid_status change_subject_step(void* h, double ru, double u, double y) {
  (void)ru, (void)u;
  return resonid_change_step((resonid_change*)h, y, 1.0);
}

static inline void configure_guard(resonid_guard_config* c, uint32_t kind) {
  CHECK_OK(resonid_guard_defaults(c, sizeof *c));
  c->sample_rate_hz = 500.0;
  c->amplitude = 1.0;
  c->torque_limit = 50.0;
  c->velocity_limit = 100.0;
  c->oscillation_from_hz = 5.0;
  c->oscillation_least = 10.0;
  c->torque_is_total = kind;
}
SUBJECT_FUNCTIONS(guard, configure_guard(&c, kind))
static inline void guard_subject_tell(const void* h, told* out) {
  resonid_guard_info info;
  CHECK_OK(resonid_guard_get_info((const resonid_guard*)h, &info, sizeof info));
  memcpy(out->bytes, &info, sizeof info);
}
static inline resonid_status guard_subject_step(void* h, double ru, double u, double y) {
  double injected;
  return resonid_guard_step((resonid_guard*)h, ru, u, y, 0.0, &injected);
}

static inline void configure_encoder(resonid_encoder_config* c, uint32_t kind) {
  CHECK_OK(resonid_encoder_defaults(c, sizeof *c));
  c->kind = kind;
  c->sample_rate_hz = 500.0;
  c->counts_per_turn = 4096;
  c->bits = 16;
  c->largest_velocity = 700.0;
}
SUBJECT_FUNCTIONS(encoder, configure_encoder(&c, kind))
static inline void encoder_subject_tell(const void* h, told* out) {
  resonid_encoder_info info;
  CHECK_OK(resonid_encoder_get_info((const resonid_encoder*)h, &info, sizeof info));
  memcpy(out->bytes, &info, sizeof info);
}
static inline resonid_status encoder_subject_step(void* h, double ru, double u, double y) {
  (void)ru, (void)u;
  if (isnan(y)) return resonid_encoder_miss((resonid_encoder*)h, 1);
  return resonid_encoder_step((resonid_encoder*)h, (uint64_t)(2048 + (int)(300.0 * y)), NULL);
}

#define SUBJECT(label, name, family, kind)                                                 \
  {                                                                                        \
    label, family, kind, &name##_subject_size, &name##_subject_init, &name##_subject_step, \
        &name##_subject_reset, &name##_subject_tell                                        \
  }
static const subject kSubjects[] = {
    SUBJECT("prbs", excitation, RESONID_FAMILY_EXCITATION, RESONID_PRBS),
    SUBJECT("multisine", excitation, RESONID_FAMILY_EXCITATION, RESONID_MULTISINE),
    SUBJECT("chirp", excitation, RESONID_FAMILY_EXCITATION, RESONID_CHIRP),
    SUBJECT("stepped sine", excitation, RESONID_FAMILY_EXCITATION, RESONID_STEPPED_SINE),
    SUBJECT("line bank", line_bank, RESONID_FAMILY_LINE_BANK, 0),
    SUBJECT("line bank, float", line_bank, RESONID_FAMILY_LINE_BANK, 1),
    SUBJECT("line bank of three", line_bank, RESONID_FAMILY_LINE_BANK, 2),
    SUBJECT("line bank of three, float", line_bank, RESONID_FAMILY_LINE_BANK, 3),
    SUBJECT("Kalman bank", tracker, RESONID_FAMILY_TRACKER, RESONID_KALMAN_BANK),
    SUBJECT("sliding DFT", tracker, RESONID_FAMILY_TRACKER, RESONID_SLIDING_DFT),
    SUBJECT("chirp tracker", tracker, RESONID_FAMILY_TRACKER, RESONID_CHIRP_TRACKER),
    SUBJECT("sliding DFT, long", tracker, RESONID_FAMILY_TRACKER, 3),
    SUBJECT("response of a Kalman bank", response, RESONID_FAMILY_RESPONSE, RESONID_KALMAN_BANK),
    SUBJECT("response of a sliding DFT", response, RESONID_FAMILY_RESPONSE, RESONID_SLIDING_DFT),
    SUBJECT("response of a chirp tracker", response, RESONID_FAMILY_RESPONSE, RESONID_CHIRP_TRACKER),
    SUBJECT("response of a sliding DFT, long", response, RESONID_FAMILY_RESPONSE, 3),
    SUBJECT("least squares", rls, RESONID_FAMILY_RLS, 2 * RESONID_FORGETTING_CONSTANT),
    SUBJECT("least squares, float", rls, RESONID_FAMILY_RLS, 2 * RESONID_FORGETTING_CONSTANT + 1),
    SUBJECT("least squares, variable", rls, RESONID_FAMILY_RLS, 2 * RESONID_FORGETTING_VARIABLE),
    SUBJECT("least squares, directional", rls, RESONID_FAMILY_RLS, 2 * RESONID_FORGETTING_DIRECTIONAL),
    SUBJECT("ARX", model, RESONID_FAMILY_MODEL, RESONID_ARX),
    SUBJECT("output error", model, RESONID_FAMILY_MODEL, RESONID_OE),
    SUBJECT("output error, filtered", model, RESONID_FAMILY_MODEL, RESONID_OE_FILTERED),
    SUBJECT("CLOE", model, RESONID_FAMILY_MODEL, RESONID_CLOE),
    SUBJECT("F-CLOE", model, RESONID_FAMILY_MODEL, RESONID_F_CLOE),
    SUBJECT("CLOE, damped", model, RESONID_FAMILY_MODEL, RESONID_CLOE_DAMPED),
    SUBJECT("instrumental variables", model, RESONID_FAMILY_MODEL, RESONID_IV),
    SUBJECT("physical", physical, RESONID_FAMILY_PHYSICAL, 0),
    SUBJECT("physical, replaying", physical, RESONID_FAMILY_PHYSICAL, 1),
    SUBJECT("CUSUM", change, RESONID_FAMILY_CHANGE, RESONID_CUSUM),
    SUBJECT("likelihood ratio", change, RESONID_FAMILY_CHANGE, RESONID_LIKELIHOOD_RATIO),
    SUBJECT("guard", guard, RESONID_FAMILY_GUARD, 0),
    SUBJECT("encoder", encoder, RESONID_FAMILY_ENCODER, RESONID_ENCODER_COUNTER),
    SUBJECT("encoder, absolute", encoder, RESONID_FAMILY_ENCODER, RESONID_ENCODER_ABSOLUTE_TURN),
};
enum { kSubjectCount = sizeof kSubjects / sizeof kSubjects[0] };

/// Whether two handles of the subject say the same, bit for bit.
static inline int tell_the_same(const subject* s, const void* one, const void* other) {
  told first, second;
  memset(&first, 0, sizeof first);
  memset(&second, 0, sizeof second);
  s->tell(one, &first);
  s->tell(other, &second);
  return memcmp(&first, &second, sizeof first) == 0;
}

#endif
