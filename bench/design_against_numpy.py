#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Runs parts of control design by resonid and the same work by numpy in turns and prints the ratios of the medians.

    cmake --preset release && cmake --build --preset release --target bench_design
    bench/design_against_numpy.py build/release/bench/bench_design [build/release/apps/cli/resonid]

Exact gains: quadratic rows of |S| and the load's transfer on 600 lines, the smallest positive root in ki for 60 values of kp, all vectorised (docs/methods/tune.md 4.1, 4.2). Monte Carlo: 10 000 two-mass drives by their
closed form (vectorised over draws and 160 lines), maxima on the lines; resonid refines them between the lines. With the command line
tool: `tune --structure pi+biquads --report` on a saved result, from start to page, against numpy and scipy that search one biquad with the
exact PI inside for the least error of the load step, for a set of machines to which the worst of 2000 on the ellipsoid of radius 2 is added
twice, with 10 000 draws at the end: no page, no figures, no other candidate. --json FILE writes the ratios; what each is to be stands in bench/floors.json.
"""
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(name, "1")
import numpy as np
from scipy.linalg import expm
from scipy.optimize import differential_evolution

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


def largest_ki(machines, filtered, q, controller_peak=None):
    """Largest ki and its kp for measured and load responses, with what stands behind the gains on the lines."""
    rows, size = [], np.abs(filtered)
    one, none = np.ones_like(filtered), np.zeros_like(filtered)
    for g, load in machines:
        loop = gram(np.stack([one, filtered * g, q * filtered * g]))
        rows.append(MS**2 * loop - gram(np.stack([one, none, none])))
        rows.append(ML**2 * loop - gram(np.stack([none, filtered * load, q * filtered * load])))
        if controller_peak:
            rows.append(controller_peak**2 * loop - gram(np.stack([none, size, q * size])))
    rows = np.concatenate(rows, 2)
    limit = first_roots(rows[1, 1], rows[0, 1], rows[0, 0]).min()
    kp = limit * np.arange(1, 61)[:, None] / 60.0
    c = rows[0, 0] + kp * (2.0 * rows[0, 1] + kp * rows[1, 1])
    ki = np.where((c < 0.0).any(1), 0.0, first_roots(rows[2, 2], rows[0, 2] + kp * rows[1, 2], c).min(1))
    best = ki.argmax()
    return ki[best], kp[best, 0]


def exact_gains():
    return largest_ki([(G, GL)], np.ones_like(G), Q)[0]


LINES = 250.0 * 1e-4 ** (1.0 - np.arange(160) / 159.0)


def monte_carlo(controller=None):
    random = np.random.default_rng(1)
    if controller is None:
        controller = KP + KI * TS / (1.0 - np.exp(-2j * np.pi * LINES * TS))
    exceeding = 0
    for _ in range(20):  # in parts that a cache can take
        g, load = plant(V0 + STD * random.normal(size=(500, 5)), LINES)
        returned = np.abs(1.0 + controller * g)
        s = (1.0 / returned).max(1)
        t = (np.abs(controller * load) / returned).max(1)
        exceeding += int(((s > MS) | (t > ML)).sum())
    return exceeding


def biquad(x):
    """Numerator and denominator in z^-1 of a notch at x[0] Hz by the bilinear transform, prewarped."""
    w = np.tan(np.pi * x[0] * TS)
    b = np.array([1.0 + 2.0 * x[1] * w + w * w, 2.0 * (w * w - 1.0), 1.0 - 2.0 * x[1] * w + w * w])
    a = np.array([1.0 + 2.0 * x[2] * w + w * w, 2.0 * (w * w - 1.0), 1.0 - 2.0 * x[2] * w + w * w])
    return b / a[0], a / a[0]


def load_step_iae(kp, ki, b, a, samples=1000):
    """The load's velocity after a step of its torque on the nominal machine, two samples of delay; infinite where it does not settle."""
    j1, j2, k, d = np.exp(V0[:4])
    rates = np.array([[-d / j1, d / j1, -k / j1, 1.0 / j1, 0.0], [d / j2, -d / j2, k / j2, 0.0, -1.0 / j2], [1.0, -1.0, 0.0, 0.0, 0.0],
                      [0.0] * 5, [0.0] * 5])
    held = expm(rates * TS)[:3]
    n = 8  # speeds, twist; torque delayed by one and two samples; integral; both states of the biquad
    m = np.zeros((n, n))
    m[:3, :3] = held[:, :3]
    m[:3, 4] = held[:, 3]
    m[4, 3] = 1.0
    law = np.zeros(n)  # of the PI, then through the biquad (transposed direct form II)
    law[0], law[5] = -kp - ki * TS, 1.0
    m[5, 5], m[5, 0] = 1.0, -ki * TS
    m[3] = b[0] * law
    m[3, 6] += 1.0
    m[6] = b[1] * law - a[1] * m[3]
    m[6, 7] += 1.0
    m[7] = b[2] * law - a[2] * m[3]
    push = np.zeros(n)
    push[:3] = held[:, 4]
    x, sum_, last = np.zeros(n), 0.0, 0.0
    for i in range(samples):
        x = m @ x + push
        sum_ += TS * abs(x[1])
        if abs(x[1]) > 1e3:
            return np.inf
        if i >= samples - 50:
            last = max(last, abs(x[1]))
    return sum_ if last < 0.05 * sum_ / TS / samples + 1e-3 else np.inf


def robust_biquad():
    q = TS / (1.0 - np.exp(-2j * np.pi * LINES * TS))
    z = np.exp(-2j * np.pi * LINES * TS)
    controller_peak = 2.0 * 2.1  # of the best PI
    machines = [plant(V0, LINES)]
    random = np.random.default_rng(2)
    on_edge = random.normal(size=(2000, 5))
    on_edge *= 2.0 / np.linalg.norm(on_edge, axis=1)[:, None]
    edge = plant(V0 + STD * on_edge, LINES)

    def found(x):
        b, a = biquad(x)
        filtered = np.polyval(b[::-1], z) / np.polyval(a[::-1], z)
        ki, kp = largest_ki(machines, filtered, q, controller_peak)
        return ki, kp, b, a, filtered

    def cost(x):
        ki, kp, b, a, _ = found(x)
        return load_step_iae(kp, ki, b, a) if ki > 0.0 else 1e3

    for _ in range(3):
        best = differential_evolution(lambda x: min(cost(x), 1e3), [(5.0, 120.0), (0.05, 1.5), (0.05, 1.5)], popsize=8, maxiter=12, seed=3,
                                      polish=False, tol=0.0).x
        ki, kp, b, a, filtered = found(best)
        controller = (kp + ki * q) * filtered
        returned = np.abs(1.0 + controller * edge[0])
        beyond = np.maximum((1.0 / returned).max(1) / MS, (np.abs(controller * edge[1]) / returned).max(1) / ML)
        machines.append((edge[0][beyond.argmax()], edge[1][beyond.argmax()]))
    return load_step_iae(kp, ki, b, a), monte_carlo(controller)


def tune(program, folder):
    """A saved result, and how long its design takes, s."""
    run = lambda *words: subprocess.run([program, *words], check=True, capture_output=True, cwd=folder)
    if not os.path.exists(os.path.join(folder, "r.json")):
        run("simulate", "vi_prbs_a", "--out", "r.csv")
        run("identify", "r.csv", "--delay", "0.004", "--json", "r.json")
    begin = time.perf_counter()
    run("tune", "r.json", "--structure", "pi+biquads", "--report", "page.html")
    return time.perf_counter() - begin


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
    if len(sys.argv) > 2 and not sys.argv[2].startswith("--"):
        with tempfile.TemporaryDirectory() as folder:
            tune(os.path.abspath(sys.argv[2]), folder)
            own = statistics.median(tune(os.path.abspath(sys.argv[2]), folder) for _ in range(5))
        assert 0.04 < robust_biquad()[0] < 0.06
        theirs = seconds(robust_biquad)
        ratios["numpy / tune_one_biquad_with_report"] = theirs / own
        ratios["3 s / tune_one_biquad_with_report"] = 3.0 / own
        print(f"tune --structure pi+biquads --report: {own:.2f} s of wall time (median of 5), numpy and scipy {theirs:.1f} s, {theirs / own:.1f} times faster")
    if "--json" in sys.argv:
        with open(sys.argv[sys.argv.index("--json") + 1], "w", encoding="utf-8") as file:
            json.dump(ratios, file, indent=1)
    return 0


if __name__ == "__main__":
    sys.exit(main())
