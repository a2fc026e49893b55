#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Runs `resonid monitor` on the real halsampler, which reads the simulated axis of two_mass.hal through a sampler as
docs/monitor.md sets it up, and holds what the service says against the truth from plant.py:

    monitor_test.py FOLDER PROGRAM      FOLDER: where the modules are built, with the compiler $CXX; PROGRAM: resonid

Session and reasons to skip are those of test.py."""
import http.client
import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time

import plant
from session import HERE, PERIOD_S, Session, build, check, failures, machine, namespace, require_linuxcnc, skip

LONGEST_S = 60.0  # until the axis is followed
LATE_S = 9.0  # before somebody reads: the FIFO is full after 8 s
LEAST_SAMPLES = 30000  # more than the FIFO has room for
WATCH = "loadusr -w python3 FOLDER/monitor_test.py --watch FOLDER\n"  # what this file does within the session
CONFIGURATION = """
[monitor]
data = "data"
listen = "127.0.0.1:0"
[source.hal]
kind = "hal"
columns = ["ru", "u", "y", "overruns"]
[axis.x]
source = "hal"
sample_rate_hz = {rate}
excitation = "ru"
input = "u"
output = "y"
controller = "pi:{kp},{ti}"
delay_s = {delay}
"""


def documented_sampler(text):
    """The FIFO of docs/monitor.md: excitation, torque and velocity, which are the first three pins of two_mass.hal's."""
    text = re.sub(r"(loadrt sampler depth=16000 cfg=)\w+", r"\1fffs", text)
    text = re.sub(r" *=> sampler\.0\.pin\.(?:[3-9]|1\d)$", "", text, flags=re.M)
    return text + "\nnet x-lost sampler.0.overruns => sampler.0.pin.3\n"


def asked(port, path):
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=20)
    connection.request("GET", path)
    answer = json.loads(connection.getresponse().read())
    connection.close()
    return answer


def running(name):
    count = 0
    for path in pathlib.Path("/proc").glob("[0-9]*/comm"):
        try:
            count += path.read_text().strip() == name
        except OSError:  # ended meanwhile
            pass
    return count


def watch(folder):
    """Within the session, as its user: the service until it follows the axis, and its end. What it said goes to seen.json."""
    time.sleep(LATE_S)
    begin, seen = time.monotonic(), {}
    with open(folder / "log", "w", encoding="utf-8") as log:
        service = subprocess.Popen([folder / "resonid", "monitor", folder / "monitor.toml"], stdout=subprocess.PIPE,
                                   stderr=log, text=True)
    address = re.search(r"http://127\.0\.0\.1:(\d+)", service.stdout.readline())
    while address and time.monotonic() - begin < LONGEST_S:
        seen["axis"] = asked(int(address.group(1)), "/api/v1/axes")["axes"][0]
        followed = seen["axis"]["state"] == "following" and seen["axis"]["trusted"]
        if followed and seen["axis"]["samples"]["received"] >= LEAST_SAMPLES:
            break
        time.sleep(0.2)
    seen["seconds"] = time.monotonic() - begin
    if address:
        seen["source"] = asked(int(address.group(1)), "/api/v1/status")["sources"][0]
    seen["readers"] = running("halsampler")
    service.send_signal(signal.SIGTERM)
    try:
        seen["code"] = service.wait(20)
    except subprocess.TimeoutExpired:
        service.kill()
    seen["readers_left"] = running("halsampler")
    (folder / "seen.json").write_text(json.dumps(seen))


def check_samples(seen, overruns):
    """The sampler of LinuxCNC 2.9 does not number what overflows its FIFO: its pin counts it."""
    samples, source = seen["axis"]["samples"], seen["source"]
    check(source["kind"] == "hal" and source["state"] == "running" and seen["readers"] == 1,
          f"source {source['name']} of kind {source['kind']} is {source['state']} {source['text']}")
    wrong = {name: samples[name] for name in ("late", "duplicate", "lost")}
    check(samples["received"] >= LEAST_SAMPLES and not any(wrong.values()) and not seen["axis"]["faults"],
          f"{samples['received']} samples in {seen['seconds']:.1f} s: "
          f"{', '.join(f'{count} {name}' for name, count in wrong.items())}, faults {seen['axis']['faults']}")
    check(samples["missing"] == overruns > 0, f"{overruns:.0f} overflowed the FIFO, {samples['missing']} are missing")


def check_figures(axis):
    drive, p, i, value = machine()
    loop = plant.margins(drive, p, i, 1.0, 500.0)
    check(axis["state"] == "following" and axis["trusted"], f"{axis['state']}, {axis['verdict']} {axis.get('why', '')}")
    for name, truth, most in (("resonance_hz", drive.resonance_hz, 0.02), ("antiresonance_hz", drive.antiresonance_hz, 0.02),
                              ("stiffness", value["two-mass.0.k"], 0.05), ("driven_inertia", value["two-mass.0.j1"], 0.05),
                              ("load_inertia", value["two-mass.0.j2"], 0.05), ("modulus_margin", loop["modulus"], 0.05)):
        figure = axis["figures"].get(name, {"value": float("nan"), "std": float("nan")})
        error = figure["value"] / truth - 1
        check(abs(error) < most, f"{name} {figure['value']:.6g} +- {figure['std']:.2g}, truth {truth:.6g}: {100 * error:+.2f} %, "
              f"at most {100 * most:.0f} %")
    told = axis.get("worst_alarm", {}).get("text", "")
    check(axis["alarms"] == 1 and told.startswith(("data", "Samples are missing")), f"{axis['alarms']} alarm, {told}")


def main():
    if sys.argv[1] == "--watch":
        return watch(pathlib.Path(sys.argv[2]))
    require_linuxcnc()
    modules, program = (pathlib.Path(argument).resolve() for argument in sys.argv[1:3])
    if not os.access(program, os.X_OK):
        skip(f"there is no program {program}")
    isolated = namespace()
    build(modules)
    _, p, i, value = machine()
    with tempfile.TemporaryDirectory(prefix="resonid-hal-") as temporary:
        folder = pathlib.Path(temporary)
        folder.chmod(0o755)
        session = Session("monitor", isolated, modules, "start\n" + WATCH + "show pin sampler\nshow comp\n", folder, documented_sampler,
                          {"resonid": program})
        for name in ("monitor_test.py", "session.py", "plant.py"):
            shutil.copy(HERE / name, session.folder)
        (session.folder / "monitor.toml").write_text(CONFIGURATION.format(
            rate=1 / PERIOD_S, kp=p, ti=p / i, delay=value["resonid.0.delay"]))
        session.run()
        log, seen_file = session.folder / "log", session.folder / "seen.json"
        said = log.read_text() if log.exists() else ""
        seen = json.loads(seen_file.read_text()) if seen_file.exists() else {}
    check(session.code == 0 and session.shown and "source" in seen, "the session ended well, and the service answered")
    if not failures:
        check_samples(seen, session.shown[-1]["sampler.0.overruns"])
        check_figures(seen["axis"])
        check(seen.get("code") == 0, f"the service ended with {seen.get('code')} after SIGTERM")
        check(seen["readers_left"] == 0 and "halsampler" not in session.output, "halsampler ended with it, and left HAL")
    if failures:
        print(session.output + session.errors + said)
    print(f"{len(failures)} failures")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
