#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The embedded stages on a Cortex-M, in QEMU: builds the images, runs them, compares and tabulates.

    measure.py build   CORE WORK [--texts PROGRAM]   cross-compile the images (CORE: m4 or m7) into the folder WORK; with the
                                                     program's exported controllers (exported/texts.cpp)
    measure.py run     CORE WORK --reference PROGRAM run them all, compare with the host's results, write WORK/results.json
    measure.py exported CORE WORK --texts PROGRAM    run those controllers, compare with what the program says
    measure.py example CORE WORK                     run the example; its exit code tells whether it saw what it should
    measure.py symbols CORE WORK                     no heap; double precision only where it is known to be
    measure.py check   CORE WORK                     floors, and the table in docs/embedded.md against the results
    measure.py write   WORK_M4 WORK_M7               write that table anew

Exit code 77, which ctest shows as skipped, when the cross compiler or QEMU is not there.
"""
import argparse
import cmath
import json
import math
import pathlib
import re
import shutil
import struct
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
PAGE = ROOT / "docs" / "embedded.md"
BEGIN, END = "<!-- table: begin -->", "<!-- table: end -->"
MACHINE = {"m4": "mps2-an386", "m7": "mps2-an500"}
TOOLS = ["arm-none-eabi-g++", "qemu-system-arm", "ninja"]

# QEMU: -icount shift=6 makes an instruction 64 ns; the boards' timer ticks every 40 ns.
INSTRUCTIONS_PER_TICK = 40.0 / 64.0

# Case -> what it is, in the order of the table.
CASES = {
    "line_bank_8": "`LineBank<float, 8>`: u, y and the response at all lines",
    "line_bank_21": "`LineBank<float, 21>`: u, y and the response at all lines",
    "kalman_bank_8": "`KalmanBank<float, 8>`: one signal",
    "response_tracker_8": "`ResponseTracker<KalmanBank<float, 8>>`: ru, u, y, one response with its deviation",
    "chirp_tracker_3": "`ChirpTracker<float, 3>`: ru, u and y",
    "sliding_dft_21": "`SlidingDft<float, 21, 512>`: one signal",
    "rls_6": "`RecursiveLeastSquares<float, 6>`",
    "arx_3": "`Arx<float, 3>`",
    "output_error_3": "`OutputError<float, 3>`",
    "cloe_3": "`ClosedLoopOutputError<float, 3>`",
    "instrumental_variables_3": "`InstrumentalVariables<float, 3>`",
    "physical_tracker": "`PhysicalTracker<float, 0>`",
    "response_fit_3_21": "`ResponseFit<float, 3, 21>`: a whole fit",
    "recursive_response_fit_3_21": "`RecursiveResponseFit<float, 3, 21>`",
    "prbs_10": "`Prbs`",
    "multisine_21": "`Multisine<21>`",
    "chirp": "`Chirp`",
    "stepped_sine_21": "`SteppedSine<21>`",
    "change_detector": "`ChangeDetector<float, 64>`, blocks of 16",
    "axis_lines_8": "`BasicAxis` of `AxisLines<float, 8>`: a row of response and margins every 64 samples, spread over them",
    "drive_control": "`DriveControl<float, 2, 5>`: PI, two biquads, a schedule of five nodes, a limit",
    "drive_cascade": "the same as a cascade, its position summed, while other biquads take over: both chains run",
}
# Most that may be, on the M4F: instructions per sample, bytes.
LARGEST_STEP = {"line_bank_8": 600, "line_bank_21": 1400, "chirp_tracker_3": 300, "rls_6": 650, "cloe_3": 1300, "drive_control": 300, "drive_cascade": 400}
LARGEST_STATE = {"line_bank_21": 1024}
LARGEST_CODE = {"core_set": 48 * 1024, "whole_library": 48 * 1024}
# Floors that are not reached yet (docs/embedded.md says so too). What reaches its floor must leave this list.
MISSED = {"whole_library"}
TOLERANCE = 1e-5  # of the host's results
TABLE_TOLERANCE = 0.02  # of the committed table: patch levels of the compiler differ a little


def tools_or_skip():
    missing = [tool for tool in TOOLS if not shutil.which(tool)]
    if missing:
        print(f"skipped: {', '.join(missing)} not found (tools/install_packages test)")
        sys.exit(77)


def write_texts(program, work):
    """C texts of designs into the folder of which an image is made; torque of each by the law's definition."""
    said = subprocess.run([program, str(work / "exported")], stdout=subprocess.PIPE, text=True, check=True).stdout
    torque = {}
    for line in said.splitlines():
        _, name, value = line.split()
        torque.setdefault(name, []).append(float(value))
    return torque


def build(core, work, texts):
    folder = ""
    if texts:
        write_texts(texts, work)
        folder = str((work / "exported").resolve())
    subprocess.run(["cmake", "--preset", f"cortex-{core}", "-B", str(work), f"-DRESONID_EXPORTED={folder}"], cwd=ROOT,
                   check=True, stdout=subprocess.DEVNULL)
    return subprocess.run(["cmake", "--build", str(work), "--target", "cortex_images"], check=False).returncode


def images(work):
    return work / "hosts" / "cortex-m"


def run_image(core, path):
    command = ["qemu-system-arm", "-M", MACHINE[core], "-nographic", "-monitor", "none", "-serial", "none",
               "-semihosting-config", "enable=on,target=native", "-icount", "shift=6,sleep=off", "-kernel", str(path)]
    done = subprocess.run(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                          text=True, timeout=60, check=False)
    if done.returncode != 0:
        sys.exit(f"{path.name}: exit code {done.returncode}\n{done.stdout}")
    return parse(done.stdout)


def parse(text):
    """Printed results: groups of floats as [(name, [value])], and numbers."""
    groups, numbers = [], {}
    for line in text.splitlines():
        kind, name, *words = line.split()
        if kind == "floats":
            groups.append((name, [struct.unpack(">f", bytes.fromhex(word))[0] for word in words]))
        elif kind == "number":
            numbers[name] = int(words[0], 16)
    return groups, numbers


# Largest difference, relative to the largest torque.
EXPORTED_TOLERANCE = {"double": 1e-12, "float": 1e-5}
# Coefficients of polynomials cancel, those of the PID in the texts to a 200th of their sum, and so rounding grows: 2^-24 times 200.
POLYNOMIALS_TOLERANCE = {"double": 1e-12, "float": 3e-5}


def exported(core, work, texts):
    groups, numbers = run_image(core, images(work) / "exported.elf")
    found, failed = {}, 0
    for name, (rounded, rest) in groups:
        found.setdefault(name, []).append(rounded + rest)
    wanted = write_texts(texts, work)
    if found.keys() != wanted.keys() or not wanted:
        sys.exit("the image has other controllers than the program: measure.py build")
    for name, torque in wanted.items():
        size = max(abs(x) for x in torque)
        if len(found[name]) != len(torque) or not size > 0.0:
            sys.exit(f"{name}: {len(found[name])} samples, not {len(torque)}")
        difference = max(abs(a - b) for a, b in zip(found[name], torque)) / size
        tolerance = POLYNOMIALS_TOLERANCE if name.startswith("rst") else EXPORTED_TOLERANCE
        good = difference <= tolerance[name.rsplit("_", 1)[1]]
        instructions = numbers[name] * INSTRUCTIONS_PER_TICK / len(torque)
        print(f"{name:16} {instructions:6.0f} instructions, {difference:.1e} from the design{'' if good else ': too far'}")
        failed |= not good
    return failed


def sizes(path):
    """Code and constants in flash, without and with what comes from libm, libc and libgcc."""
    own, libraries = 0, 0
    lines = path.with_suffix(".map").read_text().split("Linker script and memory map")[1].split("\n")
    for number, line in enumerate(lines):
        section = re.match(r"^ (?:\.text|\.rodata|\.ARM\.exidx|\.vectors|\.data)\S*(.*)$", line)
        if not section:
            continue
        entry = re.match(r"\s+0x[0-9a-f]+\s+0x([0-9a-f]+) (\S+)$", section.group(1) or lines[number + 1])
        if not entry:
            continue
        if re.search(r"lib(m|c|gcc)\.a\(", entry.group(2)):
            libraries += int(entry.group(1), 16)
        else:
            own += int(entry.group(1), 16)
    return own, libraries


def compare(case, target, host):
    """Largest difference of host and target, relative to the largest value of its group, and where."""
    if [(name, len(values)) for name, values in target] != [(name, len(values)) for name, values in host] or not host:
        sys.exit(f"{case}: host and target print different things")
    largest, worst = 0.0, ""
    for (name, found), (_, expected) in zip(target, host):
        if not all(math.isfinite(x) for x in found):
            sys.exit(f"{case}: {name} is not finite")
        size = max(abs(x) for x in expected)
        if size > 0.0:
            difference = max(abs(a - b) for a, b in zip(found, expected)) / size
            if difference > largest:
                largest, worst = difference, f"{name}: {found} here, {expected} on the host"
    return largest, worst


def run(core, work, reference):
    results, failed = {}, []
    _, idle = run_image(core, images(work) / "empty.elf")
    empty = sizes(images(work) / "empty.elf")
    for case in CASES:
        path = images(work) / f"{case}.elf"
        groups, numbers = run_image(core, path)
        host, _ = parse(subprocess.run([reference, case], stdout=subprocess.PIPE, text=True, check=True).stdout)
        difference, worst = compare(case, groups, host)
        fault = check_truth(case, groups)
        if difference > TOLERANCE:
            failed.append(f"{case}: differs from the host by {difference:.1e}; {worst}")
        if fault:
            failed.append(f"{case}: {fault}")
        overhead = idle["step_ticks"] / idle["samples"]
        size = sizes(path)
        results[case] = {
            "step": (numbers["step_ticks"] / numbers["samples"] - overhead) * INSTRUCTIONS_PER_TICK,
            "longest": (numbers["longest_step_ticks"] - overhead) * INSTRUCTIONS_PER_TICK,
            "create": numbers["create_ticks"] * INSTRUCTIONS_PER_TICK,
            "state": numbers["state_bytes"],
            "code": size[0] - empty[0],
            "libraries": size[1] - empty[1],
            "difference": difference,
        }
        print(f"{case:28} {results[case]['step']:9.0f} instructions, {difference:.1e} from the host")
    for name in LARGEST_CODE:
        size = sizes(images(work) / f"{name}.elf")
        results[name] = {"code": size[0] - empty[0], "libraries": size[1] - empty[1]}
        print(f"{name}: {results[name]}")
    (work / "results.json").write_text(json.dumps(results, indent=1))
    for line in failed:
        print(line)
    return 1 if failed else 0


# Truth about the drive of record.hpp, from its physical parameters alone.
RATE_HZ, J1, J2, STIFFNESS, DAMPING = 256.0, 0.02, 0.03, 2000.0, 0.5
RESONANCE_HZ = math.sqrt(STIFFNESS * (1.0 / J1 + 1.0 / J2)) / (2.0 * math.pi)


def product(a, b):
    return [[sum(x * y for x, y in zip(row, column)) for column in zip(*b)] for row in a]


def zoh_drive():
    """exp of the drive's matrix and input over a sample: states are v1, v2 and the twist."""
    a = [[-DAMPING / J1, DAMPING / J1, -STIFFNESS / J1, 1.0 / J1],
         [DAMPING / J2, -DAMPING / J2, STIFFNESS / J2, 0.0],
         [1.0, -1.0, 0.0, 0.0],
         [0.0, 0.0, 0.0, 0.0]]
    a = [[x / RATE_HZ / 1024.0 for x in row] for row in a]
    total = [[float(i == j) for j in range(4)] for i in range(4)]
    term = total
    for n in range(1, 12):
        term = [[x / n for x in row] for row in product(term, a)]
        total = [[x + y for x, y in zip(p, q)] for p, q in zip(total, term)]
    for _ in range(10):
        total = product(total, total)
    return total


def true_response(frequency_hz):
    """v1 over the torque: (z - A)^-1 b by Cramer's rule."""
    zoh = zoh_drive()
    z = cmath.exp(2j * math.pi * frequency_hz / RATE_HZ)
    m = [[(z if i == j else 0.0) - zoh[i][j] for j in range(3)] for i in range(3)]
    b = [zoh[i][3] for i in range(3)]

    def determinant(d):
        return (d[0][0] * (d[1][1] * d[2][2] - d[1][2] * d[2][1]) - d[0][1] * (d[1][0] * d[2][2] - d[1][2] * d[2][0])
                + d[0][2] * (d[1][0] * d[2][1] - d[1][1] * d[2][0]))

    return determinant([[b[i]] + m[i][1:] for i in range(3)]) / determinant(m)


def resonance_hz(a):
    """Undamped frequency of the complex poles of 1 + a1 z^-1 + a2 z^-2 + a3 z^-3 (Durand and Kerner)."""
    roots = [complex(0.4, 0.9) ** k for k in range(3)]
    for _ in range(200):
        for i, r in enumerate(roots):
            others = math.prod([r - q for j, q in enumerate(roots) if j != i])
            roots[i] = r - (r**3 + a[0] * r**2 + a[1] * r + a[2]) / others
    return max(abs(cmath.log(r)) * RATE_HZ / (2.0 * math.pi) for r in roots if abs(r.imag) > 1e-3)


def check_truth(case, groups):
    """What is wrong with the newest results, by the truth; empty when nothing is."""
    newest = groups[-len(groups) // 4:]  # of four reports
    if case.startswith("line_bank"):
        lines = [complex(*values) for name, values in newest if name == "response"]
        if len(lines) == 21:
            for i, found in enumerate(lines):
                expected = true_response(10.0 * (i + 1) * RATE_HZ / 1024.0)
                if abs(found - expected) > 0.05 * abs(expected):
                    return f"line {i} is {found}, not {expected}"
    if case in ("arx_3", "cloe_3", "output_error_3", "instrumental_variables_3"):
        found = resonance_hz(dict(newest)["a"])
        if abs(found / RESONANCE_HZ - 1.0) > 0.01:
            return f"resonance {found:.2f} Hz, not {RESONANCE_HZ:.2f}"
    if case == "physical_tracker":
        for (_, [found]), expected in zip(newest, (J1, J2, STIFFNESS, DAMPING)):
            if abs(found / expected - 1.0) > 0.05:
                return f"{found} is not {expected}"
    return ""


# Double precision in software, from libgcc; hardware on the M7.
DOUBLE = re.compile(r"__aeabi_(d[a-z2]|[a-z]+2d|cd|l2d|ul2d)|__(add|sub|mul|div|neg)df3|__\w*df2|__\w*(si|di|sf)df2?$")
HEAP = re.compile(r"^(_?(malloc|calloc|realloc|free)(_r)?|_?sbrk(_r)?|_Zn[wa].*|_Zd[la].*)$")
# Cases whose steps keep to single precision, and must.
SINGLE = ["line_bank_8", "line_bank_21", "kalman_bank_8", "sliding_dft_21", "rls_6", "arx_3", "output_error_3", "cloe_3",
          "instrumental_variables_3", "response_fit_3_21", "recursive_response_fit_3_21", "drive_control", "drive_cascade"]


def calls(path):
    """Function -> functions that it calls or jumps to."""
    text = subprocess.run(["arm-none-eabi-objdump", "-d", "--no-show-raw-insn", str(path)], stdout=subprocess.PIPE,
                          text=True, check=True).stdout
    graph, function = {}, ""
    for line in text.splitlines():
        begin = re.match(r"^[0-9a-f]+ <(.+)>:$", line)
        if begin:
            function = begin.group(1)
            graph[function] = set()
            continue
        jump = re.search(r"\tb\S*\t[0-9a-f]+ <([^+>]+)>", line)
        if jump and jump.group(1) != function:
            graph[function].add(jump.group(1))
    return graph


def reached(graph, begin):
    """Function -> the one it is first reached from."""
    found, waiting = {begin: ""}, [begin]
    while waiting:
        function = waiting.pop()
        for target in sorted(graph.get(function, ())):
            if target not in found:
                found[target] = function
                waiting.append(target)
    return found


def symbols(core, work):
    failed = 0
    for case in CASES:
        path = images(work) / f"{case}.elf"
        names = subprocess.run(["arm-none-eabi-nm", "--format=just-symbols", str(path)], stdout=subprocess.PIPE,
                               text=True, check=True).stdout.split()
        heap = [name for name in names if HEAP.match(name)]
        graph = calls(path)
        steps = [name for name in graph if re.search(r"Case.*4stepERK6Sample$", name)]
        if len(steps) != 1:
            sys.exit(f"{case}: no step in {sorted(graph)}")
        found = reached(graph, steps[0])
        double = sorted({found[name] for name in found if DOUBLE.match(name) and found[name].startswith("_Z")})
        print(f"{case:28} heap: {', '.join(heap) or 'none'}; double precision per sample: {', '.join(double) or 'none'}")
        if heap or (double and case in SINGLE and core == "m4"):
            print(f"{case}: must have none")
            failed = 1
    return failed


CORE_NAMES = {"m4": "M4F", "m7": "M7"}
COLUMNS = {
    "instructions per sample": lambda r: f"{r['step']:.0f} ({r['longest']:.0f})",
    "code": lambda r: f"{r['code']} + {r['libraries']}",
    "create": lambda r: f"{r['create'] / 1000:.{0 if r['create'] > 1e4 else 2}f}",
}


def table(results):
    """The table as lines, `results` of both cores."""
    head = ["estimator", "state"] + [f"{column}, {CORE_NAMES[core]}" for column in COLUMNS for core in results]
    lines = ["| " + " | ".join(head) + " |", "|---|" + "---:|" * (len(head) - 1)]
    for case, meaning in CASES.items():
        cells = [meaning, str(results["m4"][case]["state"])]
        cells += [cell(r[case]) for cell in COLUMNS.values() for r in results.values()]
        lines.append("| " + " | ".join(cells) + " |")
    lines.append("")
    for name, meaning in (("core_set", "`LineBank` of 21 lines, `ChirpTracker`, `SlidingDft`, `RecursiveLeastSquares`, "
                           "`ClosedLoopOutputError`, `PhysicalTracker` and the generators"),
                          ("whole_library", "All of the table but the change detector, `LineBank` of 8 lines, the axis, the controller and the lone "
                           "`KalmanBank`")):
        lines.append(f"- In one image, {meaning}: " + "; ".join(
            f"{CORE_NAMES[core]} {r[name]['code']} bytes + {r[name]['libraries']} of libm, libgcc and libc"
            for core, r in results.items()) + ".")
    return lines


def numbers_of(text):
    return [float(x) for x in re.findall(r"\d+(?:\.\d+)?(?:e[+-]?\d+)?", text)]


def check(core, work):
    results = json.loads((work / "results.json").read_text())
    failed = []
    if core == "m4":
        for column, limits in (("step", LARGEST_STEP), ("state", LARGEST_STATE), ("code", LARGEST_CODE)):
            for case, most in limits.items():
                value = results[case][column]
                print(f"{case}: {column} {value:.0f}, floor {most}")
                if (0 < value < most) == (case in MISSED):
                    failed.append(f"{case}: {'reached, take it out of MISSED' if case in MISSED else 'floor missed'}")
    committed = PAGE.read_text().split(BEGIN)[1].split(END)[0].split("\n")
    fresh = table({"m4": results, "m7": results})
    if len(committed) != len(fresh) + 2:
        failed.append("the table has other rows: hosts/cortex-m/measure.py write")
    own = [i for i, name in enumerate(fresh[0].split("|")) if not name.endswith(("M4F ", "M7 ")) or CORE_NAMES[core] in name]
    for before, now in zip(committed[1:], fresh):
        for i in own if before.startswith("|") else []:
            old, new = before.split("|")[i], now.split("|")[i]
            if re.sub(r"\d\S*", "", old) != re.sub(r"\d\S*", "", new) or not all(
                    abs(a - b) <= max(2.0, TABLE_TOLERANCE * a) for a, b in zip(numbers_of(old), numbers_of(new))):
                failed.append(f"the table says{old}, measured is{new}: {before}")
    for line in failed:
        print(line)
    return 1 if failed else 0


def write(works):
    results = {core: json.loads((work / "results.json").read_text()) for core, work in works.items()}
    text = PAGE.read_text()
    before, rest = text.split(BEGIN)
    PAGE.write_text(before + BEGIN + "\n" + "\n".join(table(results)) + "\n" + END + rest.split(END)[1])
    return 0


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    verbs = parser.add_subparsers(dest="verb", required=True)
    for verb in ("build", "run", "exported", "example", "symbols", "check"):
        part = verbs.add_parser(verb)
        part.add_argument("core", choices=MACHINE)
        part.add_argument("work", type=pathlib.Path)
        if verb == "run":
            part.add_argument("--reference", required=True)
        if verb in ("build", "exported"):
            part.add_argument("--texts", required=verb == "exported")
    part = verbs.add_parser("write")
    part.add_argument("work_m4", type=pathlib.Path)
    part.add_argument("work_m7", type=pathlib.Path)
    options = parser.parse_args()
    tools_or_skip()
    if options.verb == "build":
        return build(options.core, options.work, options.texts)
    if options.verb == "run":
        return run(options.core, options.work, options.reference)
    if options.verb == "exported":
        return exported(options.core, options.work, options.texts)
    if options.verb == "example":
        run_image(options.core, images(options.work) / "example.elf")
        return 0
    if options.verb == "symbols":
        return symbols(options.core, options.work)
    if options.verb == "check":
        return check(options.core, options.work)
    return write({"m4": options.work_m4, "m7": options.work_m7})


if __name__ == "__main__":
    sys.exit(main())
