# SPDX-License-Identifier: MIT
"""Damaged recordings, one fault each."""
import numpy as np

from formats import plain
from registry import file
from signals import periodic
from writers import compressed, doubles, mat_file, numbers, table

NAMES = ["time_s", "torque_Nm", "velocity_rad_s"]


def columns(comma=False):
    s = periodic()
    return [numbers(x, comma=comma) for x in (s.t, s.u, s.y)]


def lines():
    return plain().replace("\r\n", "\n").splitlines()  # the names are the first


def text(rows):
    return "\n".join(rows) + "\n"


def with_cells(value, rows, column=2, separator=",", comma=False):
    """A table in which `value` stands in some rows of a column."""
    c = columns(comma)
    for k in rows:
        c[column][k] = value
    return table(c, NAMES, separator)


def some(count, seed, least=100, apart=3):
    """Indices that lie at least `apart` from each other."""
    slots = np.arange(least, len(periodic().t) - 100, apart)
    return sorted(np.random.default_rng(seed).choice(slots, count, replace=False).tolist())


def without(rows):
    gone = {k + 1 for k in rows}
    return text(line for k, line in enumerate(lines()) if k not in gone)


# --- the end of the file

@file("torn_last_line.csv")
def _():
    return text(lines())[:-12]


@file("torn_inside_last_number.csv")
def _():
    whole = text(lines())
    return whole[:-4]


@file("torn_utf16.csv")
def _():
    return (b"\xff\xfe" + plain().encode("utf-16-le"))[:-7]


@file("torn.csv.gz")
def _():
    packed = compressed(plain())
    return packed[:len(packed) * 2 // 3]


@file("torn.mat")
def _():
    s = periodic()
    whole = mat_file(doubles("t_s", s.t), doubles("torque_Nm", s.u), doubles("velocity_rad_s", s.y))
    return whole[:len(whole) * 3 // 4]


@file("zero_bytes_at_the_end.csv")
def _():
    """The power failed: the file system gave the length, the data never came."""
    return plain().encode()[:-2048] + b"\0" * 2048


# --- cells without a number

@file("nan_isolated.csv")
def _():
    return with_cells("NaN", some(20, 21))


@file("infinite.csv")
def _():
    return with_cells("inf", some(5, 22))


@file("nv_isolated.csv")
def _():
    return with_cells("#NV", some(12, 23), separator=";", comma=True)


@file("na_isolated.csv")
def _():
    return with_cells("#N/A", some(12, 24), column=1)


@file("empty_isolated.csv")
def _():
    return with_cells("", some(30, 25))


@file("empty_many.csv")
def _():
    return with_cells("", some(1200, 26))


@file("empty_run.csv")
def _():
    """A second without velocity."""
    return with_cells("", range(3000, 3500))


def half_empty(name):
    """The last column is a slow channel: a value in every second row."""
    s = periodic()
    last = numbers(s.ru if name == "ru" else s.r)
    last[1::2] = [""] * len(last[1::2])
    return table([*columns(), last], [*NAMES, name])


@file("half_empty_reference.csv")
def _():
    return half_empty("r")


@file("half_empty_excitation.csv")
def _():
    return half_empty("ru")


@file("time_cells_empty.csv")
def _():
    return with_cells("", some(12, 27), column=0)


@file("text_rows.csv")
def _():
    rows = lines()
    for k, word in ((4001, "*** trigger ***"), (2001, "Pause"), (1001, "overrun")):
        rows.insert(k, word)
    return text(rows)


@file("text_in_a_cell.csv")
def _():
    return with_cells("error", [3210])


@file("all_text.csv")
def _():
    c = columns()
    return table([c[0], ["ok"] * len(c[0]), ["ok"] * len(c[0])], NAMES)


# --- rows

@file("duplicate_rows.csv")
def _():
    rows = lines()
    for k in reversed(some(40, 31)):
        rows.insert(k + 1, rows[k + 1])
    return text(rows)


@file("repeated_stamps.csv")
def _():
    """Two different samples carry one stamp: the clock ticks at 4 ms, the samples come every 2 ms."""
    c = columns()
    s = periodic()
    c[0] = numbers(np.floor(s.t / 0.004 + 1e-9) * 0.004)
    return table(c, NAMES)


@file("time_goes_back.csv")
def _():
    s = periodic()
    c = columns()
    c[0] = numbers(np.where(s.t > 6.0, s.t - 1.5, s.t))
    return table(c, NAMES)


@file("two_recordings.csv")
def _():
    """Appended to an older recording, header and all."""
    rows = lines()
    return text(rows[:4001] + rows)


@file("missing_one_percent.csv")
def _():
    return without(some(58, 32))


@file("missing_two_in_a_row.csv")
def _():
    first = some(15, 33, apart=6)
    return without(first + [k + 1 for k in first])


@file("missing_three_percent.csv")
def _():
    return without(some(180, 37))


@file("missing_five_in_a_row.csv")
def _():
    return without(range(2500, 2505))


@file("missing_ten_percent.csv")
def _():
    return without(some(600, 34, apart=1))


@file("long_gap.csv")
def _():
    return without(range(2000, 2400))


@file("missing_without_time.csv")
def _():
    """The tags of halsampler show the loss: 'overrun', and the sample number jumps."""
    s = periodic()
    lost = {k for first in (1500, 3000, 4500) for k in range(first, first + 2)}
    rows = []
    for k, (u, y) in enumerate(zip(s.u, s.y)):
        if k in lost:
            continue
        if k - 1 in lost:
            rows.append("overrun")
        rows.append(f"{k} {u:f} {y:f} ")
    return text(rows)


@file("short_rows.csv")
def _():
    rows = lines()
    for k in some(10, 35):
        rows[k + 1] = rows[k + 1].rsplit(",", 1)[0]
    return text(rows)


@file("long_row.csv")
def _():
    rows = lines()
    rows[3000] += ",17"
    return text(rows)


@file("zero_bytes_in_the_middle.csv")
def _():
    data = plain().encode()
    middle = len(data) // 2
    return data[:middle] + b"\0" * 512 + data[middle + 512:]


@file("spikes.csv")
def _():
    """A bit flipped on the way: five samples of the velocity are far out."""
    c = columns()
    for k in some(5, 36):
        c[2][k] = "65535"
    return table(c, NAMES)


@file("stuck_velocity.csv")
def _():
    """The bus stood still for one and a half seconds in the middle: the last velocity is repeated."""
    c = columns()
    for k in range(3000, 3750):
        c[2][k] = c[2][2999]
    return table(c, NAMES)


# --- the form of the table

@file("quoted_numbers.csv")
def _():
    return table([[f'"{x}"' for x in c] for c in columns()], [f'"{n}"' for n in NAMES])


@file("duplicate_names.csv")
def _():
    t, u, y = columns()
    return table([t, u, y, u], ["time_s", "torque_Nm", "velocity_rad_s", "torque_Nm"])


@file("duplicate_names_that_differ.csv")
def _():
    s = periodic()
    t, u, y = columns()
    return table([t, u, numbers(0.5 * s.u + 1.0), y], ["time_s", "torque_Nm", "torque_Nm", "velocity_rad_s"])


@file("names_missing.csv")
def _():
    return table(columns(), ["time_s", "", ""])


@file("trailing_separators.csv")
def _():
    return table([*columns(True), [""] * len(periodic().t)], [*NAMES, ""], ";", "\r\n")


@file("trailing_separators_data_only.csv")
def _():
    return table([*columns(), [""] * len(periodic().t)], NAMES)


@file("decimal_comma_tab.csv")
def _():
    return table(columns(True), NAMES, "\t")


@file("decimal_comma_semicolon.csv")
def _():
    return table(columns(True), NAMES, ";")


@file("decimal_comma_space.csv")
def _():
    return table(columns(True), NAMES, " ")


@file("decimal_comma_and_comma.csv")
def _():
    s = periodic()
    return table([numbers(s.t, "%.4f", True), numbers(s.u, "%.4f", True), numbers(s.y, "%.4f", True)], NAMES, ",")


@file("aligned_with_blanks.txt")
def _():
    return table([[x.rjust(16) for x in c] for c in columns()], [n.rjust(16) for n in NAMES], "")


@file("pipes.csv")
def _():
    return table(columns(), NAMES, "|")


@file("blank_lines.csv")
def _():
    return "\n\n".join(lines()) + "\n\n\n"


@file("summary_below.csv")
def _():
    s = periodic()
    return text([*lines(), "", "Statistics", f"mean,{s.u.mean():.4f},{s.y.mean():.4f}", f"max,{s.u.max():.4f},{s.y.max():.4f}"])


@file("footer_of_another_table.csv")
def _():
    return text([*lines(), "", "Marker,Time,Value", "X1,1.0,2.0", "X2,3.0,4.0"])


# --- no recording at all

@file("empty.csv")
def _():
    return b""


@file("names_only.csv")
def _():
    return ",".join(NAMES) + "\n"


@file("login_page.csv")
def _():
    return "<!DOCTYPE html>\n<html><head><title>Sign in</title></head>\n<body><p>Your session has expired.</p></body></html>\n"


@file("other_binary.csv")
def _():
    return np.random.default_rng(40).integers(0, 256, 20000, dtype=np.uint8).tobytes()


@file("one_column.csv")
def _():
    return table([numbers(periodic().y)], ["velocity_rad_s"])
