// SPDX-License-Identifier: MIT
// Callers of other versions: structs that are shorter or longer than the library's, versions, words.
#include <stddef.h>

#include "check.h"

RESONID_MEMORY(memory, 1 << 19);
RESONID_MEMORY(other_memory, 1 << 19);

/// The defaults fill just the struct that the caller has, whatever its size, and refuse sizes that no version
/// has.
#define CHECK_DEFAULTS(type, ...)                                                       \
  do {                                                                                  \
    type whole, *part = (type*)malloc(sizeof whole + 64);                               \
    CHECK_OK(type##_call(&whole, sizeof whole, __VA_ARGS__));                           \
    CHECK(whole.struct_size == sizeof whole);                                           \
    for (size_t size = 8; size <= sizeof whole + 32; size += 8) {                       \
      memset(part, 0x5A, sizeof whole + 64);                                            \
      CHECK_OK(type##_call(part, size, __VA_ARGS__));                                   \
      CHECK(part->struct_size == size);                                                 \
      const unsigned char* bytes = (const unsigned char*)part;                          \
      const size_t known = size < sizeof whole ? size : sizeof whole;                   \
      CHECK(memcmp(bytes + 4, (const unsigned char*)&whole + 4, known - 4) == 0);       \
      for (size_t i = known; i < size; ++i) CHECK(bytes[i] == 0);                       \
      for (size_t i = size; i < sizeof whole + 64; ++i) CHECK(bytes[i] == 0x5A);        \
    }                                                                                   \
    CHECK_STATUS(type##_call(part, 0, __VA_ARGS__), RESONID_ERROR_SIZE);                \
    CHECK_STATUS(type##_call(part, 4, __VA_ARGS__), RESONID_ERROR_SIZE);                \
    CHECK_STATUS(type##_call(part, sizeof whole - 1, __VA_ARGS__), RESONID_ERROR_SIZE); \
    CHECK_STATUS(type##_call(NULL, sizeof whole, __VA_ARGS__), RESONID_ERROR_NULL);     \
    free(part);                                                                         \
  } while (0)
#define resonid_excitation_config_call(c, size, kind) resonid_excitation_defaults(c, size, kind)
#define resonid_line_bank_config_call(c, size, none) resonid_line_bank_defaults(c, size)
#define resonid_tracker_config_call(c, size, kind) resonid_tracker_defaults(c, size, kind)
#define resonid_response_config_call(c, size, none) resonid_response_defaults(c, size)
#define resonid_rls_config_call(c, size, none) resonid_rls_defaults(c, size)
#define resonid_model_config_call(c, size, method) resonid_model_defaults(c, size, method)
#define resonid_physical_config_call(c, size, none) resonid_physical_defaults(c, size)
#define resonid_change_config_call(c, size, none) resonid_change_defaults(c, size)
#define resonid_guard_config_call(c, size, none) resonid_guard_defaults(c, size)
#define resonid_encoder_config_call(c, size, none) resonid_encoder_defaults(c, size)

/// A caller whose struct ends before the last fields gets their defaults: the same bytes as one that sets
/// them. Its struct lies at the end of its memory, where a sanitizer sees every byte that is read too far.
static void an_older_struct_serves(void) {
  resonid_physical_config c;
  CHECK_OK(resonid_physical_defaults(&c, sizeof c));
  c.sample_rate_hz = 500.0;
  c.driven_inertia.value = c.load_inertia.value = 0.01;
  c.stiffness.value = 100.0;
  c.damping.value = 0.1;
  const size_t older = offsetof(resonid_physical_config, refresh_samples);
  resonid_physical_config* shorter = (resonid_physical_config*)malloc(older);
  memcpy(shorter, &c, older);
  shorter->struct_size = (uint32_t)older;
  resonid_physical *whole = NULL, *part = NULL;
  CHECK(resonid_physical_size(shorter) == resonid_physical_size(&c));
  CHECK_OK(resonid_physical_init(memory, sizeof memory, &c, &whole, NULL));
  CHECK_OK(resonid_physical_init(other_memory, sizeof other_memory, shorter, &part, NULL));
  CHECK(memcmp(memory, other_memory, resonid_physical_size(&c)) == 0);
  c.refresh_samples = 3;  // the field does count
  CHECK_OK(resonid_physical_init(memory, sizeof memory, &c, &whole, NULL));
  CHECK(memcmp(memory, other_memory, resonid_physical_size(&c)) != 0);
  free(shorter);
}

static void a_kind_keeps_its_own_defaults_in_a_shorter_struct(void) {
  resonid_tracker_config c;
  const double lines_hz[] = {10.0};
  CHECK_OK(resonid_tracker_defaults(&c, sizeof c, RESONID_KALMAN_BANK));
  c.sample_rate_hz = 500.0;
  c.frequency_hz = lines_hz;
  c.lines = 1;
  resonid_tracker* handle = NULL;
  CHECK_OK(resonid_tracker_init(memory, sizeof memory, &c, &handle, NULL));
  c.struct_size = (uint32_t)offsetof(resonid_tracker_config, lambda);
  c.lambda = -1000.0;  // behind the end
  CHECK_OK(resonid_tracker_init(other_memory, sizeof other_memory, &c, &handle, NULL));
  CHECK(memcmp(memory, other_memory, resonid_handle_size(memory)) == 0);
}

static void a_newer_struct_serves_while_it_asks_for_nothing_new(void) {
  struct {
    resonid_rls_config known;
    double added;
  } newer;
  CHECK_OK(resonid_rls_defaults(&newer.known, sizeof newer));
  CHECK(newer.added == 0.0 && newer.known.struct_size == sizeof newer);
  newer.known.parameters = 2;
  resonid_rls* rls = NULL;
  resonid_error error = RESONID_ERROR_INIT;
  CHECK_OK(resonid_rls_init(memory, sizeof memory, &newer.known, &rls, &error));
  newer.added = 1.0;
  CHECK_STATUS(resonid_rls_init(memory, sizeof memory, &newer.known, &rls, &error), RESONID_ERROR_CONFIG);
  CHECK(strcmp(error.field, "struct_size") == 0);
  newer.known.struct_size = 0;  // defaults were never called
  CHECK_STATUS(resonid_rls_init(memory, sizeof memory, &newer.known, &rls, &error), RESONID_ERROR_SIZE);
  CHECK(strcmp(error.field, "struct_size") == 0);
  newer.known.struct_size = 0xFFFFFFF8U;  // nor any other memory that was never set
  CHECK_STATUS(resonid_rls_init(memory, sizeof memory, &newer.known, &rls, &error), RESONID_ERROR_SIZE);
  CHECK(resonid_rls_size(&newer.known) == 0 && resonid_rls_size(NULL) == 0);
}

static void results_fit_the_callers_struct(void) {
  resonid_rls_config c;
  CHECK_OK(resonid_rls_defaults(&c, sizeof c));
  c.parameters = 2;
  resonid_rls* rls = NULL;
  CHECK_OK(resonid_rls_init(memory, sizeof memory, &c, &rls, NULL));
  const double f[2] = {1.0, 0.5};
  CHECK_OK(resonid_rls_step(rls, f, 2.0, 1.0));
  resonid_rls_info whole, part;
  CHECK_OK(resonid_rls_get_info(rls, &whole, sizeof whole));
  CHECK(whole.struct_size == sizeof whole && whole.residual == 2.0);
  for (size_t size = 8; size < sizeof part; size += 8) {
    memset(&part, 0x5A, sizeof part);
    CHECK_OK(resonid_rls_get_info(rls, &part, size));
    CHECK(part.struct_size == size);
    CHECK(memcmp((const char*)&part + 4, (const char*)&whole + 4, size - 4) == 0);
    for (size_t i = size; i < sizeof part; ++i) CHECK(((const unsigned char*)&part)[i] == 0x5A);
  }
  CHECK_STATUS(resonid_rls_get_info(rls, &part, 3), RESONID_ERROR_SIZE);
  CHECK_STATUS(resonid_rls_get_info(rls, NULL, sizeof part), RESONID_ERROR_NULL);
}

static void errors_fit_the_callers_struct(void) {
  resonid_rls_config c;
  CHECK_OK(resonid_rls_defaults(&c, sizeof c));
  resonid_rls* rls = NULL;
  resonid_error error;
  memset(&error, 0, sizeof error);  // not begun with RESONID_ERROR_INIT: left alone
  CHECK_STATUS(resonid_rls_create(&c, &rls, &error), RESONID_ERROR_CONFIG);
  CHECK(error.status == 0 && error.field[0] == 0);
  error.struct_size = offsetof(resonid_error, field);  // an older, shorter one: filled as far as it goes
  CHECK_STATUS(resonid_rls_create(&c, &rls, &error), RESONID_ERROR_CONFIG);
  CHECK(error.status == RESONID_ERROR_CONFIG && error.field[0] == 0);
  CHECK_STATUS(resonid_rls_create(&c, &rls, NULL), RESONID_ERROR_CONFIG);
  CHECK_STATUS(resonid_rls_create(&c, NULL, NULL), RESONID_ERROR_NULL);
  CHECK_STATUS(resonid_rls_create(NULL, &rls, NULL), RESONID_ERROR_NULL);
  resonid_destroy(NULL);
}

static void versions_and_words(void) {
  char expected[32];
  snprintf(expected, sizeof expected, "%d.%d.%d", RESONID_VERSION_MAJOR, RESONID_VERSION_MINOR,
           RESONID_VERSION_PATCH);
  CHECK(strcmp(resonid_version(), expected) == 0);
  CHECK(resonid_version_number() ==
        RESONID_VERSION_MAJOR * 65536u + RESONID_VERSION_MINOR * 256u + RESONID_VERSION_PATCH);
  for (resonid_status i = 0; i < RESONID_STATUS_COUNT; ++i) {
    CHECK(strcmp(resonid_status_string(i), "unknown status") != 0);
    for (resonid_status j = 0; j < i; ++j)
      CHECK(strcmp(resonid_status_string(i), resonid_status_string(j)) != 0);
  }
  CHECK(strcmp(resonid_status_string(RESONID_STATUS_COUNT), "unknown status") == 0);
  CHECK(strcmp(resonid_status_string(-1), "unknown status") == 0);
}

int main(void) {
  for (uint32_t kind = RESONID_PRBS; kind <= RESONID_STEPPED_SINE; ++kind)
    CHECK_DEFAULTS(resonid_excitation_config, kind);
  CHECK_DEFAULTS(resonid_line_bank_config, 0);
  for (uint32_t kind = RESONID_KALMAN_BANK; kind <= RESONID_CHIRP_TRACKER; ++kind)
    CHECK_DEFAULTS(resonid_tracker_config, kind);
  CHECK_DEFAULTS(resonid_response_config, 0);
  CHECK_DEFAULTS(resonid_rls_config, 0);
  for (uint32_t method = RESONID_ARX; method <= RESONID_IV; ++method)
    CHECK_DEFAULTS(resonid_model_config, method);
  CHECK_DEFAULTS(resonid_physical_config, 0);
  CHECK_DEFAULTS(resonid_change_config, 0);
  CHECK_DEFAULTS(resonid_guard_config, 0);
  CHECK_DEFAULTS(resonid_encoder_config, 0);
  an_older_struct_serves();
  a_kind_keeps_its_own_defaults_in_a_shorter_struct();
  a_newer_struct_serves_while_it_asks_for_nothing_new();
  results_fit_the_callers_struct();
  errors_fit_the_callers_struct();
  versions_and_words();
  return verdict();
}
