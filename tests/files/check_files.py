#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Writes the set of recordings (README.md) and holds what `resonid identify` says of each against expected.toml.

    check_files.py PROGRAM FOLDER [--only REGEX] [--jobs N] [--expect right|untrusted|error] [--verbose] [--json FILE]
    check_files.py --self-test    see that wrong answers are found

FOLDER is made and filled. One row per case: name, expected, got, seconds, ok. Exit code 1 where a case fails, 77 without NumPy.
"""
import argparse
import concurrent.futures
import json
import os
import pathlib
import re
import shlex
import subprocess
import sys
import tempfile
import time
import tomllib
import types

import make_files
import signals

HERE = pathlib.Path(__file__).resolve().parent
TOLERANCE = {"resonance": 0.01, "antiresonance": 0.01, "driven_inertia": 0.03, "load_inertia": 0.03, "stiffness": 0.03,
             "damping": 0.25}
FREQUENCIES = ("resonance", "antiresonance")
SECONDS = 120
# What nobody wants to read: 0.9999999999999996669, 4.4e9, -5860 %.
ABSURD = re.compile(r"\d\.\d{11,}|\d{13,}|\d[eE]\+?(?:0?[6-9]|[1-9]\d)\b|-\d{3,}(?:\.\d+)? ?%")


def wanted(case):
    return [case["expect"]] if isinstance(case["expect"], str) else case["expect"]


def run(program, folder, case, result):
    """What the program says: exit code, both outputs, its JSON."""
    command = [program, "identify", "-" if case.get("stdin") else case["file"], *shlex.split(case.get("options", "")),
               "--json", str(result)]
    data = (folder / case["file"]).read_bytes() if case.get("stdin") else b""
    try:
        done = subprocess.run(command, input=data, capture_output=True, timeout=SECONDS, cwd=folder,
                              env={**os.environ, "NO_COLOR": "1"})
    except subprocess.TimeoutExpired:
        return types.SimpleNamespace(code=None, out="", err=f"no answer after {SECONDS} s", json=None)
    text = json.loads(result.read_text("utf-8")) if result.exists() and done.returncode in (0, 3) else None
    return types.SimpleNamespace(code=done.returncode, out=done.stdout.decode("utf-8", "replace"),
                                 err=done.stderr.decode("utf-8", "replace"), json=text, left=result.exists())


def outcome(answer):
    if answer.code == 2:
        return "error"
    if answer.code != 0 or answer.json is None:
        return "failed" if answer.code is not None and answer.code >= 0 else "crashed or hung"
    return "trusted" if answer.json.get("trusted") else "untrusted"


def figures(result):
    """Of the JSON: what truth() has."""
    found = {r["kind"]: r["frequency_hz"] for r in reversed(result.get("resonances", []))}
    for name, parameter in result.get("model", {}).get("parameters", {}).items():
        found[name] = parameter["value"]
    return found


def wrong_figures(result, case):
    """Figures that are missing or off, as phrases."""
    kind, right, found = case.get("figures", "all"), signals.truth(case.get("motion", "rotary")), figures(result)
    names = {"all": TOLERANCE, "frequencies": FREQUENCIES, "none": ()}[kind]
    for name in names:
        if name not in found:
            yield f"no {name}"
        elif not abs(found[name] / right[name] - 1.0) <= TOLERANCE[name]:
            yield f"{name} {found[name]:.5g}, true {right[name]:.5g}"


def unsaid(patterns, text):
    return [f"does not say /{p}/" for p in patterns if not re.search(p, text, re.IGNORECASE)]


def absurd(answer, case):
    """Figures in the text that no drive has; the file's own name and numbers quoted from it are not meant."""
    return [f"says {m.group(0)}" for m in ABSURD.finditer(answer.out.replace(case.get("file", ""), ""))][:3]


def first_finding(result):
    findings = result.get("findings", [])
    return " ".join(str(v) for v in findings[0].values()) if findings else ""


def messages(err):
    """Messages on standard error: a line that is not indented begins one; where help stands belongs to the one above it."""
    return [line for line in err.splitlines() if line.strip() and not line[0].isspace() and not line.startswith("See '")]


def complaints(answer, case):
    """What is wrong with an answer; nothing where it is as expected."""
    got, accepted, says = outcome(answer), wanted(case), case.get("says", [])
    if got == "trusted":
        if "right" not in accepted:
            return ["trusted: a silent wrong answer"]
        found = list(wrong_figures(answer.json, case))
        text = answer.out + answer.err + json.dumps(answer.json.get("findings", []), ensure_ascii=False)
        return found + absurd(answer, case) + unsaid(says + case.get("says_right", []), text)
    if got not in accepted:
        return [f"{got}: {(answer.err.strip() or (first_finding(answer.json) if answer.json else '')) or 'nothing said'}"]
    if got == "untrusted":
        errors = [f["id"] for f in answer.json.get("findings", []) if f.get("severity") == "error"]
        followers = [f"followers are not suppressed: {', '.join(errors)}"] if len(errors) > 1 else []
        return unsaid(says + case.get("says_untrusted", []), first_finding(answer.json)) + followers + absurd(answer, case)
    found = unsaid(says + case.get("says_error", []), answer.err)
    if len(messages(answer.err)) != 1:
        found.append(f"{len(messages(answer.err))} messages instead of one")
    if answer.left or answer.out.strip():
        found.append("writes something although it failed")
    return found


def examine(program, folder, name, case):
    begin = time.monotonic()
    with tempfile.TemporaryDirectory() as scratch:
        answer = run(program, folder, case, pathlib.Path(scratch) / "result.json")
    found = complaints(answer, case)
    return types.SimpleNamespace(name=name, case=case, answer=answer, got=outcome(answer), complaints=found,
                                 seconds=time.monotonic() - begin)


def cases(only, expect):
    with open(HERE / "expected.toml", "rb") as file:
        document = tomllib.load(file)
    chosen = {}
    for name, case in document["case"].items():
        case.setdefault("file", name)
        if case["source"] not in document["sources"]:
            raise SystemExit(f"expected.toml: {name}: no source '{case['source']}'")
        if re.search(only, name) and (expect is None or expect in wanted(case)):
            chosen[name] = case
    forgotten = set(make_files.FILES) - {c["file"] for c in document["case"].values()}
    if forgotten:
        raise SystemExit(f"expected.toml: nothing is expected of {', '.join(sorted(forgotten))}")
    return chosen


def self_test():
    """Answers made up: right ones, and each way of being wrong. README.md lists every source, every pattern is one."""
    true = signals.truth()
    def answer(trusted=True, code=0, err="", scale=1.0, left=False, finding="low-excitation", out="", errors=1):
        result = {"trusted": trusted, "findings": [{"id": finding, "severity": "error"}] * errors,
                  "resonances": [{"kind": k, "frequency_hz": scale * true[k]} for k in FREQUENCIES],
                  "model": {"parameters": {k: {"value": true[k]} for k in TOLERANCE if k not in FREQUENCIES}}}
        return types.SimpleNamespace(code=code, out=out, err=err, json=None if code else result, left=left)
    right, error, refused = {"expect": "right"}, {"expect": "error", "says": ["comma"]}, {"expect": ["error", "untrusted"], "says": ["excit"]}
    sound = [(answer(), right), (answer(code=2, err="resonid: decimal comma\n"), error), (answer(False), refused),
             (answer(scale=3.0), {"expect": "right", "figures": "none"})]
    unsound = [(answer(scale=1.02), right), (answer(False), right), (answer(), refused), (answer(), error),
               (answer(code=2, err="resonid: bad line\n"), error), (answer(code=2, err="resonid: comma\nwarning: comma\n"), error),
               (answer(code=2, err="resonid: comma\n", left=True), error), (answer(code=-11), error), (answer(code=1), error),
               (answer(False, finding="jitter"), refused), (answer(False, errors=2), refused), (answer(out="fit -5860 %"), right),
               (answer(out="inertia 4.4e9"), right), (answer(out="0.9999999999999996669"), right), (answer(), {"expect": "right", "says": ["rpm"]})]
    with open(HERE / "expected.toml", "rb") as file:
        document = tomllib.load(file)
    for case in cases("", None).values():
        unsaid([p for key, patterns in case.items() if key.startswith("says") for p in patterns], "")
    unlisted = [k for k in document["sources"] if f"`{k}`" not in (HERE / "README.md").read_text("utf-8")]
    if unlisted:
        print(f"README.md does not list the sources {', '.join(unlisted)}")
        return 1
    missed = [k for k, (a, c) in enumerate(unsound) if not complaints(a, c)]
    blamed = [k for k, (a, c) in enumerate(sound) if complaints(a, c)]
    print("wrong answers are found" if not missed and not blamed else f"missed {missed}, blamed {blamed}")
    return 1 if missed or blamed else 0


def main():
    if sys.argv[1:] == ["--self-test"]:
        return self_test()
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--only", default="", help="names of cases, as a regular expression")
    parser.add_argument("--expect", choices=("right", "untrusted", "error"), help="only cases that accept this")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--verbose", action="store_true", help="what the program said, below each case that fails")
    parser.add_argument("--json", type=pathlib.Path, help="the table, for machines")
    arguments = parser.parse_args()
    chosen = cases(arguments.only, arguments.expect)
    if not chosen:
        parser.error("no case is called so")
    program = str(pathlib.Path(arguments.program).resolve())
    files = {c["file"] for c in chosen.values()}
    make_files.write(arguments.folder, lambda name: name in files)

    width = max(map(len, chosen))
    print(f"{'case':{width}}  {'expected':17}  {'got':17}  {'s':>5}  ok")
    failed, rows = 0, []
    with concurrent.futures.ThreadPoolExecutor(max(1, arguments.jobs)) as pool:
        for done in pool.map(lambda item: examine(program, arguments.folder, *item), chosen.items()):
            failed += bool(done.complaints)
            print(f"{done.name:{width}}  {' or '.join(wanted(done.case)):17.17}  {done.got:17}  {done.seconds:5.2f}  "
                  f"{'no' if done.complaints else 'yes'}", flush=True)
            for complaint in done.complaints:
                print(f"    {complaint}")
            if done.complaints and arguments.verbose:
                print("    | " + "\n    | ".join((done.answer.out + done.answer.err).splitlines()[:40]))
            rows.append({"case": done.name, "got": done.got, "ok": not done.complaints, "complaints": done.complaints,
                         "seconds": round(done.seconds, 3), "standard_error": done.answer.err})
    if arguments.json:
        arguments.json.write_text(json.dumps(rows, indent=1), "utf-8")
    print(f"{len(chosen)} cases of {len(files)} files, {len(chosen) - failed} as expected, {failed} not")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
