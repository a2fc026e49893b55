#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Numbers of loop_errors_test.cpp, without the library: margins by bisection and golden section on a loop in
plain complex arithmetic, their derivatives by central differences of the margins themselves."""
import cmath
import math

FS, DELAY = 500.0, 0.002
J1, J2, K, D, B = 0.0028, 0.0027, 415.0, 0.075, 0.02
GAIN, INTEGRAL, POSITION = 0.12, 0.2, 5.0  # a cascade's law from velocity to -u
# ln J1, ln J2, ln K, ln D, B
PHYSICAL = [[4e-4, 1e-4, 0, 0, 0], [1e-4, 9e-4, 2e-4, 0, 0], [0, 2e-4, 4e-4, 0, 0], [0, 0, 0, 4e-2, 0],
            [0, 0, 0, 0, 1e-4]]
V = [0.01, -0.02, 0.015, 0.004, -0.006, 0.003]
W = [0.02, 0.01, -0.01, -0.002, 0.003, 0.001]
# of b_1 ... a_3
DISCRETE = [[(1e-4 if i < 3 else 1e-6) * (i == j) + 0.2 * V[i] * V[j] + 0.1 * W[i] * W[j] for j in range(6)]
            for i in range(6)]


def times(a, b):
    return [[sum(a[i][k] * b[k][j] for k in range(len(b))) for j in range(len(b[0]))] for i in range(len(a))]


def exponential(m):
    n = len(m)
    scaled = [[x / 2.0**12 for x in row] for row in m]
    e = [[float(i == j) for j in range(n)] for i in range(n)]
    term = [row[:] for row in e]
    for k in range(1, 20):
        term = [[x / k for x in row] for row in times(term, scaled)]
        e = [[e[i][j] + term[i][j] for j in range(n)] for i in range(n)]
    for _ in range(12):
        e = times(e, e)
    return e


def sampled(p):
    """b, a of the zero-order hold from torque to driven velocity (Faddeev and Leverrier)."""
    j1, j2, k, d = (math.exp(x) for x in p[:4])
    c = [[-(d + p[4]) / j1, d / j1, -k / j1, 1 / j1], [d / j2, -d / j2, k / j2, 0], [1, -1, 0, 0], [0, 0, 0, 0]]
    e = exponential([[x / FS for x in row] for row in c])
    a, b = [row[:3] for row in e[:3]], [[row[3]] for row in e[:3]]
    adjoint = [[float(i == j) for j in range(3)] for i in range(3)]
    num, den = [], []
    for i in range(3):
        num.append(times(adjoint, b)[0][0])
        m = times(a, adjoint)
        den.append(-sum(m[j][j] for j in range(3)) / (i + 1))
        adjoint = [[m[r][s] + den[-1] * (r == s) for s in range(3)] for r in range(3)]
    return num + den


def plant(t, f):
    z = cmath.exp(-2j * math.pi * f / FS)
    return (t[0] * z + t[1] * z**2 + t[2] * z**3) / (1 + t[3] * z + t[4] * z**2 + t[5] * z**3)


def controller(f):
    z = cmath.exp(-2j * math.pi * f / FS)
    proportional, outer = GAIN * (1 + 1 / FS / INTEGRAL), 1 + POSITION / FS
    return (proportional * outer - (proportional + GAIN * outer) * z + GAIN * z * z) / (1 - z)**2


def loop(t, f):
    return plant(t, f) * controller(f) * cmath.exp(-2j * math.pi * f * DELAY)


def figures(t):
    """Crossover, phase margin, modulus margin, where that is."""
    grid = [0.5 * (249.0 / 0.5)**(i / 1999.0) for i in range(2000)]
    gain = [abs(loop(t, f)) for f in grid]
    i = next(i for i in range(1999) if gain[i] >= 1 > gain[i + 1])
    low, high = grid[i], grid[i + 1]
    for _ in range(80):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if abs(loop(t, middle)) >= 1 else (low, middle)
    margin = 180 + math.degrees(cmath.phase(loop(t, low)))
    distance = [abs(1 + loop(t, f)) for f in grid]
    j = distance.index(min(distance))
    a, b, golden = grid[j - 1], grid[j + 1], (math.sqrt(5) - 1) / 2
    for _ in range(80):
        x, y = b - golden * (b - a), a + golden * (b - a)
        a, b = (a, y) if abs(1 + loop(t, x)) < abs(1 + loop(t, y)) else (x, b)
    return [low, margin, abs(1 + loop(t, a)), a]


def stds(make, p, covariance, step):
    slopes = []
    for i in range(len(p)):
        up, down = list(p), list(p)
        up[i] += step[i]
        down[i] -= step[i]
        slopes.append([(x - y) / (2 * step[i]) for x, y in zip(figures(make(up)), figures(make(down)))])
    n = range(len(p))
    return [math.sqrt(sum(slopes[i][k] * covariance[i][j] * slopes[j][k] for i in n for j in n)) for k in range(3)]


p = [math.log(J1), math.log(J2), math.log(K), math.log(D), B]
t = sampled(p)
print("b, a", [float(f"{x:.15g}") for x in t])
print("figures", figures(t))
print("stds by physical parameters", stds(sampled, p, PHYSICAL, [1e-5] * 4 + [1e-6]))
print("stds by b, a", stds(lambda x: x, t, DISCRETE, [1e-5] * 3 + [1e-6] * 3))
g = plant(t, 40.0)
print("G(40 Hz)", g)
for i, h in enumerate([1e-5] * 4 + [1e-6]):
    up, down = list(p), list(p)
    up[i] += h
    down[i] -= h
    print("relative slope", i, (plant(sampled(up), 40.0) - plant(sampled(down), 40.0)) / (2 * h) / g)
