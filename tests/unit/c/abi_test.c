// SPDX-License-Identifier: MIT
// Callers of other versions: structs that are shorter or longer than the library's, versions, words.
#include <stddef.h>

#include "check.h"

RESONID_MEMORY(memory, 1 << 19);
RESONID_MEMORY(other_memory, 1 << 19);

/// The defaults fill just the struct that the caller has, whatever its size, and refuse sizes that no version
/// has.
static void defaults_fit_the_callers_struct(uint32_t kind, size_t size_known) {
  unsigned char whole[1024], part[1024 + 64];
  resonid_settings *all = (resonid_settings*)(void*)whole, *some = (resonid_settings*)(void*)part;
  CHECK(size_known < sizeof whole);
  CHECK_OK(resonid_defaults(all, size_known, kind));
  CHECK(all->struct_size == size_known && all->kind == kind);
  for (size_t size = 8; size <= size_known + 32; size += 8) {
    memset(part, 0x5A, sizeof part);
    CHECK_OK(resonid_defaults(some, size, kind));
    CHECK(some->struct_size == size);
    const size_t known = size < size_known ? size : size_known;
    CHECK(memcmp(part + 4, whole + 4, known - 4) == 0);
    for (size_t i = known; i < size; ++i) CHECK(part[i] == 0);
    for (size_t i = size; i < size_known + 64; ++i) CHECK(part[i] == 0x5A);
  }
  CHECK_STATUS(resonid_defaults(some, 0, kind), RESONID_ERROR_SIZE);
  CHECK_STATUS(resonid_defaults(some, 4, kind), RESONID_ERROR_SIZE);
  CHECK_STATUS(resonid_defaults(some, size_known - 1, kind), RESONID_ERROR_SIZE);
  CHECK_STATUS(resonid_defaults(NULL, size_known, kind), RESONID_ERROR_NULL);
}
static void kinds_are_those_that_there_are(void) {
  static const struct {
    uint32_t first, last;
    size_t settings;
  } family[] = {{RESONID_PRBS, RESONID_STEPPED_SINE, sizeof(resonid_excitation_settings)},
                {RESONID_LINE_BANK, RESONID_LINE_BANK, sizeof(resonid_line_bank_settings)},
                {RESONID_KALMAN_BANK, RESONID_CHIRP_TRACKER, sizeof(resonid_tracker_settings)},
                {RESONID_RESPONSE, RESONID_RESPONSE, sizeof(resonid_response_settings)},
                {RESONID_RLS, RESONID_RLS, sizeof(resonid_rls_settings)},
                {RESONID_ARX, RESONID_IV, sizeof(resonid_model_settings)},
                {RESONID_PHYSICAL, RESONID_PHYSICAL, sizeof(resonid_physical_settings)},
                {RESONID_CUSUM, RESONID_LIKELIHOOD_RATIO, sizeof(resonid_change_settings)},
                {RESONID_GUARD, RESONID_GUARD, sizeof(resonid_guard_settings)},
                {RESONID_ENCODER_COUNTER, RESONID_ENCODER_ABSOLUTE, sizeof(resonid_encoder_settings)},
                {RESONID_AXIS_ARX, RESONID_AXIS_CHIRP, sizeof(resonid_axis_settings)},
                {RESONID_CONTROL, RESONID_CONTROL, sizeof(resonid_control_settings)}};
  enum { kFamilies = sizeof family / sizeof family[0] };
  for (uint32_t kind = 0; kind < 0x1800; ++kind) {
    size_t settings = 0;
    for (int i = 0; i < kFamilies; ++i)
      if (kind >= family[i].first && kind <= family[i].last) settings = family[i].settings;
    unsigned char room[1024];
    resonid_settings* head = (resonid_settings*)(void*)room;
    resonid_handle* handle = NULL;
    resonid_error error = RESONID_ERROR_INIT;
    if (settings > 0) {
      defaults_fit_the_callers_struct(kind, settings);
      continue;
    }
    CHECK_STATUS(resonid_defaults(head, sizeof room, kind), RESONID_ERROR_RANGE);
    head->struct_size = 64;
    head->kind = kind;
    CHECK(resonid_size(head) == 0);
    CHECK_STATUS(resonid_create(head, &handle, &error), RESONID_ERROR_RANGE);
    CHECK(strcmp(error.field, "kind") == 0 && error.value == (double)kind && handle == NULL);
  }
}

/// What a physical tracker says after 200 samples. Its bytes may differ in their padding.
static resonid_physical_results said_by(resonid_handle* tracker) {
  resonid_physical_results said;
  memset(&said, 0, sizeof said);
  for (int k = 0; k < 200; ++k) CHECK_OK(resonid_step(tracker, 0.0, k % 7 < 3 ? 1.0 : -1.0, sin(0.3 * k)));
  CHECK_OK(resonid_read(tracker, RESONID_PHYSICAL, &said.head, sizeof said));
  return said;
}

/// A caller whose struct ends before the last fields gets their defaults: the same as one that sets them. Its
/// struct lies at the end of its memory, where a sanitizer sees every byte that is read too far.
static void an_older_struct_serves(void) {
  resonid_physical_settings c;
  CHECK_OK(resonid_defaults(&c.head, sizeof c, RESONID_PHYSICAL));
  c.sample_rate_hz = 500.0;
  c.driven_inertia.value = c.load_inertia.value = 0.01;
  c.stiffness.value = 100.0;
  c.damping.value = 0.1;
  const size_t older = offsetof(resonid_physical_settings, refresh_samples);
  resonid_physical_settings* shorter = (resonid_physical_settings*)malloc(older);
  memcpy(shorter, &c, older);
  shorter->head.struct_size = (uint32_t)older;
  resonid_handle *whole = NULL, *part = NULL;
  CHECK(resonid_size(&shorter->head) == resonid_size(&c.head));
  CHECK_OK(resonid_init(memory, sizeof memory, &c.head, &whole, NULL));
  CHECK_OK(resonid_init(other_memory, sizeof other_memory, &shorter->head, &part, NULL));
  const resonid_physical_results one = said_by(whole), other = said_by(part);
  CHECK(memcmp(&one, &other, sizeof one) == 0);
  c.refresh_samples = 3;  // the field does count
  CHECK_OK(resonid_init(memory, sizeof memory, &c.head, &whole, NULL));
  CHECK(memcmp(memory, other_memory, resonid_size(&c.head)) != 0);
  free(shorter);
}

static void a_kind_keeps_its_own_defaults_in_a_shorter_struct(void) {
  resonid_tracker_settings c;
  const double lines_hz[] = {10.0};
  CHECK_OK(resonid_defaults(&c.head, sizeof c, RESONID_KALMAN_BANK));
  c.sample_rate_hz = 500.0;
  c.frequency_hz = lines_hz;
  c.lines = 1;
  resonid_handle* handle = NULL;
  CHECK_OK(resonid_init(memory, sizeof memory, &c.head, &handle, NULL));
  c.head.struct_size = (uint32_t)offsetof(resonid_tracker_settings, lambda);
  c.lambda = -1000.0;  // behind the end
  CHECK_OK(resonid_init(other_memory, sizeof other_memory, &c.head, &handle, NULL));
  CHECK(memcmp(memory, other_memory, resonid_handle_size(handle)) == 0);
}

static void a_newer_struct_serves_while_it_asks_for_nothing_new(void) {
  struct {
    resonid_rls_settings known;
    double added;
  } newer;
  CHECK_OK(resonid_defaults(&newer.known.head, sizeof newer, RESONID_RLS));
  CHECK(newer.added == 0.0 && newer.known.head.struct_size == sizeof newer);
  newer.known.parameters = 2;
  resonid_handle* rls = NULL;
  resonid_error error = RESONID_ERROR_INIT;
  CHECK_OK(resonid_init(memory, sizeof memory, &newer.known.head, &rls, &error));
  newer.added = 1.0;
  CHECK_STATUS(resonid_init(memory, sizeof memory, &newer.known.head, &rls, &error), RESONID_ERROR_SETTINGS);
  CHECK(strcmp(error.field, "struct_size") == 0);
  newer.known.head.struct_size = 0;  // defaults were never called
  CHECK_STATUS(resonid_init(memory, sizeof memory, &newer.known.head, &rls, &error), RESONID_ERROR_SIZE);
  CHECK(strcmp(error.field, "struct_size") == 0);
  newer.known.head.struct_size = 0xFFFFFFF8U;  // nor any other memory that was never set
  CHECK_STATUS(resonid_init(memory, sizeof memory, &newer.known.head, &rls, &error), RESONID_ERROR_SIZE);
  CHECK(resonid_size(&newer.known.head) == 0 && resonid_size(NULL) == 0);
}

static void results_fit_the_callers_struct(void) {
  resonid_rls_settings c;
  CHECK_OK(resonid_defaults(&c.head, sizeof c, RESONID_RLS));
  c.parameters = 2;
  resonid_handle* rls = NULL;
  CHECK_OK(resonid_init(memory, sizeof memory, &c.head, &rls, NULL));
  const double f[2] = {1.0, 0.5};
  CHECK_OK(resonid_rls_step(rls, f, 2, 2.0, 1.0));
  resonid_rls_results whole, part;
  CHECK_OK(resonid_read(rls, RESONID_RLS, &whole.head, sizeof whole));
  CHECK(whole.head.struct_size == sizeof whole && whole.residual == 2.0);
  for (size_t size = 8; size < sizeof part; size += 8) {
    memset(&part, 0x5A, sizeof part);
    CHECK_OK(resonid_read(rls, RESONID_RLS, &part.head, size));
    CHECK(part.head.struct_size == size);
    CHECK(memcmp((const char*)&part + 4, (const char*)&whole + 4, size - 4) == 0);
    for (size_t i = size; i < sizeof part; ++i) CHECK(((const unsigned char*)&part)[i] == 0x5A);
  }
  CHECK_STATUS(resonid_read(rls, RESONID_RLS, &part.head, 3), RESONID_ERROR_SIZE);
  CHECK_STATUS(resonid_read(rls, RESONID_RLS, NULL, sizeof part), RESONID_ERROR_NULL);
}

static void errors_fit_the_callers_struct(void) {
  resonid_rls_settings c;
  CHECK_OK(resonid_defaults(&c.head, sizeof c, RESONID_RLS));
  resonid_handle* rls = NULL;
  resonid_error error;
  memset(&error, 0, sizeof error);  // not begun with RESONID_ERROR_INIT: left alone
  CHECK_STATUS(resonid_create(&c.head, &rls, &error), RESONID_ERROR_SETTINGS);
  CHECK(error.status == 0 && error.field[0] == 0);
  error.struct_size = offsetof(resonid_error, field);  // an older, shorter one: filled as far as it goes
  CHECK_STATUS(resonid_create(&c.head, &rls, &error), RESONID_ERROR_SETTINGS);
  CHECK(error.status == RESONID_ERROR_SETTINGS && error.field[0] == 0);
  CHECK_STATUS(resonid_create(&c.head, &rls, NULL), RESONID_ERROR_SETTINGS);
  CHECK_STATUS(resonid_create(&c.head, NULL, NULL), RESONID_ERROR_NULL);
  CHECK_STATUS(resonid_create(NULL, &rls, NULL), RESONID_ERROR_NULL);
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
  kinds_are_those_that_there_are();
  an_older_struct_serves();
  a_kind_keeps_its_own_defaults_in_a_shorter_struct();
  a_newer_struct_serves_while_it_asks_for_nothing_new();
  results_fit_the_callers_struct();
  errors_fit_the_callers_struct();
  versions_and_words();
  return verdict();
}
