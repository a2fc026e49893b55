#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""What an automatic script of forty lines finds in a record: the measure that `identify` must not fall below.

    bench/baseline.py RECORD.csv [--input u] [--output y] [--time time_s] [--rate HZ] [--position] [--from S]
    bench/baseline.py --recordings PROGRAM    beside `identify`, on the recordings of real machines

Hann-windowed averaged spectra (H1) at several segment lengths, coherence above 0.5, the most prominent dip and peak after it; the inertia of
the whole from the lines below. For rigid axes and motion, least squares on the low-pass-filtered inverse dynamics.
"""
import argparse
import json
import os
import pathlib
import subprocess

import numpy as np
from scipy import signal


def response(u, y, rate, segment):
    f, puu = signal.welch(u, rate, "hann", segment)
    _, puy = signal.csd(u, y, rate, "hann", segment)
    _, pyy = signal.welch(y, rate, "hann", segment)
    with np.errstate(all="ignore"):
        h, coherence = puy / puu, np.abs(puy)**2 / (puu * pyy)
    keep = (coherence > 0.5) & (f > 0.0)
    return f[keep], h[keep]


def dip_and_peak(f, h):
    """(anti-resonance, resonance, dB of both): the dip and the peak after it that stand out most from the integrator's slope."""
    level = 20.0 * np.log10(np.abs(h) * f)
    dips, of_dip = signal.find_peaks(-level, prominence=3.0)
    peaks, of_peak = signal.find_peaks(level, prominence=3.0)
    best = (None, None, 0.0)
    for d, a in zip(dips, of_dip["prominences"]):
        for p, b in zip(peaks, of_peak["prominences"]):
            if p > d and a + b > best[2]:
                best = (f[d], f[p], a + b)
    return best


def from_response(u, y, rate):
    """Most prominent over segments of 1/2 ... 1/32 of the record; the finer wins while it shows the same dip."""
    found = {}
    best = 0.0
    for parts in (4, 8, 16, 32, 64):
        segment = len(u) // parts
        if segment < 32:
            break
        f, h = response(u, y, rate, segment)
        if len(f) < 8:
            continue
        dip, peak, level = dip_and_peak(f, h)
        if dip is not None and level > best + 3.0:
            best = level
            below = f < 0.5 * dip
            found = {"antiresonance": dip, "resonance": peak}
            if below.sum() >= 3:
                found["inertia"] = float(np.median(1.0 / (2.0 * np.pi * f[below] * np.abs(h[below]))))
    return {k: float(v) for k, v in found.items()}


def from_motion(u, y, rate, corner_hz):
    """Least squares u = J dy/dt + b y + c sign(y) + o, all of it through the same low-pass; velocities near zero left out."""
    sos = signal.butter(4, corner_hz, fs=rate, output="sos")
    low = lambda x: signal.sosfiltfilt(sos, x)
    v = low(y)
    a, s = np.gradient(v) * rate, np.sign(v)
    reverses = (v > 0.05 * np.abs(v).max()).mean() > 0.02 and (v < -0.05 * np.abs(v).max()).mean() > 0.02
    columns = [a, v, np.ones_like(v)] + ([low(s)] if reverses else [])
    use = np.ones(len(v), bool)
    if reverses:  # not as long as the filter remembers a standstill, where friction is anything
        slow = np.abs(v) < 0.05 * np.abs(v).max()
        use = np.convolve(slow, np.ones(2 * int(rate / corner_hz) + 1), "same") < 0.5
        if use.sum() < 50:
            use = ~slow
    x, *_ = np.linalg.lstsq(np.column_stack(columns)[use], low(u)[use], rcond=None)
    return {"inertia": float(x[0]), "viscous_friction": float(x[1]), "offset": float(x[2]),
            **({"coulomb_friction": float(x[3])} if reverses else {})}


def baseline(u, y, rate, late=0):
    """Figures by name; the inertia from the response, where it shows a dip and the machine does not move to and fro.
    late: samples by which the output is known to be late."""
    u, y = np.asarray(u, float)[:len(u) - late], np.asarray(y, float)[late:]
    good = np.isfinite(u) & np.isfinite(y)
    u, y = u[good], y[good]
    if len(u) < 256 or np.ptp(u) == 0.0 or np.ptp(y) == 0.0:
        return {}
    found = from_response(u - u.mean(), y - y.mean(), rate)
    motion = from_motion(u, y, rate, 0.05 * rate)
    if "coulomb_friction" in motion:  # to and fro: the motion tells the inertia
        return {**found, **motion}
    return {**motion, **found}


def of_file(path, u, y, time="time_s", rate=None, position=False, start=0.0, scale=1.0):
    table = np.genfromtxt(path, delimiter=",", names=True)
    rate = rate or (len(table) - 1) / (table[time][-1] - table[time][0])
    table = table[round(start * rate):]
    return baseline(scale * table[u], np.gradient(table[y]) * rate if position else table[y], rate)


# file -> what is known (anti-resonance, resonance), columns, and what a user would tell `identify`
RECORDINGS = {
    "utokyo_two_mass_bench/multisine.csv": (
        "53.9 and 76.2 Hz, inertia 0.00538", {"u": "iq_meas_A", "y": "theta_motor_rad", "time": "t_s", "position": True, "start": 1.0, "scale": 0.564},
        ["--input-scale", "0.564", "--output-quantity", "position", "--drop-periods", "1", "--period-samples", "2500"]),
    "ist_flexible_arm/prbs.csv": (
        "anti-resonance 3.43 Hz", {"u": "u_V", "y": "theta_motor_V", "time": "t_s", "position": True}, ["--output-quantity", "position"]),
    "ist_flexible_arm/square.csv": (
        "anti-resonance 3.43 Hz", {"u": "u_V", "y": "theta_motor_V", "time": "t_s", "position": True}, ["--output-quantity", "position"])}


def recordings(program):
    """Lines of a table; one that says so where there are none."""
    root = pathlib.Path(__file__).resolve().parent.parent
    fetched = root / "recordings"  # by tools/fetch_recordings
    folder = pathlib.Path(os.environ.get("RESONID_RECORDINGS", fetched if fetched.is_dir() else root.parent / "shared" / "recordings"))
    if not folder.is_dir():
        return [f"No recordings of real machines in {folder.name}/ beside the checkout: skipped."]
    said = lambda figures: ", ".join(f"{k} {v:.4g}" for k, v in figures.items()) or "nothing"
    lines = ["| recording | known | script | resonid | trusted |", "|---|---|---|---|---|"]
    for name, (known, columns, options) in RECORDINGS.items():
        path = folder / name
        if not path.exists():
            lines.append(f"| {name} | {known} | absent: skipped | | |")
            continue
        asked = subprocess.run([program, "identify", path, "--input", columns["u"], "--output", columns["y"], "--json", "-", *options],
                               capture_output=True, text=True)
        if asked.returncode:
            ours, verdict = asked.stderr.strip().splitlines()[0].replace(str(folder), ""), "error"
        else:
            result = json.loads(asked.stdout[asked.stdout.index("{"):])
            found = (result.get("model") or {}).get("parameters", {})
            inertias = [p["value"] for k, p in found.items() if k.endswith("inertia") and p.get("value") is not None]
            verdict = "yes" if result["trusted"] else "no: " + ", ".join(f["id"] for f in result["findings"] if f["severity"] == "error")
            ours = said({m["kind"]: m["frequency_hz"] for m in reversed(result["resonances"])} | ({"inertia": sum(inertias)} if inertias else {}))
        lines.append(f"| {name} | {known} | {said(of_file(path, **columns))} | {ours} | {verdict} |")
    return lines


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("record", nargs="?")
    p.add_argument("--input", default="u")
    p.add_argument("--output", default="y")
    p.add_argument("--time", default="time_s")
    p.add_argument("--rate", type=float)
    p.add_argument("--position", action="store_true", help="the output is a position")
    p.add_argument("--from", dest="start", type=float, default=0.0, help="seconds to leave out at the start")
    p.add_argument("--recordings", metavar="PROGRAM")
    o = p.parse_args()
    if o.recordings:
        print("\n".join(recordings(o.recordings)))
    elif o.record:
        print(json.dumps(of_file(o.record, o.input, o.output, o.time, o.rate, o.position, o.start), indent=1))
    else:
        p.error("RECORD.csv or --recordings PROGRAM is required")


if __name__ == "__main__":
    main()
