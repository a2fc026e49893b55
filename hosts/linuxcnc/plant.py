# SPDX-License-Identifier: MIT
"""What resonid should find, computed from the parameters of two_mass.hal: sampled response of the drive, its
controller and the margins of their loop. Plain arithmetic, none of it from resonid."""
import cmath
import math


def matrix_product(a, b):
    return [[sum(x * b[l][j] for l, x in enumerate(row)) for j in range(len(b[0]))] for row in a]


def exponential(a):
    """exp(a) by halving, a series, and squaring."""
    n, halvings = len(a), 20
    scaled = [[x / 2**halvings for x in row] for row in a]
    identity = [[float(i == j) for j in range(n)] for i in range(n)]
    e, term = [row[:] for row in identity], [row[:] for row in identity]
    for k in range(1, 8):
        term = [[x / k for x in row] for row in matrix_product(term, scaled)]
        e = [[x + y for x, y in zip(*rows)] for rows in zip(e, term)]
    for _ in range(halvings):
        e = matrix_product(e, e)
    return e


def solve(a, b):
    """Gauss with pivoting, complex."""
    n = len(a)
    rows = [list(row) + [right] for row, right in zip(a, b)]
    for i in range(n):
        pivot = max(range(i, n), key=lambda r: abs(rows[r][i]))
        rows[i], rows[pivot] = rows[pivot], rows[i]
        for r in range(n):
            if r != i:
                factor = rows[r][i] / rows[i][i]
                rows[r] = [x - factor * y for x, y in zip(rows[r], rows[i])]
    return [rows[i][n] / rows[i][i] for i in range(n)]


class Drive:
    """Zero-order hold of position and velocity of both masses; the velocity that is shown is the difference of
    two positions of the motor."""

    def __init__(self, j1, j2, k, d, period_s, delay):
        self.resonance_hz = math.sqrt(k * (1 / j1 + 1 / j2)) / (2 * math.pi)
        self.antiresonance_hz = math.sqrt(k / j2) / (2 * math.pi)
        self.damping = 0.5 * d * math.sqrt((1 / j1 + 1 / j2) / k)
        self.period_s, self.delay = period_s, delay
        a = [[0, 1, 0, 0, 0], [-k / j1, -d / j1, k / j1, d / j1, 1 / j1], [0, 0, 0, 1, 0],
             [k / j2, d / j2, -k / j2, -d / j2, 0], [0, 0, 0, 0, 0]]
        e = exponential([[x * period_s for x in row] for row in a])
        self.phi, self.gamma = [row[:4] for row in e[:4]], [row[4] for row in e[:4]]

    def response(self, hz):
        z = cmath.exp(2j * math.pi * hz * self.period_s)
        position = solve([[(z if i == j else 0) - x for j, x in enumerate(row)] for i, row in enumerate(self.phi)],
                         self.gamma)[0]
        return position * (1 - 1 / z) / self.period_s / z**self.delay


def pid(p, i, period_s, hz):
    return p + i * period_s / (1 - cmath.exp(-2j * math.pi * hz * period_s))


def margins(drive, p, i, first_hz, last_hz, steps=4000):
    """Crossover, phase margins in degrees and modulus margin within a band, on a fine grid."""
    found, before = {"modulus": math.inf, "worst": math.inf}, None
    for n in range(steps + 1):
        hz = first_hz + (last_hz - first_hz) * n / steps
        loop = pid(p, i, drive.period_s, hz) * drive.response(hz)
        if abs(1 + loop) < found["modulus"]:
            found.update(modulus=abs(1 + loop), modulus_hz=hz)
        if before is not None and (abs(before) > 1) != (abs(loop) > 1):
            phase = 180 + math.degrees(cmath.phase(loop))
            margin = phase - 360 if phase > 180 else phase
            if abs(before) > 1 and "crossover_hz" not in found:
                found.update(crossover_hz=hz, phase=margin)
            if abs(margin) < abs(found["worst"]):
                found["worst"] = margin
        before = loop
    return found
