/* SPDX-License-Identifier: MIT
   Snapshots of the C interface: whatever the bytes are, resonid_restore() refuses them, or gives a handle
   that every function can be called with. The input says which kind, where its state is changed and what is
   called then; the checksum is made right again, since no fuzzer would guess it. */
#include "../tests/unit/c/subjects.h"

RESONID_MEMORY(memory, kLargestHandle);
static unsigned char snapshot[kLargestHandle];
static unsigned char* pristine[kSubjectCount];
static size_t sizes[kSubjectCount];

static void require(int holds) {
  if (!holds) abort();
}
/* As of resonid/c/detail/types.h, bit by bit. */
static uint32_t crc32(const unsigned char* p, size_t size) {
  uint32_t c = 0xFFFFFFFFu;
  for (size_t i = 0; i < size; ++i) {
    c ^= p[i];
    for (int bit = 0; bit < 8; ++bit) c = c & 1 ? c >> 1 ^ 0xEDB88320u : c >> 1;
  }
  return ~c;
}

static void make_pristine(int i) {
  const subject* s = &kSubjects[i];
  signals signal = first_signals();
  sizes[i] = subject_size(s);
  pristine[i] = (unsigned char*)malloc(sizes[i]);
  require(subject_init(s, memory, sizeof memory, NULL) == RESONID_OK);
  for (int k = 0; k < 700; ++k) {
    double ru, u, y;
    next_signals(&signal, k, &ru, &u, &y);
    require(subject_step(s, memory, ru, u, y) == RESONID_OK);
  }
  require(resonid_snapshot((resonid_handle*)(void*)memory, pristine[i], sizes[i], NULL) == RESONID_OK);
}

/* Everything that a handle of the kind can do. */
static void use(const subject* s, resonid_handle* h, uint64_t missed) {
  signals signal = first_signals();
  resonid_mode modes[4];
  resonid_complex z[2];
  double lag, x[64];
  size_t count;
  uint32_t accepted;
  const double told = 0.3, one = 1.0;
  const resonid_gain_node node = {0.1, 0.3, 2.0};
  const resonid_biquad notch = {30.0, 0.1, 0.8};
  (void)tell(h);
  for (int round = 0; round < 2; ++round) {
    for (int k = 0; k < 40; ++k) {
      double ru, u, y;
      next_signals(&signal, k, &ru, &u, &y);
      require(subject_step(s, h, ru, u, k % 19 == 7 ? NAN : y) == RESONID_OK);
    }
    (void)tell(h);
    (void)resonid_lag_samples(h, &lag);
    (void)resonid_modes(h, RESONID_RESONANCES, modes, 4, &count);
    (void)resonid_modes(h, RESONID_ANTIRESONANCES, modes, 4, &count);
    (void)resonid_ratios(h, 0, 1, z, 2);
    (void)resonid_generate(h, x, 64);
    (void)resonid_watch(h, 0.5);
    (void)resonid_stop(h);
    (void)resonid_acknowledge(h, &accepted);
    (void)resonid_encoder_set_position(h, -5);
    (void)resonid_control_set_gains(h, 0.4, 3.0, NULL);
    (void)resonid_control_set_schedule(h, &node, 1, NULL);
    (void)resonid_control_exchange_filters(h, &notch, 1, 3, 5, NULL);
    (void)resonid_control_set_position(h, 0.2);
    (void)resonid_axis_excite(h, 0.1, 0.2, 0.3, 0.4, x);
    (void)resonid_axis_set_loop(h, &told, 1, &one, 1, 0, RESONID_LOOP_CONTROLLER, 0.002, NULL);
    (void)resonid_miss(h, missed);
  }
}

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size);
int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  resonid_handle* h = NULL;
  if (size < 2) return 0;
  if (data[0] == 0xFF) { /* as it is */
    (void)resonid_restore(memory, sizeof memory, data + 1, size - 1, 0, &h, NULL);
    return 0;
  }
  const int i = data[0] % kSubjectCount;
  const subject* s = &kSubjects[i];
  const uint64_t missed = data[1] < 200 ? data[1] : UINT64_MAX >> (data[1] - 200);
  if (pristine[i] == NULL) make_pristine(i);
  memcpy(snapshot, pristine[i], sizes[i]);
  for (const uint8_t* p = data + 2; data + size - p >= 4;) { /* place, length, bytes */
    const size_t place = 64 + (p[0] | (size_t)p[1] << 8 | (size_t)p[2] << 16) % (sizes[i] - 64);
    size_t length = 1 + p[3] % 8;
    p += 4;
    if (length > (size_t)(data + size - p)) length = (size_t)(data + size - p);
    if (length > sizes[i] - place) length = sizes[i] - place;
    memcpy(snapshot + place, p, length);
    p += length;
  }
  const uint32_t none = 0;
  memcpy(snapshot + 24, &none, sizeof none);
  const uint32_t checksum = crc32(snapshot, sizes[i]);
  memcpy(snapshot + 24, &checksum, sizeof checksum);
  require(resonid_check(snapshot, sizes[i], s->kind, NULL) == RESONID_OK);
  const resonid_status status = resonid_restore(memory, sizeof memory, snapshot, sizes[i], s->kind, &h, NULL);
  require(status == RESONID_OK || status == RESONID_ERROR_SNAPSHOT);
  if (status != RESONID_OK) {
    require(resonid_kind((resonid_handle*)(void*)memory) == 0);
    return 0;
  }
  use(s, h, missed);
  /* What steps have left can be restored again. */
  require(resonid_snapshot(h, snapshot, sizeof snapshot, NULL) == RESONID_OK);
  require(resonid_restore(memory, sizeof memory, snapshot, sizes[i], s->kind, &h, NULL) == RESONID_OK);
  require(resonid_reset(h) == RESONID_OK);
  (void)resonid_change_relearn(h);
  use(s, h, 3);
  return 0;
}
