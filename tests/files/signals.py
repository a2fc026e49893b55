# SPDX-License-Identifier: MIT
"""The signals that the files hold: a known two-inertia drive under a PI speed controller, simulated exactly.

Nothing here calls resonid: what is true follows from the figures below alone.

    J1 w1' = u - K (a1 - a2) - D (w1 - w2),   J2 w2' = K (a1 - a2) + D (w1 - w2)

The torque is constant between samples, so one matrix exponential moves the drive exactly from sample to sample. The measured
velocity is late by whole samples; u = C (r - y) + ru with C(z) = KP (1 + Ts/TI z/(z-1)).
"""
import functools
import math
import types

import numpy as np

RATE_HZ = 500.0
STEP_S = 1.0 / RATE_HZ
DELAY_SAMPLES = 2
NOISE_RMS = 0.02  # rad/s
VELOCITY = 10.0  # rad/s, the drive turns
KP, TI_S = 1.036, 0.147
RADIUS_M = 0.05  # of the pulley, for the files of a linear motion

DRIVE = types.SimpleNamespace(motor_inertia=0.032, load_inertia=0.032, stiffness=143.75, damping=0.30)
CHIRP_HZ = (35.0, 1.5)
CHIRP_S = 12.0
PERIOD_SAMPLES = 1000  # of the multisine


def truth(motion="rotary"):
    """What a right answer says: undamped frequencies in Hz, inertias in kg m2 (or kg), stiffness and damping."""
    j1, j2, k, d = DRIVE.motor_inertia, DRIVE.load_inertia, DRIVE.stiffness, DRIVE.damping
    scale = 1.0 if motion == "rotary" else 1.0 / RADIUS_M**2
    return {
        "resonance": math.sqrt(k * (j1 + j2) / (j1 * j2)) / (2.0 * math.pi),
        "antiresonance": math.sqrt(k / j2) / (2.0 * math.pi),
        "driven_inertia": j1 * scale,
        "load_inertia": j2 * scale,
        "stiffness": k * scale,
        "damping": d * scale,
    }


def exponential(matrix):
    """exp of a small matrix: Taylor series of the matrix halved until it is small, squared back."""
    halvings = max(0, int(math.ceil(math.log2(max(np.abs(matrix).sum(axis=1).max(), 1e-300)))) + 4)
    small, term, total = matrix / 2.0**halvings, np.eye(len(matrix)), np.eye(len(matrix))
    for k in range(1, 20):
        term = term @ small / k
        total = total + term
    for _ in range(halvings):
        total = total @ total
    return total


@functools.lru_cache(maxsize=None)
def discrete():
    """(A, B) of the states w1, w2, a1, a2 over one sample of constant torque."""
    j1, j2, k, d = DRIVE.motor_inertia, DRIVE.load_inertia, DRIVE.stiffness, DRIVE.damping
    a = np.zeros((5, 5))
    a[0, :] = [-d / j1, d / j1, -k / j1, k / j1, 1.0 / j1]
    a[1, :4] = [d / j2, -d / j2, k / j2, -k / j2]
    a[2, 0] = a[3, 1] = 1.0
    e = exponential(a * STEP_S)
    return e[:4, :4], e[:4, 4]


def chirp(samples, lead, first_hz=CHIRP_HZ[0], last_hz=CHIRP_HZ[1], seconds=CHIRP_S, amplitude=1.0):
    """A linear sweep that begins after `lead` samples."""
    t = (np.arange(samples) - lead) * STEP_S
    phase = 2.0 * math.pi * (first_hz * t + 0.5 * (last_hz - first_hz) * t**2 / seconds)
    return np.where((t >= 0.0) & (t < seconds), amplitude * np.sin(phase), 0.0)


def multisine(periods, rms=0.7):
    """Random phases at every multiple of 0.5 Hz from 1.5 to 35 Hz, `periods` times."""
    rng = np.random.default_rng(7)
    n = np.arange(PERIOD_SAMPLES)
    lines = np.arange(3, 71)
    one = np.cos(2.0 * math.pi * np.outer(n, lines) / PERIOD_SAMPLES + rng.uniform(0, 2 * math.pi, len(lines))).sum(axis=1)
    return np.tile(one * rms / one.std(), periods)


def run(excitation, seed, noise=NOISE_RMS, torque_limit=None, velocity=VELOCITY):
    """Every signal of one run, as arrays of one length.

    u is the torque that acts; demanded what the controller asked for, which is another only where a limit bites."""
    a, b = discrete()
    rng = np.random.default_rng(seed)
    w = noise * rng.standard_normal(len(excitation))
    x = np.array([velocity, velocity, 0.0, 0.0])
    late = [velocity] * DELAY_SAMPLES  # measured, not yet arrived
    late_angle = [-velocity * STEP_S * (DELAY_SAMPLES - k) for k in range(DELAY_SAMPLES)]
    integral = 0.0
    rows = np.empty((len(excitation), 6))
    for n, ru in enumerate(excitation):
        late.append(x[0])
        late_angle.append(x[2])
        y, angle = late.pop(0) + w[n], late_angle.pop(0)
        error = velocity - y
        integral += STEP_S / TI_S * error
        demanded = KP * (error + integral) + ru
        u = demanded if torque_limit is None else min(max(demanded, -torque_limit), torque_limit)
        rows[n] = ru, u, y, angle, x[1], demanded
        x = a @ x + b * u
    names = ("ru", "u", "y", "angle", "load_velocity", "demanded")
    signals = types.SimpleNamespace(**dict(zip(names, rows.T)))
    signals.t = np.arange(len(excitation)) * STEP_S
    signals.r = np.full(len(excitation), velocity)
    return signals


@functools.lru_cache(maxsize=None)
def swept(seed=1, rest_s=0.0, amplitude=1.0, **options):
    """A sweep, with some rest before and after it."""
    rest = int(round(rest_s * RATE_HZ))
    return run(chirp(int(round(CHIRP_S * RATE_HZ)) + 2 * rest, rest, amplitude=amplitude), seed, **options)


@functools.lru_cache(maxsize=None)
def periodic(periods=6, seed=2, **options):
    return run(multisine(periods), seed, **options)


@functools.lru_cache(maxsize=None)
def quiet(seed=3):
    """The controller only keeps the velocity: nothing is injected."""
    return run(np.zeros(3000), seed)
