// SPDX-License-Identifier: MIT
// What holds for every handle: memory, wrong calls, snapshots, no heap in step.
#include "subjects.h"

// Of all that the process allocates, the library's share included: these stand before those of the C library.
#ifdef RESONID_COUNT_ALLOCATIONS
static size_t allocations = 0;
extern void* __libc_malloc(size_t);
extern void* __libc_calloc(size_t, size_t);
extern void* __libc_realloc(void*, size_t);
extern void* __libc_memalign(size_t, size_t);
void* malloc(size_t size) { return ++allocations, __libc_malloc(size); }
void* calloc(size_t count, size_t size) { return ++allocations, __libc_calloc(count, size); }
void* realloc(void* memory, size_t size) { return ++allocations, __libc_realloc(memory, size); }
void* aligned_alloc(size_t alignment, size_t size) { return ++allocations, __libc_memalign(alignment, size); }

static void counting_sees_the_library(void) {
  const size_t before = allocations;
  resonid_rls_settings c;
  resonid_handle* rls = NULL;
  CHECK_OK(resonid_defaults(&c.head, sizeof c, RESONID_RLS));
  c.parameters = 1;
  CHECK_OK(resonid_create(&c.head, &rls, NULL));
  CHECK(allocations == before + 1);  // "allocated once"
  resonid_destroy(rls);
}
#else
static const size_t allocations = 0;
static void counting_sees_the_library(void) {}
#endif

RESONID_MEMORY(first_memory, kLargestHandle);
RESONID_MEMORY(second_memory, kLargestHandle);
static unsigned char snapshot[kLargestHandle + 1];

static resonid_handle* handle_in(void* memory) { return (resonid_handle*)memory; }

static void run(const subject* s, void* memory, signals* from, int begin, int end) {
  for (int k = begin; k < end; ++k) {
    double ru, u, y;
    next_signals(from, k, &ru, &u, &y);
    CHECK_OK(subject_step(s, memory, ru, u, k % 97 == 5 ? NAN : y));
  }
}

static const resonid_gain_node kNode = {0.0, 1.0, 1.0};

static void memory_is_checked(const subject* s) {
  const size_t size = subject_size(s);
  resonid_error error = RESONID_ERROR_INIT;
  CHECK(size > 64 && size <= kLargestHandle && size % RESONID_ALIGNMENT == 0);
  CHECK_STATUS(subject_init(s, NULL, size, &error), RESONID_ERROR_NULL);
  CHECK(strcmp(error.field, "memory") == 0);
  CHECK_STATUS(subject_init(s, first_memory, size - 1, &error), RESONID_ERROR_SIZE);
  CHECK(strcmp(error.field, "size") == 0 && error.value == (double)(size - 1));
  for (size_t off = 1; off < RESONID_ALIGNMENT; off += 7)
    CHECK_STATUS(subject_init(s, first_memory + off, size, &error), RESONID_ERROR_ALIGNMENT);
  memset(first_memory, 0xA5, sizeof first_memory);
  CHECK_OK(subject_init(s, first_memory, size, &error));
  CHECK(resonid_handle_size(handle_in(first_memory)) == size);
  CHECK(resonid_kind(handle_in(first_memory)) == s->kind);
  size_t beyond = 0;
  for (size_t i = size; i < sizeof first_memory; ++i) beyond += first_memory[i] != 0xA5;
  CHECK(beyond == 0);
}

/// Calls every function that takes a handle; counts those that did not refuse with this status.
static int calls_not_refused_with(resonid_status status, void* memory) {
  resonid_handle* h = handle_in(memory);
  double x[16] = {0};
  float f[4] = {0};
  uint32_t accepted = 0;
  size_t count = 0;
  resonid_complex z[4];
  resonid_mode mode;
  resonid_tracker_line tracker_line;
  resonid_response_line response_line;
  resonid_rls_results results;
  resonid_axis_line_info axis_line;
  const resonid_axis_criteria criteria = {0};
  return (resonid_step(h, 0, 0, 0) != status) + (resonid_run(h, x, x, x, 1) != status) +
         (resonid_run_float(h, f, f, f, 1) != status) + (resonid_miss(h, 1) != status) +
         (resonid_reset(h) != status) +
         (resonid_read(h, RESONID_RLS, &results.head, sizeof results) != status) +
         (resonid_snapshot(h, snapshot, sizeof snapshot, NULL) != status) +
         (resonid_parameters(h, x, 1) != status) + (resonid_covariance(h, x, 1) != status) +
         (resonid_lag_samples(h, x) != status) + (resonid_modes(h, 0, &mode, 1, &count) != status) +
         (resonid_generate(h, x, 1) != status) + (resonid_guard_step(h, 0, 0, 0, 0, x) != status) +
         (resonid_control_step(h, 0, 0, 0, 0, 0, x) != status) +
         (resonid_control_set_gains(h, 1, 1, NULL) != status) +
         (resonid_control_set_schedule(h, &kNode, 1, NULL) != status) +
         (resonid_control_exchange_filters(h, NULL, 0, 0, 1, NULL) != status) +
         (resonid_control_set_position(h, 0) != status) + (resonid_watch(h, 0) != status) +
         (resonid_stop(h) != status) + (resonid_acknowledge(h, &accepted) != status) +
         (resonid_ratios(h, 0, 1, z, 2) != status) + (resonid_phasors(h, 0, z, 2) != status) +
         (resonid_read_tracker_line(h, 0, &tracker_line, sizeof tracker_line) != status) +
         (resonid_read_response_line(h, 0, 0, &response_line, sizeof response_line) != status) +
         (resonid_encoder_step(h, 0, NULL) != status) + (resonid_encoder_set_position(h, 0) != status) +
         (resonid_rls_step(h, x, 3, 0, 1) != status) + (resonid_change_step(h, 0, 1) != status) +
         (resonid_change_relearn(h) != status) + (resonid_axis_step(h, 0, 0, 0, &accepted) != status) +
         (resonid_axis_run(h, x, x, x, 1, &count, &accepted) != status) +
         (resonid_axis_start(h, RESONID_INJECT_GIVEN, 1, NULL, NULL) != status) +
         (resonid_axis_excite(h, 0, 0, 0, 0, x) != status) +
         (resonid_axis_line(h, 0, &axis_line, sizeof axis_line) != status) +
         (resonid_axis_response(h, 1, z) != status) +
         (resonid_axis_set_loop(h, x, 1, x, 1, 0, RESONID_LOOP_NONE, 0, NULL) != status) +
         (resonid_axis_set_criteria(h, &criteria) != status);
}

static void wrong_handles_are_refused(const subject* s) {
  CHECK(calls_not_refused_with(RESONID_ERROR_NULL, NULL) == 0);
  CHECK_OK(subject_init(s, first_memory, sizeof first_memory, NULL));
  CHECK(calls_not_refused_with(RESONID_ERROR_ALIGNMENT, first_memory + 8) == 0);
  memset(second_memory, 0, sizeof second_memory);  // no handle at all
  CHECK(calls_not_refused_with(RESONID_ERROR_HANDLE, second_memory) == 0);
  CHECK(resonid_handle_size(handle_in(second_memory)) == 0 && resonid_kind(handle_in(second_memory)) == 0);
  // A snapshot is no handle before it was checked.
  CHECK_OK(resonid_snapshot(handle_in(first_memory), second_memory, sizeof second_memory, NULL));
  CHECK(calls_not_refused_with(RESONID_ERROR_HANDLE, second_memory) == 0);
  // A header whose type does not exist, whose size is another type's, whose kind does not exist.
  const struct {
    size_t at;
    uint32_t value;
  } wrong[] = {{12, 0x7fffffff}, {16, RESONID_ALIGNMENT}, {8, 0x7f00}, {8, 0x01ff}};
  for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; ++i) {
    CHECK_OK(subject_init(s, second_memory, sizeof second_memory, NULL));
    memcpy(second_memory + wrong[i].at, &wrong[i].value, sizeof wrong[i].value);
    CHECK(calls_not_refused_with(RESONID_ERROR_HANDLE, second_memory) == 0);
  }
}

/// What a kind has not gives a status and changes nothing.
static void other_kinds_are_refused(const subject* s) {
  resonid_handle* h = handle_in(first_memory);
  const uint32_t family = s->kind >> 8;
  const size_t size = subject_size(s);
  union {
    resonid_results head;
    uint64_t room[128];
  } results;
  double x[12] = {0}, covariance[144];
  resonid_complex z[2];
  resonid_mode mode;
  resonid_tracker_line tracker_line;
  resonid_response_line response_line;
  uint32_t accepted = 0;
  size_t count = 0;
  int unsupported = 0;
#define CHECK_ONLY_OF(call, ...)                                                                           \
  do {                                                                                                     \
    const uint32_t kinds_[] = {__VA_ARGS__};                                                               \
    int has_ = 0;                                                                                          \
    for (size_t i = 0; i < sizeof kinds_ / sizeof kinds_[0]; ++i) has_ = has_ || kinds_[i] >> 8 == family; \
    CHECK_OK(subject_init(s, first_memory, sizeof first_memory, NULL));                                    \
    memcpy(second_memory, first_memory, size);                                                             \
    CHECK_STATUS(call, has_ ? RESONID_OK : RESONID_ERROR_UNSUPPORTED);                                     \
    if (!has_) CHECK(++unsupported&& memcmp(first_memory, second_memory, size) == 0);                      \
  } while (0)
  for (int i = 0; i < kSubjectCount; ++i)
    CHECK_ONLY_OF(resonid_read(h, kSubjects[i].kind, &results.head, sizeof results), kSubjects[i].kind);
  const size_t n = family == RESONID_PHYSICAL >> 8 ? 8 : family == RESONID_RLS >> 8 ? 3 : 4;
  CHECK_ONLY_OF(resonid_step(h, 0, 0, 0), RESONID_LINE_BANK, RESONID_KALMAN_BANK, RESONID_RESPONSE,
                RESONID_ARX, RESONID_PHYSICAL, RESONID_AXIS_ARX);
  CHECK_ONLY_OF(resonid_parameters(h, x, n), RESONID_RLS, RESONID_ARX, RESONID_PHYSICAL);
  CHECK_ONLY_OF(resonid_covariance(h, covariance, n * n), RESONID_RLS, RESONID_ARX, RESONID_PHYSICAL);
  CHECK_ONLY_OF(resonid_lag_samples(h, x), RESONID_ARX, RESONID_PHYSICAL);
  CHECK_ONLY_OF(resonid_modes(h, RESONID_RESONANCES, &mode, 1, &count), RESONID_ARX);
  CHECK_ONLY_OF(resonid_generate(h, x, 1), RESONID_PRBS);
  CHECK_ONLY_OF(resonid_guard_step(h, 0, 0, 0, 0, x), RESONID_GUARD);
  CHECK_ONLY_OF(resonid_control_step(h, 0, 0, 0, 0, 0, x), RESONID_CONTROL);
  CHECK_ONLY_OF(resonid_control_set_gains(h, 1, 1, NULL), RESONID_CONTROL);
  CHECK_ONLY_OF(resonid_control_set_schedule(h, &kNode, 1, NULL), RESONID_CONTROL);
  CHECK_ONLY_OF(resonid_control_exchange_filters(h, NULL, 0, 0, 1, NULL), RESONID_CONTROL);
  CHECK_ONLY_OF(resonid_control_set_position(h, 0), RESONID_CONTROL);
  CHECK_ONLY_OF(resonid_watch(h, 0), RESONID_GUARD);
  CHECK_ONLY_OF(resonid_stop(h), RESONID_GUARD, RESONID_AXIS_ARX);
  CHECK_ONLY_OF(resonid_acknowledge(h, &accepted), RESONID_GUARD);
  CHECK_ONLY_OF(resonid_ratios(h, 0, 1, z, 2), RESONID_LINE_BANK);
  CHECK_ONLY_OF(resonid_phasors(h, 0, z, s->kind == RESONID_CHIRP_TRACKER ? 1 : 2), RESONID_LINE_BANK,
                RESONID_KALMAN_BANK);
  CHECK_ONLY_OF(resonid_read_tracker_line(h, 0, &tracker_line, sizeof tracker_line), RESONID_KALMAN_BANK);
  CHECK_ONLY_OF(resonid_read_response_line(h, 0, 0, &response_line, sizeof response_line), RESONID_RESPONSE);
  CHECK_ONLY_OF(resonid_encoder_step(h, 0, NULL), RESONID_ENCODER_COUNTER);
  CHECK_ONLY_OF(resonid_encoder_set_position(h, 0), RESONID_ENCODER_COUNTER);
  CHECK_ONLY_OF(resonid_rls_step(h, x, 3, 0, 1), RESONID_RLS);
  CHECK_ONLY_OF(resonid_change_step(h, 0, 1), RESONID_CUSUM);
  CHECK_ONLY_OF(resonid_change_relearn(h), RESONID_CUSUM);
  const double told[] = {0.5}, one[] = {1.0};
  const resonid_axis_criteria criteria = {0};
  resonid_guard_settings guard;
  CHECK_OK(resonid_defaults(&guard.head, sizeof guard, RESONID_GUARD));
  guard.amplitude = 1.0;
  guard.torque_limit = 10.0;
  CHECK_ONLY_OF(resonid_axis_step(h, 0, 0, 0, &accepted), RESONID_AXIS_ARX);
  CHECK_ONLY_OF(resonid_axis_run(h, x, x, x, 1, &count, &accepted), RESONID_AXIS_ARX);
  CHECK_ONLY_OF(resonid_axis_start(h, RESONID_INJECT_GIVEN, 1, &guard, NULL), RESONID_AXIS_ARX);
  CHECK_ONLY_OF(resonid_axis_excite(h, 0, 0, 0, 0, x), RESONID_AXIS_ARX);
  CHECK_ONLY_OF(resonid_axis_response(h, 1, z), RESONID_AXIS_ARX);
  CHECK_ONLY_OF(resonid_axis_set_loop(h, told, 1, one, 1, 0, RESONID_LOOP_CONTROLLER, 0, NULL),
                RESONID_AXIS_ARX);
  CHECK_ONLY_OF(resonid_axis_set_criteria(h, &criteria), RESONID_AXIS_ARX);
  CHECK(unsupported > 30);
  CHECK_STATUS(resonid_read(h, 0, &results.head, sizeof results), RESONID_ERROR_UNSUPPORTED);
}

/// Restored from a snapshot a handle continues bit for bit, wherever it is put.
static void snapshots_continue(const subject* s) {
  const size_t size = subject_size(s);
  const int taken_at = 150 + 37 * (s->form + (int)(s->kind & 0xFF));
  signals signal = first_signals();
  resonid_handle* h = NULL;
  CHECK_OK(subject_init(s, first_memory, sizeof first_memory, NULL));
  run(s, first_memory, &signal, 0, taken_at);
  CHECK_OK(resonid_snapshot(handle_in(first_memory), snapshot + 1, size, NULL));  // at any address
  signals again = signal;
  run(s, first_memory, &signal, taken_at, taken_at + 701);
  memset(second_memory, 0xFF, sizeof second_memory);
  CHECK_OK(resonid_check(snapshot + 1, size, s->kind, NULL));
  CHECK_OK(resonid_restore(second_memory, sizeof second_memory, snapshot + 1, size, s->kind, &h, NULL));
  CHECK((void*)h == (void*)second_memory);
  CHECK(!tell_the_same(first_memory, second_memory));
  run(s, second_memory, &again, taken_at, taken_at + 701);
  CHECK(tell_the_same(first_memory, second_memory));

  // A copy of the handle's bytes can be made a snapshot later.
  memcpy(second_memory, first_memory, size);
  CHECK_OK(resonid_snapshot(handle_in(second_memory), snapshot + 1, size, NULL));
  CHECK_OK(resonid_restore(second_memory, sizeof second_memory, snapshot + 1, size, 0, &h, NULL));
  CHECK(memcmp(first_memory, second_memory, size) == 0);
}

static void damaged_snapshots_are_refused(const subject* s) {
  const size_t size = subject_size(s);
  const uint32_t kind = s->kind;
  signals signal = first_signals();
  resonid_handle* h = NULL;
  resonid_error error = RESONID_ERROR_INIT;
  CHECK_OK(subject_init(s, first_memory, sizeof first_memory, NULL));
  run(s, first_memory, &signal, 0, 150);
  unsigned char* const taken = snapshot + 1;
  CHECK_OK(resonid_snapshot(handle_in(first_memory), taken, size, NULL));
  memcpy(second_memory, first_memory, size);
  CHECK_STATUS(resonid_snapshot(handle_in(first_memory), taken, size - 1, &error), RESONID_ERROR_SIZE);
  CHECK_STATUS(resonid_snapshot(handle_in(first_memory), NULL, size, &error), RESONID_ERROR_NULL);
  CHECK_STATUS(resonid_restore(second_memory, size - 1, taken, size, kind, &h, &error), RESONID_ERROR_SIZE);
  CHECK_STATUS(resonid_restore(second_memory, size, taken, size - 1, kind, &h, &error), RESONID_ERROR_SIZE);
  CHECK_STATUS(resonid_restore(second_memory, size, taken, 63, kind, &h, &error), RESONID_ERROR_SIZE);
  CHECK_STATUS(resonid_restore(second_memory + 8, size, taken, size, kind, &h, &error),
               RESONID_ERROR_ALIGNMENT);
  CHECK_STATUS(resonid_restore(NULL, size, taken, size, kind, &h, &error), RESONID_ERROR_NULL);
  CHECK_STATUS(resonid_restore(second_memory, size, NULL, size, kind, &h, &error), RESONID_ERROR_NULL);
  CHECK_STATUS(resonid_restore(second_memory, size, taken, size, kind, NULL, &error), RESONID_ERROR_NULL);
  CHECK_STATUS(resonid_restore(second_memory, size, taken, size, kind + 0x100, &h, &error),
               RESONID_ERROR_HANDLE);
  CHECK(strcmp(error.field, "kind") == 0 && error.value == (double)kind);
  // The bytes of the handle itself, without a checksum.
  CHECK_STATUS(resonid_restore(second_memory, size, first_memory, size, kind, &h, &error),
               RESONID_ERROR_HANDLE);
  for (size_t byte = 0; byte < 12; ++byte) {  // magic, version, kind
    taken[byte] ^= 0x40;
    CHECK_STATUS(resonid_restore(second_memory, size, taken, size, kind, &h, &error), RESONID_ERROR_HANDLE);
    taken[byte] ^= 0x40;
  }
  int found = 0, tried = 0;  // any other bit: the checksum finds it
  const size_t stride = 61 + size / 100;
  for (size_t byte = 12; byte < size; byte += byte < 128 ? 1 : stride, ++tried) {
    taken[byte] ^= (unsigned char)(1u << byte % 8);
    found += resonid_restore(second_memory, size, taken, size, kind, &h, &error) == RESONID_ERROR_SNAPSHOT;
    CHECK(resonid_check(taken, size, kind, NULL) == RESONID_ERROR_SNAPSHOT);
    taken[byte] ^= (unsigned char)(1u << byte % 8);
  }
  CHECK(found == tried);
  CHECK(strcmp(error.field, "snapshot") == 0 && error.requirement[0] != 0);
  CHECK(h == NULL && memcmp(first_memory, second_memory, size) == 0);  // refused restores change nothing
}

static uint32_t crc32(const unsigned char* p, size_t size) {
  static uint32_t of_byte[256];
  for (uint32_t i = 0; i < 256; ++i) {
    uint32_t c = i;
    for (int bit = 0; bit < 8; ++bit) c = c & 1 ? c >> 1 ^ 0xEDB88320u : c >> 1;
    of_byte[i] = c;
  }
  uint32_t c = 0xFFFFFFFFu;
  for (size_t i = 0; i < size; ++i) c = of_byte[(c ^ p[i]) & 0xFF] ^ c >> 8;
  return ~c;
}

/// Behind a right checksum any state may stand (fuzz/snapshot.c makes more of them): it is refused, or can be
/// used and leaves a state that is not refused. Sanitizers look on.
static void forged_snapshots_do_no_harm(const subject* s) {
  const size_t size = subject_size(s);
  const size_t stride = 8 + size / 60 / 8 * 8;
  signals signal = first_signals();
  CHECK_OK(subject_init(s, first_memory, sizeof first_memory, NULL));
  run(s, first_memory, &signal, 0, 150);
  CHECK_OK(resonid_snapshot(handle_in(first_memory), snapshot, size, NULL));
  memcpy(first_memory, snapshot, size);
  int taken = 0;
  for (size_t at = 64; at + 8 <= size; at += stride)
    for (int byte = 0; byte < 2; ++byte) {
      resonid_handle* h = NULL;
      const uint32_t none = 0;
      memcpy(snapshot, first_memory, size);
      memset(snapshot + at, byte == 0 ? 0xFF : 0x41, 8);
      memcpy(snapshot + 24, &none, sizeof none);
      const uint32_t checksum = crc32(snapshot, size);
      memcpy(snapshot + 24, &checksum, sizeof checksum);
      const resonid_status status =
          resonid_restore(second_memory, sizeof second_memory, snapshot, size, s->kind, &h, NULL);
      CHECK(status == RESONID_OK || status == RESONID_ERROR_SNAPSHOT);
      if (status != RESONID_OK) {
        CHECK(resonid_kind(handle_in(second_memory)) == 0);
        continue;
      }
      ++taken;
      run(s, second_memory, &signal, 150, 155);
      (void)resonid_miss(h, 1000000);
      run(s, second_memory, &signal, 155, 160);
      (void)tell(h);
      CHECK_OK(resonid_snapshot(h, snapshot, size, NULL));
      CHECK_OK(resonid_restore(second_memory, sizeof second_memory, snapshot, size, s->kind, &h, NULL));
    }
  CHECK(taken > 0);
}

static void reset_is_the_start(const subject* s) {
  signals signal = first_signals();
  CHECK_OK(subject_init(s, first_memory, sizeof first_memory, NULL));
  run(s, first_memory, &signal, 0, 401);
  CHECK_OK(subject_init(s, second_memory, sizeof second_memory, NULL));
  CHECK(!tell_the_same(first_memory, second_memory));
  CHECK_OK(resonid_reset(handle_in(first_memory)));
  CHECK(tell_the_same(first_memory, second_memory));
  signal = first_signals();
  run(s, first_memory, &signal, 0, 1300);
  signal = first_signals();
  run(s, second_memory, &signal, 0, 1300);
  CHECK(tell_the_same(first_memory, second_memory));
}

/// Of kinds that take ru, u, y: runs are steps, of float signals as well.
static void runs_are_steps(const subject* s) {
  enum { kSamples = 300 };
  static double ru[kSamples], u[kSamples], y[kSamples];
  static float ru_f[kSamples], u_f[kSamples], y_f[kSamples];
  signals signal = first_signals();
  for (int k = 0; k < kSamples; ++k) {
    next_signals(&signal, k, &ru[k], &u[k], &y[k]);
    ru[k] = ru_f[k] = (float)ru[k];
    u[k] = u_f[k] = (float)u[k];
    y[k] = y_f[k] = (float)y[k];
  }
  CHECK_OK(subject_init(s, first_memory, sizeof first_memory, NULL));
  const resonid_status status = resonid_step(handle_in(first_memory), ru[0], u[0], y[0]);
  CHECK_OK(subject_init(s, second_memory, sizeof second_memory, NULL));
  CHECK_STATUS(resonid_run(handle_in(second_memory), ru, u, y, kSamples), status);
  if (status != RESONID_OK) {
    CHECK_STATUS(status, RESONID_ERROR_UNSUPPORTED);
    return;
  }
  for (int k = 1; k < kSamples; ++k) CHECK_OK(resonid_step(handle_in(first_memory), ru[k], u[k], y[k]));
  CHECK(tell_the_same(first_memory, second_memory));
  CHECK_OK(subject_init(s, second_memory, sizeof second_memory, NULL));
  CHECK_OK(resonid_run_float(handle_in(second_memory), ru_f, u_f, y_f, kSamples));
  CHECK(tell_the_same(first_memory, second_memory));
  CHECK_STATUS(resonid_run(handle_in(second_memory), ru, u, NULL, kSamples), RESONID_ERROR_NULL);
  CHECK_OK(resonid_run(handle_in(second_memory), NULL, NULL, NULL, 0));
}

static void step_needs_no_heap(const subject* s) {
  signals signal = first_signals();
  CHECK_OK(subject_init(s, first_memory, sizeof first_memory, NULL));
  const size_t before = allocations;
  run(s, first_memory, &signal, 0, 2000);
  CHECK_OK(resonid_reset(handle_in(first_memory)));
  run(s, first_memory, &signal, 2000, 2100);
  const size_t after = allocations;
  CHECK(after == before);
}

int main(void) {
  counting_sees_the_library();
  for (int i = 0; i < kSubjectCount; ++i) {
    const int before = failures;
    const subject* s = &kSubjects[i];
    memory_is_checked(s);
    wrong_handles_are_refused(s);
    other_kinds_are_refused(s);
    snapshots_continue(s);
    damaged_snapshots_are_refused(s);
    forged_snapshots_do_no_harm(s);
    reset_is_the_start(s);
    runs_are_steps(s);
    step_needs_no_heap(s);
    if (failures != before) printf("... of: %s\n", s->name);
  }
  return verdict();
}
