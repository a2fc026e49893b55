#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Loop figures of Publication VI, Figure 5, read at every sample: Figure5.ReadAtEverySample.

    /usr/bin/python3 tests/reference/figure_5_every_sample.py build/dev/apps/cli/resonid

Records of `resonid simulate` with seeds 1 ... 20; the published tracker p(k) = e^{jw(k-1)Ts} p(k-1) + (z - Re)/9 for torque and
velocity; L = C Y/U e^{jw 4 ms} at every sample, without the operating point.
"""
import pathlib
import subprocess
import sys
import tempfile
import tomllib

import numpy as np

EXPERIMENT = pathlib.Path(__file__).resolve().parents[2] / "experiments" / "vi_chirp_a_literal.toml"


def tracked(signal, angle):
    p, out = 0.0 + 0.0j, np.empty(len(signal), complex)
    for k, z in enumerate(signal):
        p *= np.exp(1j * angle[k - 1]) if k else 1.0
        p += (z - p.real) / 9.0
        out[k] = p
    return out


def figures(hz, loop):
    """Crossover (Hz), phase margin (deg), modulus margin, resonance, anti-resonance (Hz) by the publication's rules: the margins between
    the crossover and where the curve leaves the third quadrant, the others at extrema of |1 + L| and |L| in the fourth."""
    size, distance = np.abs(loop), np.abs(1.0 + loop)
    k = np.nonzero((size[:-1] >= 1.0) & (size[1:] < 1.0))[0][0]
    part = (size[k] - 1.0) / (size[k] - size[k + 1])
    crossover = hz[k] + part * (hz[k + 1] - hz[k])
    at = loop[k] + part * (loop[k + 1] - loop[k])
    margin = np.degrees(np.arccos(1.0 - 0.5 * abs(1.0 + at)**2))
    modulus, i = abs(1.0 + at), k + 1
    while loop[i].real < 0.0 and loop[i].imag < 0.0:
        modulus, i = min(modulus, distance[i]), i + 1
    fourth = (loop.real > 0.0) & (loop.imag < 0.0)
    middle = fourth[1:-1]
    highest = middle & (distance[1:-1] >= distance[:-2]) & (distance[1:-1] >= distance[2:])
    deepest = middle & (size[1:-1] <= size[:-2]) & (size[1:-1] <= size[2:])
    inner = hz[1:-1]
    return crossover, margin, modulus, inner[highest][np.argmax(distance[1:-1][highest])], inner[deepest][np.argmin(size[1:-1][deepest])]


def main():
    program, text = sys.argv[1], EXPERIMENT.read_text(encoding="utf-8")
    c = tomllib.loads(text)
    for rate in (1000.0, 500.0, 2000.0):
        runs = []
        for seed in range(1, 21):
            with tempfile.TemporaryDirectory() as folder:
                e = c | {"run": {**c["run"], "sample_rate_hz": rate, "seed": seed}}
                lines = "\n".join(f"[{t}]\n" + "\n".join(f"{k} = {v!r}".replace("'", '"') for k, v in keys.items()) for t, keys in e.items())
                pathlib.Path(folder, "e.toml").write_text(lines, encoding="utf-8")
                subprocess.run([program, "simulate", f"{folder}/e.toml", "--out", f"{folder}/r.csv"], check=True, capture_output=True)
                with open(f"{folder}/r.csv", encoding="utf-8") as file:
                    names = file.readline().strip().split(",")
                    rows = np.loadtxt(file, delimiter=",")
            x, ts = c["excitation"], 1.0 / rate
            hz = x["from_hz"] + (x["to_hz"] - x["from_hz"]) * np.arange(len(rows)) * ts / x["duration_s"]
            w = 2.0 * np.pi * hz
            u, y = (tracked(rows[:, names.index(n)] - at, w * ts) for n, at in (("u", 0.0), ("y", c["motion"]["velocity"])))
            z = np.exp(1j * w * ts)
            ctl = c["controller"]
            controller = ctl["gain"] * (1.0 + ts / ctl["integral_time_s"] / (1.0 - 1.0 / z))
            loop = controller * y / u * np.exp(1j * w * c["measurement"]["delay_s"])
            order = np.argsort(hz)
            order = order[(hz[order] > 1.8 - 1e-9) & (hz[order] < 33.0 + 1e-9)]
            runs.append(figures(hz[order], loop[order]))
        print(rate, np.mean(runs, axis=0))


if __name__ == "__main__":
    main()
