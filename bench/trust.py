#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""How often a trusted result of `identify` is wrong: kinds of experiment, several seeds each, against the truth of the simulation.

    bench/trust.py PROGRAM [--seeds 10] [--only NAME] [--markdown FILE] [--jobs N]

PROGRAM is the command line tool. A figure (inertias, stiffness, damping, friction, resonances) counts as wrong when it is further from
the truth than 3 of its own standard deviations and 1e-6 of its value; of a machine that changes, from the resonance at either end.
A record is identified with what a user would tell: controller and delay where the experiment has them.
"""
import argparse
import concurrent.futures
import json
import math
import pathlib
import random
import subprocess
import sys
import tempfile
import tomllib

EXPERIMENTS = pathlib.Path(__file__).resolve().parent.parent / "experiments"


def toml_of(config):
    def value(v):
        if isinstance(v, str):
            return json.dumps(v)
        if isinstance(v, bool):
            return "true" if v else "false"
        return repr(v)
    return "\n".join(f"[{table}]\n" + "".join(f"{k} = {value(v)}\n" for k, v in keys.items()) for table, keys in config.items())


# ---- faults of measuring: rows of numbers in, rows out; the random generator is the run's

def column(name, change):
    def fault(header, rows, generator):
        at = header.index(name)
        values = change([r[at] for r in rows], generator)
        for row, v in zip(rows, values):
            row[at] = v
        return rows
    return fault


def clipped(share):
    def change(v, _):
        limit = share * max(abs(x) for x in v)
        return [min(limit, max(-limit, x)) for x in v]
    return change


def noisy(share):
    def change(v, g):
        rms = math.sqrt(sum(x * x for x in v) / len(v))
        return [x + g.gauss(0.0, share * rms) for x in v]
    return change


def missing(share):
    return lambda header, rows, generator: [r for r in rows if generator.random() >= share]


LATE = column("y", lambda v, _: [v[0]] * 3 + v[:-3])
HELD = column("y", lambda v, _: [v[k - k % 4] for k in range(len(v))])
COPY = lambda header, rows, _: [[u if h == "y" else x for h, x in zip(header, r)] for r in rows for u in [r[header.index("u")]]]

STILL = {"motion": {"kind": "standstill"}}
SHORT = {"run": {"duration_s": 20.0}}
BELT = {"run": {"duration_s": 20.0}, "excitation": {"kind": "prbs", "amplitude": 2.1, "register_length": 13}}


def with_(base, **tables):
    merged = {t: dict(k) for t, k in base.items()}
    for table, keys in tables.items():
        merged[table] = {**merged.get(table, {}), **keys}
    return merged


# name -> (experiment, what differs, faults)
KINDS = {name: (name, {}, []) for name in (
    "demo", "belt_1", "belt_2", "belt_3", "i_prbs", "rigid", "iv_multisine_a", "iv_multisine_b", "iv_prbs_a", "shaft_drive",
    "servo_cascade", "friction_reversal", "three_mass_tensioner", "vi_chirp_a", "vi_chirp_b", "vi_chirp_a_5s", "belt_loosens",
    "stiffness_drifts", "ii_iii_tooth_prbs", "ii_iii_tooth_prbs_2ms", "v_tooth_chirp_middle", "load_steps", "eccentric_roller",
    "vi_chirp_tensioner_a")}
KINDS |= {
    "belt": ("vi_prbs_a", BELT, []),
    "belt, noise 1": ("vi_prbs_a", with_(BELT, measurement={"noise_rms": 1.0}), []),
    "belt, noise 0.01": ("vi_prbs_a", with_(BELT, measurement={"noise_rms": 0.01}), []),
    "torque lag 0.4 ms": ("servo_cascade", {"friction": {"coulomb": 0.0, "breakaway": 0.0}, "actuator": {"lag_s": 0.0004}}, []),
    "torque lag 2 ms": ("vi_prbs_a", with_(BELT, actuator={"lag_s": 0.002}), []),
    "dry friction, standstill": ("vi_prbs_a", with_(BELT, friction={"coulomb": 0.5}, **STILL), []),
    "dry friction on the load, standstill": ("vi_prbs_a", with_(BELT, friction={"load_coulomb": 0.5}, **STILL), []),
    "viscous friction on the load": ("vi_prbs_a", with_(BELT, drive={"load_viscous_friction": 0.1}), []),
    "belt loses 5 % at once": ("vi_prbs_a", with_(BELT, disturbance={"loosening": 0.05, "loosening_at_s": 10.0}), []),
    "belt loses 30 % slowly": ("vi_prbs_a", with_(BELT, disturbance={"loosening": 0.3, "loosening_at_s": 5.0, "loosening_over_s": 10.0}), []),
    "stiffness drifts 1 %/s": ("vi_prbs_a", with_(BELT, disturbance={"stiffness_drift_per_s": 0.01}), []),
    "load step": ("vi_prbs_a", with_(BELT, disturbance={"load_step": [2.0], "load_step_at_s": [10.0]}), []),
    "velocity clipped": ("vi_prbs_a", BELT, [column("y", clipped(0.97))]),
    "velocity three samples late": ("vi_prbs_a", BELT, [LATE]),
    "velocity new every 4th sample": ("vi_prbs_a", BELT, [HELD]),
    "noisy torque": ("vi_prbs_a", BELT, [column("u", noisy(0.2))]),
    "1 % of the samples missing": ("vi_prbs_a", BELT, [missing(0.01)]),
    "output a copy of the input": ("vi_prbs_a", BELT, [COPY]),
}


def configured(kind, seed):
    experiment, changes, _ = KINDS[kind]
    config = tomllib.loads((EXPERIMENTS / f"{experiment}.toml").read_text(encoding="utf-8"))
    for table, keys in changes.items():
        whole = "kind" in keys and table in config
        config[table] = {**({} if whole else config.get(table, {})), **keys}
    config.setdefault("run", {})["seed"] = 100 + seed
    return config


def truths(truth):
    figures = {k: [v["value"]] for k, v in truth["model"]["parameters"].items() if isinstance(v, dict) and "value" in v}
    for kind in ("resonance", "antiresonance"):
        modes = [m["frequency_hz"] for m in truth.get("resonances", []) if m["kind"] == kind]
        if modes:
            figures[kind] = [modes[0]]
    over_time = truth.get("over_time")
    if over_time:
        course = over_time["resonance_hz"]
        figures["resonance"] = [min(course), max(course)]
        for moving in ("stiffness", "damping", "antiresonance"):
            figures.pop(moving, None)
    return figures


def found(result):
    figures = {k: (v["value"], v["std"]) for k, v in (result.get("model") or {}).get("parameters", {}).items()
               if isinstance(v, dict) and v.get("std") is not None}
    for mode in result.get("resonances", []):
        if mode.get("std_hz") is not None and mode["kind"] not in figures:
            figures[mode["kind"]] = (mode["frequency_hz"], mode["std_hz"])
    return figures


def run(program, kind, seed):
    """(verdict, worst figure, how many of its standard deviations off)"""
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder)
        (path / "e.toml").write_text(toml_of(configured(kind, seed)), encoding="utf-8")
        made = subprocess.run([program, "simulate", "e.toml", "--out", "r.csv", "--truth", "t.json"], cwd=path, capture_output=True, text=True)
        if made.returncode:
            sys.exit(f"{kind}: {made.stderr}")
        truth = json.loads((path / "t.json").read_text(encoding="utf-8"))
        lines = (path / "r.csv").read_text(encoding="utf-8").split()
        header, rows = lines[0].split(","), [[float(x) for x in line.split(",")] for line in lines[1:]]
        generator = random.Random(seed)
        for fault in KINDS[kind][2]:
            rows = fault(header, rows, generator)
        (path / "r.csv").write_text(lines[0] + "\n" + "\n".join(",".join(map(repr, r)) for r in rows) + "\n", encoding="utf-8")
        options = ["--delay", repr(truth["delay_s"])] if truth["delay_s"] else []
        if "controller" in truth:
            (path / "c.json").write_text(json.dumps(truth["controller"]), encoding="utf-8")
            options += ["--controller", "c.json"]
        try:
            asked = subprocess.run([program, "identify", "r.csv", "--json", "i.json", *options], cwd=path, capture_output=True, text=True, timeout=120)
        except subprocess.TimeoutExpired:
            return "timeout", "", 0.0
        if asked.returncode:
            return "error", asked.stderr.strip().splitlines()[0], 0.0
        result = json.loads((path / "i.json").read_text(encoding="utf-8"))
    worst, name = 0.0, ""
    true = truths(truth)
    for figure, (value, std) in found(result).items():
        if figure not in true or abs(value) > 1e300:
            continue
        off = max(abs(value - t) for t in true[figure])
        if off > 1e-6 * abs(value) and off > worst * std:
            worst, name = (off / std if std > 0.0 else math.inf), figure
    return ("trusted" if result["trusted"] else "untrusted"), name, worst


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--only", default="")
    parser.add_argument("--markdown")
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    program = str(pathlib.Path(options.program).resolve())
    kinds = [k for k in KINDS if options.only in k]
    rows, all_trusted, all_wrong, all_grossly = [], 0, 0, 0
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        runs = {k: [pool.submit(run, program, k, s) for s in range(options.seeds)] for k in kinds}
        for kind in kinds:
            outcomes = [f.result() for f in runs[kind]]
            trusted = [o for o in outcomes if o[0] == "trusted"]
            wrong, grossly = [o for o in trusted if o[2] > 3.0], [o for o in trusted if o[2] > 5.0]
            worst = max(trusted, key=lambda o: o[2], default=("", "", 0.0))
            failed = sum(o[0] in ("error", "timeout") for o in outcomes)
            all_trusted, all_wrong, all_grossly = all_trusted + len(trusted), all_wrong + len(wrong), all_grossly + len(grossly)
            rows.append(f"| {kind} | {len(outcomes)} | {len(trusted)} | {len(wrong)} | {len(grossly)} | "
                        f"{f'{worst[1]} {worst[2]:.1f}' if worst[1] else ''} | {failed or ''} |")
            print(rows[-1], flush=True)
    total = f"| all | {len(kinds) * options.seeds} | {all_trusted} | {all_wrong} | {all_grossly} | | |"
    print(total)
    if options.markdown:
        head = ["| kind | runs | trusted | of these wrong | beyond 5 | worst figure, standard deviations | error |", "|---|---|---|---|---|---|---|"]
        pathlib.Path(options.markdown).write_text("\n".join(head + rows + [total]) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
