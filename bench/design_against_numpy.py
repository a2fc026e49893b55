#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Runs parts of control design by resonid and the same work by numpy in turns and prints the ratios of the medians.

    cmake --preset release && cmake --build --preset release --target bench_design
    bench/design_against_numpy.py build/release/bench/bench_design

Exact gains: quadratic rows of |S| and the load's transfer on 600 lines, the smallest positive root in ki for 60 values of kp, all vectorised (docs/methods/tune.md 4.1, 4.2). Monte Carlo: 10 000 two-mass drives by their
closed form (vectorised over draws and 160 lines), maxima on the lines; resonid refines them between the lines. --json FILE writes the ratios; what each is to be stands in bench/floors.json.
"""
import json
import os
import statistics
import subprocess
import sys
import time

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(name, "1")
import numpy as np

TS = 0.002
MS, ML = 1.4, 1.3
V0 = np.array([np.log(0.032), np.log(0.032), np.log(143.75), np.log(0.3), 0.004])
STD = np.array([0.03, 0.03, 0.03, 0.09, 0.0002])
FREQUENCIES = 250.0 * 1e-4 ** (1.0 - np.arange(600) / 599.0)


def plant(v, f):
    """Sampled responses to the measured and the load's velocity; v[..., 5], f[line]."""
    j1, j2, k, d = (np.exp(v[..., i])[..., None] for i in range(4))
    delay = v[..., 4][..., None]
    n = np.floor(delay / TS + 1e-9)
    rest = np.maximum(delay - n * TS, 0.0)
    j = j1 + j2
    g = d * j / (2.0 * j1 * j2)
    wd = np.sqrt(k * j / (j1 * j2) - g * g)
    h = lambda t: np.exp(-g * t) * np.sin(wd * t) / wd
    c, e = 2.0 * np.exp(-g * TS) * np.cos(wd * TS), np.exp(-2.0 * g * TS)
    x = np.exp(-2j * np.pi * f * TS)
    below = 1.0 - c * x + e * x * x

    def mode(late):
        return (1.0 - x) * (h(TS - late) * x + (h(2.0 * TS - late) - c * h(TS - late)) * x * x) / below

    rigid = 1.0 / ((1.0 - x) * j)
    measured = x**n * (((TS - rest) * x + rest * x * x) * rigid + j2 / (j1 * j) * mode(rest))
    return measured, TS * x * rigid - mode(0.0) / j


G, GL = plant(V0, FREQUENCIES)
Q = TS / (1.0 - np.exp(-2j * np.pi * FREQUENCIES * TS))
KP = 1.908059045
KI = 18.4348455


def gram(x):
    return np.real(x[:, None, :] * np.conj(x[None, :, :]))


def first_roots(a, b, c):
    """Smallest positive root of a x^2 + 2 b x + c, infinite where there is none."""
    with np.errstate(all="ignore"):
        s = -(b + np.copysign(np.sqrt(b * b - a * c), b))
        roots = np.stack([s / a, c / s])
        return np.nanmin(np.where(roots > 0.0, roots, np.inf), 0)


def exact_gains():
    one, none = np.ones_like(G), np.zeros_like(G)
    loop = gram(np.stack([one, G, Q * G]))
    rows = np.concatenate([MS**2 * loop - gram(np.stack([one, none, none])), ML**2 * loop - gram(np.stack([none, GL, Q * GL]))], 2)
    limit = first_roots(rows[1, 1], rows[0, 1], rows[0, 0]).min()
    kp = limit * np.arange(1, 61)[:, None] / 60.0
    c = rows[0, 0] + kp * (2.0 * rows[0, 1] + kp * rows[1, 1])
    ki = first_roots(rows[2, 2], rows[0, 2] + kp * rows[1, 2], c).min(1)
    return np.where((c < 0.0).any(1), 0.0, ki).max()


LINES = 250.0 * 1e-4 ** (1.0 - np.arange(160) / 159.0)


def monte_carlo():
    random = np.random.default_rng(1)
    q = TS / (1.0 - np.exp(-2j * np.pi * LINES * TS))
    controller = KP + KI * q
    exceeding = 0
    for _ in range(20):  # in parts that a cache can take
        g, load = plant(V0 + STD * random.normal(size=(500, 5)), LINES)
        returned = np.abs(1.0 + controller * g)
        s = (1.0 / returned).max(1)
        t = (np.abs(controller * load) / returned).max(1)
        exceeding += int(((s > MS) | (t > ML)).sum())
    return exceeding


def seconds(work):
    begin = time.process_time()
    work()
    return time.process_time() - begin


def ours(program):
    run = subprocess.run([program, "--benchmark_format=json", "--benchmark_min_time=0.2"], check=True, capture_output=True, text=True)
    return {b["name"].split("/")[0]: b["cpu_time"] * 1e-3 for b in json.loads(run.stdout)["benchmarks"]}


def main():
    best = exact_gains()
    assert abs(best - 21.5) < 0.3, best
    share = monte_carlo() / 10000.0
    assert 0.02 < share < 0.06, share
    rounds = [(ours(sys.argv[1]), seconds(exact_gains), seconds(monte_carlo)) for _ in range(5)]
    ratios = {}
    for name, column in (("exact_gains_600_lines_60_gains", 1), ("monte_carlo_10000", 2)):
        own = statistics.median(r[0][name] for r in rounds)
        theirs = statistics.median(r[column] for r in rounds)
        ratios[f"numpy / {name}"] = theirs / own
        print(f"{name}: resonid {own * 1e3:.3f} ms, numpy {theirs * 1e3:.3f} ms, {theirs / own:.1f} times faster (medians of {len(rounds)})")
    for name in ("exact_gains", "confident_design_one_biquad"):
        print(f"{name}: resonid {statistics.median(r[0][name] for r in rounds) * 1e3:.2f} ms")
    if "--json" in sys.argv:
        with open(sys.argv[sys.argv.index("--json") + 1], "w", encoding="utf-8") as file:
            json.dump(ratios, file, indent=1)
    return 0


if __name__ == "__main__":
    sys.exit(main())
