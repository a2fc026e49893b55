# SPDX-License-Identifier: MIT
"""Undamaged recordings as drives, controllers and simulators export them, rebuilt from public descriptions.

expected.toml names the description that each follows; README.md says what it leaves open. No vendor's own file was seen.
"""
import math

import numpy as np

from registry import file
from signals import RADIUS_M, STEP_S, periodic, swept
from writers import (clock, compressed, doubles, grouped, mat_file, numbers, opaque, structure, table, text_variable, workbook)

RPM = 60.0 / (2.0 * math.pi)
DEG = 180.0 / math.pi
TURN = 1.0 / (2.0 * math.pi)
TORQUE_CONSTANT = 0.5  # Nm/A, of every file that holds a current
RATED_TORQUE = 5.0  # Nm, of every file that holds a share of the rated torque
FILETIME = 133_535_826_000_000_000  # some moment in 2024, in 100 ns since 1601


def jittered(s, rms=20e-6):
    """Time stamps of a program that polls."""
    return s.t + np.abs(rms * np.random.default_rng(11).standard_normal(len(s.t)))


# --- plain

@file("clean.csv")
def _():
    s = swept()
    return table([numbers(x) for x in (s.t, s.ru, s.u, s.y)], ["time_s", "ru", "u", "y"])


@file("torque_velocity.csv")
def _():
    s = periodic()
    return table([numbers(x) for x in (s.t, s.u, s.y)], ["time_s", "torque_Nm", "velocity_rad_s"])


@file("rest_before_and_after.csv")
def _():
    s = swept(rest_s=0.5)
    return table([numbers(x) for x in (s.t, s.ru, s.u, s.y)], ["time_s", "ru", "u", "y"])


@file("multisine.csv")
def _():
    s = periodic()
    return table([numbers(x) for x in (s.t, s.ru, s.u, s.y)], ["time_s", "ru", "u", "y"])


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


@file("excel_german.csv")
def _():
    s = periodic()
    return table([numbers(s.t, "%.4f", comma=True), numbers(s.u, "%.5f", comma=True), numbers(RPM * s.y, "%.4f", comma=True)],
                 ["Zeit [s]", "Sollmoment [Nm]", "Istdrehzahl [U/min]"], separator=";", end="\r\n").encode("latin-1")


@file("excel_german_angle_latin1.csv")
def _():
    s = periodic()
    return table([numbers(s.t, "%.4f", comma=True), numbers(s.u, "%.5f", comma=True), numbers(DEG * s.angle, "%.5f", comma=True)],
                 ["Zeit [s]", "Moment [Nm]", "Winkel [°]"], separator=";", end="\r\n",
                 preamble=["Prüfstand 2;Antrieb für Längsachse;;"]).encode("latin-1")


@file("german_thousands.csv")
def _():
    s = periodic()
    return table([grouped(1e3 * s.t, 1), grouped(1e3 * s.u, 3), grouped(DEG * s.y, 4)],
                 ["Zeit (ms)", "Moment (mNm)", "Geschwindigkeit (°/s)"], separator=";", end="\r\n")


@file("english_thousands_quoted.csv")
def _():
    s = periodic()
    return table([[f'"{x}"' for x in grouped(v, d, ",", ".")] for v, d in ((1e3 * s.t, 1), (1e3 * s.u, 3), (DEG * s.y, 4))],
                 ["Time (ms)", "Torque (mNm)", "Velocity (deg/s)"])


@file("linear_mm.csv")
def _():
    s = periodic()
    return table([numbers(s.t), numbers(s.u / RADIUS_M, "%.4f"), numbers(1e3 * RADIUS_M * s.y, "%.4f")],
                 ["time_s", "force_N", "velocity_mm_s"])


@file("names_n_act_m_act.csv")
def _():
    s = periodic()
    return table([numbers(x) for x in (s.t, s.r, s.y, s.u)], ["t", "n_ref", "n_act", "M_act"])


@file("names_theta_trq.csv")
def _():
    s = periodic()
    return table([numbers(s.t), numbers(s.u), numbers(s.angle, "%.7f")], ["t_s", "trq", "theta_rad"])


@file("names_iq_speed.csv")
def _():
    s = periodic()
    return table([numbers(x) for x in (s.t, s.u / TORQUE_CONSTANT, s.y)], ["t_s", "Iq", "speed_rad_s"])


@file("names_words.csv")
def _():
    s = periodic()
    return table([numbers(x) for x in (s.t, s.u, s.y)], ["Time / s", "Torque command / Nm", "Actual velocity / rad/s"])


@file("units_row.csv")
def _():
    s = periodic()
    return table([numbers(1e3 * s.t, "%.0f"), numbers(s.u), numbers(RPM * s.y)], ["t", "torque", "speed"], units=["ms", "Nm", "rpm"])


@file("preamble.csv")
def _():
    s = periodic()
    return table([numbers(s.t), numbers(s.u), numbers(s.y)], ["time_s", "torque_Nm", "velocity_rad_s"],
                 preamble=["Axis 3, belt A", "Date: 2026-03-02, operator: mk", "Kp 1.036, Tn 147 ms", "", "[Data]"])


@file("numpy_savetxt.txt")
def _():
    s = periodic()
    return table([numbers(x, "%.18e") for x in (s.t, s.u, s.y)], separator=" ", preamble=["# t_s u y"])


@file("per_channel_time.csv")
def _():
    """Each signal with stamps of its own, which agree."""
    s = periodic()
    return table([numbers(s.t, "%.6f"), numbers(s.u), numbers(s.t, "%.6f"), numbers(s.y)],
                 ["torque time [s]", "torque [Nm]", "velocity time [s]", "velocity [rad/s]"])


@file("no_header.csv")
def _():
    s = periodic()
    return table([numbers(x) for x in (s.t, s.u, s.y)])


@file("no_header_no_options.csv")
def _():
    s = periodic()
    return table([numbers(x) for x in (s.t, s.u, s.y)])


# --- encodings and containers

def plain():
    s = periodic()
    return table([numbers(x) for x in (s.t, s.u, s.y)], ["time_s", "torque_Nm", "velocity_rad_s"], end="\r\n")


@file("utf8_bom.csv")
def _():
    return plain().encode("utf-8-sig")


@file("utf16le_bom.csv")
def _():
    return b"\xff\xfe" + plain().encode("utf-16-le")


@file("utf16be_bom.csv")
def _():
    return b"\xfe\xff" + plain().encode("utf-16-be")


@file("utf16le_without_bom.csv")
def _():
    return plain().encode("utf-16-le")


@file("utf16be_without_bom.csv")
def _():
    return plain().encode("utf-16-be")


@file("carriage_returns_only.csv")
def _():
    return plain().replace("\r\n", "\r")


@file("recording.csv.gz")
def _():
    return compressed(plain())


@file("recording.xlsx")
def _():
    s = periodic()
    return workbook(["time_s", "torque_Nm", "velocity_rad_s"], [s.t, s.u, s.y])


@file("workbook_called_csv.csv")
def _():
    s = periodic()
    return workbook(["time_s", "torque_Nm", "velocity_rad_s"], [s.t[:500], s.u[:500], s.y[:500]])


# --- times

def timed(stamps, name, **options):
    s = periodic()
    return table([stamps, numbers(s.u), numbers(s.y)], [name, "torque_Nm", "velocity_rad_s"], **options)


@file("time_microseconds.csv")
def _():
    return timed(numbers(1e6 * periodic().t, "%.0f"), "t_us")


@file("time_milliseconds_bracket.csv")
def _():
    return timed(numbers(1e3 * periodic().t, "%.0f"), "Timestamp [ms]")


@file("time_sample_number.csv")
def _():
    return timed([str(k) for k in range(len(periodic().t))], "sample")


@file("time_of_day.csv")
def _():
    return timed(clock(36000.0 + periodic().t), "Time")


@file("time_of_day_over_midnight.csv")
def _():
    return timed(clock((86395.0 + periodic().t) % 86400.0), "Time")


@file("time_iso.csv")
def _():
    return timed([f"2026-03-02T{x}Z" for x in clock(36000.0 + periodic().t)], "timestamp")


@file("time_iso_blank.csv")
def _():
    return timed([f"2026-03-02 {x}" for x in clock(36000.0 + periodic().t, 6)], "timestamp", separator=";")


@file("time_date_and_clock.csv")
def _():
    s = periodic()
    return table([["02.03.2026"] * len(s.t), [x.replace(".", ",") for x in clock(36000.0 + s.t)], numbers(s.u, comma=True),
                  numbers(s.y, comma=True)], ["Datum", "Uhrzeit", "Sollmoment [Nm]", "Istdrehzahl [rad/s]"], separator=";")


@file("time_filetime.csv")
def _():
    return timed([str(FILETIME + int(round(1e7 * x))) for x in periodic().t], "FILETIME")


@file("time_unit_told.csv")
def _():
    return timed(numbers(1e3 * periodic().t, "%.0f"), "t")
