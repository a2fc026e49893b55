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
  resonid_rls_config c;
  resonid_rls* rls = NULL;
  CHECK_OK(resonid_rls_defaults(&c, sizeof c));
  c.parameters = 1;
  CHECK_OK(resonid_rls_create(&c, &rls, NULL));
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

static void run(const subject* s, void* handle, signals* from, int begin, int end) {
  for (int k = begin; k < end; ++k) {
    double ru, u, y;
    next_signals(from, k, &ru, &u, &y);
    CHECK_OK(s->step(handle, ru, u, k % 97 == 5 ? NAN : y));
  }
}

static void memory_is_checked(const subject* s) {
  const size_t size = s->size(s->kind);
  resonid_error error = RESONID_ERROR_INIT;
  CHECK(size > 64 && size <= kLargestHandle && size % RESONID_ALIGNMENT == 0);
  CHECK_STATUS(s->init(s->kind, NULL, size, &error), RESONID_ERROR_NULL);
  CHECK(strcmp(error.field, "memory") == 0);
  CHECK_STATUS(s->init(s->kind, first_memory, size - 1, &error), RESONID_ERROR_SIZE);
  CHECK(strcmp(error.field, "size") == 0 && error.value == (double)(size - 1));
  for (size_t off = 1; off < RESONID_ALIGNMENT; off += 7)
    CHECK_STATUS(s->init(s->kind, first_memory + off, size, &error), RESONID_ERROR_ALIGNMENT);
  memset(first_memory, 0xA5, sizeof first_memory);
  CHECK_OK(s->init(s->kind, first_memory, size, &error));
  CHECK(resonid_handle_size(first_memory) == size);
  size_t beyond = 0;
  for (size_t i = size; i < sizeof first_memory; ++i) beyond += first_memory[i] != 0xA5;
  CHECK(beyond == 0);
}

static void wrong_handles_are_refused(const subject* s) {
  CHECK_STATUS(s->step(NULL, 0, 0, 0), RESONID_ERROR_NULL);
  CHECK_STATUS(s->reset(NULL), RESONID_ERROR_NULL);
  CHECK_STATUS(s->step(first_memory + 8, 0, 0, 0), RESONID_ERROR_ALIGNMENT);
  for (int i = 0; i < kSubjectCount; ++i) {  // a handle of another family
    if (kSubjects[i].family == s->family) continue;
    CHECK_OK(kSubjects[i].init(kSubjects[i].kind, second_memory, sizeof second_memory, NULL));
    CHECK_STATUS(s->step(second_memory, 0, 0, 0), RESONID_ERROR_HANDLE);
    CHECK_STATUS(s->reset(second_memory), RESONID_ERROR_HANDLE);
    CHECK_STATUS(resonid_check(second_memory, sizeof second_memory, s->family, NULL), RESONID_ERROR_HANDLE);
  }
  memset(second_memory, 0, sizeof second_memory);  // no handle at all
  CHECK_STATUS(s->step(second_memory, 0, 0, 0), RESONID_ERROR_HANDLE);
  CHECK(resonid_handle_size(second_memory) == 0);
  // A header of the family whose type does not exist.
  CHECK_OK(s->init(s->kind, second_memory, sizeof second_memory, NULL));
  const uint32_t variant = 0x7fffffff;
  memcpy(second_memory + 12, &variant, sizeof variant);
  CHECK_STATUS(s->step(second_memory, 0, 0, 0), RESONID_ERROR_HANDLE);
  // One whose size is not that of its type: restored into less memory, steps would write beyond it.
  CHECK_OK(s->init(s->kind, second_memory, sizeof second_memory, NULL));
  const uint64_t header_alone = RESONID_ALIGNMENT;
  memcpy(second_memory + 16, &header_alone, sizeof header_alone);
  CHECK_OK(
      resonid_restore(first_memory, RESONID_ALIGNMENT, second_memory, RESONID_ALIGNMENT, s->family, NULL));
  CHECK_STATUS(s->step(first_memory, 0, 0, 0), RESONID_ERROR_HANDLE);
  CHECK_STATUS(s->reset(first_memory), RESONID_ERROR_HANDLE);
}

/// A copy of the bytes is the handle: it continues bit for bit, wherever it is put.
static void snapshots_continue(const subject* s) {
  const size_t size = s->size(s->kind);
  const int taken_at = 150 + 37 * (int)s->kind;
  signals signal = first_signals();
  CHECK_OK(s->init(s->kind, first_memory, sizeof first_memory, NULL));
  run(s, first_memory, &signal, 0, taken_at);
  memcpy(snapshot + 1, first_memory, size);  // at any address
  signals again = signal;
  run(s, first_memory, &signal, taken_at, taken_at + 701);
  memset(second_memory, 0xFF, sizeof second_memory);
  CHECK_OK(resonid_restore(second_memory, sizeof second_memory, snapshot + 1, size, s->family, NULL));
  CHECK(memcmp(second_memory, snapshot + 1, size) == 0);
  CHECK(!tell_the_same(s, first_memory, second_memory));
  run(s, second_memory, &again, taken_at, taken_at + 701);
  CHECK(tell_the_same(s, first_memory, second_memory));
  memcpy(first_memory, second_memory, size);

  resonid_error error = RESONID_ERROR_INIT;
  CHECK_STATUS(resonid_restore(second_memory, size - 1, snapshot + 1, size, s->family, &error),
               RESONID_ERROR_SIZE);
  CHECK_STATUS(resonid_restore(second_memory, size, snapshot + 1, size - 1, s->family, &error),
               RESONID_ERROR_SIZE);
  CHECK_STATUS(resonid_restore(second_memory, size, snapshot + 1, 63, s->family, &error), RESONID_ERROR_SIZE);
  CHECK_STATUS(resonid_restore(second_memory + 8, size, snapshot + 1, size, s->family, &error),
               RESONID_ERROR_ALIGNMENT);
  CHECK_STATUS(resonid_restore(NULL, size, snapshot + 1, size, s->family, &error), RESONID_ERROR_NULL);
  CHECK_STATUS(resonid_restore(second_memory, size, NULL, size, s->family, &error), RESONID_ERROR_NULL);
  for (size_t byte = 0; byte < 12; ++byte) {  // magic, version, family
    snapshot[1 + byte] ^= 0x40;
    CHECK_STATUS(resonid_restore(second_memory, size, snapshot + 1, size, s->family, &error),
                 RESONID_ERROR_HANDLE);
    snapshot[1 + byte] ^= 0x40;
  }
  CHECK(error.status == RESONID_ERROR_HANDLE && error.requirement[0] != 0);
  CHECK(memcmp(first_memory, second_memory, size) == 0);  // refused restores change nothing
}

static void reset_is_the_start(const subject* s) {
  signals signal = first_signals();
  CHECK_OK(s->init(s->kind, first_memory, sizeof first_memory, NULL));
  run(s, first_memory, &signal, 0, 401);
  CHECK_OK(s->init(s->kind, second_memory, sizeof second_memory, NULL));
  CHECK(!tell_the_same(s, first_memory, second_memory));
  CHECK_OK(s->reset(first_memory));
  CHECK(tell_the_same(s, first_memory, second_memory));
  signal = first_signals();
  run(s, first_memory, &signal, 0, 1300);
  signal = first_signals();
  run(s, second_memory, &signal, 0, 1300);
  CHECK(tell_the_same(s, first_memory, second_memory));
}

static void step_needs_no_heap(const subject* s) {
  signals signal = first_signals();
  CHECK_OK(s->init(s->kind, first_memory, sizeof first_memory, NULL));
  const size_t before = allocations;
  run(s, first_memory, &signal, 0, 2000);
  CHECK_OK(s->reset(first_memory));
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
    snapshots_continue(s);
    reset_is_the_start(s);
    step_needs_no_heap(s);
    if (failures != before) printf("... of: %s\n", s->name);
  }
  return verdict();
}
