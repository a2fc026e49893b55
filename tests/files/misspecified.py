# SPDX-License-Identifier: MIT
"""Sound recordings that are not what they are called, or about which something wrong is told. One fault each."""

import numpy as np

from faults import NAMES
from registry import file
from signals import NOISE_RMS, STEP_S, chirp, discrete, periodic, quiet, swept
from units import DEG, RATED_TORQUE, RPM, TORQUE_CONSTANT, TURN
from writers import numbers, table


def record(u, y, t=None, names=NAMES, form="%.6g"):
    return table([numbers(swept().t[:len(u)] if t is None else t), numbers(u, form), numbers(y, form)], names)


def s_table(s, names=NAMES):
    return record(s.u, s.y, s.t, names)


# --- quantities and units

@file("position_called_y.csv")
def _():
    s = swept()
    return record(s.u, s.angle, names=["t", "u", "y"], form="%.9g")


@file("position_called_velocity.csv")
def _():
    s = swept()
    return record(s.u, s.angle, names=["t", "torque", "velocity"], form="%.9g")


@file("position_standing_called_y.csv")
def _():
    """The same fault on a drive that does not turn, so that no ramp gives it away."""
    s = swept(6, velocity=0.0)
    return record(s.u, s.angle, names=["t", "u", "y"], form="%.9g")


@file("acceleration_called_velocity.csv")
def _():
    s = swept(noise=0.0005)
    return record(s.u, np.gradient(s.y, s.t), names=["t", "torque", "velocity"])


@file("velocity_rpm_without_unit.csv")
def _():
    s = swept()
    return record(s.u, RPM * s.y, names=["t", "u", "y"])


@file("velocity_rpm.csv")
def _():
    s = swept()
    return record(s.u, RPM * s.y, names=["t", "torque_Nm", "n_rpm"])


@file("velocity_deg_s.csv")
def _():
    s = swept()
    return record(s.u, DEG * s.y, names=["t", "torque_Nm", "velocity_deg_s"])


@file("position_deg.csv")
def _():
    s = swept()
    return record(s.u, DEG * s.angle, names=["t_s", "torque_Nm", "angle_deg"], form="%.9g")


@file("position_turns.csv")
def _():
    s = swept()
    return record(s.u, TURN * s.angle, names=["t_s", "torque_Nm", "position [rev]"], form="%.9g")


def counter(per_turn, bits, modulus=None, lowest=0):
    s = swept()
    return s, (np.floor(per_turn * TURN * s.angle).astype(int) - lowest) % (modulus or 2**bits) + lowest


def counted(values, name="position_counts"):
    s = swept()
    return table([numbers(s.t), numbers(s.u), numbers(values, "%d")], ["t_s", "torque_Nm", name])


for name, modulus, lowest in (("counts_wrapping_at_4000.csv", 4000, 0), ("counts_wrapping_at_9999.csv", 9999, 0),
                              ("counts_wrapping_between_signs.csv", 4000, -2000)):
    file(name)(lambda modulus=modulus, lowest=lowest: counted(counter(20000, 0, modulus, lowest)[1]))


@file("counts_without_unit_wrapping.csv")
def _():
    return counted(counter(20000, 0, 3600)[1], "position")


@file("degrees_without_unit_wrapping.csv")
def _():
    s = swept()
    return record(s.u, (DEG * s.angle) % 360.0, names=["t_s", "torque_Nm", "position"], form="%.9g")


@file("counts_reset_at_the_index.csv")
def _():
    """The counter is set to zero at a mark that comes 3600 ... 4400 counts later: no one range."""
    counts = np.floor(20000 * TURN * swept().angle).astype(int) + 1000
    marks = np.cumsum(np.random.default_rng(11).integers(3600, 4400, 100))
    passed = np.searchsorted(marks, counts, side="right")
    return counted(counts - np.concatenate([[0], marks])[passed])


@file("counts_wrapping_at_16_bits.csv")
def _():
    s, counts = counter(20000, 16)
    return table([numbers(s.t), numbers(s.u), numbers(counts, "%d")], ["t_s", "torque_Nm", "position_counts"])


@file("counts_per_turn_unknown.csv")
def _():
    s, counts = counter(20000, 16)
    return table([numbers(s.t), numbers(s.u), numbers(counts, "%d")], ["t_s", "torque_Nm", "position_counts"])


@file("angle_wrapping_at_one_turn.csv")
def _():
    s = swept()
    return record(s.u, (DEG * s.angle) % 360.0, names=["t_s", "torque_Nm", "angle_deg"], form="%.9g")


@file("input_ampere.csv")
def _():
    s = swept()
    return record(s.u / TORQUE_CONSTANT, s.y, names=["t_s", "Iq_A", "velocity_rad_s"])


@file("input_ampere_without_constant.csv")
def _():
    s = swept()
    return record(s.u / TORQUE_CONSTANT, s.y, names=["t_s", "Iq_A", "velocity_rad_s"])


@file("input_percent.csv")
def _():
    s = swept()
    return record(100.0 * s.u / RATED_TORQUE, s.y, names=["t_s", "torque [%]", "velocity_rad_s"])


@file("input_percent_without_rated_torque.csv")
def _():
    s = swept()
    return record(100.0 * s.u / RATED_TORQUE, s.y, names=["t_s", "torque [%]", "velocity_rad_s"])


@file("input_per_mille.csv")
def _():
    s = swept()
    return record(np.round(1000.0 * s.u / RATED_TORQUE), s.y, names=["t_s", "torque [‰]", "velocity_rad_s"])


@file("input_per_mille_of_a_large_motor.csv")
def _():
    s = swept()
    return record(np.round(1000.0 * s.u / (2.0 * RATED_TORQUE)), s.y, names=["t_s", "torque [‰]", "velocity_rad_s"])


@file("input_millinewtonmetres.csv")
def _():
    s = swept()
    return record(1e3 * s.u, s.y, names=["t_s", "torque_mNm", "velocity_rad_s"])


@file("unit_nobody_knows.csv")
def _():
    s = swept()
    return record(s.u, s.y / 3.7, names=["t_s", "torque [Nm]", "velocity [furlong/fortnight]"])


# --- columns

@file("output_multiple_of_input.csv")
def _():
    s = swept()
    return record(s.u, 2.5 * s.u)


@file("output_multiple_of_input_with_offset.csv")
def _():
    s = swept()
    return record(s.u, 10.0 - 0.3 * s.u)


@file("exchanged.csv")
def _():
    return s_table(swept())


@file("exchanged_names.csv")
def _():
    s = swept()
    return record(s.y, s.u, names=["time_s", "torque_Nm", "velocity_rad_s"])


@file("sign_of_output.csv")
def _():
    s = swept()
    return record(s.u, -s.y)


@file("sign_of_input.csv")
def _():
    s = swept()
    return record(-s.u, s.y)


@file("column_not_there.csv")
def _():
    return s_table(swept())


@file("several_torques.csv")
def _():
    s = swept()
    return table([numbers(x) for x in (s.t, s.u, s.u + 0.2 * np.sin(3.0 * s.t), s.y)],
                 ["time_s", "torque_set_Nm", "torque_load_Nm", "velocity_rad_s"])


# --- time

@file("milliseconds_as_seconds.csv")
def _():
    s = swept()
    return record(s.u, s.y, 1e3 * s.t, ["t", "u", "y"])


@file("milliseconds_called_seconds.csv")
def _():
    s = swept()
    return record(s.u, s.y, 1e3 * s.t, ["t_s", "torque_Nm", "velocity_rad_s"])


@file("rate_contradicts_time.csv")
def _():
    return s_table(swept())


@file("sample_number_without_rate.csv")
def _():
    s = swept()
    return record(s.u, s.y, np.arange(len(s.t)), ["sample", "torque_Nm", "velocity_rad_s"])


# --- what was told about the excitation

def whole(s):
    return table([numbers(x) for x in (s.t, s.ru, s.u, s.y)], ["time_s", "ru", "u", "y"])


for name in ("chirp_told_right.csv", "chirp_told_other_way.csv", "chirp_told_too_long.csv", "chirp_told_other_band.csv"):
    file(name)(lambda: whole(swept()))

@file("chirp_told_with_rest_before.csv")
def _():
    """--chirp counts from the first sample, the sweep begins half a second later."""
    return whole(swept(rest_s=0.5))


for name in ("period_told_right.csv", "period_told_wrong.csv"):
    file(name)(lambda: whole(periodic()))


@file("chirp_told_of_a_multisine.csv")
def _():
    return whole(periodic())


@file("period_told_of_a_chirp.csv")
def _():
    return whole(swept())


# --- too little

@file("too_short.csv")
def _():
    s = swept()
    part = slice(1000, 1060)
    return record(s.u[part], s.y[part], s.t[part])


@file("three_rows.csv")
def _():
    s = swept()
    return record(s.u[:3], s.y[:3], s.t[:3])


@file("hardly_excited.csv")
def _():
    return s_table(quiet())


@file("hardly_excited_at_rest.csv")
def _():
    """A millionth of the torque is injected: what moves is noise of the measurement."""
    return s_table(swept(8, amplitude=1e-6))


@file("hardly_excited_excitation_recorded.csv")
def _():
    """The injected torque is 0.005 Nm, a twentieth of what the controller makes of the noise."""
    s = swept(8, amplitude=5e-3)
    return table([numbers(x) for x in (s.t, s.ru, s.u, s.y)], ["time_s", "ru", "u", "y"])


@file("hardly_excited_open_loop.csv")
def _():
    """A sweep of 1 mNm on a drive without a controller, below the noise of the velocity."""
    rng = np.random.default_rng(12)
    u = chirp(6000, 0, amplitude=1e-3)
    a, b = discrete()
    x, y = np.zeros(4), []
    for torque in u:
        y.append(x[0] + NOISE_RMS * rng.standard_normal())
        x = a @ x + b * torque
    return record(u, np.array(y), form="%.9g")


@file("idle_position_loop.csv")
def _():
    """A position loop that keeps its place: noise of the encoder and the torque that answers it."""
    rng = np.random.default_rng(7)
    a, b = discrete()
    x, last, rows = np.zeros(4), 0.0, []
    for _ in range(6000):
        position = x[2] + 1e-5 * rng.standard_normal()
        torque = -1.5 * position - 0.06 * (position - last) / STEP_S
        last = position
        rows.append((torque, position))
        x = a @ x + b * torque
    u, y = np.array(rows).T
    return record(u, y, names=["t_s", "torque_Nm", "position_rad"], form="%.9g")


@file("constant_output.csv")
def _():
    s = swept()
    return record(s.u, np.full(len(s.u), 10.0))


@file("constant_input.csv")
def _():
    s = swept()
    return record(np.full(len(s.u), 0.5), s.y)


@file("zero_input.csv")
def _():
    s = swept()
    return record(np.zeros(len(s.u)), s.y)


# --- saturation

LIMIT_NM = 0.8


@file("saturated_torque.csv")
def _():
    """What acted was recorded: the plant can still be identified."""
    return s_table(swept(9, torque_limit=LIMIT_NM))


@file("saturated_torque_not_recorded.csv")
def _():
    """The command before the limit was recorded: for two fifths of the time another torque acted."""
    s = swept(9, torque_limit=LIMIT_NM)
    return record(s.demanded, s.y, s.t)


@file("velocity_clipped.csv")
def _():
    """The converter of the velocity ends at 10.2 rad/s."""
    s = swept()
    return record(s.u, np.minimum(s.y, 10.2))


@file("coarse_velocity.csv")
def _():
    """Whole revolutions per minute."""
    s = swept()
    return record(s.u, np.round(RPM * s.y), names=["t_s", "torque_Nm", "speed_rpm"])


@file("linear_called_rotary.csv")
def _():
    s = swept()
    return record(s.u / 0.05, 0.05 * s.y, names=["t_s", "force_N", "velocity_m_s"])
