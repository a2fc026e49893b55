# SPDX-License-Identifier: MIT
"""What the tests beside this share: the modules, namespaces in which they are seen among LinuxCNC's, one run of halrun."""
import os
import pathlib
import re
import shlex
import shutil
import subprocess
import sys

import plant

HERE = pathlib.Path(__file__).resolve().parent
INSTALLED = pathlib.Path("/usr/lib/linuxcnc/modules")
PERIOD_S = 500e-6
SAMPLED = ("excitation torque velocity load resonance antiresonance phase modulus coherence running settled trusted stop "
           "t_excite t_identify t_servo t_period").split()
failures = []


def check(holds, what):
    print(("ok      " if holds else "FAILED  ") + what, flush=True)
    if not holds:
        failures.append(what)


def skip(reason):
    print(f"skipped: {reason}")
    sys.exit(77)


def build(folder):
    done = subprocess.run(["make", "-C", str(HERE), f"OUT={folder}", f"CXX={os.environ.get('CXX', 'g++')}"],
                          capture_output=True, text=True)
    if done.returncode != 0:
        print(done.stdout + done.stderr)
        sys.exit("the components do not build")
    # The servo thread has no heap, no exceptions and no C++ library: all that is asked for is libm.
    objects = [str(folder / name) for name in ("axis.o", "core.o", "axis_config.o", "axis_figures.o", "axis_loop.o", "chirp.o", "metrics.o", "multisine.o", "prbs.o")]
    symbols = subprocess.run(["nm", "-u", *objects], capture_output=True, text=True, check=True).stdout
    bad = sorted(set(re.findall(r"\bU (_Zn\w*|_Zd\w*|malloc|calloc|realloc|free|_Unwind\w*|__cxa\w*|_ZSt\w*|abort)\b", symbols)))
    check(not bad, f"the component asks for no heap, exception or C++ library {' '.join(bad)}")


def require_linuxcnc():
    if not (shutil.which("halrun") and shutil.which("halcompile") and INSTALLED.is_dir()):
        skip("LinuxCNC is not installed (Debian packages linuxcnc-uspace, linuxcnc-uspace-dev)")


def namespace():
    """The command that makes the namespaces and runs a script of the shell as their root."""
    isolated = ["unshare", "--mount", "--ipc", "--pid", "--fork", "--kill-child", "--mount-proc"]
    if os.getuid() != 0:
        isolated[1:1] = ["--user", "--map-root-user"]
    if subprocess.run(isolated + ["mount", "--bind", "/tmp", "/mnt"], capture_output=True).returncode != 0:
        skip("IPC and mount namespaces are not permitted here")
    return isolated


class Session:
    """One run of halrun: HAL commands after those of two_mass.hal, in which `edited` may change something; what each
    `show pin` said, and the samples. FOLDER in the commands is the session's own, in which its user may write; `mounted`
    are files seen there by other names, though that user may not see them where they are."""

    def __init__(self, name, isolated, modules, commands, folder, edited=lambda text: text, mounted=None):
        self.name, self.folder = name, folder / name
        merged = self.folder / "modules"
        shutil.copytree(INSTALLED, merged)
        for module in ("resonid.so", "two_mass.so"):
            shutil.copy(modules / module, merged)
        self.samples_file = self.folder / "samples"
        script, machine_script = self.folder / "session.hal", self.folder / "two_mass.hal"
        machine_script.write_text(edited((HERE / "two_mass.hal").read_text()))  # the user that runs it may not see the clone
        commands = commands.replace("SAMPLES", str(self.samples_file)).replace("FOLDER", str(self.folder))
        script.write_text(f"source {machine_script}\n" + commands)
        mounts = [(merged, INSTALLED)]
        for seen_as, file in (mounted or {}).items():
            (self.folder / seen_as).touch()
            mounts.append((file, self.folder / seen_as))
        self.folder.chmod(0o777)
        # halrun refuses root; without real time any other user will do.
        user = "runuser -u nobody --" if os.getuid() == 0 else "unshare --user --map-user=1000"
        user += f" env HOME={self.folder}"
        mount = " && ".join(shlex.join(["mount", "--bind", str(what), str(where)]) for what, where in mounts)
        self.command = isolated + ["sh", "-c", f"{mount} && cd {self.folder} && exec {user} "
                                   f"RTAPI_FIFO_PATH={self.folder}/fifo halrun -f {script}"]

    def run(self):
        done = subprocess.run(self.command, capture_output=True, text=True, timeout=120)
        self.output, self.errors, self.code = done.stdout, done.stderr, done.returncode
        self.shown = [self.pins(part) for part in self.output.split("Component Pins:")[1:]]
        rows = self.samples_file.read_text().split("\n") if self.samples_file.exists() else []
        self.rows = [row.split() for row in rows if row]
        return self

    @staticmethod
    def pins(text):
        def number(word):
            if word in ("TRUE", "FALSE"):
                return word == "TRUE"
            return float(int(word, 16)) if word.startswith("0x") else float(word)

        rows = re.findall(r"^\s*\d+\s+\S+\s+(?:IN|OUT|I/O)\s+(\S+)\s+(\S+)", text, re.M)
        return {name.removeprefix("resonid.0."): number(word) for word, name in rows}

    def column(self, name):
        return [float(row[1 + SAMPLED.index(name)]) for row in self.rows]


def machine():
    """Drive and gains as two_mass.hal sets them."""
    value = {name: float(x) for name, x in
             re.findall(r"^setp\s+(\S+)\s+(\S+)", (HERE / "two_mass.hal").read_text(), re.M)}
    drive = plant.Drive(*(value["two-mass.0." + name] for name in ("j1", "j2", "k", "d")), PERIOD_S,
                        int(value["two-mass.0.delay"]))
    return drive, value["pid.0.Pgain"], value["pid.0.Igain"], value
