#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Reads one CSV file with numpy.loadtxt and with resonid in turns and prints the ratio of the median times.

    cmake --preset release && cmake --build --preset release --target bench_read_csv
    bench/csv_against_numpy.py build/release/bench/bench_read_csv --json ratios.json
"""
import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time

import numpy as np


def write_file(path, rows, number_format):
    random = np.random.default_rng(1)
    signals = random.normal(size=(rows, 3)) * [1.0, 1.0, 100.0]
    table = np.column_stack([np.arange(rows) * 0.0004, signals])
    np.savetxt(path, table, fmt=number_format, delimiter=",", header="time_s,ru,u,y", comments="")


def numpy_seconds(path):
    begin = time.perf_counter()
    table = np.loadtxt(path, delimiter=",", skiprows=1)
    return time.perf_counter() - begin, table


def resonid_seconds(driver, path):
    run = subprocess.run([driver, path], check=True, capture_output=True, text=True)
    return float(run.stdout), run.stderr.strip()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("driver", help="the program bench_read_csv")
    parser.add_argument("--rows", type=int, default=2_000_000)
    parser.add_argument("--times", type=int, default=5)
    parser.add_argument("--formats", nargs="+", default=["%.9g", "%.18e"])
    parser.add_argument("--json", help="file for the ratios; what each is to be stands in bench/floors.json")
    options = parser.parse_args()
    ratios = {}
    with tempfile.TemporaryDirectory() as folder:
        for number_format in options.formats:
            path = os.path.join(folder, "record.csv")
            write_file(path, options.rows, number_format)
            theirs, ours = [], []
            for _ in range(options.times):
                seconds, table = numpy_seconds(path)
                theirs.append(seconds)
                seconds, facts = resonid_seconds(options.driver, path)
                ours.append(seconds)
            # The same numbers: only the order of additions differs.
            total = float(facts.rsplit(" ", 1)[1])
            assert abs(total - table.sum()) <= 1e-9 * np.abs(table).sum(), (total, table.sum())
            ratio = statistics.median(theirs) / statistics.median(ours)
            ratios[f"numpy.loadtxt / read_csv, {number_format}"] = ratio
            print(f"{options.rows} x 4, {number_format}, {os.path.getsize(path) / 1e6:.0f} MB: numpy.loadtxt "
                  f"{statistics.median(theirs):.3f} s, resonid {statistics.median(ours):.3f} s, {ratio:.1f} times faster "
                  f"(medians of {options.times}; {os.cpu_count()} processors)")
    if options.json:
        with open(options.json, "w", encoding="utf-8") as file:
            json.dump(ratios, file, indent=1)
    return 0


if __name__ == "__main__":
    sys.exit(main())
