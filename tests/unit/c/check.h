// SPDX-License-Identifier: MIT
// What the C tests share: checks that count failures, a random generator, drives that are simulated here.
#ifndef RESONID_TESTS_C_CHECK_H
#define RESONID_TESTS_C_CHECK_H

#include <math.h>
#include <resonid/c/resonid.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int failures = 0;

#define CHECK(condition)                                               \
  do {                                                                 \
    if (!(condition)) {                                                \
      ++failures;                                                      \
      printf("%s:%d: not true: %s\n", __FILE__, __LINE__, #condition); \
    }                                                                  \
  } while (0)
#define CHECK_NEAR(value, expected, tolerance)                                              \
  do {                                                                                      \
    const double v_ = (value), e_ = (expected);                                             \
    if (!(fabs(v_ - e_) <= (tolerance))) {                                                  \
      ++failures;                                                                           \
      printf("%s:%d: %s is %.9g, not %.9g within %g\n", __FILE__, __LINE__, #value, v_, e_, \
             (double)(tolerance));                                                          \
    }                                                                                       \
  } while (0)
/// Status, and what the error says, if anything was expected of it.
#define CHECK_OK(call)                                                                 \
  do {                                                                                 \
    const resonid_status s_ = (call);                                                  \
    if (s_ != RESONID_OK) {                                                            \
      ++failures;                                                                      \
      printf("%s:%d: %s: %s\n", __FILE__, __LINE__, #call, resonid_status_string(s_)); \
    }                                                                                  \
  } while (0)
#define CHECK_STATUS(call, expected) CHECK((call) == (expected))

static inline void check_refused(int line, const resonid_error* error, resonid_status status,
                                 const char* field) {
  if (status == RESONID_ERROR_SETTINGS && error->status == status && strcmp(error->field, field) == 0 &&
      error->requirement[0] != 0)
    return;
  ++failures;
  printf("line %d: status %d, field '%s', requirement '%s' instead of field '%s'\n", line, (int)status,
         error->field, error->requirement, field);
}
/// The call refuses this field of the configuration; `error` must be at hand.
#define CHECK_REFUSED(call, name)                \
  do {                                           \
    resonid_error error = RESONID_ERROR_INIT;    \
    const resonid_status s_ = (call);            \
    check_refused(__LINE__, &error, s_, (name)); \
  } while (0)

static const double kTwoPi = 6.283185307179586476925;

/// Uniform in -1 ... 1; each test has its own state.
static inline double noise(uint64_t* state) {
  *state ^= *state << 13;
  *state ^= *state >> 7;
  *state ^= *state << 17;
  return (double)(*state >> 11) / 4503599627370496.0 - 1.0;
}

/// y(k) = sum b_i u(k-i) - sum a_i y(k-i), i = 1 ... order.
typedef struct difference_equation {
  int order;
  double b[8], a[8], u[8], y[8];
} difference_equation;

static inline double next_output(difference_equation* e) {
  double y = 0.0;
  for (int i = 0; i < e->order; ++i) y += e->b[i] * e->u[i] - e->a[i] * e->y[i];
  return y;
}
static inline void push(difference_equation* e, double u, double y) {
  for (int i = e->order - 1; i > 0; --i) {
    e->u[i] = e->u[i - 1];
    e->y[i] = e->y[i - 1];
  }
  e->u[0] = u;
  e->y[0] = y;
}
/// Its response at w rad per sample.
static inline resonid_complex response_of(const difference_equation* e, double w) {
  double nr = 0.0, ni = 0.0, dr = 1.0, di = 0.0;
  for (int i = 0; i < e->order; ++i) {
    const double c = cos(w * (i + 1)), s = -sin(w * (i + 1));
    nr += e->b[i] * c;
    ni += e->b[i] * s;
    dr += e->a[i] * c;
    di += e->a[i] * s;
  }
  const double power = dr * dr + di * di;
  const resonid_complex g = {(nr * dr + ni * di) / power, (ni * dr - nr * di) / power};
  return g;
}

static inline double distance(resonid_complex a, resonid_complex b) {
  return hypot(a.re - b.re, a.im - b.im);
}

static inline int verdict(void) {
  if (failures > 0) printf("%d checks failed\n", failures);
  return failures > 0 ? 1 : 0;
}

#endif
