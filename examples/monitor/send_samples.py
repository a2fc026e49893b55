#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Sends samples of one axis to `resonid monitor` by TCP (docs/monitor_frame.md), each until it is acknowledged.

    send_samples.py HOST PORT AXIS FRAMES
"""
import socket
import struct
import sys
import time

COLUMNS, RATE_HZ, SAMPLES = ("ru", "u", "y"), 2000.0, 100
NO_TIME, REFUSED = -(1 << 63), (1 << 64) - 1


def remainder(value):
    for _ in range(8):
        value = value >> 1 ^ (0x82F63B78 if value & 1 else 0)
    return value


TABLE = [remainder(byte) for byte in range(256)]


def crc32c(data):
    crc = 0xFFFFFFFF
    for byte in data:
        crc = crc >> 8 ^ TABLE[(crc ^ byte) & 0xFF]
    return crc ^ 0xFFFFFFFF


def padded(data):
    return data + bytes(-len(data) % 8)


def signed(data):
    return data + struct.pack("<I", crc32c(data))


def frame(axis, first_sample, rows, time_ns=NO_TIME):
    """`rows` has a value per column each; `time_ns` is the UNIX time of the first one."""
    names = axis.encode() + b"".join(struct.pack("B", len(c)) + c.encode() for c in COLUMNS)
    header_bytes = len(padded(bytes(46) + names))
    values = b"".join(struct.pack(f"<{len(row)}d", *row) for row in rows)
    header = struct.pack("<4sHHIIQdqHBBH", b"RSN1", 1, header_bytes, header_bytes + len(values) + 4, len(rows), first_sample,
                         RATE_HZ, time_ns, len(COLUMNS), 2, 0, len(axis.encode()))
    return signed(padded(header + names) + values)


def question(axis):
    return signed(padded(b"RSNQ" + struct.pack("<I", len(axis.encode())) + axis.encode()))


def next_wanted(stream, axis):
    """The next sample that the server wants: all before it are on its disk."""
    named = len(padded(bytes(8) + axis.encode()))
    answer = stream.read(named + 12)
    if len(answer) < named + 12 or answer[:4] != b"RSNA" or signed(answer[:-4]) != answer:
        raise ConnectionError("no acknowledgement")
    wanted = struct.unpack_from("<Q", answer, named)[0]
    if wanted == REFUSED:
        sys.exit(f"the server takes no samples of axis {axis}")
    return wanted


def measure(sample):
    """What the machine measured: excitation, input, output. A drive reads them from its controller."""
    return [sample % 1000 + 0.25 * column for column in range(len(COLUMNS))]


def main():
    if len(sys.argv) != 5:
        sys.exit("required: send_samples.py HOST PORT AXIS FRAMES")
    host, port, axis, frames = sys.argv[1], int(sys.argv[2]), sys.argv[3], int(sys.argv[4])
    end, done = SAMPLES * frames, 0
    while done < end:
        try:
            with socket.create_connection((host, port), timeout=10) as connection, connection.makefile("rb") as stream:
                # Goes on where the server stands. A drive whose own count has begun again at 0 must not ask: it would be told
                # the old number. It sends from 0, with times.
                connection.sendall(question(axis))
                done = next_wanted(stream, axis)
                while done < end:
                    connection.sendall(frame(axis, done, [measure(k) for k in range(done, done + SAMPLES)]))
                    before, done = done, next_wanted(stream, axis)
                    if done <= before:
                        print("the server took nothing; its page says why", file=sys.stderr)
                        time.sleep(0.5)
        except OSError as error:
            print(f"{error}; trying again", file=sys.stderr)
            time.sleep(0.2)


if __name__ == "__main__":
    main()
