// SPDX-License-Identifier: MIT
#include "check.h"

enum { kMost = RESONID_RLS_MAX_PARAMETERS };

static void recovers_parameters(uint32_t precision, uint32_t parameters, double tolerance) {
  resonid_rls_settings c;
  CHECK_OK(resonid_defaults(&c.head, sizeof c, RESONID_RLS));
  c.precision = precision;
  c.parameters = parameters;
  c.start_variance = 1e4;
  RESONID_MEMORY(memory, RESONID_RLS_SIZE);
  resonid_handle* rls = NULL;
  CHECK_OK(resonid_init(memory, sizeof memory, &c.head, &rls, NULL));
  uint64_t random = 5 + parameters;
  double truth[kMost], f[kMost], found[kMost];
  for (uint32_t i = 0; i < parameters; ++i) truth[i] = 3.0 * noise(&random);
  for (int k = 0; k < 3000; ++k) {
    double value = 0.0;
    for (uint32_t i = 0; i < parameters; ++i) value += truth[i] * (f[i] = noise(&random));
    CHECK_OK(resonid_rls_step(rls, f, parameters, k == 7 ? NAN : value, 1.0));
  }
  CHECK_OK(resonid_parameters(rls, found, parameters));
  for (uint32_t i = 0; i < parameters; ++i) CHECK_NEAR(found[i], truth[i], tolerance);
  resonid_rls_results info;
  CHECK_OK(resonid_read(rls, RESONID_RLS, &info.head, sizeof info));
  CHECK(info.parameters == parameters && info.excited && info.samples == 3000 && info.skipped_samples == 1);
  CHECK_NEAR(info.memory_samples, 1.0 / (1.0 - c.factor), 1e-2);
  CHECK_OK(resonid_miss(rls, 5));
  CHECK_OK(resonid_read(rls, RESONID_RLS, &info.head, sizeof info));
  CHECK(info.samples == 3005 && info.skipped_samples == 6);
  CHECK_STATUS(resonid_parameters(rls, found, parameters + 1), RESONID_ERROR_RANGE);
  CHECK_STATUS(resonid_rls_step(rls, f, parameters + 1, 0.0, 1.0), RESONID_ERROR_RANGE);
  CHECK_STATUS(resonid_rls_step(rls, NULL, parameters, 0.0, 1.0), RESONID_ERROR_NULL);
}

/// Without forgetting: the textbook's (F'F)^-1 sigma^2, for a regressor whose sums are known in advance.
static void covariance_is_that_of_least_squares(void) {
  enum { kSamples = 20000 };
  resonid_rls_settings c;
  CHECK_OK(resonid_defaults(&c.head, sizeof c, RESONID_RLS));
  c.parameters = 2;
  c.forgetting = RESONID_FORGETTING_NONE;
  c.start_variance = 1e6;
  resonid_handle* rls = NULL;
  CHECK_OK(resonid_create(&c.head, &rls, NULL));
  uint64_t random = 3;
  for (int k = 0; k < kSamples; ++k) {
    const double f[2] = {1.0, k % 2 == 0 ? 2.0 : -2.0};
    CHECK_OK(resonid_rls_step(rls, f, 2, 0.5 * f[0] - 0.25 * f[1] + noise(&random), 1.0));
  }
  double p[4];
  CHECK_OK(resonid_covariance(rls, p, 4));
  const double variance = 1.0 / 3.0;  // of the uniform noise
  CHECK_NEAR(p[0], variance / kSamples, 0.03 * variance / kSamples);
  CHECK_NEAR(p[3], variance / (4.0 * kSamples), 0.03 * variance / (4.0 * kSamples));
  CHECK_NEAR(p[1], 0.0, 0.01 * p[3]);
  CHECK(p[1] == p[2]);
  CHECK_STATUS(resonid_covariance(rls, p, 3), RESONID_ERROR_RANGE);
  resonid_destroy(rls);
}

static void fixed_parameters_stay(void) {
  const double start[] = {0.0, 7.0};
  const uint32_t fixed[] = {0, 1};
  resonid_rls_settings c;
  CHECK_OK(resonid_defaults(&c.head, sizeof c, RESONID_RLS));
  c.parameters = 2;
  c.start = start;
  c.fixed = fixed;
  resonid_handle* rls = NULL;
  CHECK_OK(resonid_create(&c.head, &rls, NULL));
  uint64_t random = 11;
  double found[2];
  for (int k = 0; k < 2000; ++k) {
    const double f[2] = {noise(&random), noise(&random)};
    CHECK_OK(resonid_rls_step(rls, f, 2, 2.0 * f[0] + 7.0 * f[1], 1.0));
  }
  CHECK_OK(resonid_parameters(rls, found, 2));
  CHECK(found[1] == 7.0);
  CHECK_NEAR(found[0], 2.0, 1e-6);
  CHECK_OK(resonid_reset(rls));
  CHECK_OK(resonid_parameters(rls, found, 2));
  CHECK(found[0] == 0.0 && found[1] == 7.0);
  resonid_destroy(rls);
}

static void refusals_name_the_field(void) {
  resonid_rls_settings c;
  resonid_handle* rls = NULL;
  CHECK_OK(resonid_defaults(&c.head, sizeof c, RESONID_RLS));
  CHECK_REFUSED(resonid_create(&c.head, &rls, &error), "parameters");
  c.parameters = kMost + 1;
  CHECK_REFUSED(resonid_create(&c.head, &rls, &error), "parameters");
  CHECK(resonid_size(&c.head) == 0);
  c.parameters = 2;
  c.forgetting = 4;
  CHECK_REFUSED(resonid_create(&c.head, &rls, &error), "forgetting");
  c.forgetting = RESONID_FORGETTING_VARIABLE;
  c.smallest_factor = 2.0;
  CHECK_REFUSED(resonid_create(&c.head, &rls, &error), "smallest_factor");
  c.factor = 0.0;
  CHECK_REFUSED(resonid_create(&c.head, &rls, &error), "factor");
  const double scale[] = {1.0, 0.0};
  CHECK_OK(resonid_defaults(&c.head, sizeof c, RESONID_RLS));
  c.parameters = 2;
  c.scale = scale;
  CHECK_REFUSED(resonid_create(&c.head, &rls, &error), "scale");
  CHECK(rls == NULL);
}

int main(void) {
  for (uint32_t parameters = 1; parameters <= kMost; ++parameters) {
    recovers_parameters(RESONID_DOUBLE, parameters, 1e-7);
    recovers_parameters(RESONID_FLOAT, parameters, 2e-4);
  }
  covariance_is_that_of_least_squares();
  fixed_parameters_stay();
  refusals_name_the_field();
  return verdict();
}
