# SPDX-License-Identifier: MIT
"""The kinds of experiment of trust.py: shipped ones, named machines, machines drawn at random; what is not ideal; faults of measuring.

A kind is `conform` when a model of linear masses with viscous and dry friction, torque lag, springs to ground and filter holds it,
`beyond` when the machine has or does what none of these holds, `fault` when the record is not what the machine did. `linear`: fault-free,
linear and constant, so that any finding of inconsistency is false.
"""
import dataclasses
import math
import pathlib
import random
import tomllib
import typing

import numpy as np

from trust_machines import Machine, experiment, positioning, random_machine, with_

EXPERIMENTS = pathlib.Path(__file__).resolve().parent.parent / "experiments"


@dataclasses.dataclass
class Kind:
    name: str
    of: str                       # conform, beyond or fault
    config: typing.Callable       # random.Random -> tables
    faults: tuple = ()
    linear: bool = False
    drawn: bool = False           # another machine with every seed
    told_delay: float = 0.0       # samples added to the delay that is told
    told_controller: float = 1.0  # factor of the numerator that is told


# ---- faults of measuring: names of columns and rows of numbers in, both out

def column(name, change):
    def fault(names, rows, g):
        rows = rows.copy()
        rows[:, names.index(name)] = change(rows[:, names.index(name)], g, rows[1, 0] - rows[0, 0])
        return names, rows
    return fault


def rms(v):
    return math.sqrt(np.mean((v - v.mean())**2))


def clipped(share):
    def change(v, *_):
        middle, half = 0.5 * (v.max() + v.min()), 0.5 * (v.max() - v.min())
        return np.clip(v, middle - share * half, middle + share * half)
    return change


def later(samples):
    """By whole samples, or by a part of one through the cubic through four neighbours."""
    def change(v, *_):
        whole, part = int(samples), samples - int(samples)
        x = 1.0 - part
        weights = (-x * (x - 1.0) * (x - 2.0) / 6.0, (x * x - 1.0) * (x - 2.0) / 2.0, -x * (x + 1.0) * (x - 2.0) / 2.0, x * (x * x - 1.0) / 6.0)
        at = np.arange(len(v)) - whole - (1 if part else 0)  # the sample before the instant wanted
        take = lambda k: v[np.clip(at + k, 0, len(v) - 1)]
        return sum(w * take(k - 1) for k, w in enumerate(weights)) if part else take(0)
    return change


def filtered(samples):
    """A first-order low-pass with this time constant in samples."""
    def change(v, *_):
        keep, state, out = math.exp(-1.0 / samples), v[0], np.empty_like(v)
        for k, x in enumerate(v.tolist()):
            out[k] = state = keep * state + (1.0 - keep) * x
        return out
    return change


def some_rows(pick):
    return lambda names, rows, g: (names, rows[pick(len(rows), g)])


def renumbered(fault):
    """The time column does not tell."""
    def changed(names, rows, g):
        step, (names, rows) = rows[1, 0] - rows[0, 0], fault(names, rows, g)
        rows = rows.copy()
        rows[:, 0] = np.arange(len(rows)) * step
        return names, rows
    return changed


def without(*dropped):
    def fault(names, rows, _):
        keep = [k for k, n in enumerate(names) if n not in dropped]
        return [names[k] for k in keep], rows[:, keep]
    return fault


def swapped(names, rows, _):
    u, y = names.index("u"), names.index("y")
    rows = rows.copy()
    rows[:, [u, y]] = rows[:, [y, u]]
    return names, rows


def copied(names, rows, _):
    rows = rows.copy()
    rows[:, names.index("y")] = rows[:, names.index("u")]
    return names, rows


def noise(share):
    return lambda v, g, _: v + g.normal(0.0, share * rms(v), len(v))


drop = lambda share: some_rows(lambda n, g: g.random(n) >= share)
twice = lambda share: some_rows(lambda n, g: np.repeat(np.arange(n), 1 + (g.random(n) < share)))
FAULTS = {
    "velocity clipped 3 %": [column("y", clipped(0.97))],
    "velocity clipped 20 %": [column("y", clipped(0.8))],
    "torque clipped 20 %": [column("u", clipped(0.8))],
    "velocity 0.3 samples late": [column("y", later(0.3))],
    "velocity 3 samples late": [column("y", later(3))],
    "torque 3 samples late": [column("u", later(3))],
    "velocity filtered, 2 samples": [column("y", filtered(2.0))],
    "velocity filtered, 8 samples": [column("y", filtered(8.0))],
    "velocity new every 4th sample": [column("y", lambda v, *_: v[np.arange(len(v)) // 4 * 4])],
    "1 % of the samples missing": [drop(0.01)],
    "1 % missing, times renumbered": [renumbered(drop(0.01))],
    "1 % of the samples twice": [twice(0.01)],
    "1 % twice, times renumbered": [renumbered(twice(0.01))],
    "velocity wanders": [column("y", lambda v, g, _: v + np.cumsum(g.normal(0.0, 2.0 * rms(v) / math.sqrt(len(v)), len(v))))],
    "velocity drifts": [column("y", lambda v, *_: v + 3.0 * rms(v) * np.linspace(0.0, 1.0, len(v)))],
    "noisy torque, 20 %": [column("u", noise(0.2))],
    "noisy torque, no excitation channel": [column("u", noise(0.2)), without("ru")],
    "no excitation channel": [without("ru")],
    "no excitation channel, no reference": [without("ru", "r")],
    "output a copy of the input": [copied],
    "columns swapped": [swapped],
    "sign of the velocity wrong": [column("y", lambda v, *_: -v)],
    "outliers, 1 in 500": [column("y", lambda v, g, _: v + 10.0 * rms(v) * (g.random(len(v)) < 0.002))],
}
TOLD = {"told delay 1 sample long": {"told_delay": 1.0}, "told delay 1 sample short": {"told_delay": -1.0},
        "told controller 5 % strong": {"told_controller": 1.05}, "told controller 5 % weak": {"told_controller": 0.95}}


# ---- what is not ideal: (class, linear, how a machine's tables change, what the experiment must be)

def third_mass(m, c, g):
    share = g.uniform(0.05, 0.3)
    drive = {**c["drive"], "structure": "three-mass", "middle_inertia": share * m.load, "load_inertia": (1.0 - share) * m.load,
             "stiffness_2": m.stiffness * g.uniform(1.0, 3.0), "damping_2": m.damping}
    drive["stiffness"] *= 1.5
    return {**c, "drive": drive}


def spring(name, at):
    """A ground spring on which the whole would oscillate at a part of the anti-resonance."""
    return lambda m, c, g: with_(c, drive={name: m.inertia * (2.0 * math.pi * at(g) * m.antiresonance_hz)**2})


def friction(**parts):
    return lambda m, c, g: with_(c, friction={k: p * c["sizes"]["torque"] for k, p in parts.items()})


def counts(share):
    def change(m, c, g):
        step = share * c["sizes"]["velocity"] / m.rate
        c = with_(c, measurement={"velocity": "encoder", "encoder_counts": max(1, round((1.0 if m.linear else 2.0 * math.pi) / step))})
        del c["measurement"]["noise_rms"]
        return c
    return change


def twist(table, key, part):
    """Relative to the coupling's twist under the excitation's torque."""
    return lambda m, c, g: with_(c, **{table: {key: part(g) * c["sizes"]["torque"] * m.ratio / (1.0 + m.ratio) / m.stiffness}})


def in_time(key, part, **more):
    return lambda m, c, g: with_(c, disturbance={key: part(g), **{k: v * c["sizes"]["seconds"] for k, v in more.items()}})


STILL = {"moving": False}
NOT_IDEAL = {
    "viscous friction": ("conform", True, lambda m, c, g: with_(
        c, drive={"viscous_friction": g.uniform(0.05, 0.6) * m.inertia * 2.0 * math.pi * m.antiresonance_hz}), {}),
    "viscous friction on the load": ("conform", True, lambda m, c, g: with_(
        c, drive={"load_viscous_friction": g.uniform(0.02, 0.3) * m.load * 2.0 * math.pi * m.antiresonance_hz}), {}),
    "torque lag": ("conform", True, lambda m, c, g: with_(c, actuator={"lag_s": g.uniform(0.1, 0.6) / (2.0 * math.pi * m.resonance_hz)}), {}),
    "dry friction while moving": ("conform", True, friction(coulomb=0.3), {}),
    "dry friction on the load while moving": ("conform", True, friction(load_coulomb=0.3), {}),
    "dry friction at standstill": ("conform", False, friction(coulomb=0.2), STILL),
    "dry friction on the load at standstill": ("conform", False, friction(load_coulomb=0.1), STILL),
    "spring to ground on the motor": ("conform", True, spring("motor_ground_stiffness", lambda g: g.uniform(0.15, 0.6)), STILL),
    "spring to ground on the load": ("conform", True, spring("load_ground_stiffness", lambda g: g.uniform(0.15, 0.6)), STILL),
    "third mass": ("conform", True, third_mass, {}),
    "velocity filter": ("conform", True, lambda m, c, g: with_(c, measurement={"filter_s": g.uniform(0.1, 0.6) / (2.0 * math.pi * m.resonance_hz)}), {}),
    "velocity held": ("conform", True, lambda m, c, g: with_(c, measurement={"hold_samples": 4 if m.rate > 30.0 * m.resonance_hz else 2}), {}),
    "coloured noise": ("conform", True, lambda m, c, g: with_(c, measurement={"noise_bandwidth_hz": g.uniform(0.3, 3.0) * m.resonance_hz}), {}),
    "fine encoder": ("conform", True, counts(0.02), {}),
    "load torque": ("conform", True, lambda m, c, g: with_(c, disturbance={"load_torque": 0.5 * c["sizes"]["torque"]}), {}),
    "backlash": ("beyond", False, twist("drive", "backlash", lambda g: g.uniform(0.2, 2.0)), STILL),
    "stiffening coupling": ("beyond", False, twist("drive", "stiffening_twist", lambda g: g.uniform(1.0, 4.0)), STILL),
    "stiffness drifts": ("beyond", False, lambda m, c, g: with_(
        c, disturbance={"stiffness_drift_per_s": g.uniform(0.03, 0.3) / c["sizes"]["seconds"]}), {}),
    "loosens at once": ("beyond", False, in_time("loosening", lambda g: g.uniform(0.04, 0.3), loosening_at_s=0.5), {}),
    "loosens slowly": ("beyond", False, in_time("loosening", lambda g: g.uniform(0.1, 0.3), loosening_at_s=0.25, loosening_over_s=0.5), {}),
    "load step": ("beyond", False, lambda m, c, g: with_(c, disturbance={
        "load_step": [g.uniform(0.5, 2.0) * c["sizes"]["torque"]], "load_step_at_s": [g.uniform(0.3, 0.7) * c["sizes"]["seconds"]]}), {}),
    "eccentric roller": ("beyond", False, twist("disturbance", "eccentricity", lambda g: g.uniform(0.05, 0.5)), {}),
    "coarse encoder": ("fault", False, counts(0.5), {}),
}


def not_ideal(name, machine, excitation, **how):
    of, linear, change, needs = NOT_IDEAL[name]
    def config(g):
        m = machine(g)
        return change(m, experiment(m, excitation, **{**how, **needs}), g)
    return of, linear, config


SECOND_OUTPUTS = {"load_position": "load-encoder", "load_acceleration": "load-accelerometer"}  # columns of the simulation


def second_output(m, excitation, measures):
    """Load side too: an encoder as noisy as the velocity over the sharpest mode's period, an accelerometer of 5 % of the torque's."""
    config = experiment(m, excitation)
    sizes = config["sizes"]
    noise = 0.02 * sizes["velocity"] / (2.0 * math.pi * m.resonance_hz) if measures == "load-encoder" else 0.05 * sizes["torque"] / m.inertia
    return with_(config, measurement={"second_output": measures, "second_noise": noise})


# ---- the kinds

SHIPPED = {  # name -> (class, linear)
    **{n: ("conform", True) for n in ("demo", "belt_1", "belt_2", "belt_3", "i_prbs", "iv_multisine_a", "iv_multisine_b", "iv_prbs_a",
                                      "vi_chirp_a", "vi_chirp_b", "vi_chirp_a_5s", "three_mass_tensioner", "vi_chirp_tensioner_a")},
    **{n: ("conform", False) for n in ("rigid", "shaft_drive", "servo_cascade", "friction_reversal", "ii_tooth_standstill")},
    **{n: ("beyond", False) for n in ("belt_loosens", "stiffness_drifts", "ii_iii_tooth_prbs", "ii_iii_tooth_prbs_2ms", "v_tooth_chirp_middle",
                                      "load_steps", "eccentric_roller", "chain_four_masses")}}
MACHINES = {
    "belt": Machine(11.0, 1.0, 0.064, 500.0, 0.05), "servo": Machine(95.0, 1.8, 0.0042, 2000.0, 0.04),
    "slow": Machine(2.2, 9.0, 22.0, 200.0, 0.03), "stage": Machine(60.0, 0.5, 9.0, 4000.0, 0.02, linear=True),
    "quick": Machine(320.0, 0.25, 5e-4, 8000.0, 0.02), "heavy load": Machine(7.0, 18.0, 1.2, 1000.0, 0.06),
    "rigid": Machine(20.0, 1.0, 0.01, 1000.0, rigid=True)}
EXCITATIONS = ("chirp", "log-chirp", "multisine", "prbs", "stepped-sine")


def shipped(name, changes=None):
    def config(_):
        tables = tomllib.loads((EXPERIMENTS / f"{name}.toml").read_text(encoding="utf-8"))
        for table, keys in (changes or {}).items():
            tables[table] = keys if "kind" in keys else {**tables.get(table, {}), **keys}
        return tables
    return config


def drawn_at_random(g):
    """A machine, an excitation and, in two of three, something conform or beyond that is not ideal."""
    m, excitation = random_machine(g), g.choice(EXCITATIONS + ("long-prbs",))
    how = {"torque": 10.0**g.uniform(-1.0, 2.0), "noise": 10.0**g.uniform(-2.5, -0.7), "closed": g.random() < 0.7,
           "moving": g.random() < 0.6, "delay_samples": g.choice((0.0, 1.0, 1.0, 2.0, 1.4)), "bandwidth": g.uniform(0.1, 0.4)}
    name = g.choice(list(NOT_IDEAL)) if g.random() < 0.67 else None
    if name is None:
        return "conform", True, experiment(m, excitation, **how)
    of, linear, change, needs = NOT_IDEAL[name]
    needs = {**needs, "closed": True, "moving": True} if "moving" in name or "eccentric" in name or "load torque" == name else needs
    return of, linear, change(m, experiment(m, excitation, **{**how, **needs}), g)


def kinds(salt=""):
    found = []
    def add(name, of, config, **more):
        found.append(Kind(name, of, config, **more))

    for name, (of, linear) in SHIPPED.items():
        add(name, of, shipped(name), linear=linear)
    for name, m in MACHINES.items():
        for e in EXCITATIONS:
            add(f"{name}, {e}", "conform", lambda g, m=m, e=e: experiment(m, e), linear=True)
    belt, servo = MACHINES["belt"], MACHINES["servo"]
    add("belt, half a second", "conform", lambda g: experiment(belt, "prbs", 0.5, noise=0.005), linear=True)
    add("servo, half a second, open loop", "conform", lambda g: experiment(servo, "multisine", 0.5, closed=False), linear=True)
    add("belt, noise as large", "conform", lambda g: experiment(belt, "prbs", noise=1.0), linear=True)
    add("belt, hardly any noise", "conform", lambda g: experiment(belt, "prbs", noise=0.001), linear=True)
    voltage_driven = Machine(2.77, 0.494, 0.0248, 200.0, 0.03)  # its back-EMF is a viscous friction
    for e in ("multisine", "one-multisine", "prbs"):
        add(f"voltage-driven, {e}", "conform", lambda g, e=e: with_(experiment(voltage_driven, e, 20.0, closed=False, noise=0.002), drive={
            "viscous_friction": 0.65}), linear=True)
    for ms in (0.2, 0.4, 2.0):
        add(f"servo, torque lag {ms} ms", "conform", lambda g, ms=ms: with_(experiment(servo, "prbs"), actuator={"lag_s": 1e-3 * ms}), linear=True)
    for mrad in (2, 20):
        add(f"belt, backlash {mrad} mrad", "beyond", lambda g, b=1e-3 * mrad: with_(experiment(belt, "prbs", moving=False), drive={"backlash": b}))
    for name, (of, linear, _, _) in NOT_IDEAL.items():
        for machine, e in ((("belt", "prbs"), ("stage", "chirp")) if name != "torque lag" else (("stage", "chirp"),)):
            _, _, config = not_ideal(name, lambda g, m=machine: MACHINES[m], e)
            add(f"{machine}, {name}", of, lambda g, c=config, n=name: c(random.Random(n)), linear=linear)

    for machine, e in (("belt", "prbs"), ("servo", "chirp")):
        for measures in SECOND_OUTPUTS.values():
            add(f"{machine}, {measures}", "conform", lambda g, m=machine, e=e, s=measures: second_output(MACHINES[m], e, s), linear=True)
    add("drawn machine, multisine, load-encoder", "conform", lambda g: second_output(random_machine(g), "multisine", "load-encoder"),
        linear=True, drawn=True)
    add("drawn machine, chirp, load-accelerometer", "conform", lambda g: second_output(random_machine(g), "chirp", "load-accelerometer"),
        linear=True, drawn=True)
    add("belt: load encoder of a gear", "fault", lambda g: second_output(belt, "prbs", "load-encoder"),
        faults=(column("load_position", lambda v, *_: 3.2 * v),))
    add("servo: load accelerometer upside down", "fault", lambda g: second_output(servo, "chirp", "load-accelerometer"),
        faults=(column("load_acceleration", lambda v, *_: -v),))

    moving = {"rigid axis": MACHINES["rigid"], "servo": servo, "belt": belt, "stage": MACHINES["stage"]}
    recorded = (without("ru"),)  # no column where nothing is injected
    for name, m in moving.items():
        add(f"{name}, moves only, dry friction", "conform", lambda g, m=m: positioning(m), faults=recorded)
        add(f"{name}, moves only, s-curve, encoder", "conform", lambda g, m=m: positioning(
            m, profile="s-curve", counts=round(2e5 / (1.0 / m.antiresonance_hz**2 / m.inertia))), faults=recorded)
    add("servo, moves only, excitation column all 0", "conform", lambda g: positioning(servo))
    add("servo, Stribeck friction to and fro", "conform", lambda g: with_(positioning(servo, excited=0.3), friction={
        "breakaway": 0.2, "stribeck_velocity": 0.1}))
    add("belt, Stribeck friction to and fro", "conform", lambda g: with_(positioning(belt, excited=0.3), friction={
        "breakaway": 0.2, "stribeck_velocity": 0.1}))
    of_load = {"load_coulomb": 0.1, "load_breakaway": 0.2, "load_stribeck_velocity": 0.1}
    for name, m in (("servo", servo), ("belt", belt)):
        add(f"{name}, Stribeck friction on the load to and fro", "beyond", lambda g, m=m: with_(positioning(m, excited=0.3), friction=of_load))
    add("rigid axis, asymmetric friction", "conform", lambda g: with_(positioning(MACHINES["rigid"]), friction={"coulomb_friction_negative": 0.15}),
        faults=recorded)
    for name, faults in FAULTS.items():
        add(f"belt: {name}", "fault", lambda g: experiment(belt, "prbs"), faults=tuple(faults))
    for name, told in TOLD.items():
        add(f"belt: {name}", "fault", lambda g: experiment(belt, "prbs"), **told)

    for n, (name, (of, linear, _, _)) in enumerate(NOT_IDEAL.items()):
        e = EXCITATIONS[n % 4]
        _, _, config = not_ideal(name, random_machine, e)
        add(f"drawn machine, {e}, {name}", of, config, linear=linear, drawn=True)
    for e in EXCITATIONS + ("long-prbs",):
        add(f"drawn machine, {e}", "conform", lambda g, e=e: experiment(random_machine(g), e), linear=True, drawn=True)
        add(f"drawn machine, {e}, open loop", "conform", lambda g, e=e: experiment(random_machine(g), e, closed=False), linear=True, drawn=True)
    add("drawn machine, moves only", "conform", lambda g: positioning(random_machine(g), coulomb=g.uniform(0.02, 0.3)), faults=recorded, drawn=True)
    add("drawn machine, moves and is excited", "conform", lambda g: positioning(random_machine(g), excited=g.uniform(0.2, 1.0)), drawn=True)
    for n, name in enumerate(list(FAULTS)[::2]):
        e = EXCITATIONS[n % 4]
        add(f"drawn machine, {e}: {name}", "fault", lambda g, e=e: experiment(random_machine(g), e), faults=tuple(FAULTS[name]), drawn=True)
    for name, told in TOLD.items():
        add(f"drawn machine, chirp: {name}", "fault", lambda g: experiment(random_machine(g), "chirp"), drawn=True, **told)
    for n in range(1, 31):  # one machine each, other noise with every seed
        seed = f"{salt}machine {n}"
        of, linear, _ = drawn_at_random(random.Random(seed))
        add(f"drawn at random {n:02}", of, lambda g, s=seed: drawn_at_random(random.Random(s))[2], linear=linear, drawn=True)
    return found
