# SPDX-License-Identifier: MIT
"""Undamaged recordings as drives, controllers and simulators export them, rebuilt from public descriptions.

expected.toml names the description that each follows; README.md says what it leaves open. No vendor's own file was seen.
"""
import numpy as np

from registry import file
from signals import RADIUS_M, STEP_S, periodic
from units import DEG, FILETIME, RATED_TORQUE, RPM, TORQUE_CONSTANT, TURN
from writers import doubles, mat_file, numbers, opaque, structure, table, text_variable


def jittered(s, rms=20e-6):
    """Time stamps of a program that polls."""
    return s.t + np.abs(rms * np.random.default_rng(11).standard_normal(len(s.t)))


# --- TwinCAT Scope

SCOPE_ROWS = ("SymbolComment", "Data-Type", "SampleTime[ms]", "VariableSize", "SymbolBased", "IndexGroup", "IndexOffset",
              "SymbolName", "NetID", "Port", "Offset", "ScaleFactor", "BitMask", "Unit", "Unit ScaleFactor", "Unit Offset")


def scope_header(channels, separator, comma, each_time, rows=SCOPE_ROWS, period_ms=2):
    """Lines above the data. channels: (name, unit, symbol). With each_time every channel has a key and a value."""
    def values(key, channel):
        name, unit, symbol = channel
        decimal = "0,000" if comma else "0.000"
        return {"Name": name, "SymbolComment": "", "Data-Type": "REAL64", "SampleTime[ms]": f"{period_ms}", "VariableSize": "8",
                "SymbolBased": "True", "IndexGroup": "16448", "IndexOffset": "385024", "SymbolName": symbol,
                "NetID": "5.62.192.41.1.1", "Port": "851", "Offset": decimal, "ScaleFactor": decimal.replace("0", "1", 1),
                "BitMask": "0xFFFFFFFFFFFFFFFF", "Unit": unit, "Unit ScaleFactor": "1", "Unit Offset": "0"}[key]
    lines = [separator.join(("Name", "YT Scope Project")),
             separator.join(("File", r"C:\Projekte\Achse 1\Aufnahme 3.svdx")),
             separator.join(("Starttime of export", str(FILETIME), "Dienstag, 27. Februar 2024", "10:10:00.000")),
             separator.join(("Endtime of export", str(FILETIME + 130_000_000), "Dienstag, 27. Februar 2024", "10:10:13.000")),
             ""]
    for key in ("Name", *rows):
        cells = [values(key, c) for c in channels]
        lines.append(separator.join([x for c in cells for x in (key, c)] if each_time else [key, *cells]))
    return lines + [""]


MAIN = [("Sollmoment", "Nm", "MAIN.fbAchse.fSollmoment"), ("Istdrehzahl", "rad/s", "MAIN.fbAchse.fIstdrehzahl")]


@file("twincat_all_tab_comma.csv")
def _():
    s = periodic()
    t = numbers(1e3 * s.t, "%.0f")
    return table([t, numbers(s.u, comma=True), t, numbers(s.y, comma=True)], separator="\t", end="\r\n",
                 preamble=scope_header(MAIN, "\t", True, True))


@file("twincat_each_sampletime_semicolon.csv")
def _():
    s = periodic()
    return table([numbers(1e3 * s.t, "%.0f"), numbers(s.u, comma=True), numbers(s.y, comma=True)], separator=";", end="\r\n",
                 preamble=scope_header(MAIN, ";", True, False)) + "EOF\r\n"


@file("twincat_rpm.csv")
def _():
    s = periodic()
    channels = [("Sollmoment", "Nm", "MAIN.fbAchse.fSollmoment"), ("Istdrehzahl", "1/min", "MAIN.fbAchse.fIstdrehzahl")]
    t = numbers(1e3 * s.t, "%.0f")
    return table([t, numbers(s.u, comma=True), t, numbers(RPM * s.y, comma=True)], separator="\t", end="\r\n",
                 preamble=scope_header(channels, "\t", True, True)) + "EOF\r\n"


@file("twincat_filetime.csv")
def _():
    s = periodic()
    t = [str(FILETIME + int(round(1e7 * x))) for x in s.t]
    return table([t, numbers(s.u, comma=True), t, numbers(s.y, comma=True)], separator="\t", end="\r\n",
                 preamble=scope_header(MAIN, "\t", True, True))


@file("twincat_no_timelines.csv")
def _():
    """Timelines: None. Only the header's SampleTime says how far apart the rows are."""
    s = periodic()
    keys = ("Name", "SampleTime[ms]", "SymbolName", "Unit")
    header = [h for h in scope_header(MAIN, "\t", True, False) if not h or h.split("\t")[0] in keys or h.startswith(("File", "Start", "End"))]
    return table([numbers(s.u, comma=True), numbers(s.y, comma=True)], separator="\t", end="\r\n", preamble=header)


@file("twincat_name_only_comma.csv")
def _():
    s = periodic()
    t = numbers(1e3 * s.t, "%.0f")
    return table([t, numbers(s.u), t, numbers(s.y)], separator=",", end="\r\n",
                 preamble=scope_header(MAIN, ",", False, True, rows=()))


@file("twincat_comma_for_both.csv")
def _():
    s = periodic()
    t = numbers(1e3 * s.t, "%.0f")
    return table([t, numbers(s.u, comma=True), t, numbers(s.y, comma=True)], separator=",", end="\r\n",
                 preamble=scope_header(MAIN, ",", True, True))


@file("twincat2_scope.csv")
def _():
    s = periodic()
    channels = [("M_SOLL", "MAIN.M_SOLL"), ("N_IST", "MAIN.N_IST")]
    rows = [("Name", 0), ("NetId", "172.16.8.205.1.1"), ("Port", "801"), ("SampleTime[ms]", "2"), ("SymbolBased", "TRUE"),
            ("SymbolName", 1), ("SymbolComment", ""), ("IndexGroup", "16448"), ("IndexOffset", "608"),
            ("Data-Type", "ADST_REAL32"), ("VariableSize", "4")]
    header = ["Name\tScope01", "File\t", f"StartRecord\t{FILETIME}\tDonnerstag, 5. Februar 2009\t13:08:42",
              f"EndRecord\t{FILETIME + 130_000_000}\tDonnerstag, 5. Februar 2009\t13:08:55", ""]
    header += ["\t".join(x for c in channels for x in (k, c[v] if isinstance(v, int) else v)) for k, v in rows]
    t = numbers(1e3 * s.t, "%.0f")
    return table([t, numbers(s.u, comma=True), t, numbers(s.y, comma=True)], separator="\t", end="\r\n", preamble=header)


@file("twincat_two_rates.csv")
def _():
    """The velocity at half the rate of the torque and without interpolation: its rows end in the middle of the file."""
    s = periodic()
    slow = slice(None, None, 2)
    fast = list(zip(numbers(1e3 * s.t, "%.0f"), numbers(s.u, comma=True)))
    few = list(zip(numbers(1e3 * s.t[slow], "%.0f"), numbers(s.y[slow], comma=True)))
    rows = ["\t".join((*a, *few[k])) if k < len(few) else "\t".join(a) for k, a in enumerate(fast)]
    header = scope_header(MAIN, "\t", True, True)
    header = ["SampleTime[ms]\t2\tSampleTime[ms]\t4" if h.startswith("SampleTime") else h for h in header]
    return "\r\n".join(header + rows) + "\r\n"


@file("twincat_per_mille.csv")
def _():
    """Actual torque as the drive sends it: thousandths of the rated torque."""
    s = periodic()
    channels = [("Torque actual value", "0.1%", "MAIN.Axis.nTorque"), ("Velocity actual value", "deg/s", "MAIN.Axis.fVelo")]
    t = numbers(1e3 * s.t, "%.0f")
    return table([t, numbers(np.round(1e3 * s.u / RATED_TORQUE), "%.0f"), t, numbers(DEG * s.y, comma=True)],
                 separator="\t", end="\r\n", preamble=scope_header(channels, "\t", True, True))


# --- Siemens

SERVO = ["SERVO_03.r79[0]: Drehmomentsollwert [Nm]", "SERVO_03.r63[0]: Drehzahlistwert [1/min]"]


@file("startdrive_trace.csv")
def _():
    s = periodic()
    return table([numbers(1e3 * s.t, "%.3f", comma=True), numbers(s.u, comma=True), numbers(RPM * s.y, comma=True)],
                 ["Zeit [ms]", *SERVO], separator=";", end="\r\n", preamble=["Trace;SERVO_03", "Trace-Takt;2,000 ms", ""])


@file("startdrive_trace_utf16.csv")
def _():
    s = periodic()
    return table([numbers(s.t, "%.6f"), numbers(s.u), numbers(RPM * s.y)],
                 ["Time (s)", "SERVO_03.r80 Torque actual value (Nm)", "SERVO_03.r63 Actual speed (rpm)"],
                 separator="\t", end="\r\n").encode("utf-16")


# --- ABB

def abb():
    s = periodic()
    return table([numbers(s.t, "%.4f"), numbers(RPM * s.y, "%.3f"), numbers(100.0 * s.u / RATED_TORQUE, "%.3f")],
                 ["Time (s)", "01.01 Motor speed used (rpm)", "01.10 Motor torque (%)"], separator=";",
                 preamble=["Drive: ACS880 {0}{1}", "Sampling interval: 2 ms", ""])


@file("drive_composer.csv")
def _():
    return abb()


@file("drive_composer_rated_torque_unknown.csv")
def _():
    return abb()


# --- Kollmorgen

@file("workbench_recorder.csv")
def _():
    s = periodic()
    return table([numbers(s.u / TORQUE_CONSTANT, "%.4f"), numbers(RPM * s.r, "%.3f"), numbers(RPM * s.y, "%.3f")],
                 ["IL.CMD", "VL.CMD", "VL.FB"], end="\r\n", preamble=[f"{len(s.t)},32"])


@file("workbench_recorder_hex.csv")
def _():
    s = periodic()
    def packed(values):
        whole = [int(round(1e3 * v)) for v in values]
        return [f"F3{'-' if w < 0 else ''}0x{abs(w):X}" for w in whole]
    return table([packed(s.u / TORQUE_CONSTANT), packed(RPM * s.y)], ["IL.CMD", "VL.FB"], end="\r\n", preamble=[f"{len(s.t)},32"])


@file("workbench_scope.csv")
def _():
    s = periodic()
    return table([numbers(1e3 * s.t, "%.4f"), numbers(s.u / TORQUE_CONSTANT, "%.4f"), numbers(RPM * s.y, "%.3f")],
                 ["Time (ms)", "Current command (A)", "Velocity feedback (rpm)"], end="\r\n")


# --- open source drives

@file("odrive_bulk_capture.txt")
def _():
    s = periodic()
    return table([numbers(x, "%.18e") for x in (jittered(s), TURN * s.y, s.u / TORQUE_CONSTANT)], separator=" ")


@file("odrive_named.csv")
def _():
    s = periodic()
    return table([numbers(x) for x in (jittered(s), TURN * s.y, s.u / TORQUE_CONSTANT)],
                 ["time", "axis0.encoder.vel_estimate [turn/s]", "axis0.motor.current_control.Iq_measured [A]"])


@file("moteus_csv_output.csv")
def _():
    s = periodic()
    n = len(s.t)
    columns = [jittered(s), np.full(n, 10), TURN * s.angle, TURN * s.y, s.u, np.full(n, 24.5), np.full(n, 33.0), np.zeros(n)]
    return table([numbers(x, "%.10g") for x in columns],
                 ["time", "MODE", "POSITION", "VELOCITY", "TORQUE", "VOLTAGE", "TEMPERATURE", "FAULT"])


@file("moteus_seconds_since_1970.csv")
def _():
    s = periodic()
    return table([numbers(1_709_000_000.0 + jittered(s), "%.7f"), numbers(TURN * s.y), numbers(s.u)], ["time", "VELOCITY", "TORQUE"])


SIMPLEFOC = ["MOT: Monitor enabled!", "MOT: Init", "MOT: Enable driver.", "MOT: Align sensor.", "MOT: sensor direction==CW",
             "MOT: PP check: OK!", "MOT: Zero elec. angle: 4.28", "MOT: Align current sense.", "MOT: Success: 2", "MOT: Ready."]


@file("simplefoc_monitor.txt")
def _():
    s = periodic()
    return table([numbers(x, "%.4f") for x in (s.r, 1e3 * s.u / TORQUE_CONSTANT, s.y, s.angle)], separator="\t", end="\r\n",
                 preamble=SIMPLEFOC)


@file("simplefoc_which_column.txt")
def _():
    s = periodic()
    return table([numbers(x, "%.4f") for x in (s.r, 1e3 * s.u / TORQUE_CONSTANT, s.y, s.angle)], separator="\t", end="\r\n")


# --- LinuxCNC

@file("halsampler.txt")
def _():
    s = periodic()
    return table([numbers(s.u, "%.6f"), [x + " " for x in numbers(s.y, "%.6f")]], separator=" ")


@file("halsampler_tagged.txt")
def _():
    s = periodic()
    n = [str(k) for k in range(len(s.t))]
    return table([n, numbers(s.u, "%.6f"), [x + " " for x in numbers(s.y, "%.6f")]], separator=" ")


@file("halscope_log.txt")
def _():
    s = periodic()
    rows = [f"torque-cmd {u:+.14f} motor-vel-fb {y:+.14f} " for u, y in zip(s.u, s.y)]
    return "Sampling period is 2000000 ns \n\n" + "\n".join(rows)


# --- Klipper: only what the accelerometer says

@file("klipper_raw_data.csv")
def _():
    s = periodic()
    a = 1e3 * RADIUS_M * np.gradient(s.load_velocity, STEP_S)
    rng = np.random.default_rng(5)
    return table([numbers(120.0 + s.t, "%.6f"), *(numbers(x, "%.6f") for x in
                  (a, 40.0 * rng.standard_normal(len(a)), 9800.0 + 40.0 * rng.standard_normal(len(a))))],
                 ["#time", "accel_x", "accel_y", "accel_z"])


# --- Simulink and MATLAB

@file("simulink_structure_with_time.mat")
def _():
    s = periodic()
    def signal(values, label):
        return {"values": lambda n: doubles(n, values), "dimensions": lambda n: doubles(n, [1.0]),
                "label": lambda n: text_variable(n, label)}
    signals = [signal(s.u, "torque"), signal(s.y, "velocity")]
    strip = [{k: v("") for k, v in x.items()} for x in signals]
    logged = {"time": doubles("", s.t), "signals": structure("", strip), "blockName": text_variable("", "drive/Scope")}
    return mat_file(structure("ScopeData", [logged]))


@file("simulink_array.mat")
def _():
    s = periodic()
    return mat_file(doubles("tout", s.t), doubles("yout", np.column_stack([s.u, s.y])))


@file("simulink_scope_array.mat")
def _():
    s = periodic()
    return mat_file(doubles("ScopeData", np.column_stack([s.t, s.u, s.y])))


@file("simulink_timeseries.mat")
def _():
    return mat_file(opaque("torque", "timeseries"), opaque("velocity", "timeseries"))


@file("struct.mat")
def _():
    s = periodic()
    return mat_file(structure("run1", [{"t": doubles("", s.t), "torque_Nm": doubles("", s.u), "velocity_rad_s": doubles("", s.y)}]))


@file("vectors.mat")
def _():
    s = periodic()
    return mat_file(doubles("t_s", s.t), doubles("torque_Nm", s.u), doubles("velocity_rad_s", s.y))


@file("rows.mat")
def _():
    s = periodic()
    return mat_file(doubles("Ts", [STEP_S]), *(doubles(n, x[None, :]) for n, x in
                    (("time", s.t), ("torque", s.u), ("velocity", s.y))), text_variable("comment", "axis 1"))


# --- other tools

@file("codesys_trace.txt")
def _():
    s = periodic()
    return table([numbers(1e3 * s.t, "%.0f"), numbers(s.u, "%.5f"), numbers(s.y, "%.5f")],
                 ["Cycle", "PLC_PRG.fTorque", "PLC_PRG.fVelocity"], separator=" ", end="\r\n",
                 preamble=["BODAS Trace", r"D:\PROJECTS\AXIS.PRO"])


@file("motion_scope.txt")
def _():
    s = periodic()
    return table([[str(k) for k in range(len(s.t))], numbers(s.u, "%.5f"), numbers(s.y, "%.5f")],
                 ["Sample #", "Ax 0 Torque Cmd", "Ax 0 Act Vel"], separator="\t", end="\r\n")


@file("quoted_names_with_units.csv")
def _():
    s = periodic()
    return table([numbers(1e3 * s.t, "%.0f"), numbers(1e3 * s.u, "%.3f"), numbers(s.y, "%.5f")],
                 ['"Time [ms]"', ' "MOT.M [mNm]"', ' "MOT.W [rad/s]"'])


@file("cia402_rpm.csv")
def _():
    s = periodic()
    return table([numbers(1e3 * s.t, "%.0f"), numbers(np.round(1e3 * s.u / RATED_TORQUE), "%.0f"), numbers(RPM * s.y, "%.2f")],
                 ["time_ms", "0x6077 Torque actual value [‰]", "0x606C Velocity actual value [rpm]"], separator=";")


@file("cia402_counts.csv")
def _():
    """The low word of the position: 20000 counts per turn, and it wraps at 16 bits."""
    s = periodic()
    counts = np.floor(20000.0 * TURN * s.angle).astype(int)
    wrapped = (counts + 32768) % 65536 - 32768
    return table([numbers(1e3 * s.t, "%.0f"), numbers(np.round(1e3 * s.u / RATED_TORQUE), "%.0f"), numbers(wrapped, "%d")],
                 ["time_ms", "0x6077 Torque actual value [‰]", "0x6064 Position actual value [counts]"], separator=";")
