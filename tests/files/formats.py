# SPDX-License-Identifier: MIT
"""Undamaged tables in many dialects: names, units, decimal signs, encodings, containers and forms of time."""
from registry import file
from signals import RADIUS_M, periodic, swept
from units import DEG, FILETIME, RPM, TORQUE_CONSTANT
from writers import clock, compressed, grouped, minutes, numbers, table, workbook


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


# --- names, units and decimal signs

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


@file("time_minutes.csv")
def _():
    return timed(minutes(30.0 + periodic().t), "Time")


@file("time_minutes_beyond_the_hour.csv")
def _():
    return timed([x.replace(".", ",") for x in minutes(3595.0 + periodic().t)], "Zeit", separator=";")


@file("time_minutes_of_the_hour.csv")
def _():
    """As spreadsheets show a time of day that they are to show as mm:ss: begins anew with the hour."""
    return timed(minutes((3595.0 + periodic().t) % 3600.0), "Time")


@file("time_hours_of_a_run.csv")
def _():
    return timed(clock(86400.0 * 2 + 3595.0 + periodic().t), "Elapsed time")


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
