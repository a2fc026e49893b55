# SPDX-License-Identifier: MIT
"""Factors from SI units to those of the files, and the two figures of a drive that some of them need."""
import math

RPM = 60.0 / (2.0 * math.pi)
DEG = 180.0 / math.pi
TURN = 1.0 / (2.0 * math.pi)
TORQUE_CONSTANT = 0.5  # Nm/A, of every file that holds a current
RATED_TORQUE = 5.0  # Nm, of every file that holds a share of the rated torque
FILETIME = 133_535_826_000_000_000  # some moment in 2024, in 100 ns since 1601
