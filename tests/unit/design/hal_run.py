#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Runs controller.hal of a folder in LinuxCNC, without real time:

    hal_run.py FOLDER NAME PERIOD_NS SIGNAL ...   FOLDER/rows: the values of the signals, one period a row

writes the torque of each period to FOLDER/torque. Exit code 77, with the reason, where LinuxCNC or its namespaces cannot
be had."""
import os
import pathlib
import shutil
import subprocess
import sys

SESSION = """loadrt threads name1=servo-thread period1={period}
loadrt streamer depth=4000 cfg={kinds}
loadrt sampler depth=4000 cfg=f
addf streamer.0 servo-thread
source controller.hal
addf sampler.0 servo-thread
{inputs}
net {name}-torque => sampler.0.pin.0
sets {name}-enable 1
setp streamer.0.enable 1
setp sampler.0.enable 1
loadusr -w halstreamer rows
start
loadusr -w halsampler -n {count} torque
"""


def main():
    folder, name, period, signals = pathlib.Path(sys.argv[1]), sys.argv[2], sys.argv[3], sys.argv[4:]
    if not shutil.which("halrun"):
        print("no LinuxCNC here")
        sys.exit(77)
    isolated = ["unshare", "--mount", "--ipc", "--pid", "--fork", "--mount-proc"]
    if os.getuid() != 0:
        isolated[1:1] = ["--user", "--map-root-user"]
    if subprocess.run(isolated + ["true"], capture_output=True).returncode != 0:
        print("namespaces are not permitted here")
        sys.exit(77)
    count = len((folder / "rows").read_text().splitlines())
    (folder / "session.hal").write_text(SESSION.format(
        name=name, period=period, count=count, kinds="f" * len(signals),
        inputs="\n".join(f"net {name}-{signal} <= streamer.0.pin.{i}" for i, signal in enumerate(signals))))
    folder.chmod(0o777)
    for file in folder.iterdir():
        file.chmod(0o666)
    # halrun refuses root; without real time any other user will do.
    user = "runuser -u nobody --" if os.getuid() == 0 else "unshare --user --map-user=1000"
    (folder / "torque").unlink(missing_ok=True)
    done = subprocess.run(isolated + ["sh", "-c", f"cd '{folder}' && exec {user} env HOME='{folder}' "
                                      f"RTAPI_FIFO_PATH='{folder}/fifo' halrun -f session.hal"],
                          capture_output=True, text=True, timeout=120)
    print(done.stdout, done.stderr)
    sys.exit(done.returncode or not (folder / "torque").exists())


main()
