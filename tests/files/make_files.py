#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Writes the set of damaged, oddly formatted and mis-specified recordings (README.md).

    make_files.py FOLDER [--only REGEX] [--list]
"""
import argparse
import pathlib
import re
import sys

try:
    import numpy  # noqa: F401, what the signals are made with
except ImportError:
    print("skipped: no NumPy for this Python")
    sys.exit(77)

import faults  # noqa: F401, each module adds its files to the registry
import formats  # noqa: F401
import misspecified  # noqa: F401
import vendors  # noqa: F401
from registry import FILES


def write(folder, only=None):
    """Writes the files whose names match; returns their paths."""
    folder = pathlib.Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    for name, make in FILES.items():
        if only and not only(name):
            continue
        content = make()
        path = folder / name
        path.write_bytes(content.encode() if isinstance(content, str) else content)
        paths.append(path)
    return paths


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", nargs="?")
    parser.add_argument("--only", default="", help="names to write, as a regular expression")
    parser.add_argument("--list", action="store_true", help="names of the files, one a line")
    arguments = parser.parse_args()
    if arguments.list:
        print("\n".join(FILES))
        return 0
    if not arguments.folder:
        parser.error("FOLDER is required")
    paths = write(arguments.folder, lambda name: re.search(arguments.only, name))
    print(f"{len(paths)} files, {sum(p.stat().st_size for p in paths) / 1e6:.1f} MB")
    return 0


if __name__ == "__main__":
    sys.exit(main())
