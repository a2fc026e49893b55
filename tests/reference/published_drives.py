#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Figures of the published drives (Nevaranta 2016, Publications IV and VI) that tests quote, by NumPy and SciPy alone.

    /usr/bin/python3 tests/reference/published_drives.py

prints what stands in tests/unit/reproduction/publication_iv_test.cpp (distances with D = 100), publication_vi_test.cpp (the
tensioner's response, two-mass fits to it), tests/unit/diagnostics/gap_test.cpp and tests/interface/truth_test.cpp (chain).
"""
import numpy as np
from scipy.linalg import eigh, expm
from scipy.optimize import least_squares, minimize_scalar

TS, RADIUS = 0.002, 0.05
CHAIN_TS = 1.0 / 1000.0  # experiments/chain_four_masses.toml


class Chain:
    """Masses between springs and dampers, driven and measured on the first; `between`: (i, j, stiffness, damping)."""

    def __init__(self, inertias, between, friction=0.0):
        n = len(inertias)
        self.mass, self.stiffness, damping = np.diag(inertias), np.zeros((n, n)), np.zeros((n, n))
        for i, j, k, d in between:
            pattern = np.zeros(n)
            pattern[i], pattern[j] = 1.0, -1.0
            self.stiffness += k * np.outer(pattern, pattern)
            damping += d * np.outer(pattern, pattern)
        damping[0, 0] += friction
        # a twist for each spring, no angles: a free drive has no stiffness against the ground
        n_springs = len(between)
        a = np.zeros((n + n_springs, n + n_springs))
        inverse = np.diag(1.0 / np.asarray(inertias))
        a[:n, :n] = -inverse @ damping
        for s, (i, j, k, _) in enumerate(between):
            a[i, n + s], a[j, n + s] = -k / inertias[i], k / inertias[j]
            a[n + s, i], a[n + s, j] = 1.0, -1.0
        self.a, self.b = a, np.zeros(n + n_springs)
        self.b[0] = 1.0 / inertias[0]

    def response(self, hz, ts=TS):
        """Velocity of the first mass to a torque held over each sample."""
        n = len(self.b)
        block = np.zeros((n + 1, n + 1))
        block[:n, :n], block[:n, n] = self.a, self.b
        held = expm(block * ts)
        out = []
        for f in np.atleast_1d(hz):
            z = np.exp(2j * np.pi * f * ts)
            out.append(np.linalg.solve(z * np.eye(n) - held[:n, :n], held[:n, n])[0])
        return np.array(out)

    def frequencies(self):
        """(anti-resonances, resonances), undamped"""
        free = np.sqrt(np.abs(eigh(self.stiffness, self.mass, eigvals_only=True)[1:])) / (2.0 * np.pi)
        locked = np.sqrt(eigh(self.stiffness[1:, 1:], self.mass[1:, 1:], eigvals_only=True)) / (2.0 * np.pi)
        return locked, free


def belt(stiffness, damping):
    return Chain([0.032, 0.032], [(0, 1, stiffness * RADIUS**2, damping * RADIUS**2)])


def distance(g, h):
    return np.abs(g - h) / np.sqrt((1.0 + np.abs(g)**2) * (1.0 + np.abs(h)**2))


def main():
    lines, other = np.arange(2.9, 24.0, 3.0), belt(3.10e4, 90.0)
    for damping in (100.0, 120.0):
        drive = belt(5.75e4, damping)
        far = lambda f: distance(drive.response(f), other.response(f))[0]
        best = minimize_scalar(lambda f: -far(f), bounds=(10.0, 13.0), method="bounded", options={"xatol": 1e-9})
        print(f"distances of plants, D = {damping:g}:", np.round(distance(drive.response(lines), other.response(lines)), 4),
              f"largest {-best.fun:.7f} at {best.x:.2f} Hz")

    square = RADIUS**2
    tensioner = Chain([0.032, 0.0012, 0.032], [(0, 1, 5.75e4 * square, 36.0 * square), (1, 2, 5.75e4 * square, 36.0 * square),
                                               (0, 2, 2.875e4 * square, 102.0 * square)])
    print("tensioner at 5, 15, 78 Hz:", *tensioner.response([5.0, 15.0, 78.0]))

    # of the tensioner's drive A: both rollers, and at rest 5.75e4 N/m and 120 Ns/m between them
    truth = np.array([0.032, 0.032, 5.75e4 * square, 120.0 * square])
    for top in (25.0, 40.0, 100.0):
        hz = np.arange(2.0, top + 0.01, 0.25)
        exact = tensioner.response(hz)

        def error(logarithms):
            j1, j2, k, d = truth * np.exp(logarithms)
            e = Chain([j1, j2], [(0, 1, k, d)]).response(hz) - exact
            return np.concatenate([e.real, e.imag])
        fit = least_squares(error, np.zeros(4), xtol=1e-14, ftol=1e-14, gtol=1e-14)
        print(f"two masses, 2 ... {top:g} Hz, J1, J2, K, D off by (%):", 100.0 * (np.exp(fit.x) - 1.0))

    chain = Chain([0.012, 0.004, 0.006, 0.025], [(0, 1, 900.0, 0.08), (1, 2, 600.0, 0.06), (2, 3, 700.0, 0.07)], friction=0.01)
    print("chain of four masses:", *chain.frequencies())
    print("chain at 5, 26, 65, 110, 300 Hz:", *chain.response([5.0, 26.0, 65.0, 110.0, 300.0], CHAIN_TS))


if __name__ == "__main__":
    main()
