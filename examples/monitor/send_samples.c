/* SPDX-License-Identifier: MIT */
/* Sends samples of one axis from a little-endian machine to `resonid monitor` by TCP (docs/monitor_frame.md),
 * each until it is acknowledged: send_samples HOST PORT AXIS FRAMES */
#define _POSIX_C_SOURCE 200112L
#include <netdb.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

enum { SAMPLES = 100, COLUMNS = 3, LONGEST = 2048 };

static uint32_t crc32c(const unsigned char* p, size_t n) {
  uint32_t crc = 0xFFFFFFFFu;
  for (size_t bit = 0; bit < 8 * n; ++bit)
    crc = (bit % 8 ? crc : crc ^ p[bit / 8]), crc = (crc >> 1) ^ (crc & 1 ? 0x82F63B78u : 0);
  return ~crc;
}

static size_t make_frame(unsigned char* frame, const char* axis, uint64_t first) {
  static const char names[] = "\2ru\1u\1y"; /* a length before each name */
  const size_t named = strlen(axis), header = (46 + named + sizeof names - 1 + 7) / 8 * 8;
  const uint32_t total = (uint32_t)(header + 4 * SAMPLES * COLUMNS + 4), sizes[] = {total, SAMPLES};
  const uint16_t begin[] = {1, (uint16_t)header}, end[] = {COLUMNS, 1 /* float32 */, (uint16_t)named};
  const double rate_hz = 2000.0;
  const int64_t time_ns = INT64_MIN; /* not told; UNIX time of the first sample where there is a clock */
  float values[SAMPLES][COLUMNS];    /* excitation, input, output: a drive reads them from its controller */
  for (int k = 0; k < SAMPLES; ++k)
    for (int c = 0; c < COLUMNS; ++c) values[k][c] = (float)((int)(first % 1000) + k + 0.25 * c);
  memcpy(memset(frame, 0, header), "RSN1", 4);
  memcpy(frame + 4, begin, 4), memcpy(frame + 8, sizes, 8), memcpy(frame + 16, &first, 8);
  memcpy(frame + 24, &rate_hz, 8), memcpy(frame + 32, &time_ns, 8), memcpy(frame + 40, end, 6);
  memcpy(frame + 46, axis, named), memcpy(frame + 46 + named, names, sizeof names - 1);
  memcpy(frame + header, values, sizeof values);
  const uint32_t crc = crc32c(frame, total - 4);
  memcpy(frame + total - 4, &crc, 4);
  return total;
}

/* Whether an answer came: the next sample that the server wants; UINT64_MAX: it takes none of the axis. */
static int answered(int s, const char* axis, uint64_t* next) {
  unsigned char answer[LONGEST];
  const size_t named = (8 + strlen(axis) + 7) / 8 * 8;
  uint32_t crc;
  if (recv(s, answer, named + 12, MSG_WAITALL) != (ssize_t)(named + 12)) return 0;
  memcpy(next, answer + named, 8), memcpy(&crc, answer + named + 8, 4);
  return memcmp(answer, "RSNA", 4) == 0 && crc == crc32c(answer, named + 8);
}

int main(int argc, char** argv) {
  unsigned char frame[LONGEST];
  const struct addrinfo stream = {.ai_socktype = SOCK_STREAM};
  const struct timeval patience = {10, 0}; /* for an acknowledgement */
  struct addrinfo* to = NULL;
  if (argc != 5 || strlen(argv[3]) > 64 || getaddrinfo(argv[1], argv[2], &stream, &to) != 0)
    return fputs("required: send_samples HOST PORT AXIS FRAMES, a host that is known\n", stderr), 2;
  const uint64_t end = SAMPLES * strtoull(argv[4], NULL, 10);
  uint64_t next = 0, wanted = 0; /* everything before `next` is on the server's disk: a drive may forget it */
  for (int tries = 0; next < end && tries < 100; ++tries) { /* connect, and go on from `next` */
    const int s = socket(to->ai_family, to->ai_socktype, to->ai_protocol);
    setsockopt(s, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    int up = connect(s, to->ai_addr, to->ai_addrlen) == 0;
    while (up && next < end) {
      const size_t length = make_frame(frame, argv[3], next);
      up = send(s, frame, length, MSG_NOSIGNAL) == (ssize_t)length && answered(s, argv[3], &wanted);
      if (up && wanted == UINT64_MAX)
        fprintf(stderr, "the server takes no samples of axis %s\n", argv[3]), exit(1);
      if (up && wanted <= next) fputs("the server took nothing; its page says why\n", stderr), sleep(1);
      if (up) next = wanted;
    }
    close(s);
    if (next < end) fputs("no connection or no acknowledgement; trying again\n", stderr), sleep(1);
  }
  freeaddrinfo(to);
  return next >= end ? 0 : 1;
}
