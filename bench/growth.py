#!/usr/bin/python3
"""How time and memory of the verbs grow with the length of a recording.

  bench/growth.py PROGRAM [--samples 10000,100000,...] [--verbs identify,validate,track,inspect] [--markdown FILE]

The recordings are the shipped experiment shaft_drive, its chirp stretched to the length, simulated by the program
itself: what is measured is duration, not accuracy. Each figure is one run: elapsed seconds, seconds of the processor
and largest resident memory of the whole program, reading the CSV file included. Fails above the floors for 2 000 000
samples (identify 20 s and 600 MB, validate 600 MB, track 10 s) and for the 20 000 of the experiment as it is (4 s).
"""
import argparse
import os
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
RATE_HZ = 2000.0
SECONDS, MEGABYTES = "seconds", "megabytes"
FLOORS = {
    ("identify", 20_000): {SECONDS: 4.0},
    ("identify", 2_000_000): {SECONDS: 20.0, MEGABYTES: 600.0},
    ("validate", 2_000_000): {MEGABYTES: 600.0},
    ("track", 2_000_000): {SECONDS: 10.0},
}


def run(command):
    """Elapsed and processor seconds and MB of one process; what it writes to the terminal is dropped."""
    begin = time.monotonic()
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    message = process.stderr.read().decode(errors="replace")
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode not in (0, 3):  # 3: an answer that is not to be trusted
        sys.exit(f"{' '.join(map(str, command))}: exit code {process.returncode}\n{message}")
    return time.monotonic() - begin, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024.0


def recording(program, samples, folder):
    """Simulated: shaft_drive with its chirp over the whole of it."""
    experiment = (ROOT / "experiments/shaft_drive.toml").read_text()
    stretched, count = re.subn(r"^duration_s = [0-9.]+", f"duration_s = {samples / RATE_HZ}", experiment, flags=re.M)
    assert count == 1
    (folder / "experiment.toml").write_text(stretched)
    file = folder / f"{samples}.csv"
    run([program, "simulate", folder / "experiment.toml", "--out", file, "--quiet"])
    return file


def command_of(program, verb, file, result):
    if verb == "identify":
        return [program, "identify", file, "--json", result, "--quiet"]
    if verb == "validate":
        return [program, "validate", result, file, "--quiet"]
    return [program, verb, file, "--quiet"]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=Path)
    parser.add_argument("--samples", default="10000,20000,100000,1000000,2000000,10000000")
    parser.add_argument("--verbs", default="identify,validate,track,inspect")
    parser.add_argument("--markdown", type=Path, help="file for the table")
    options = parser.parse_args()
    program = options.program.resolve()
    verbs = options.verbs.split(",")
    lines = ["| samples | " + " | ".join(verbs) + " |", "|---:" * (len(verbs) + 1) + "|"]
    print("\n".join(lines), flush=True)
    beyond = []
    for samples in map(int, options.samples.split(",")):
        cells = []
        with tempfile.TemporaryDirectory() as folder:
            file = recording(program, samples, Path(folder))
            for verb in verbs:
                elapsed, processor, megabytes = run(command_of(program, verb, file, Path(folder) / "result.json"))
                cells.append(f"{elapsed:.2f} s ({processor:.2f} s), {megabytes:.0f} MB")
                measured = {SECONDS: elapsed, MEGABYTES: megabytes}
                for what, most in FLOORS.get((verb, samples), {}).items():
                    if measured[what] > most:
                        beyond.append(f"{verb} of {samples} samples: {measured[what]:.1f} {what}, at most {most:g}")
        lines.append(f"| {samples} | " + " | ".join(cells) + " |")
        print(lines[-1], flush=True)
    if options.markdown:
        options.markdown.write_text("\n".join(lines) + "\n")
    for text in beyond:
        print(text, file=sys.stderr)
    return 1 if beyond else 0


if __name__ == "__main__":
    sys.exit(main())
