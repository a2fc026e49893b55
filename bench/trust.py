#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""How often a trusted result of `identify` is wrong: kinds of experiment, several seeds each, against the truth of the simulation.

    bench/trust.py PROGRAM [--seeds 10] [--first 0] [--jobs 2] [--only REGEX] [--class conform|beyond|fault] [--draw SALT]
                   [--markdown FILE] [--json FILE] [--list] [--no-baseline] [--no-tune] [--tune-structure pi] [--tune-evaluate] [--identify-with "--model none"] [--fail-beyond 5]
                   [--fail-outside 0.1]
    bench/trust.py PROGRAM --merge FILE ... --markdown FILE    tables of the --json of runs made in parts

PROGRAM is the command line tool; the kinds stand in trust_kinds.py. A figure (inertias, stiffness, damping, friction, torque lag, resonances,
crossover, margins) counts as wrong when it is further from the truth than 3 of its own standard deviations and 1e-6 of its value; of a machine
that changes by more than 1 %, from either end of its course. A record is identified with what a user would tell: controller and delay where the experiment has
them. For every trusted result `tune` designs a controller (a PI, or --tune-structure), which is judged on the true machine (trust_tune.py): stable, and inside the bounds of
|S| and |T_load|; --no-tune leaves it out. With --tune-evaluate the gains of a PI are also
judged, times 1 to 6, as given controllers: those that `tune` calls sure are looked at on the true machine. One that is unstable there makes exit code 1. With --fail-outside so does one that is beyond a bound there by more than
that part. --draw draws other machines. A kind whose experiment this
PROGRAM cannot simulate is skipped, and said.
"""
import argparse
import collections
import concurrent.futures
import hashlib
import json
import math
import os
import pathlib
import random
import re
import resource
import shutil
import subprocess
import sys
import tempfile
import threading
import types

try:
    import numpy as np
except ImportError:
    print("skipped: no NumPy for this Python")
    sys.exit(77)

import trust_kinds
from trust_machines import slower_loop
from trust_truth import compared, right_within
from trust_tune import judge, said_of, summary

INCONSISTENT = ("changes-within-recording", "differs-over-frequency", "differs-over-amplitude", "differs-over-blocks")


def toml_of(config):
    def value(v):
        if isinstance(v, bool):
            return "true" if v else "false"
        if isinstance(v, (list, tuple)):
            return "[" + ", ".join(map(value, v)) + "]"
        return json.dumps(v) if isinstance(v, str) else repr(v)
    return "\n".join(f"[{t}]\n" + "".join(f"{k} = {value(v)}\n" for k, v in keys.items()) for t, keys in config.items() if t != "sizes")


class Simulator:
    """Makes each record once, whoever asks; a loop that would not be stable is slowed down."""

    def __init__(self, program, folder):
        self.program, self.folder, self.lock, self.made = program, folder, threading.Lock(), collections.OrderedDict()

    def __call__(self, config):
        text = toml_of(config)
        with self.lock:
            mine = text not in self.made
            future = self.made.setdefault(text, concurrent.futures.Future())
            while len(self.made) > 60:  # kinds of one experiment stand beside each other
                self.made.popitem(last=False)
        if mine:
            try:
                future.set_result(self.make(config, text))
            except Exception as error:  # whoever waits for the record has to hear of it
                future.set_exception(error)
        return future.result()

    def make(self, config, text):
        """((names, rows), truth), or why not."""
        base = self.folder / hashlib.sha256(text.encode()).hexdigest()[:20]
        for _ in range(8):
            base.with_suffix(".toml").write_text(text, encoding="utf-8")
            made = subprocess.run([self.program, "simulate", f"{base}.toml", "--out", f"{base}.csv", "--truth", f"{base}.json"],
                                  capture_output=True, text=True)
            if made.returncode == 0:
                break
            if "stable" not in made.stderr or "controller" not in config:
                return None, re.sub(r"^.*\.toml:[\d:]+ |; known here.*", "", made.stderr.strip().splitlines()[-1])
            config = slower_loop(config)
            text = toml_of(config)
        else:
            return None, "no stable loop found"
        with open(f"{base}.csv", encoding="utf-8") as file:
            names = file.readline().strip().split(",")
            rows = np.array(file.read().replace("\n", ",").rstrip(",").split(","), float).reshape(-1, len(names))
        truth = json.loads(base.with_suffix(".json").read_text(encoding="utf-8"))
        for suffix in (".toml", ".csv", ".json"):
            base.with_suffix(suffix).unlink()
        return (names, rows), truth


def limited(command, folder, seconds):
    """(exit code, first line on the error channel, processor seconds); -9 past the limit"""
    with open(folder / "stderr", "w+", encoding="utf-8") as errors:
        process = subprocess.Popen(command, cwd=folder, stdout=subprocess.DEVNULL, stderr=errors,
                                   preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds)))
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        errors.seek(0)
        said = errors.read().strip().splitlines()
    return process.returncode, (said[0] if said else ""), used.ru_utime + used.ru_stime


def run(options, simulate, kind, seed):
    """Outcome of one record: a dictionary; `status` is trusted, untrusted, error, timeout or skipped."""
    return {"seed": seed, **outcome_of(options, simulate, kind, seed)}


def outcome_of(options, simulate, kind, seed):
    drawn = f"{options.draw}{kind.name}/{seed if kind.drawn else 0}"
    config = kind.config(random.Random(drawn))
    own = int.from_bytes(hashlib.sha256(kind.name.encode()).digest()[:4], "big")  # kinds must not share their noise
    config.setdefault("run", {})["seed"] = (own + seed) % 2**31
    record, truth = simulate(config)
    if record is None:
        return {"status": "skipped", "why": truth}
    names, rows = record
    generator = np.random.default_rng(int.from_bytes(hashlib.sha256(drawn.encode()).digest()[:4], "big") + seed)
    for fault in kind.faults:
        names, rows = fault(names, rows, generator)
    with tempfile.TemporaryDirectory(dir=simulate.folder) as name:
        folder = pathlib.Path(name)
        with open(folder / "r.csv", "w", encoding="utf-8") as file:
            file.write(",".join(names) + "\n" + "\n".join(",".join(map("{:.10g}".format, r)) for r in rows.tolist()) + "\n")
        told = []
        delay = truth["delay_s"] + kind.told_delay / config["run"]["sample_rate_hz"]
        if delay > 1e-12:
            told += ["--delay", repr(delay)]
        for column, measures in trust_kinds.SECOND_OUTPUTS.items():
            if column in names:
                told += ["--second-output", column, "--second-output-kind", measures]
        if "controller" in truth:
            controller = {**truth["controller"], "numerator": [kind.told_controller * b for b in truth["controller"]["numerator"]]}
            (folder / "c.json").write_text(json.dumps(controller), encoding="utf-8")
            told += ["--controller", "c.json"]
        code, said, seconds = limited([options.program, "identify", "r.csv", "--json", "i.json", *told, *options.identify_with.split()], folder, options.limit)
        if options.keep:
            kept = pathlib.Path(options.keep) / re.sub(r"[^\w.]+", "_", f"{kind.name}_{seed}")
            shutil.copytree(folder, kept, dirs_exist_ok=True)
            (kept / "truth.json").write_text(json.dumps(truth), encoding="utf-8")
            (kept / "e.toml").write_text(toml_of(config), encoding="utf-8")
            (kept / "told").write_text(" ".join(told), encoding="utf-8")
        outcome = {"seconds": seconds, "samples": len(rows)}
        if code:
            return {**outcome, "status": "timeout" if code in (-9, -24) else "error", "why": f"{code}: {said}"}
        result = json.loads((folder / "i.json").read_text(encoding="utf-8"))
        tuned = {"tuned": of_tuning(options, folder, truth, config)} if options.tune and result["trusted"] else {}
        if options.keep and (folder / "t.json").exists():
            shutil.copy(folder / "t.json", kept)
    figures = compared(result, truth, kind.of == "conform")
    outcome |= {**tuned, "status": "trusted" if result["trusted"] else "untrusted", "figures": figures,
                "structure": (result.get("model") or {}).get("structure", "none"),
                "findings": {f["id"]: f["severity"] for f in result["findings"]}}
    if options.baseline:
        outcome |= against_baseline(options.baseline, names, rows, config["run"]["sample_rate_hz"], result, truth)
    return outcome


def of_tuning(options, folder, truth, config):
    """What `tune` proposes for this result, on the true machine; `as` is inside, outside, unstable, refused or failed."""
    modelled = json.loads((folder / "i.json").read_text(encoding="utf-8")).get("model")
    draws = ["--draws", str(options.tune_draws)] if modelled else []
    code, said, seconds = limited([options.program, "tune", "i.json", "--structure", options.tune_structure, *draws, "--json", "t.json", "--quiet"],
                                  folder, options.limit)
    found = {"seconds": seconds}
    if code == 2:
        return {**found, "as": "refused", "why": said}
    if code:
        return {**found, "as": "failed", "why": f"{code}: {said}"}
    tuning = json.loads((folder / "t.json").read_text(encoding="utf-8"))
    found |= {"sure": tuning["trusted"], "findings": [f["id"] for f in tuning["findings"]], "gains": tuning["candidates"][0].get("gains")}
    try:
        found |= judge(tuning, truth, config)
    except (ValueError, KeyError) as error:
        return {**found, "as": "failed", "why": str(error)}
    if options.tune_evaluate:
        found["given"] = given_judged(options, folder, tuning, draws, truth, config)
    return {**found, "as": seen_as(found)}


def seen_as(found):
    return "unstable" if found["spectral_radius"] >= 1.0 else "inside" if found["beyond"] <= 1.0 else "outside"


def given_judged(options, folder, tuning, draws, truth, config):
    """The proposed PI times some factors as given controllers: of those that `tune` calls sure, what they are on the true machine."""
    gains, step, judged = tuning["candidates"][0].get("gains"), 1.0 / config["run"]["sample_rate_hz"], []
    if not gains or not gains.get("ki"):
        return judged
    for factor in (1.0, 1.5, 2.5, 4.0, 6.0):
        kp, ki = factor * gains["kp"], factor * gains["ki"]
        given = {"numerator": [kp + ki * step, -kp], "denominator": [1.0, -1.0], "sample_time_s": step}
        (folder / "g.json").write_text(json.dumps(given), encoding="utf-8")
        code, _, _ = limited([options.program, "tune", "i.json", "--evaluate", "g.json", *draws, "--json", "e.json", "--quiet"], folder, options.limit)
        if code:
            continue
        judgement = json.loads((folder / "e.json").read_text(encoding="utf-8"))
        if judgement["trusted"]:
            judged.append({"factor": factor, "as": seen_as(judge(judgement, truth, config))})
    return judged


def against_baseline(baseline, names, rows, rate, result, truth):
    """Figures of the script that are right within 3 %, and those of them that resonid lacks or misses by more."""
    late = round(truth["delay_s"] * rate)
    right = right_within(0.03, baseline(rows[:, names.index("u")], rows[:, names.index("y")], rate, late), truth)
    ours = right_within(0.03, {}, truth, result)
    return {"script_right": sorted(right), "worse_than_script": sorted(set(right) - set(ours))}


def beyond(outcome, limit):
    return [(n, z) for n, z in ((n, f["z"]) for n, f in outcome["figures"].items() if f["counts"]) if z > limit]


class Table:
    def __init__(self):
        self.rows, self.kinds = [], {}

    def add(self, kind, outcomes):
        tried = [o for o in outcomes if o["status"] != "skipped"]
        trusted = [o for o in tried if o["status"] == "trusted"]
        wrong, grossly = [o for o in trusted if beyond(o, 3.0)], [o for o in trusted if beyond(o, 5.0)]
        worst = max((b for o in wrong for b in beyond(o, 3.0)), key=lambda b: b[1], default=None)
        failed = collections.Counter(o["why"] for o in tried if o["status"] in ("error", "timeout"))
        withheld = collections.Counter(f for o in tried if o["status"] == "untrusted" for f, s in o["findings"].items() if s == "error")
        worse = collections.Counter(f for o in tried for f in o.get("worse_than_script", []))
        notes = [f"{k} {n}x" for k, n in withheld.most_common(4)] + list(failed)
        if len(tried) < len(outcomes):
            notes.append("skipped: " + next(o["why"] for o in outcomes if o["status"] == "skipped"))
        tuned = said_of(o["tuned"] for o in tried if "tuned" in o)
        said = lambda c: ", ".join(f"{k} {n}x" for k, n in c.items())
        self.kinds[kind.name] = {"class": kind.of, "linear": kind.linear, "outcomes": outcomes}
        self.rows.append(f"| {kind.name} | {kind.of} | {len(tried)} | {len(trusted)} | {len(wrong)} | {len(grossly)} | "
                         f"{f'{worst[0]} {worst[1]:.1f}' if worst else ''} | {said(worse)} | {tuned} | "
                         f"{max((o['seconds'] for o in tried), default=0.0):.1f} | {'; '.join(notes)} |")
        print(self.rows[-1], flush=True)

    HEAD = ["| kind | class | runs | trusted | of these wrong | beyond 5 | worst figure, standard deviations | worse than the script | tuned, on the truth | "
            "slowest, s | trust withheld by; error |", "|---|---|---|---|---|---|---|---|---|---|---|"]

    def totals(self):
        tried = [(k, o) for k in self.kinds.values() for o in k["outcomes"] if o["status"] != "skipped"]
        trusted = [(k, o) for k, o in tried if o["status"] == "trusted"]
        share = lambda part, whole: f"{len(part)} of {len(whole)} ({100.0 * len(part) / max(1, len(whole)):.1f} %)"
        wrong = lambda limit: [o for _, o in trusted if beyond(o, limit)]
        conform = [(k, o) for k, o in tried if k["class"] == "conform"]
        linear = [(k, o) for k, o in tried if k["linear"] and "findings" in o]
        seconds = sorted(o["seconds"] for _, o in tried) or [0.0]
        per_kind = {n: sum(bool(beyond(o, 3.0)) for o in k["outcomes"] if o["status"] == "trusted") for n, k in self.kinds.items()}
        runs = max((len(k["outcomes"]) for k in self.kinds.values()), default=1)
        allowed = next(n for n in range(runs + 1) if sum(math.comb(runs, i) * 0.02**i * 0.98**(runs - i) for i in range(n + 1)) >= 0.999)
        lines = [f"- trusted: {share(trusted, tried)}; a figure beyond 3 standard deviations: {share(wrong(3.0), trusted)}, "
                 f"beyond 5: {share(wrong(5.0), trusted)} (floors 3 %, 0.5 %)",
                 f"- kinds wrong in more than {allowed} of {runs} runs: {', '.join(n for n, w in per_kind.items() if w > allowed) or 'none'}",
                 f"- 95 % intervals that cover significantly (1e-3) less than 90 % in one kind: {'; '.join(self.poorly_covered()) or 'none'}",
                 f"- conform kinds trusted: {share([o for _, o in conform if o['status'] == 'trusted'], conform)} (floor 90 %)",
                 f"- inconsistency found in fault-free linear kinds: {share([o for _, o in linear if any(f in INCONSISTENT for f in o['findings'])], linear)} "
                 f"(floor 2 %); as a warning or error: "
                 f"{share([o for _, o in linear if any(f in INCONSISTENT and s in ('warning', 'error') for f, s in o['findings'].items())], linear)}",
                 f"- processor time of one identification: at most {seconds[-1]:.1f} s, median {seconds[len(seconds) // 2]:.1f} s; "
                 f"above 10 s: {sum(s > 10.0 for s in seconds)}",
                 f"- errors: {sum(o['status'] in ('error', 'timeout') for _, o in tried)}; kinds skipped: "
                 f"{sum(all(o['status'] == 'skipped' for o in k['outcomes']) for k in self.kinds.values())}"]
        lines += summary([(k["class"], o["tuned"]) for k, o in trusted if "tuned" in o])
        judged = [o for _, o in tried if o.get("script_right")]
        if judged:
            lines.append(f"- where the script of bench/baseline.py is right within 3 %, resonid is not: "
                         f"{share([o for o in judged if o['worse_than_script']], judged)}")
        return lines

    def poorly_covered(self):
        """Figures of a kind whose trusted 95 % intervals hold the truth so seldom that 90 % is out of the question (1e-3)."""
        found = []
        for name, k in self.kinds.items():
            count = collections.defaultdict(lambda: [0, 0])
            for o in k["outcomes"]:
                for figure, f in o["figures"].items() if o["status"] == "trusted" else ():
                    if f["fixed"]:
                        count[figure][0] += 1
                        count[figure][1] += f["z"] < 1.96
            for figure, (n, held) in count.items():
                if sum(math.comb(n, i) * 0.9**i * 0.1**(n - i) for i in range(held + 1)) < 1e-3:
                    found.append(f"{name}: {figure} {held} of {n}")
        return found

    def coverage(self):
        """Pooled over kinds: all results, trusted results."""
        count = collections.defaultdict(lambda: [0, 0, 0, 0])
        for k in self.kinds.values():
            for o in k["outcomes"]:
                for name, f in o.get("figures", {}).items():
                    if f["fixed"]:
                        c, of_trusted = count[name], o["status"] == "trusted"
                        inside = f["z"] < 1.96
                        c[0], c[1], c[2], c[3] = c[0] + 1, c[1] + inside, c[2] + of_trusted, c[3] + (of_trusted and inside)
        lines = ["| figure | results | covered, % | trusted | covered, % |", "|---|---|---|---|---|"]
        percent = lambda part, whole: f"{100.0 * part / whole:.1f}" if whole else ""
        return lines + [f"| {n} | {c[0]} | {percent(c[1], c[0])} | {c[2]} | {percent(c[3], c[2])} |" for n, c in sorted(count.items())]


def identified(table, kinds, options):
    with tempfile.TemporaryDirectory() as folder, concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        simulate = Simulator(options.program, pathlib.Path(folder))
        runs = [(k, [pool.submit(run, options, simulate, k, s) for s in range(options.first, options.first + options.seeds)]) for k in kinds]
        for kind, futures in runs:
            table.add(kind, [f.result() for f in futures])
            if options.json:
                pathlib.Path(options.json).write_text(json.dumps(table.kinds, indent=1), encoding="utf-8")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--first", type=int, default=0, help="the first of the seeds: tables in parts")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--only", default="", help="kinds whose name this regular expression is found in")
    parser.add_argument("--class", dest="of", choices=("conform", "beyond", "fault"))
    parser.add_argument("--draw", default="", help="draws other machines")
    parser.add_argument("--limit", type=int, default=120, help="processor seconds of one identification")
    parser.add_argument("--markdown")
    parser.add_argument("--json")
    parser.add_argument("--keep", help="folder for every record, truth and result")
    parser.add_argument("--merge", nargs="+", metavar="FILE")
    parser.add_argument("--list", action="store_true")
    parser.add_argument("--no-baseline", dest="baseline", action="store_false")
    parser.add_argument("--no-tune", dest="tune", action="store_false")
    parser.add_argument("--tune-structure", default="pi", help="what tune designs: pi (the quickest), auto, pid, rst ...")
    parser.add_argument("--tune-evaluate", action="store_true", help="judge stiffer ones too, as given controllers")
    parser.add_argument("--identify-with", default="", help="further options of identify, as one word: '--model none'")
    parser.add_argument("--tune-draws", type=int, default=2000, help="machines that a tuning counts its confidence on")
    parser.add_argument("--fail-beyond", type=float, default=math.inf, help="exit code 1 when a trusted figure is further off")
    parser.add_argument("--fail-outside", type=float, default=math.inf, help="exit code 1 when a proposal is beyond a bound by more than this part")
    options = parser.parse_args()
    options.program = str(pathlib.Path(options.program).resolve())
    if options.baseline:
        from baseline import baseline, recordings  # needs SciPy
        options.baseline = baseline
    kinds = [k for k in trust_kinds.kinds(options.draw) if re.search(options.only, k.name) and options.of in (None, k.of)]
    if options.list:
        print("\n".join(f"{k.of:8} {'linear' if k.linear else '':7}{'drawn' if k.drawn else '':6}{k.name}" for k in kinds))
        print(f"{len(kinds)} kinds, {sum(k.drawn for k in kinds)} drawn")
        return
    table = Table()
    print("\n".join(Table.HEAD))
    if options.merge:
        found, outcomes = {}, collections.defaultdict(dict)  # the last part that has a seed counts
        for file in options.merge:
            for name, k in json.loads(pathlib.Path(file).read_text(encoding="utf-8")).items():
                found[name] = k
                outcomes[name] |= {o.get("seed", seed): o for seed, o in enumerate(k["outcomes"])}
        order = {k.name: place for place, k in enumerate(kinds)}
        for name in sorted(found, key=lambda n: order.get(n, len(order))):
            k = types.SimpleNamespace(name=name, of=found[name]["class"], linear=found[name]["linear"])
            table.add(k, [o for _, o in sorted(outcomes[name].items())])
    else:
        identified(table, kinds, options)
    print("\n".join(["", *table.totals(), "", *table.coverage()]))
    if options.markdown:
        path = pathlib.Path(options.markdown)
        before = path.read_text(encoding="utf-8").split("\n- trusted:")[0] if path.exists() else ""
        real = ["", *recordings(options.program)] if options.baseline else []
        path.write_text("\n".join([before, *table.totals(), "", *table.coverage(), *real, "", *Table.HEAD, *table.rows]) + "\n", encoding="utf-8")
    gross = [n for n, k in table.kinds.items() for o in k["outcomes"] if o["status"] == "trusted" and beyond(o, options.fail_beyond)]
    unstable = [n for n, k in table.kinds.items() for o in k["outcomes"] if "tuned" in o
                and (o["tuned"]["as"] == "unstable" or any(g["as"] == "unstable" for g in o["tuned"].get("given", [])))]
    if unstable:
        sys.exit(f"a controller was proposed that is unstable on the true machine: {', '.join(sorted(set(unstable)))}")
    outside = [n for n, k in table.kinds.items() for o in k["outcomes"] if o.get("tuned", {}).get("as") == "outside"
               and o["tuned"]["beyond"] > 1.0 + options.fail_outside]
    if outside:
        sys.exit(f"a controller was proposed that is beyond a bound by more than {100.0 * options.fail_outside:g} %: {', '.join(outside)}")
    if gross:
        sys.exit(f"trusted, and a figure beyond {options.fail_beyond} standard deviations: {', '.join(sorted(set(gross)))}")


if __name__ == "__main__":
    main()
