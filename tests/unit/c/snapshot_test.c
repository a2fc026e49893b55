// SPDX-License-Identifier: MIT
// A snapshot taken in one process continues bit for bit in another:  snapshot_test take|continue FILE
#include "subjects.h"

RESONID_MEMORY(memory, kLargestHandle);
RESONID_MEMORY(end_memory, kLargestHandle);
static unsigned char taken[kLargestHandle], finished[kLargestHandle];

static void run(const subject* s, signals* from, int begin, int end) {
  for (int k = begin; k < end; ++k) {
    double ru, u, y;
    next_signals(from, k, &ru, &u, &y);
    CHECK_OK(subject_step(s, memory, ru, u, y));
  }
}
static void write_snapshot(FILE* file, size_t size) {
  CHECK_OK(resonid_snapshot((resonid_handle*)(void*)memory, taken, sizeof taken, NULL));
  CHECK(fwrite(taken, 1, size, file) == size);
}

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  const int takes = strcmp(argv[1], "take") == 0;
  FILE* file = fopen(argv[2], takes ? "wb" : "rb");
  if (file == NULL) return 2;
  for (int i = 0; i < kSubjectCount; ++i) {
    const subject* s = &kSubjects[i];
    const size_t size = subject_size(s);
    const int at = 200 + 61 * i, end = at + 500;
    signals signal = first_signals();
    resonid_handle* handle = NULL;
    if (takes) {
      CHECK_OK(subject_init(s, memory, sizeof memory, NULL));
      run(s, &signal, 0, at);
      write_snapshot(file, size);
      run(s, &signal, at, end);
      write_snapshot(file, size);
      continue;
    }
    CHECK(fread(taken, 1, size, file) == size && fread(finished, 1, size, file) == size);
    double ru, u, y;
    for (int k = 0; k < at; ++k) next_signals(&signal, k, &ru, &u, &y);
    CHECK_OK(resonid_restore(memory, sizeof memory, taken, size, s->kind, &handle, NULL));
    run(s, &signal, at, end);
    CHECK_OK(resonid_restore(end_memory, sizeof end_memory, finished, size, s->kind, &handle, NULL));
    if (!tell_the_same(memory, end_memory)) printf("%s does not continue\n", s->name);
    CHECK(tell_the_same(memory, end_memory));
  }
  CHECK(fclose(file) == 0);
  return verdict();
}
