// SPDX-License-Identifier: MIT
// Different handles in different threads at once, of every kind: the thread sanitizer sees whether the
// library shares anything between them. The first steps come from all threads together, so that the choice of
// the instruction set does too.
#define _POSIX_C_SOURCE 200809L
#include <pthread.h>

#include "subjects.h"

enum { kThreads = 4, kSamples = 120 };

typedef struct task {
  const subject* s;
  pthread_barrier_t* begin;
  unsigned char* memory;
  unsigned char* snapshot;
  size_t size;
  told result;
} task;

/// Takes what another thread has made, as after a change of hands between threads, and goes on with it.
static void* run(void* argument) {
  task* t = (task*)argument;
  signals signal = first_signals();
  resonid_handle* h = NULL;
  pthread_barrier_wait(t->begin);
  if (resonid_restore(t->memory, t->size, t->snapshot, t->size, t->s->kind, &h, NULL) != RESONID_OK)
    return NULL;
  for (int k = 0; k < kSamples; ++k) {
    double ru, u, y;
    next_signals(&signal, k, &ru, &u, &y);
    if (subject_step(t->s, h, ru, u, y) != RESONID_OK) return NULL;
  }
  if (resonid_snapshot(h, t->snapshot, t->size, NULL) != RESONID_OK) return NULL;
  t->result = tell(h);
  return t;
}

static void kinds_side_by_side(const subject* s) {
  pthread_t thread[kThreads];
  pthread_barrier_t begin;
  task tasks[kThreads];
  const size_t size = subject_size(s);
  CHECK(pthread_barrier_init(&begin, NULL, kThreads) == 0);
  for (int i = 0; i < kThreads; ++i) {
    task* t = &tasks[i];
    memset(t, 0, sizeof *t);
    t->s = s;
    t->begin = &begin;
    t->size = size;
    t->memory = (unsigned char*)aligned_alloc(RESONID_ALIGNMENT, size);
    t->snapshot = (unsigned char*)malloc(size);
    CHECK_OK(subject_init(s, t->memory, size, NULL));
    CHECK_OK(resonid_snapshot((resonid_handle*)(void*)t->memory, t->snapshot, size, NULL));
  }
  for (int i = 0; i < kThreads; ++i) CHECK(pthread_create(&thread[i], NULL, run, &tasks[i]) == 0);
  for (int i = 0; i < kThreads; ++i) {
    void* done = NULL;
    CHECK(pthread_join(thread[i], &done) == 0 && done == &tasks[i]);
  }
  for (int i = 0; i < kThreads; ++i) {
    CHECK(memcmp(&tasks[i].result, &tasks[0].result, sizeof(told)) == 0);
    free(tasks[i].memory);
    free(tasks[i].snapshot);
  }
  CHECK(pthread_barrier_destroy(&begin) == 0);
}

int main(void) {
  for (int i = 0; i < kSubjectCount; ++i) {
    const int before = failures;
    kinds_side_by_side(&kSubjects[i]);
    if (failures != before) printf("... of: %s\n", kSubjects[i].name);
  }
  return verdict();
}
