#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Ratios from the JSON of bench_line_bank, all from one run: 21 lines of u and y.

    bench/line_bank_ratios.py bench_line_bank.json [--json RATIOS]

Times are the least CPU time of all repetitions. Flop bound: the recursion as it is written, 11 per line and 1 per
channel and sample; where the responses are wanted, 12 more per line and row of responses (power 3, product with the
conjugate 6, reciprocal 1, scaling 2; the known delay costs none, for it can be put into the gains). The bound is
these over the measured peak of fused multiply-adds. A reciprocal to full accuracy is really an estimate and four
fused multiply-adds, 9; the bound with these is printed too. What each is to be stands in bench/floors.json. On a machine that others use at the
same time the peak keeps its value better than the rest does: judge on a quiet one.
"""
import json
import sys

LINES, CHANNELS = 21, 2
RECURSION = CHANNELS * (11 * LINES + 1)
RESPONSE = 12 * LINES


def least(runs):
    """{name: least ns per item} and the largest rate of flops per ns."""
    ns, peak = {}, 0.0
    for run in runs:
        if run.get("run_type") != "iteration":
            continue
        name = run.get("run_name", run["name"])
        if "flops" in run:
            peak = max(peak, run["flops"] * 1e-9)
        else:
            ns[name] = min(ns.get(name, float("inf")), 1e9 / run["items_per_second"])
    return ns, peak


def main(arguments):
    with open(arguments[0], encoding="utf-8") as file:
        ns, peak = least(json.load(file)["benchmarks"])
    call = "resonid/per_call/responses_every_sample"
    every, sixteenth = "resonid/batch/responses_every/1", "resonid/batch/responses_every/16"
    print(f"{'':52s} ns per sample of u and y")
    for name, time in sorted(ns.items()):
        print(f"{name:52s} {time:8.2f}")
    print(f"{'peak, flops per ns':52s} {peak:8.2f}")
    bounds = {every: (RECURSION + RESPONSE) / peak, sixteenth: (RECURSION + RESPONSE / 16) / peak}
    ratios = {
        "Eigen dense, two filters / per call with responses": ns["eigen_dense/two_filters"] / ns[call],
        "Eigen dense, two columns / per call with responses": ns["eigen_dense/two_columns"] / ns[call],
        "liquid-dsp biquads / per call with responses": ns["liquid_biquads"] / ns[call],
        "batch with responses every sample / flop bound": ns[every] / bounds[every],
        "batch with responses every 16 / flop bound": ns[sixteenth] / bounds[sixteenth],
    }
    print()
    for name, ratio in ratios.items():
        print(f"{name:52s} {ratio:8.2f}")
    if "--json" in arguments:
        with open(arguments[arguments.index("--json") + 1], "w", encoding="utf-8") as file:
            json.dump(ratios, file, indent=1)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
