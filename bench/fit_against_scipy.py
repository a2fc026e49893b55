#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Runs fits by resonid and the same work by scipy and numpy in turns and prints the ratios of the medians.

    cmake --preset release && cmake --build --preset release --target bench_fit
    bench/fit_against_scipy.py build/release/bench/bench_fit

Welch: response and coherence of 2e6 samples, half-overlapping Hann segments of 4096. Output error: order 3, 10 000 samples, scipy's least_squares (lm) with analytic Jacobian by lfilter, from the same
start. Sanathanan-Koerner: 100 points, order 3, 10 iterations, numpy's lstsq on the same rows. --json FILE writes the
ratios; what each is to be stands in bench/floors.json.
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
from scipy.optimize import least_squares
from scipy.signal import csd, lfilter, welch


def denominator(radius, angle, pole):
    return np.convolve([1.0, -2.0 * radius * np.cos(angle), radius * radius], [1.0, -pole])


NUMERATOR = np.array([0.06, -0.11, 0.056])
TRUTH = denominator(0.985, 0.19, 0.995)
START = np.r_[NUMERATOR, denominator(0.975, 0.2, 0.98)[1:]]
random = np.random.default_rng(1)
U = np.sign(random.normal(size=10000))
Y = lfilter(np.r_[0.0, NUMERATOR], TRUTH, U) + 0.1 * random.normal(size=10000)


def residual(x):
    return Y - lfilter(np.r_[0.0, x[:3]], np.r_[1.0, x[3:]], U)


def jacobian(x):
    a = np.r_[1.0, x[3:]]
    u = lfilter([1.0], a, U)
    y = lfilter(np.r_[0.0, x[:3]], a, u)
    rows = np.zeros((len(U), 6))
    for i in range(3):
        rows[i + 1:, i] = -u[:len(U) - i - 1]
        rows[i + 1:, 3 + i] = y[:len(U) - i - 1]
    return rows


def output_error():
    fit = least_squares(residual, START, jac=jacobian, method="lm")
    assert np.abs(fit.x[3:] - TRUTH[1:]).max() < 1e-2, fit.x


def sanathanan_koerner():
    f = np.arange(1.0, 101.0)
    z = np.exp(-2j * np.pi * f * 0.002)
    powers = np.stack([z, z**2, z**3], 1)
    g = (powers @ NUMERATOR) / (1.0 + powers @ TRUTH[1:]) * (1.0 + 0.01 * np.sin(f))
    weight = np.ones(len(f))
    for _ in range(10):
        rows = np.hstack([powers, -powers * g[:, None]]) * weight[:, None]
        right = g * weight
        x = np.linalg.lstsq(np.vstack([rows.real, rows.imag]), np.r_[right.real, right.imag], rcond=None)[0]
        weight = 1.0 / np.abs(1.0 + powers @ x[3:])


LONG_U = random.normal(size=2000000)
LONG_Y = lfilter([0.1], [1.0, -0.95], LONG_U) + 0.1 * random.normal(size=2000000)


def averaged_spectra():
    uu = welch(LONG_U, nperseg=4096)[1]
    yy = welch(LONG_Y, nperseg=4096)[1]
    uy = csd(LONG_U, LONG_Y, nperseg=4096)[1]
    assert np.isfinite(uy / uu).all() and (np.abs(uy) ** 2 / (uu * yy))[50] > 0.5


def seconds(work):
    begin = time.process_time()
    work()
    return time.process_time() - begin


def ours(program):
    run = subprocess.run([program, "--benchmark_format=json", "--benchmark_min_time=0.1"], check=True,
                         capture_output=True, text=True)
    return {b["name"]: b["cpu_time"] * 1e-6 for b in json.loads(run.stdout)["benchmarks"]}


def main():
    rounds = [(ours(sys.argv[1]), seconds(output_error), seconds(sanathanan_koerner), seconds(averaged_spectra))
              for _ in range(7)]
    peer = {"output_error_from_start": statistics.median(r[1] for r in rounds),
            "output_error_from_scratch": statistics.median(r[1] for r in rounds),
            "welch_two_million_samples": statistics.median(r[3] for r in rounds),
            "sanathanan_koerner_100_points": statistics.median(r[2] for r in rounds)}
    ratios = {}
    for name, theirs in peer.items():
        own = statistics.median(r[0][name] for r in rounds)
        ratios[f"scipy or numpy / {name}"] = theirs / own
        print(f"{name}: resonid {own * 1e3:.3f} ms, scipy/numpy {theirs * 1e3:.3f} ms, {theirs / own:.1f} times faster "
              f"(medians of {len(rounds)})")
    if "--json" in sys.argv:
        with open(sys.argv[sys.argv.index("--json") + 1], "w", encoding="utf-8") as file:
            json.dump(ratios, file, indent=1)
    return 0


if __name__ == "__main__":
    sys.exit(main())
