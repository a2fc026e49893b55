#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Memory, files and handles of `resonid monitor` while it runs, pages are opened and closed, alarms come and
go and history grows out of its retention:

    monitor_memory.py RESONID [--minutes M] [--speed S]

With the environment that the unit of systemd gives it. A simulated belt runs S times faster than real time. Over the
second half, or the last hour of what is longer, the process' own memory must not grow by more than 1 kB per minute; what
is shorter than two hours warms up meanwhile, and may take 1 MB. Ends with 1 where something grows.
"""
import argparse
import http.client
import json
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import time

CONFIGURATION = """
[monitor]
data = "data"
listen = "127.0.0.1:0"
false_alarm_interval_s = 3600
[retention]
rows_s = 600
hours_s = 86400
evidence_s = 600
size_bytes = 10000000
[source.simulated]
kind = "demo"
experiments = ["demo"]
speed = {speed}
[axis.demo]
source = "simulated"
sample_rate_hz = 500.0
input = "u"
output = "y"
excitation = "ru"
controller = "pi:1.036,0.147"
delay_s = 0.004
baseline_s = 60
"""


UNIT = pathlib.Path(__file__).parents[2] / "apps" / "monitor" / "systemd" / "resonid-monitor.service"


def environment():
    return os.environ | dict(re.findall(r"^Environment=(\w+)=(.*)$", UNIT.read_text(), re.M))


def slope(points):
    """Least squares of (time, value)."""
    n = len(points)
    mean_t = sum(t for t, _ in points) / n
    mean_v = sum(v for _, v in points) / n
    spread = sum((t - mean_t) ** 2 for t, _ in points)
    return sum((t - mean_t) * (v - mean_v) for t, v in points) / spread if spread > 0 else 0.0


class Server:
    def __init__(self, program, folder, speed):
        configuration = folder / "monitor.toml"
        configuration.write_text(CONFIGURATION.format(speed=speed))
        self.data = folder / "data"
        self.process = subprocess.Popen([program, "monitor", str(configuration), "--log-level", "error"], stdout=subprocess.PIPE,
                                        stderr=subprocess.STDOUT, text=True, env=environment())
        self.port = None
        for line in self.process.stdout:
            found = re.search(r"http://127\.0\.0\.1:(\d+)", line)
            if found:
                self.port = int(found.group(1))
                break
        if self.port is None:
            raise SystemExit("monitor_memory: the server tells no address")
        os.set_blocking(self.process.stdout.fileno(), False)

    def own_memory_kb(self):
        text = pathlib.Path(f"/proc/{self.process.pid}/smaps_rollup").read_text()
        return int(re.search(r"^Anonymous:\s+(\d+) kB", text, re.M).group(1))

    def handles(self):
        return len(os.listdir(f"/proc/{self.process.pid}/fd"))

    def file_bytes(self):
        total = 0
        for file in self.data.rglob("*"):
            try:
                total += file.stat().st_size if file.is_file() else 0
            except FileNotFoundError:  # its retention is over
                pass
        return total

    def get(self, path, expected=(200,)):
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=20)
        connection.request("GET", path)
        answer = connection.getresponse()
        body = answer.read()
        connection.close()
        if answer.status not in expected:
            raise SystemExit(f"monitor_memory: GET {path} is answered with {answer.status}: {body[:300]!r}")
        return body

    def post(self, path, value):
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=20)
        connection.request("POST", path, json.dumps(value), {"Content-Type": "application/json"})
        status = connection.getresponse().status
        connection.close()
        return status

    def look_at_stream(self, seconds):
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=20)
        connection.request("GET", "/api/v1/stream?axis=demo")
        answer = connection.getresponse()
        end = time.monotonic() + seconds
        taken = 0
        while time.monotonic() < end:
            taken += len(answer.read1(65536))
        connection.close()
        return taken

    def stop(self):
        self.process.send_signal(signal.SIGTERM)
        return self.process.wait(60)


def use(server):
    """What a person and a scraper do: a page for a second, figures, history, alarms."""
    for path in ("/", "/metrics", "/api/v1/axes", "/api/v1/axes/demo", "/api/v1/axes/demo/history?figure=resonance_hz&points=500",
                 "/api/v1/audit"):
        server.get(path)
    server.get("/api/v1/axes/demo/response", (200, 503))  # there is none before it has learned
    server.get("/api/v1/no", (404,))
    for alarm in json.loads(server.get("/api/v1/alarms"))["alarms"][:3]:
        server.post(f"/api/v1/alarms/{alarm['id']}/acknowledge", {"who": "soak", "reason": "seen"})
    if server.look_at_stream(1.0) == 0:
        raise SystemExit("monitor_memory: the stream of events says nothing")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program")
    parser.add_argument("--minutes", type=float, default=1.5)
    parser.add_argument("--speed", type=float, default=20.0)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        server = Server(options.program, pathlib.Path(folder), options.speed)
        begin, memory, handles, files = time.monotonic(), [], [], []
        while (now := time.monotonic() - begin) < 60.0 * options.minutes:
            use(server)
            time.sleep(0.5)
            try:
                server.process.stdout.read()
            except TypeError:
                pass
            memory.append((now / 60.0, server.own_memory_kb()))
            handles.append(server.handles())
            files.append(server.file_bytes())
        first = max(0.5 * options.minutes, options.minutes - 60.0)
        last = [(t, v) for t, v in memory if t >= first]
        late = len(memory) - len(last)
        growth = slope(last)
        allowed = 1.0 if options.minutes >= 120.0 else 1000.0 / (options.minutes - first)
        axis = json.loads(server.get("/api/v1/axes/demo"))
        code = server.stop()
    print(f"{options.minutes:g} minutes at {options.speed:g} times real time: memory {memory[0][1]} ... {memory[-1][1]} kB, "
          f"{growth:.1f} kB/min over the last {options.minutes - first:.3g} minutes ({allowed:.3g} allowed); "
          f"handles {min(handles[late:])} ... {max(handles[late:])}; "
          f"files {max(files) / 1e6:.1f} MB at most, {files[-1] / 1e6:.1f} MB at the end; axis {axis['state']}, "
          f"{axis['samples']['received']} samples")
    faults = []
    if growth > allowed:
        faults.append("memory grows")
    if max(handles[late:]) > min(handles[late:]) + 3:
        faults.append("handles come and do not go")
    if max(files) > 10e6 + 60e6:
        faults.append("files grow beyond what the configuration allows")
    if axis["samples"]["received"] < 0.5 * 500 * options.speed * 60 * options.minutes:
        faults.append("the axis got too few samples for this to say anything")
    if code != 0:
        faults.append(f"the server ended with {code}")
    for fault in faults:
        print("monitor_memory: " + fault, file=sys.stderr)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
