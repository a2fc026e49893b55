#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The configurations and the PLC's frame in docs/monitor*.md are right.

    monitor_documents_test.py PROGRAM    PROGRAM is the built command line tool

Every ```toml block with a [monitor] table, and examples/monitor/monitor.toml, must be accepted by `resonid monitor --check`; files that
it names beside itself (tokens, samples) are there. The structure of structured text must have the header of the frame.
"""
import importlib.util
import pathlib
import re
import struct
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
SIZES = {"UDINT": "I", "UINT": "H", "ULINT": "Q", "LREAL": "d", "USINT": "B"}


def refusal(program, text):
    """What the program objects to, or None."""
    with tempfile.TemporaryDirectory() as folder:
        here = pathlib.Path(folder)
        for name in re.findall(r'^(?:\w+_file|path) *= *"([^/"]+)"', text, re.MULTILINE):
            (here / name).write_text("0123456789abcdef\n", encoding="utf-8")
            (here / name).chmod(0o600)
        (here / "monitor.toml").write_text(text, encoding="utf-8")
        run = subprocess.run([program, "monitor", "monitor.toml", "--check"], cwd=here, capture_output=True, text=True)
        return None if run.returncode == 0 else run.stdout + run.stderr


def number(text):
    return float(text) if "." in text else int(text[3:], 16) if text.startswith("16#") else int(text)


def initial_bytes(structure):
    """What a packed structure holds up to its values, as a PLC lays it out."""
    data = b""
    for name, kind, value in re.findall(r"^ +(\w+) +: (.+?) := (.+?);", structure, re.MULTILINE):
        if name == "crc":
            break
        if kind in SIZES:
            data += struct.pack("<" + SIZES[kind], number(value))
            continue
        last = int(re.fullmatch(r"ARRAY\[0\.\.(\d+)\] OF USINT", kind).group(1))
        elements = []
        for element in value.strip("[]").split(", "):
            repeated = re.fullmatch(r"(\d+)\((\d+)\)", element)
            elements += [int(repeated.group(2))] * int(repeated.group(1)) if repeated else [number(element)]
        assert len(elements) == last + 1, f"{name} has {len(elements)} elements, {last + 1} are declared"
        data += bytes(elements)
    return data


def header_of_a_client():
    """That of examples/monitor/send_samples.py, with values of four bytes in place of eight."""
    path = ROOT / "examples" / "monitor" / "send_samples.py"
    spec = importlib.util.spec_from_file_location("send_samples", path)
    client = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(client)
    whole = client.frame("x", 0, [[0.0] * 3] * 100)
    start = struct.unpack_from("<H", whole, 6)[0]
    header = bytearray(whole[:start])
    struct.pack_into("<I", header, 8, start + 100 * 3 * 4 + 4)
    header[42] = 1
    return bytes(header)


def main():
    sys.dont_write_bytecode = True
    program = pathlib.Path(sys.argv[1]).resolve()
    wrong = checked = 0
    pages = {page: page.read_text(encoding="utf-8") for page in sorted((ROOT / "docs").glob("monitor*.md"))}
    texts = [(page, block) for page, text in pages.items() for block in re.findall(r"^```toml\n(.*?)^```", text, re.DOTALL | re.MULTILINE)]
    example = ROOT / "examples" / "monitor" / "monitor.toml"
    for page, text in [*texts, (example, example.read_text(encoding="utf-8"))]:
        if "[monitor]" not in text:
            continue
        checked += 1
        if objection := refusal(program, text):
            print(f"{page.relative_to(ROOT)}: a configuration that is refused:\n{text}\n{objection}")
            wrong += 1
    structures = re.findall(r"^TYPE ResonidFrame : STRUCT\n(.*?)^END_STRUCT", pages[ROOT / "docs" / "monitor.md"], re.DOTALL | re.MULTILINE)
    if [initial_bytes(s) for s in structures] != [header_of_a_client()]:
        print("docs/monitor.md: the PLC's structure has not the header of the frame")
        wrong += 1
    if checked < 8:
        print(f"only {checked} configurations were found: are they still marked as toml?")
        wrong += 1
    print(f"{checked} configurations and {len(structures)} structure: {wrong} problems")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
