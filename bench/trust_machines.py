# SPDX-License-Identifier: MIT
"""Experiments on machines of any size for trust.py: an experiment's tables from a few figures, chosen or drawn at random.

Everything scales with the machine: band and length with its resonance, controller with its inertia, noise with the velocity that the
excitation causes, friction with the torque, motion with that velocity, so that another size or rate is another machine, not another kind.
"""
import copy
import math

import numpy as np


class Machine:
    """A two-mass drive (rigid: no resonance) by what is drawn: resonance, inertia ratio, inertia of the whole, damping ratio."""

    def __init__(self, resonance_hz, ratio, inertia, rate, damping_ratio=0.04, linear=False, rigid=False):
        self.resonance_hz, self.ratio, self.inertia, self.rate = resonance_hz, ratio, inertia, rate
        self.damping_ratio, self.linear, self.rigid = damping_ratio, linear, rigid
        self.driven, self.load = inertia / (1.0 + ratio), inertia * ratio / (1.0 + ratio)
        self.antiresonance_hz = resonance_hz / math.sqrt(1.0 + ratio)
        reduced, w = self.driven * self.load / inertia, 2.0 * math.pi * resonance_hz
        self.stiffness, self.damping = w * w * reduced, 2.0 * damping_ratio * w * reduced
        self.band = (self.antiresonance_hz / 6.0, min(2.5 * resonance_hz, 0.4 * rate))

    def drive(self):
        table = {"structure": "rigid", "driven_inertia": self.inertia} if self.rigid else {
            "driven_inertia": self.driven, "load_inertia": self.load, "stiffness": self.stiffness, "damping": self.damping}
        return {**table, "motion": "linear"} if self.linear else table

    def velocity_rms(self, torque_rms, band):
        """What torque of this size, spread evenly over the band, causes."""
        s = 2j * math.pi * np.linspace(*band, 2000)
        coupling = self.damping * s + self.stiffness
        response = 1.0 / (s * self.inertia) if self.rigid else \
            (self.load * s**2 + coupling) / (s * (self.driven * self.load * s**2 + self.inertia * coupling))
        return torque_rms * math.sqrt(np.mean(np.abs(response)**2))


def random_machine(g, linear=None):
    """g: random.Random. Ratio 0.2 ... 20, 1 ... 300 Hz, 200 Hz ... 8 kHz, damping ratio 0.01 ... 0.08."""
    log_uniform = lambda a, b: math.exp(g.uniform(math.log(a), math.log(b)))
    rate = g.choice((200.0, 500.0, 1000.0, 2000.0, 4000.0, 8000.0))
    resonance = log_uniform(max(1.0, rate / 200.0), rate / 9.0)
    is_linear = g.random() < 0.25 if linear is None else linear
    return Machine(resonance, log_uniform(0.2, 20.0), log_uniform(2.0, 300.0) if is_linear else log_uniform(3e-4, 3.0), rate,
                   log_uniform(0.01, 0.08), is_linear)


def excite(m, kind, seconds, torque):
    """(table of the excitation, rms of its torque, its band, length of the record)"""
    low, high = m.band
    if kind in ("chirp", "log-chirp"):
        # as many sweeps as leave 30 turns of the lowest frequency each
        sweeps = max(1, min(4, int(seconds * low / 30.0)))
        table = {"kind": "chirp", "amplitude": torque, "from_hz": low, "to_hz": high, "duration_s": seconds / sweeps, "repeat": sweeps > 1}
        if kind == "log-chirp":
            table["sweep"] = "logarithmic"
        return table, torque / math.sqrt(2.0), m.band, seconds
    if kind in ("multisine", "one-multisine"):  # four periods and more, or one as long as the record
        period = int((seconds if kind == "one-multisine" else min(seconds / 4.0, 150.0 / high)) * m.rate)
        lines = [k * m.rate / period for k in range(max(1, round(low * period / m.rate)), int(high * period / m.rate) + 1)]
        return {"kind": "multisine", "amplitude": torque / math.sqrt(len(lines) / 2.0), "lines_hz": lines}, torque, m.band, seconds
    if kind in ("prbs", "long-prbs"):
        hold = max(1, int(m.rate / (5.0 * m.resonance_hz)))
        bits = 16 if kind == "long-prbs" else max(6, int(math.log2(seconds * m.rate / hold / 3.0)))
        return {"kind": "prbs", "amplitude": torque, "register_length": min(bits, 20), "clock_divider": hold}, torque, \
            (low, 0.44 * m.rate / hold), seconds
    if kind == "stepped-sine":
        lines, settle, measure = 24, 5, 10
        def at(n):
            return [float(f) for f in np.geomspace(m.antiresonance_hz / 2.5, min(2.0 * m.resonance_hz, 0.4 * m.rate), n)]
        if m.rate * sum((settle + measure) / f for f in at(lines)) > 50000.0:
            settle, measure = 3, 5
        while lines > 10 and m.rate * sum((settle + measure) / f for f in at(lines)) > 50000.0:
            lines -= 1
        table = {"kind": "stepped-sine", "amplitude": torque, "lines_hz": at(lines), "settle_periods": settle, "measure_periods": measure}
        return table, torque / math.sqrt(2.0), (at(lines)[0], at(lines)[-1]), sum((settle + measure) / f for f in at(lines))
    raise ValueError(kind)


def experiment(m, kind, seconds=None, *, torque=1.0, noise=0.02, closed=True, moving=True, delay_samples=1.0, bandwidth=0.25):
    """Tables of an experiment. noise: part of the velocity that the excitation causes; bandwidth: the loop's, part of the anti-resonance."""
    seconds = seconds or min(60.0, max(0.5, 250.0 / m.antiresonance_hz))
    seconds = min(seconds, 40000.0 / m.rate)
    table, rms, band, seconds = excite(m, kind, seconds, torque)
    velocity = m.velocity_rms(rms, band)
    config = {"drive": m.drive(), "excitation": table,
              "measurement": {"delay_s": delay_samples / m.rate, "noise_rms": noise * velocity},
              "run": {"sample_rate_hz": m.rate}}
    config["sizes"] = {"torque": rms, "velocity": velocity, "seconds": seconds}  # of what is laid over it; not a table of the file
    if kind != "stepped-sine":
        config["run"]["duration_s"] = seconds
    if closed:
        w = 2.0 * math.pi * min(bandwidth * m.antiresonance_hz, m.rate / 60.0)
        config["controller"] = {"kind": "pi", "gain": m.inertia * w, "integral_time_s": 6.0 / w}
        if moving:
            config["motion"] = {"kind": "constant", "velocity": 6.0 * velocity}
    return config


def positioning(m, seconds=None, *, profile="trapezoidal", torque=1.0, coulomb=0.1, noise=0.002, excited=0.0, bandwidth=0.3, counts=0,
                jerk_time=0.3, accelerate_turns=2.0):
    """To and fro in a position cascade; nothing injected unless `excited` (part of the torque)."""
    w = 2.0 * math.pi * min(bandwidth * m.antiresonance_hz, m.rate / 60.0)
    acceleration, ramp = torque / m.inertia, accelerate_turns / m.antiresonance_hz
    velocity, pause = acceleration * ramp, 0.5 * ramp
    seconds = seconds or min(40000.0 / m.rate, 12.0 * 2.0 * (3.0 * ramp + pause))
    motion = {"kind": profile, "velocity": velocity, "acceleration": acceleration, "from": 0.0, "to": 2.0 * velocity * ramp,
              "wait_s": pause, "dwell_s": pause, "returns": True}
    if profile == "s-curve":
        motion["jerk"] = acceleration / (jerk_time * ramp)
    config = {"drive": {**m.drive(), "viscous_friction": 0.05 * torque / velocity},
              "friction": {"coulomb": coulomb * torque} if coulomb else {},
              "controller": {"kind": "cascade", "gain": m.inertia * w, "integral_time_s": 6.0 / w, "position_gain": w / 4.0,
                             "velocity_feedforward": 1.0, "torque_limit": 3.0 * torque},
              "motion": motion, "measurement": {"delay_s": 1.0 / m.rate, "noise_rms": noise * velocity},
              "run": {"sample_rate_hz": m.rate, "duration_s": seconds}}
    config["sizes"] = {"torque": torque, "velocity": velocity, "seconds": seconds}
    if excited:
        config["excitation"] = excite(m, "prbs", seconds, excited * torque)[0]
    if counts:
        config["measurement"] |= {"velocity": "encoder", "encoder_counts": counts}
        del config["measurement"]["noise_rms"]
    return config


def with_(base, **tables):
    """The tables with these keys laid over them."""
    merged = copy.deepcopy(base)
    for table, keys in tables.items():
        merged[table] = {**merged.get(table, {}), **keys}
    return merged


def slower_loop(config):
    """Half the bandwidth: for a machine on which the loop would not be stable."""
    config = copy.deepcopy(config)
    c = config["controller"]
    for key, factor in (("gain", 0.5), ("integral_time_s", 2.0), ("position_gain", 0.5)):
        if key in c:
            c[key] *= factor
    return config
