# SPDX-License-Identifier: MIT
"""The observer form that Nevaranta 2016, section 5.1, suggests, against the chirp tracker, on Publication VI's
record: one filter whose states are the input's phasor and the transfer function together.

    u = Re(U e^{j phase})        y = Re(Y e^{j phase})        Y = G U - (j/w') (G' U' + G'' U/2)

in time derivatives (docs/methods/swept_response.md), w' the sweep's rate: so the filter takes out to first order what the sweep
does to Y/U. U is a random walk with rate, G one with rate and curvature; extended Kalman filter; the process
noise of G is scheduled with |G|, and the response is read `lag` samples back. Compared too: a sweep whose
amplitude is designed for an even relative error, ru(f) ~ 1/sqrt(|Gcl|) at equal rms.

Run: /usr/bin/python3 bench/observer_form.py [SEEDS [2|3]], the system. Numbers of docs/decisions/0007-observer-form.md.
"""

import sys

import numpy as np
from scipy.linalg import expm

TS, NOISE, DELAY = 0.002, 0.1, 2
KP, TI = 1.03598193204, 0.147023908851
F0, F1, DURATION = 35.0, 1.5, 17.0
N = int(round(DURATION / TS))
T = np.arange(N) * TS
RATE = (F1 - F0) / DURATION
FREQUENCY = F0 + RATE * T
PHASE = 2 * np.pi * (F0 * T + RATE * T * T / 2)
SWEEP = 2 * np.pi * RATE * TS * TS  # rad per sample^2


def plant(driven, load, stiffness, damping):
    """Driven and measured on one side, zero-order hold: states W1, W2, twist."""
    k, d = stiffness * 0.0025, damping * 0.0025
    a = np.array([[-d / driven, d / driven, -k / driven], [d / load, -d / load, k / load], [1.0, -1.0, 0.0]])
    whole = expm(np.block([[a, np.array([[1 / driven], [0], [0]])], [np.zeros((1, 4))]]) * TS)
    return whole[:3, :3], whole[:3, 3]


SYSTEMS = {2: (0.032, 0.032, 5.75e4, 120.0), 3: (0.032, 0.018, 7.0e4, 100.0)}
SYSTEM = int(sys.argv[2]) if len(sys.argv) > 2 else 2
A, B = plant(*SYSTEMS[SYSTEM])


def response(f):
    z = np.exp(2j * np.pi * np.asarray(f) * TS)
    return np.array([np.linalg.solve(x * np.eye(3) - A, B)[0] for x in np.atleast_1d(z)])


def loop(ru, noise):
    x, integral, past = np.zeros(3), 0.0, [0.0] * DELAY
    u, y = np.empty(len(ru)), np.empty(len(ru))
    for k in range(len(ru)):
        y[k] = past.pop(0) + noise[k]
        integral += y[k] * TS / TI
        u[k] = ru[k] - KP * (y[k] + integral)
        past.append(x[0])
        x = A @ x + B * u[k]
    return u, y


def closed(f):
    z = np.exp(2j * np.pi * f * TS)
    g = response(f) * z ** (-DELAY)
    return g / (1 + KP * (1 + TS / TI * z / (z - 1)) * g)


def tracker(signal, gain_of):
    """Chirp-synchronised Kalman filter: filtered phasor against the chirp's phase."""
    p, out = 0j, np.empty(N, complex)
    for k in range(N):
        turn = np.exp(1j * PHASE[k])
        p += gain_of * np.conj(turn) * (signal[k] - (p * turn).real)
        out[k] = p
    return out


def chirp_tracker(u, y, gain, lag):
    g = tracker(y, gain) / tracker(u, gain)
    g = g * np.exp(2j * np.pi * FREQUENCY * DELAY * TS)
    return FREQUENCY[: N - lag], g[lag:]


def observer(u, y, q_u, q_g, scheduled, lag):
    """Phi of (U, U') and (G, G', G''), each complex; rates per sample."""
    blocks = np.zeros((5, 5))
    blocks[:2, :2] = [[1, 1], [0, 1]]
    blocks[2:, 2:] = [[1, 1, 0.5], [0, 1, 1], [0, 0, 1]]
    phi = np.kron(blocks, np.eye(2))
    x = np.zeros(10)
    x[0], x[4] = 1.0, 0.1
    p = np.diag([0.1, 0.1, 1e-6, 1e-6, 0.05, 0.05, 1e-7, 1e-7, 1e-12, 1e-12])
    # The controller feeds the noise of y back into u; taken as independent, since with the true correlation
    # the filter trusts its linearisation too much and diverges.
    r = NOISE**2 * np.diag([KP * KP, 1.0])
    estimate = np.full(N, np.nan, complex)
    for k in range(N):
        turn = np.exp(1j * PHASE[k])
        U, dU, G, dG, ddG = (x[2 * i] + 1j * x[2 * i + 1] for i in range(5))
        c = -1j / SWEEP
        Y = G * U + c * (dG * dU + 0.5 * ddG * U)
        slope = [G + 0.5 * c * ddG, c * dG, U, c * dU, 0.5 * c * U]
        h = np.zeros((2, 10))
        h[0, 0], h[0, 1] = turn.real, -turn.imag
        for i, s in enumerate(slope):
            h[1, 2 * i], h[1, 2 * i + 1] = (s * turn).real, -(s * turn).imag
        e = np.array([u[k] - (U * turn).real, y[k] - (Y * turn).real])
        s = h @ p @ h.T + r
        gain = np.linalg.solve(s, h @ p).T
        x = x + gain @ e
        p = p - gain @ h @ p
        G, dG, ddG = (x[2 * i] + 1j * x[2 * i + 1] for i in (2, 3, 4))
        estimate[k] = G - lag * dG + 0.5 * lag * lag * ddG
        x = phi @ x
        p = phi @ p @ phi.T
        noise_g = q_g * (abs(G) if scheduled else 1.0)
        p[2, 2] += q_u**2
        p[3, 3] += q_u**2
        p[8, 8] += noise_g**2
        p[9, 9] += noise_g**2
        p = 0.5 * (p + p.T)
    f = FREQUENCY[: N - lag]
    return f, estimate[lag:] * np.exp(2j * np.pi * f * DELAY * TS)


GRID = np.arange(5.0, 33.01, 0.05)
TRUTH = response(GRID)


def errors(f, g):
    at = np.interp(GRID, f[::-1], g.real[::-1]) + 1j * np.interp(GRID, f[::-1], g.imag[::-1])
    ratio = at / TRUTH
    return (
        np.max(np.abs(20 * np.log10(np.abs(ratio)))),
        np.max(np.abs(np.degrees(np.angle(ratio)))),
        np.sqrt(np.mean(np.abs(ratio - 1) ** 2)),
    )


def main():
    seeds = int(sys.argv[1]) if len(sys.argv) > 1 else 20
    even = np.ones(N)
    design = 1 / np.sqrt(np.abs(closed(FREQUENCY)))
    design *= 1 / np.sqrt(np.mean(design**2))
    methods = {
        "chirp tracker, lambda 8 (published)": lambda u, y: chirp_tracker(u, y, 1 / 9.0, 0),
        "the same, lag of 17 samples taken out": lambda u, y: chirp_tracker(u, y, 1 / 9.0, 17),
    }
    for gain, lag in ((0.04, 49), (0.02, 99), (0.01, 199)):
        label = f"chirp tracker, gain {gain}, lag of {lag} taken out"
        methods[label] = lambda u, y, g=gain, l=lag: chirp_tracker(u, y, g, l)
    for scheduled, drift, lag in ((False, 2e-7, 200), (True, 2e-7, 200), (True, 4e-7, 100), (True, 4e-7, 200)):
        label = f"observer form, drift {drift:g}{' |G|' if scheduled else ''}, lag of {lag}"
        methods[label] = lambda u, y, q=drift, l=lag, s=scheduled: observer(u, y, 5e-6, q, s, l)
    for name, amplitude in (("even amplitude", even), ("designed amplitude", design)):
        ru = amplitude * np.cos(PHASE)
        print(name, "largest", np.max(amplitude), flush=True)
        clean = loop(ru, np.zeros(N))
        noisy = [loop(ru, NOISE * np.random.default_rng(s).standard_normal(N)) for s in range(101, 101 + seeds)]
        for label, method in methods.items():
            exact = errors(*method(*clean))
            rms = [errors(*method(*r))[2] for r in noisy]
            print(
                f"  {label:52s} noise-free {exact[0]:6.3f} dB {exact[1]:6.2f} deg rms {exact[2]:.4f}"
                f"   noisy rms {np.mean(rms):.4f}",
                flush=True,
            )


if __name__ == "__main__":
    main()
