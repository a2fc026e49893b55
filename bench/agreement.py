#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Whether `identify` and `validate` say the same of one recording: each is identified, and the model validated on the recording itself.

    bench/agreement.py PROGRAM [--kept FOLDER ...] [--jobs 2] [--only REGEX]

Recordings: all of experiments/, simulated, with the controller and the delay that a user knows, and what `trust.py --keep FOLDER` kept. Prints how
often which pair of words was said and every recording about which they disagree: a trusted result whose model is rejected or not trusted on
its own recording, or a result that is not trusted and a model that is. Exit code 1 where there is any.
"""
import argparse
import collections
import concurrent.futures
import json
import pathlib
import re
import shlex
import subprocess
import sys
import tempfile

EXPERIMENTS = pathlib.Path(__file__).resolve().parent.parent / "experiments"


def simulated(program, experiment, folder):
    folder.mkdir()
    subprocess.run([program, "simulate", experiment, "--out", "r.csv", "--truth", "truth.json"], cwd=folder, check=True,
                   capture_output=True)
    truth = json.loads((folder / "truth.json").read_text(encoding="utf-8"))
    told = ["--delay", repr(truth["delay_s"])] if truth.get("delay_s", 0.0) > 1e-12 else []
    if "controller" in truth:
        (folder / "c.json").write_text(json.dumps(truth["controller"]), encoding="utf-8")
        told += ["--controller", "c.json"]
    subprocess.run([program, "identify", "r.csv", "--json", "i.json", *told], cwd=folder, capture_output=True)
    (folder / "told").write_text(shlex.join(told), encoding="utf-8")


def of_identify_alone(told):
    words = iter(shlex.split(told))
    return [w for word in words for w in ((next(words), ())[1] if word.startswith("--second-output") else (word,))]


def words_of(program, folder):
    """(what identify says, what validate says, findings that only validate has)"""
    if not (folder / "i.json").exists():
        return "error", "not asked", []
    result = json.loads((folder / "i.json").read_text(encoding="utf-8"))
    first = "trusted" if result["trusted"] else "not trusted"
    if "model" not in result and "black_box" not in result:
        return first, "no model", []
    told = of_identify_alone((folder / "told").read_text(encoding="utf-8"))
    done = subprocess.run([program, "validate", "i.json", "r.csv", "--json", "-", *told], cwd=folder, capture_output=True, text=True)
    if done.returncode:
        return first, "error", done.stderr.strip().splitlines()[:1]
    v = json.loads(done.stdout)
    known = {f["id"] for f in result["findings"]}
    return (first, v["verdict"] + ("" if v["trusted"] else ", not trusted"),
            [f["id"] for f in v["findings"] if f["severity"] != "info" and f["id"] not in known])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("--kept", nargs="*", default=[], type=pathlib.Path)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--only", default="")
    options = parser.parse_args()
    program = str(pathlib.Path(options.program).resolve())
    with tempfile.TemporaryDirectory() as work, concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        experiments = [e for e in sorted(EXPERIMENTS.glob("*.toml")) if re.search(options.only, e.stem)]
        folders = [pathlib.Path(work) / e.stem for e in experiments]
        list(pool.map(lambda pair: simulated(program, *pair), zip(experiments, folders)))
        folders += [f for kept in options.kept for f in sorted(kept.iterdir()) if f.is_dir() and re.search(options.only, f.name)]
        said = list(pool.map(lambda f: words_of(program, f), folders))
    print("| identify | validate | recordings |\n|---|---|---|")
    for (first, second), n in sorted(collections.Counter(s[:2] for s in said).items()):
        print(f"| {first} | {second} | {n} |")
    apart = 0
    for folder, (first, second, only) in zip(folders, said):
        rejected = "rejected" in second or "not trusted" in second
        judged = second not in ("error", "not asked", "no model")
        disagree = judged and (rejected if first == "trusted" else not rejected)
        apart += disagree
        if disagree or second == "error" or (first == "trusted" and judged and second != "accepted"):
            print(f"{'DISAGREE' if disagree else 'note'}: {folder.name}: {first}, {second}; validate alone: {' '.join(only)}")
    sys.exit(1 if apart else 0)


if __name__ == "__main__":
    main()
