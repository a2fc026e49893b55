# SPDX-License-Identifier: MIT
"""The numbers in full_kalman_bank_test.cpp: filtered covariance and predictor gain of the steady state, by
scipy.linalg.solve_discrete_are. Run: /usr/bin/python3 full_kalman_bank_reference.py"""

import numpy as np
from scipy.linalg import block_diag, solve_discrete_are

np.set_printoptions(precision=12)
SAMPLE_TIME, NOISE = 0.002, 0.1
LINES, DRIFT, OFFSET_DRIFT = [2.9, 11.9, 14.9], [0.05, 0.2, 0.4], 0.3

turns = []
for f in LINES:
    angle = 2 * np.pi * f * SAMPLE_TIME
    turns.append(np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]))
phi = block_diag(*turns, 1.0)
h = np.array([[1.0, 0.0] * len(LINES) + [1.0]])
q = np.diag([0.5 * d * d * SAMPLE_TIME for d in DRIFT for _ in range(2)] + [OFFSET_DRIFT**2 * SAMPLE_TIME])
r = np.array([[NOISE**2]])
predicted = solve_discrete_are(phi.T, h.T, q, r)
s = (h @ predicted @ h.T + r)[0, 0]
gain = predicted @ h.T / s
filtered = predicted - gain @ gain.T * s
print("predictor gain", (phi @ gain).ravel())
for line in range(len(LINES)):
    block = filtered[2 * line : 2 * line + 2, 2 * line : 2 * line + 2]
    print("filtered covariance of line", line, repr(block.ravel()))
