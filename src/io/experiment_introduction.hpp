// SPDX-License-Identifier: MIT
#pragma once

#include <string_view>

namespace resonid::io {

/// What docs/experiment_files.md begins with, before the tables of keys.
inline constexpr std::string_view kExperimentIntroduction = R"md(# Experiment files

<!-- Written by `resonid simulate --schema`; change the descriptions in include/resonid, not this file. -->

An experiment file is a [TOML](https://toml.io) file that describes a simulated drive and what is done with it:

    resonid simulate experiments/demo.toml --out record.csv --truth truth.json
    resonid simulate demo --duration 5 --seed 2        # a shipped file by its name, shorter, other noise
    resonid simulate --list                            # the shipped ones

What the equations behind the keys are stands in [methods/simulation.md](methods/simulation.md).

```toml
[drive]
driven_inertia = 0.032    # kgm2
load_inertia = 0.032
stiffness = 143.75        # Nm/rad: a shaft, as there is no radius_m
damping = 0.3             # Nms/rad

[controller]              # without this table: open loop
kind = "pi"
gain = 1.036              # Nms/rad
integral_time_s = 0.147

[motion]                  # without this table: standstill
kind = "constant"
velocity = 10.0           # rad/s

[excitation]
kind = "multisine"
lines_hz = "2:30:1"       # or a list, [2.9, 5.9, 8.9]
amplitude = 0.3           # Nm of each line

[measurement]
delay_s = 0.004
noise_rms = 0.05          # rad/s

[run]
sample_rate_hz = 500.0
duration_s = 10.0
```

Required are the tables `[drive]` and `[run]`, and `[excitation]` or a duration. Every other table, and every key that
has a default, may be left out. "Only for" names the values of `structure` or `kind` for which a key exists; in the file
of another one it is an error. Units are those of a rotary drive; with `motion = "linear"` in `[drive]` read kg for kgm2, N
for Nm, N/m for Nm/rad and m for rad. A key that ends in `_hz`, `_s`, `_m`, `_kg` or `_n` carries its unit whatever the
drive.

## Errors

A file is refused before the first sample and before anything is written, with exit code 2 and one line that says where,
what was found and what is required:

    e.toml:29:1: unknown key 'measurement.dealy_s' (did you mean 'delay_s'?); known here: delay_s, noise_rms, ...
    e.toml:5:18: drive.driven_inertia: found -0.032, must be > 0
    e.toml:14:8: controller.gain: found 100, must leave the closed loop stable: an oscillation at 70.1 Hz grows tenfold in 0.00664 s

Refused are: what is not TOML, unknown tables and keys, wrong types, values out of range, lists of unequal length, a
sample rate below twice the highest resonance, a motion that leaves the stroke, and an unstable closed loop (its poles,
delay included, at every stiffness that the run may go through). What only shows itself on the way, a cart that is driven out of
its stroke by the excitation or a loop that diverges, ends the run in the same manner, also without a file.
)md";

}  // namespace resonid::io
