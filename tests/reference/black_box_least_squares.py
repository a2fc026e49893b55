#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Output error of order three on tests/golden/f_prbs_sys2.csv by SciPy: BlackBox.MeetsScipyLeastSquares.

    /usr/bin/python3 tests/reference/black_box_least_squares.py
"""
import json
import pathlib

import numpy as np
from scipy.optimize import least_squares
from scipy.signal import lfilter

GOLDEN = pathlib.Path(__file__).resolve().parent.parent / "golden"
DELAY = 2


def main():
    with open(GOLDEN / "f_prbs_sys2.csv", encoding="utf-8") as file:
        names = file.readline().strip().split(",")
        rows = np.loadtxt(file, delimiter=",")
    u, y = rows[:, names.index("u_noisy")], rows[:, names.index("y_noisy")]

    def simulated(x):
        return np.r_[np.zeros(DELAY), lfilter(np.r_[0.0, x[:3]], np.r_[1.0, x[3:]], u)[:-DELAY]]

    def slopes(x):  # of y - yh: -F u and F yh with F = z^-i/A
        a, yh = np.r_[1.0, x[3:]], simulated(x)
        filtered = lfilter([1.0], a, np.r_[np.zeros(DELAY), u[:-DELAY]]), lfilter([1.0], a, yh)
        late = lambda v, i: np.r_[np.zeros(i), v[:-i]]
        return np.column_stack([-late(filtered[0], i) for i in (1, 2, 3)] + [late(filtered[1], i) for i in (1, 2, 3)])

    # the output before the delay has passed says nothing of the model
    fit = least_squares(lambda x: (y - simulated(x))[DELAY:], START, jac=lambda x: slopes(x)[DELAY:], method="lm", xtol=1e-15, ftol=1e-15,
                        gtol=1e-15, x_scale="jac", max_nfev=10000)
    print("b1 ... b3, a1 ... a3:", *(f"{x:.12g}" for x in fit.x))
    print(f"sum of squares: {2.0 * fit.cost:.9f}")


# near the drive's zero-order hold
START = np.array([0.06, -0.12, 0.06, -2.9282, 2.8917, -0.9635])

if __name__ == "__main__":
    main()
