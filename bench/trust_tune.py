# SPDX-License-Identifier: MIT
"""What a controller that `resonid tune` proposes does on the machine of the truth: exact sampled loop, poles, largest |S| and |T_load|.

Made of the truth's masses and of the tables of the experiment by the differential equations, with NumPy alone; held against the truth's
own transfer function (`misunderstood`).
"""
import collections
import math
import re

import numpy as np

BOUNDS = {"sensitivity": 1.4, "load_transfer": 1.3}  # those of tune where none are told
GRID = 3000


def exponential(matrix):
    """By series of a 2^-12th, squared as e^m - 1, which keeps its digits."""
    small = matrix / 2.0**12
    total, term = np.zeros_like(small), small
    for k in range(2, 14):
        total, term = total + term, term @ small / k
    for _ in range(12):
        total = 2.0 * total + total @ total
    return total + np.eye(len(matrix))


def value(parameters, name, otherwise=0.0):
    return parameters[name]["value"] if name in parameters else otherwise


class Machine:
    """Masses, couplings (from, to, stiffness, damping), frictions and springs to the ground at the driven shaft."""

    def __init__(self, truth):
        p, structure = truth["model"]["parameters"], truth["model"]["structure"]
        if structure == "chain":
            self.inertia = [i["value"] for i in p["inertias"]]
            self.couplings = [(*c["between"], c["stiffness"]["value"], c["damping"]["value"]) for c in p["couplings"]]
        else:
            names = {"rigid": ["driven_inertia"], "two-mass": ["driven_inertia", "load_inertia"],
                     "three-mass": ["driven_inertia", "middle_inertia", "load_inertia"]}[structure]
            self.inertia = [value(p, n) for n in names]
            self.couplings = [(0, 1, value(p, "stiffness"), value(p, "damping"))] if len(names) > 1 else []
            if len(names) > 2:
                self.couplings += [(1, 2, value(p, "stiffness_2"), value(p, "damping_2")),
                                   (0, 2, value(p, "bypass_stiffness"), value(p, "bypass_damping"))]
        self.viscous, self.ground = [0.0] * len(self.inertia), [0.0] * len(self.inertia)
        self.viscous[-1] += value(p, "load_viscous_friction") if len(self.inertia) > 1 else 0.0
        self.viscous[0] += value(p, "viscous_friction")
        self.ground[-1] += value(p, "load_ground_stiffness")
        self.ground[0] += value(p, "motor_ground_stiffness")
        self.lag_s = value(p, "torque_lag")

    def stretched(self, factor, of_damping=1.0):
        changed = Machine.__new__(Machine)
        changed.__dict__ = {**self.__dict__, "couplings": [(a, b, factor * k, of_damping * d) for a, b, k, d in self.couplings]}
        return changed

    def motor_alone(self):
        changed = Machine.__new__(Machine)
        changed.__dict__ = {**self.__dict__, "inertia": self.inertia[:1], "couplings": [], "viscous": self.viscous[:1], "ground": self.ground[:1]}
        return changed

    def rates(self):
        """States: angles, velocities, the torque where it lags behind, then the commanded torque, which is kept."""
        n, lags = len(self.inertia), self.lag_s > 0.0
        a = np.zeros((2 * n + lags + 1, 2 * n + lags + 1))
        for i, j in enumerate(self.inertia):
            a[i, n + i] = 1.0
            a[n + i, n + i] -= self.viscous[i] / j
            a[n + i, i] -= self.ground[i] / j
        for first, second, k, d in self.couplings:
            for here, there in ((first, second), (second, first)):
                j = self.inertia[here]
                a[n + here, [here, there]] += [-k / j, k / j]
                a[n + here, [n + here, n + there]] += [-d / j, d / j]
        a[n, 2 * n] = 1.0 / self.inertia[0]
        if lags:
            a[2 * n, 2 * n:] = -1.0 / self.lag_s, 1.0 / self.lag_s
        return a


class SampledLoop:
    """The masses from sample to sample, what is measured of them, and how late: states of the whole, and responses."""

    def __init__(self, machine, measurement, delay_s, step):
        n, rates = len(machine.inertia), machine.rates()
        # Only twists matter, unless something holds the angles: the angle of the whole is another pole at 1, which the
        # velocity does not see. Angles are taken relative to the first, which stays only where a spring or an encoder asks for it.
        self.step, self.encoder = step, measurement.get("velocity") == "encoder"
        self.late = max(0, math.ceil(delay_s / step - 1e-9))
        whole, part = exponential(rates * step), exponential(rates * (self.late * step - delay_s))
        self.a, self.b = whole[:-1, :-1], whole[:-1, -1]
        row = 0 if self.encoder else n
        self.c, self.d, self.load = part[row, :-1], part[row, -1], n + len(machine.inertia) - 1
        self.rigid_angle = not any(machine.ground)
        if self.rigid_angle:
            # x = [twists to the first, velocities, torque]; an encoder's angle itself has to stay.
            turn = np.eye(len(self.a))
            for i in range(1, n):
                turn[i, 0] = -1.0
            back = np.linalg.inv(turn)
            self.a, self.b, self.c = turn @ self.a @ back, turn @ self.b, self.c @ back
            if not self.encoder:
                keep = [i for i in range(len(self.a)) if i != 0]
                self.a, self.b, self.c, self.load = self.a[np.ix_(keep, keep)], self.b[keep], self.c[keep], self.load - 1
        filter_s, self.hold = measurement.get("filter_s", 0.0), int(measurement.get("hold_samples", 1))
        self.pole = math.exp(-step / filter_s) if filter_s > 0.0 else 0.0

    def responses(self, hz, delayed=True):
        """Of what is measured and of the load's velocity, to the torque."""
        z = np.exp(2j * np.pi * hz * self.step)
        x = np.linalg.solve(z[:, None, None] * np.eye(len(self.a)) - self.a, np.broadcast_to(self.b[:, None], (len(hz), len(self.b), 1)))[:, :, 0]
        measured = x @ self.c + self.d
        if delayed:
            measured = measured * z**-self.late
        if self.encoder:
            measured = measured * (1.0 - 1.0 / z) / self.step
        measured = measured * (1.0 - self.pole) / (1.0 - self.pole / z)
        return measured * sum(z**-k for k in range(self.hold)) / self.hold, x[:, self.load]

    def spectral_radius(self, controller):
        """Of all states over the hold's samples, per sample."""
        size = max(len(controller["numerator"]), len(controller["denominator"]))
        b, a = ([*controller[k], *[0.0] * (size - len(controller[k]))] for k in ("numerator", "denominator"))
        n, order, line = len(self.a), size - 1, self.late + 1
        # States: masses, the last `late` and one more of what is measured, filter, held value, controller.
        at_line, at_filter, at_held, at_memory = n, n + line, n + line + 1, n + line + 2
        total = at_memory + order
        one = np.eye(total)

        def of_sample(renewed):
            # What is read now: without delay directly of the state, which then must not hang on this torque.
            reads = one[at_line + self.late - 1] if self.late else np.concatenate([self.c, np.zeros(total - n)])
            velocity = (reads - one[at_line + self.late]) / self.step if self.encoder else reads
            filtered = self.pole * one[at_filter] + (1.0 - self.pole) * velocity
            held = filtered if renewed else one[at_held]
            torque = -b[0] * held + (one[at_memory] if order else 0.0)
            m = np.zeros((total, total))
            m[:n, :n] = self.a
            m[:n] += np.outer(self.b, torque)
            if self.late:
                m[at_line] = np.concatenate([self.c, np.zeros(total - n)]) + self.d * torque
                for i in range(1, self.late + 1):
                    m[at_line + i] = one[at_line + i - 1]
            else:
                m[at_line] = reads
            m[at_filter], m[at_held] = filtered, held
            for i in range(order):
                m[at_memory + i] = -b[i + 1] * held - a[i + 1] * torque + (one[at_memory + i + 1] if i + 1 < order else 0.0)
            return m

        product = of_sample(True)
        for _ in range(self.hold - 1):
            product = of_sample(False) @ product
        poles = np.linalg.eigvals(product)
        if self.encoder and self.rigid_angle:  # a turn of the whole, which differences do not see
            poles = np.delete(poles, np.argmin(np.abs(poles - 1.0)))
        return float(np.max(np.abs(poles)) ** (1.0 / self.hold))

    def judged(self, controller):
        """(spectral radius, largest |S|, largest |T_load|)"""
        def sizes(hz):
            z = np.exp(2j * np.pi * hz * self.step)
            c = np.polyval(controller["numerator"][::-1], 1.0 / z) / np.polyval(controller["denominator"][::-1], 1.0 / z)
            measured, load = self.responses(hz)
            s = 1.0 / (1.0 + c * measured)
            return np.abs(s), np.abs(c * load * s)

        found = []
        for which in (0, 1):
            hz = np.geomspace(1e-5, 1.0, GRID + 1) * 0.5 / self.step
            for _ in range(3):  # ever finer around the largest
                value = sizes(hz)[which]
                top = int(np.argmax(value))
                largest, hz = value[top], np.linspace(hz[max(0, top - 1)], hz[min(len(hz) - 1, top + 1)], 41)
            found.append(float(largest))
        return (self.spectral_radius(controller), *found)


def misunderstood(machine, truth, measurement, step):
    """By how much the response without delay is off the truth's own, relative: otherwise this file judges another machine."""
    hz, f = np.array([0.01, 0.03, 0.1, 0.2, 0.3, 0.45]) / step, truth["model"]["transfer_function"]
    late = np.exp(-2j * np.pi * hz * step)
    theirs = np.polyval(f["numerator"][::-1], late) / np.polyval(f["denominator"][::-1], late)
    return float(np.max(np.abs(SampledLoop(machine, measurement, 0.0, step).responses(hz)[0] / theirs - 1.0)))


def judge(tuning, truth, config):
    """What the first candidate does on the true machine: at each end of its course, where it changes; the worst counts."""
    controller, measurement = tuning["candidates"][0]["feedback"], config.get("measurement", {})
    step, machine = 1.0 / config["run"]["sample_rate_hz"], Machine(truth)
    of = lambda m: SampledLoop(m, measurement, truth["delay_s"], step)
    off = misunderstood(machine, truth, measurement, step)
    if off > 1e-4:
        raise ValueError(f"the truth's transfer function is another one: off by {off:.2g}")
    machines = [machine]
    over_time = truth.get("over_time")
    if over_time:
        first = next(m["frequency_hz"] for m in truth["resonances"] if m["kind"] == "resonance")
        belt = config["drive"].get("structure") == "tooth-belt"  # its damping goes with K/f
        machines += [machine.stretched((f / first)**2, f / first if belt else 1.0)
                     for f in (min(over_time["resonance_hz"]), max(over_time["resonance_hz"]))]
    radius, sensitivity, load = (max(column) for column in zip(*(of(m).judged(controller) for m in machines)))
    found = {"spectral_radius": radius, "sensitivity": sensitivity, "load_transfer": load,
             "beyond": max(sensitivity / BOUNDS["sensitivity"], load / BOUNDS["load_transfer"])}
    if config["drive"].get("backlash"):
        found["radius_in_the_play"] = of(machine.motor_alone()).spectral_radius(controller)
    return found


def said_of(tunings):
    """How often what, and by how much a bound is exceeded at most."""
    tunings = list(tunings)
    count = collections.Counter(t["as"] for t in tunings)
    most = max((t["beyond"] for t in tunings if t["as"] == "outside"), default=1.0)
    return ", ".join(f"{k} {n}x" for k, n in count.items()) + (f" by {100.0 * (most - 1.0):.2g} %" if count["outside"] else "")


def summary(tunings):
    """Lines for (class of the kind, tuning of a trusted result)."""
    if not tunings:
        return []
    proposed = [(k, t) for k, t in tunings if t["as"] in ("inside", "outside", "unstable")]
    share = lambda part, whole: f"{part} of {whole} ({100.0 * part / max(1, whole):.1f} %)"
    count = lambda what, of=None: sum(t["as"] in what for k, t in proposed if of in (None, k))
    inside = [f"{share(count(('inside',), of), sum(k == of for k, _ in proposed))} {of}" for of in ("conform", "beyond", "fault")]
    off = sorted(t["beyond"] for _, t in proposed if t["as"] == "outside")
    # Numbers differ from result to result; the reason stands around them.
    reasons = collections.Counter(re.sub(r"[\d.]+(e[-+]?\d+)?", "_", t["why"]) for _, t in tunings if t["as"] in ("refused", "failed"))
    return [f"- PI controllers tuned for trusted results, on the true machine: proposed {share(len(proposed), len(tunings))}; of these stable "
            f"{share(count(('inside', 'outside')), len(proposed))}, inside both bounds {', '.join(inside)}",
            f"- of those outside, beyond a bound by: {', '.join(f'{100.0 * (b - 1.0):.2g} %' for b in off) or 'none'}",
            *given_lines([g for _, t in tunings for g in t.get("given", [])], share),
            *[f"- not proposed, {n}x: {why}" for why, n in reasons.most_common()]]


def given_lines(given, share):
    if not given:
        return []
    count = lambda what: share(sum(g["as"] == what for g in given), len(given))
    return [f"- given controllers that were called sure, on the true machine: inside {count('inside')}, outside {count('outside')}, unstable {count('unstable')}"]
