/* SPDX-License-Identifier: MIT */
/* Sends samples of one axis to `resonid monitor` by TCP (docs/monitor_frame.md), each until it is
 * acknowledged: send_samples HOST PORT AXIS FRAMES */
#define _POSIX_C_SOURCE 200112L
#include <netdb.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

enum { SAMPLES = 100, COLUMNS = 3, RATE_HZ = 2000, LONGEST = 2048 };

static uint32_t crc32c(const unsigned char* p, size_t n) {
  uint32_t crc = 0xFFFFFFFFu;
  while (n--) {
    crc ^= *p++;
    for (int k = 0; k < 8; ++k) crc = (crc >> 1) ^ (crc & 1 ? 0x82F63B78u : 0);
  }
  return ~crc;
}

static unsigned char* put(unsigned char* p, const void* value, size_t n) { /* little endian machines */
  memcpy(p, value, n);
  return p + n;
}

/* What the machine measured: excitation, input, output of one sample. A drive reads them from its controller.
 */
static void measure(uint64_t sample, float* values) {
  for (int c = 0; c < COLUMNS; ++c) values[c] = (float)(sample % 1000 + 0.25 * c);
}

static size_t make_frame(unsigned char* frame, const char* axis, uint64_t first) {
  static const char names[] = "\2ru\1u\1y"; /* a length before each name */
  const uint16_t version = 1, columns = COLUMNS, axis_length = (uint16_t)strlen(axis);
  const uint16_t header = (uint16_t)((46 + axis_length + sizeof names - 1 + 7) / 8 * 8);
  const uint32_t samples = SAMPLES, total = header + 4 * SAMPLES * COLUMNS + 4;
  const double rate = RATE_HZ;
  const int64_t time_ns = INT64_MIN; /* not told; UNIX time of the first sample where there is a clock */
  const uint8_t float32 = 1, flags = 0;
  memset(frame, 0, header);
  unsigned char* p = put(frame, "RSN1", 4);
  p = put(put(put(put(p, &version, 2), &header, 2), &total, 4), &samples, 4);
  p = put(put(put(put(p, &first, 8), &rate, 8), &time_ns, 8), &columns, 2);
  p = put(put(put(put(p, &float32, 1), &flags, 1), &axis_length, 2), axis, axis_length);
  put(p, names, sizeof names - 1);
  p = frame + header;
  for (uint64_t k = first; k < first + SAMPLES; ++k) {
    float values[COLUMNS];
    measure(k, values);
    p = put(p, values, sizeof values);
  }
  const uint32_t crc = crc32c(frame, total - 4);
  put(p, &crc, 4);
  return total;
}

static int connected(const char* host, const char* port) {
  const struct timeval patience = {10, 0}; /* for an acknowledgement */
  struct addrinfo wanted = {0}, *found = NULL;
  wanted.ai_socktype = SOCK_STREAM;
  if (getaddrinfo(host, port, &wanted, &found) != 0) return -1;
  int s = socket(found->ai_family, found->ai_socktype, found->ai_protocol);
  if (s >= 0 && connect(s, found->ai_addr, found->ai_addrlen) != 0) close(s), s = -1;
  if (s >= 0) setsockopt(s, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  freeaddrinfo(found);
  return s;
}

/* The next sample that the server wants; UINT64_MAX: the connection is lost, or it takes no samples of the
 * axis. */
static uint64_t next_wanted(int s, const char* axis) {
  unsigned char answer[LONGEST];
  const size_t named = (8 + strlen(axis) + 7) / 8 * 8, length = named + 12;
  uint64_t next = UINT64_MAX;
  uint32_t crc = 0;
  for (size_t got = 0; got < length;) {
    const ssize_t n = recv(s, answer + got, length - got, 0);
    if (n <= 0) return UINT64_MAX;
    got += (size_t)n;
  }
  memcpy(&next, answer + named, 8);
  memcpy(&crc, answer + named + 8, 4);
  return memcmp(answer, "RSNA", 4) == 0 && crc == crc32c(answer, named + 8) ? next : UINT64_MAX;
}

int main(int argc, char** argv) {
  unsigned char frame[LONGEST];
  if (argc != 5 || strlen(argv[3]) > 64) return fprintf(stderr, "send_samples HOST PORT AXIS FRAMES\n"), 2;
  const uint64_t end = SAMPLES * strtoull(argv[4], NULL, 10);
  uint64_t next = 0; /* everything before it is on the server's disk: a drive may forget it */
  for (int tries = 0; next < end && tries < 100; ++tries) {
    const int s = connected(argv[1], argv[2]);
    while (s >= 0 && next < end) {
      const size_t length = make_frame(frame, argv[3], next);
      if (send(s, frame, length, MSG_NOSIGNAL) != (ssize_t)length) break;
      const uint64_t wanted = next_wanted(s, argv[3]);
      if (wanted == UINT64_MAX) break; /* connect again and send from `next` on */
      if (wanted <= next) fprintf(stderr, "the server took nothing; its page says why\n"), sleep(1);
      next = wanted;
    }
    if (s >= 0) close(s);
    if (next < end) fprintf(stderr, "no connection or no acknowledgement; trying again\n"), sleep(1);
  }
  return next >= end ? 0 : 1;
}
