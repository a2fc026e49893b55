# SPDX-License-Identifier: MIT
"""Result and truth of trust.py, figure by figure: only what means the same in both is compared."""
import math

PARAMETERS = ("driven_inertia", "load_inertia", "middle_inertia", "stiffness", "stiffness_2", "damping", "damping_2", "viscous_friction",
              "load_viscous_friction", "coulomb_friction", "coulomb_friction_negative", "load_coulomb_friction", "load_coulomb_friction_negative",
              "stribeck_velocity", "breakaway_friction", "torque_lag", "motor_ground_stiffness", "load_ground_stiffness", "backlash", "output_filter")
# What a drive does not have is zero there. A torque lag stays out: what a delay takes over of another lag is no error.
ZERO_IF_ABSENT = ("viscous_friction", "load_viscous_friction", "coulomb_friction", "load_coulomb_friction")
MARGINS = {"crossover_hz": "crossover_std_hz", "phase_margin_deg": "phase_margin_std_deg", "modulus_margin": "modulus_margin_std",
           "gain_margin_db": "gain_margin_std_db"}


def true_parameters(truth):
    return {k: v["value"] for k, v in truth["model"]["parameters"].items() if isinstance(v, dict) and "value" in v}


def total_inertia(parameters):
    return sum(v for k, v in parameters.items() if k.endswith("inertia") or k.startswith("inertia"))


def modes(found):
    return [m for m in found if m["kind"] in ("resonance", "antiresonance")]


def course(truth):
    """By what factors the first resonance went, against that of the truth, in nine tenths of the time; (1,): a machine that stays."""
    over_time = truth.get("over_time")
    first = next((m["frequency_hz"] for m in truth.get("resonances", []) if m["kind"] == "resonance"), None)
    if not over_time or not first or max(over_time["resonance_hz"]) - min(over_time["resonance_hz"]) < 1e-9 * first:
        return (1.0,)
    ordered = sorted(over_time["resonance_hz"])
    return tuple(ordered[int(q * (len(ordered) - 1))] / first for q in (0.05, 0.95))


def compared(result, truth, conform):
    """name -> value, std, z (deviations off the truth), counts (a figure of the floors), fixed (one truth, for coverage)"""
    figures = {}
    moves = course(truth)
    stays, narrow = moves == (1.0,), moves[-1] - moves[0] < 0.01  # of a narrow course one figure tells, anywhere in it; else both ends count

    def judge(name, value, std, truths, counts=True):
        if value is None or std is None or not truths or abs(value) > 1e300:
            return
        low, high = min(truths), max(truths)
        off = max(0.0, low - value, value - high) if narrow else max(value - low, high - value)
        z = 0.0 if off <= 1e-6 * abs(value) else off / std if std > 0.0 else math.inf
        if name not in figures or z > figures[name]["z"]:
            figures[name] = {"value": value, "std": std, "truth": truths, "z": z, "counts": counts, "fixed": len(truths) == 1 and conform}

    true, model = true_parameters(truth), result.get("model") or {}
    found = {k: v for k, v in model.get("parameters", {}).items() if isinstance(v, dict) and v.get("value") is not None}
    structure, of_truth = model.get("structure"), truth["model"]["structure"]
    if structure == of_truth and structure in ("rigid", "two-mass", "three-mass"):
        for name in PARAMETERS:
            if name in found:
                judge(name, found[name]["value"], found[name].get("std"), meanings(name, true, found, moves))
    elif structure in ("rigid", "two-mass", "three-mass"):  # a simpler or richer structure: only the whole means the same
        inertias = [n for n in found if n.endswith("inertia")]
        if all(found[n].get("std") is not None for n in inertias):
            judge("total_inertia", sum(found[n]["value"] for n in inertias), std_of_sum(model, found, inertias), [total_inertia(true)])
    true_modes = modes(truth.get("resonances", []))
    for m in modes(result.get("resonances", [])):
        alike = [t["frequency_hz"] for t in true_modes if t["kind"] == m["kind"]]
        if m.get("std_hz") is None or m["frequency_hz"] <= 0.0:
            continue
        nearest = min(alike, key=lambda t: abs(math.log(t / m["frequency_hz"])), default=None)
        if nearest is None:
            figures[f"invented {m['kind']}"] = {"value": m["frequency_hz"], "std": m["std_hz"], "truth": [], "z": math.inf, "counts": True, "fixed": False}
        else:
            judge(m["kind"], m["frequency_hz"], m["std_hz"], [nearest * f for f in moves])
    if stays and "loop" in truth and result.get("loop"):
        for name, std in MARGINS.items():
            if truth["loop"].get(name) is not None:
                judge(name, result["loop"].get(name), result["loop"].get(std), [truth["loop"][name]])
    return figures


def meanings(name, true, found, moves):
    """The truth of a parameter; none where the name means something else or the machine's course does not tell."""
    if len(moves) > 1 and name in ("damping", "damping_2"):
        return []
    if len(moves) > 1 and name.startswith("stiffness"):
        return [true[name] * f * f for f in moves]
    if name in ("viscous_friction", "coulomb_friction"):
        sides = [name] if f"load_{name}" in found else [name, f"load_{name}"]  # undivided: the drive's, wherever it is
        def of_side(n):  # one figure for both directions: their mean, the rest is an offset
            both = [true.get(n, 0.0)] + [true[m] for m in [f"{n}_negative"] if m in true and m not in found]
            return sum(both) / len(both)
        return [sum(of_side(n) for n in sides)]
    return [true[name]] if name in true else [0.0] if name in ZERO_IF_ABSENT else []


def std_of_sum(model, found, names):
    covariance = model.get("covariance") or {}
    at = [covariance["parameters"].index(n) for n in names if n in covariance.get("parameters", [])]
    if len(at) < len(names):
        return math.sqrt(sum(found[n]["std"]**2 for n in names))
    return math.sqrt(max(0.0, sum(covariance["matrix"][i][j] for i in at for j in at)))


def right_within(share, script, truth, result=None):
    """Names of the figures of the script (or of a result) that are within this share of the truth: inertia of the whole, antiresonance
    and resonance."""
    if len(course(truth)) > 1:
        return set()
    true_modes, total = modes(truth.get("resonances", [])), total_inertia(true_parameters(truth))
    if result is not None:
        found = {k: v["value"] for k, v in (result.get("model") or {}).get("parameters", {}).items() if isinstance(v, dict) and "value" in v}
        inertias = [v for k, v in found.items() if k.endswith("inertia") and v is not None]
        script = {"inertia": sum(inertias)} if inertias else {}
        given = {k: [m["frequency_hz"] for m in modes(result.get("resonances", [])) if m["kind"] == k] for k in ("resonance", "antiresonance")}
    else:
        given = {k: [script[k]] for k in ("resonance", "antiresonance") if k in script}
    near = lambda value, t: abs(value - t) <= share * t
    whole = {"inertia"} if "inertia" in script and near(script["inertia"], total) else set()
    if true_modes:
        return whole | {k for k, values in given.items() for t in true_modes if t["kind"] == k and any(near(v, t["frequency_hz"]) for v in values)}
    return whole
