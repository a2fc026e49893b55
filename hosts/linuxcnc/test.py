#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Runs resonid in LinuxCNC's servo thread (two_mass.hal, simulation without real time) and holds what its pins say
against the truth from plant.py:

    test.py FOLDER [SESSION ...]      FOLDER: where the modules are built, with the compiler $CXX

Every session has an IPC and a mount namespace of its own, in which the modules are seen among LinuxCNC's; nothing is
installed. Exit code 77, with the reason, where that cannot be had."""
import concurrent.futures
import math
import pathlib
import sys
import tempfile

import plant
from session import SAMPLED, Session, build, check, failures, machine, namespace, require_linuxcnc

FIRST_HZ, LAST_HZ = 10.0, 110.0


def identified(pins, drive, name):
    """Resonance within 1 %, anti-resonance within 2 %, and trusted."""
    for quantity, truth, most in (("resonance-hz", drive.resonance_hz, 0.01),
                                  ("antiresonance-hz", drive.antiresonance_hz, 0.02)):
        error = pins[quantity] / truth - 1
        check(abs(error) < most, f"{name}: {quantity} {pins[quantity]:.3f}, truth {truth:.3f}: {100 * error:+.2f} %, "
              f"at most {100 * most:.0f} %")
    check(pins["trusted"] and pins["trust-reason"] == 0, f"{name}: trusted")


def check_identification(session, drive, p, i, value):
    pins = session.shown[-1]
    identified(pins, drive, "multisine")
    check(abs(pins["resonance-damping"] / drive.damping - 1) < 0.05,
          f"damping {pins['resonance-damping']:.4f}, truth {drive.damping:.4f}")
    for name, truth in (("motor-inertia", value["two-mass.0.j1"]), ("load-inertia", value["two-mass.0.j2"]),
                        ("stiffness", value["two-mass.0.k"])):
        check(abs(pins[name] / truth - 1) < 0.03, f"{name} {pins[name]:.6g}, truth {truth:.6g}")
    return pins


def check_margins(pins, truth, name):
    # Between lines 5 Hz apart the curve is interpolated: that is good to 1 degree and 0.02, on top of the noise.
    for quantity, key, std, most in (("phase-margin-deg", "phase", 3 * pins["phase-margin-std-deg"], 1.0),
                                     ("modulus-margin", "modulus", 3 * pins["modulus-margin-std"], 0.02),
                                     ("crossover-hz", "crossover_hz", 0.0, 0.5),
                                     ("worst-phase-margin-deg", "worst", 0.0, 3.0)):
        error = pins[quantity] - truth[key]
        check(abs(error) < most + std, f"{name}: {quantity} {pins[quantity]:.3f}, truth {truth[key]:.3f} "
              f"(within {most + std:.3f})")


def check_recording(session):
    numbers = [int(row[0]) for row in session.rows]
    check(numbers == list(range(numbers[0], numbers[0] + len(numbers))) and len(numbers) == 12000,
          f"sampler: {len(numbers)} rows without gaps")


def check_time(session):
    """Clocks of the two functions, of the thread, and between two periods; the median of the latter is a period. Without
    real time the thread is interrupted now and then, in the component too: that is what the largest times show."""
    period = sorted(session.column("t_period"))[len(session.rows) // 2]
    usual = {}
    for name in ("t_excite", "t_identify", "t_servo"):
        times = sorted(session.column(name))
        usual[name] = times[len(times) * 99 // 100]
        print(f"        {name[2:]}.time: median {times[len(times) // 2] / period:.2%} of the period, 99 % below "
              f"{usual[name] / period:.2%}, largest {times[-1] / period:.2%}")
    late = sum(t > 1.5 * period for t in session.column("t_period"))
    print(f"        {late} of {len(session.rows)} periods began late by more than half a period")
    check(usual["t_excite"] + usual["t_identify"] < 0.5 * period,
          "the component takes less than half a period in 99 % of the periods")


def check_limit(session, limit):
    """The speed is doubled: the excitation ends before the velocity passes the limit, and stays out."""
    before, tripped, toggled, again, lost = session.shown
    check(before["trusted"] and before["stop-reason"] == 0, "limit: a good run before")
    check(tripped["stop-reason"] == 4 and not tripped["running"] and tripped["excitation"] == 0,
          "limit: the velocity stops the excitation, and stop-reason says so")
    check(not tripped["trusted"] and tripped["trust-reason"] == 3, "limit: results are not trusted any more")
    excited = [abs(v) for v, x in zip(session.column("velocity"), session.column("excitation")) if x != 0]
    check(0.0 < max(excited) < limit, f"limit: up to {max(excited):.1f} rad/s with excitation, limit {limit:.1f}")
    check(max(session.column("velocity")) > limit, "limit: the machine itself went on beyond")
    check(not toggled["running"] and toggled["stop-reason"] == 4, "limit: enable alone does not start again")
    check(again["running"] and again["stop-reason"] == 0, "limit: reset and enable do")
    check(lost["stop-reason"] == 7 and not lost["running"] and lost["skipped-samples"] > 0,
          "limit: losing the velocity that a limit needs stops it as well")


def check_growth(session):
    pins = session.shown[-1]
    torque = [abs(u) for u, x in zip(session.column("torque"), session.column("excitation")) if x != 0]
    check(session.shown[0]["stop-reason"] == 0 and pins["stop-reason"] == 6 and not pins["running"],
          f"growing oscillation: stops the excitation, and stop-reason says so, at {torque[-1]:.1f} Nm")


RECORD = "loadusr -w halsampler -t -n {} SAMPLES\nshow pin\n"
SESSIONS = {
    "first": "start\n" + RECORD.format(12000),
    "second": "start\n" + RECORD.format(12000),
    "gains": "setp resonid.0.loop 1\nsetp resonid.0.pgain 0.15\nsetp resonid.0.igain 1\nstart\n" +
             RECORD.format(12000) + "setp resonid.0.enable 0\nloadusr -w sleep 1\nshow pin\n",
    "prbs": "setp resonid.0.excitation-kind 2\nstart\n" + RECORD.format(18000),
    "chirp": "setp resonid.0.excitation-kind 1\nstart\n" + RECORD.format(20000),
    "limit": "setp resonid.0.max-velocity 30\nstart\nloadusr -w sleep 5\nshow pin\n"
             "setp pid.0.command 40\nloadusr -w sleep 0.5\nshow pin\n"
             "setp pid.0.command 20\nsetp resonid.0.enable 0\nloadusr -w sleep 0.2\n"
             "setp resonid.0.enable 1\nloadusr -w sleep 0.2\nshow pin\n"
             "setp resonid.0.enable 0\nsetp resonid.0.reset 1\nloadusr -w sleep 0.2\nsetp resonid.0.reset 0\n"
             "setp resonid.0.enable 1\nloadusr -w sleep 0.5\nshow pin\n"
             "setp resonid.0.valid 0\nloadusr -w sleep 0.2\nshow pin\n"
             "loadusr -w halsampler -t -n 13500 SAMPLES\n",
    # What is normal is learned when the machine is at its speed: then only the excitation is started.
    "growth": "setp resonid.0.enable 0\nsetp resonid.0.max-growth 2\nsetp resonid.0.least-oscillation 0.5\nstart\n"
              "loadusr -w sleep 1\nsetp resonid.0.enable 1\nloadusr -w sleep 3\nshow pin\n"
              "setp pid.0.Pgain 1.2\nloadusr -w halsampler -t -n 13000 SAMPLES\nshow pin\n",
}


def main():
    require_linuxcnc()
    modules = pathlib.Path(sys.argv[1]).resolve()
    isolated = namespace()
    build(modules)
    only = sys.argv[2:] or list(SESSIONS)
    with tempfile.TemporaryDirectory(prefix="resonid-hal-") as temporary:
        folder = pathlib.Path(temporary)
        folder.chmod(0o755)
        sessions = [Session(name, isolated, modules, SESSIONS[name], folder) for name in only]
        with concurrent.futures.ThreadPoolExecutor(len(sessions)) as pool:
            run = {s.name: s for s in pool.map(Session.run, sessions)}
    drive, p, i, value = machine()
    for s in run.values():
        check(s.code == 0 and s.shown, f"session {s.name}: ended well")
        if s.code != 0 or not s.shown:
            print(s.output + s.errors)
            return 1
    if "first" in run:
        pins = check_identification(run["first"], drive, p, i, value)
        check_margins(pins, plant.margins(drive, p, i, FIRST_HZ, LAST_HZ), "measured loop")
        check_recording(run["first"])
        check_time(run["first"])
    if "second" in run:
        same = [[row[:1 + SAMPLED.index("t_excite")] for row in run[name].rows] for name in ("first", "second")]
        check(same[0] == same[1], "two runs recorded the same, digit by digit")
    if "gains" in run:
        pins = run["gains"].shown[-1]
        check(not pins["running"] and pins["excitation"] == 0 and pins["stop-reason"] == 1 and pins["trusted"],
              "after enable has fallen: no excitation, and the results stay")
        check_margins(pins, plant.margins(drive, 0.15, 1.0, FIRST_HZ, LAST_HZ), "other gains")
    for name in ("prbs", "chirp"):
        if name in run:
            identified(run[name].shown[-1], drive, name)
    if "limit" in run:
        check_limit(run["limit"], 30.0)
    if "growth" in run:
        check_growth(run["growth"])
    print(f"{len(failures)} failures")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
