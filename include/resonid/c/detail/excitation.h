// SPDX-License-Identifier: MIT
// What is injected, sample by sample: PRBS, multisine, chirp, stepped sine; and the guard that stops it at
// the machine's limits.
#ifndef RESONID_C_EXCITATION_H
#define RESONID_C_EXCITATION_H

#include <resonid/c/detail/types.h>

RESONID_BEGIN

// ---- Excitation ----

enum {
  RESONID_PHASES_RANDOM = 0,
  RESONID_PHASES_SCHROEDER = 1,
  RESONID_PHASES_ZERO = 2,
  RESONID_PHASES_GIVEN = 3
};
#define RESONID_EXCITATION_MAX_LINES 64

/// The kind decides which of the fields below the amplitude count.
typedef struct resonid_excitation_settings {
  resonid_settings head;
  double sample_rate_hz;  ///< Rate at which samples are generated, > 0.
  double amplitude;       ///< Peak value, of each line of a multisine without line_amplitudes, > 0.

  uint32_t register_length;  ///< PRBS: cells n of the shift register, 2 ... 24; the period is 2^n - 1 bits.
  uint32_t clock_divider;    ///< PRBS: samples for which a bit is held, >= 1.
  uint32_t start_state;      ///< PRBS: cells at the start, 1 ... 2^n - 1.

  uint32_t lines;                 ///< Multisine, stepped sine: 1 ... RESONID_EXCITATION_MAX_LINES.
  const double* lines_hz;         ///< [lines], > 0 and below half the sample rate; of a multisine ascending.
  const double* line_amplitudes;  ///< Multisine: [lines], > 0, or NULL: `amplitude` each.
  const double* phases_rad;       ///< Multisine, RESONID_PHASES_GIVEN only: [lines].
  uint32_t phases;                ///< Multisine: RESONID_PHASES_...
  uint32_t sweep;                 ///< Chirp: RESONID_SWEEP_...
  uint64_t seed;                  ///< Multisine: of random phases.
  double first_phase_rad;         ///< Multisine: of Schroeder's phases.

  double from_hz;          ///< Chirp: at the start, > 0 and below half the sample rate.
  double to_hz;            ///< Chirp: at the end, likewise; lower than at the start sweeps down.
  double duration_s;       ///< Chirp: of one sweep, at least two samples.
  double phase_rad;        ///< Chirp: phase p of the first sample, which is amplitude * cos(p).
  uint32_t repeat;         ///< Chirp: not 0: begins again after the end; else 0 from there on.
  uint32_t reserved;       ///< 0.
  double settle_periods;   ///< Stepped sine: at each frequency before measuring, 0 ... 1e6.
  double measure_periods;  ///< Stepped sine: measured at each frequency, 1 ... 1e6.
} resonid_excitation_settings;

typedef struct resonid_excitation_results {
  resonid_results head;
  uint64_t length_samples;  ///< One period, sweep or stepped measurement; 0: there is none.
  uint64_t period_samples;  ///< After which the signal repeats; 0: it does not.
  double low_hz, high_hz;   ///< Band that the signal reaches.
  uint32_t lines;           ///< Multisine, stepped sine; else 0.
  uint32_t line;  ///< Stepped sine: index of the frequency of the newest sample; `lines` when all are done.
  uint32_t measuring;  ///< Stepped sine: whether that sample is to be measured.
  uint32_t reserved;
} resonid_excitation_results;

/// The next `count` samples of an excitation, in the unit of the amplitude. Real-time safe, in time
/// proportional to `count`.
RESONID_API resonid_status resonid_generate(resonid_handle* excitation, double* samples,
                                            size_t count) RESONID_NOEXCEPT;

// ---- Guard ----

/// Why the injection has ended or is ending.
enum {
  RESONID_STOP_NONE = 0,
  RESONID_STOP_REQUESTED = 1,  ///< resonid_stop()
  RESONID_STOP_FINISHED = 2,   ///< duration_s
  RESONID_STOP_TORQUE = 3,
  RESONID_STOP_VELOCITY = 4,
  RESONID_STOP_POSITION = 5,
  RESONID_STOP_OSCILLATION = 6,
  RESONID_STOP_SIGNAL_LOST = 7,         ///< A measurement that a limit needs.
  RESONID_STOP_WATCHDOG_AMPLITUDE = 8,  ///< resonid_watch()
  RESONID_STOP_WATCHDOG_SILENT = 9      ///< resonid_watch() is not called any more.
};
enum { RESONID_OSCILLATION_OF_VELOCITY = 0, RESONID_OSCILLATION_OF_TORQUE = 1 };

/// A guard takes any excitation sample by sample and gives what of it may be injected: ramps it in and out,
/// keeps it within the torque that is left, and takes it away before the machine comes to a limit. It only
/// takes the excitation away: a moving machine has to be stopped by the host, for which `tripped` is the
/// signal. Units of the driven side: Nm, rad, rad/s; N, m, m/s for linear motion. A limit that is 0 is not
/// watched; without limits it guards nothing.
typedef struct resonid_guard_settings {
  resonid_settings head;
  double sample_rate_hz;        ///< Rate of resonid_guard_step(), > 0.
  double amplitude;             ///< The excitation is clipped to this, > 0.
  double ramp_in_s;             ///< Raised cosine at the start, >= 0.
  double ramp_out_s;            ///< Likewise at the end and when it is stopped.
  double trip_ramp_s;           ///< Likewise when a limit stops it; 0: at once.
  double duration_s;            ///< Length of the injection, both ramps included; 0: until it is stopped.
  double margin;                ///< Share of each of the machine's limits at which it stops, in (0, 1].
  double torque_limit;          ///< Limit of the drive, against the command with the excitation.
  double velocity_limit;        ///< Limit of the machine, either way.
  double position_low;          ///< Lower end of travel; both ends 0: none.
  double position_high;         ///< Upper end of travel.
  double deceleration;          ///< With which the machine is sure to stop, > 0 with a position window.
  double largest_acceleration;  ///< That the machine may still have until it reacts; 0: left out.
  double reaction_s;            ///< Delay of the measurements and of the stop, >= 0.
  double oscillation_from_hz;   ///< Lower end of the band that is watched for growing oscillation; 0: not
                                ///< watched.
  double oscillation_least;     ///< Rms below which nothing is an oscillation, > 0.
  double oscillation_expected;  ///< Rms that a normal run reaches at most; 0: learned from its beginning.
  double oscillation_growth;    ///< Factor over what is expected that stops it, > 1.
  double oscillation_window_s;  ///< Time constant of the rms; 0: 3/oscillation_from_hz.
  double oscillation_learn_s;   ///< Time after the ramp in during which what is normal is learned, >= 0.
  double lost_s;                ///< Longest time without a measurement that a limit needs, >= 0.
  double watch_limit;           ///< Limit of the amplitude given to resonid_watch(); 0: none.
  double watch_timeout_s;       ///< Longest time between two calls of it; 0: any.
  uint32_t oscillation_signal;  ///< RESONID_OSCILLATION_OF_...
  uint32_t torque_is_total;     ///< Not 0: the torque given is that of the last sample, excitation included.
} resonid_guard_settings;

typedef struct resonid_guard_results {
  resonid_results head;
  uint64_t samples;          ///< Since init or reset, missing ones included.
  uint64_t skipped_samples;  ///< At which a watched quantity was not measured.
  uint32_t reason;           ///< RESONID_STOP_...: the first that ended it.
  uint32_t tripped;          ///< Whether a limit stopped it, and not the plan or a request.
  uint32_t stopped;          ///< Nothing is injected any more until resonid_acknowledge().
  uint32_t steady;           ///< The ramp in is over, and nothing has ended it yet.
  uint64_t stop_sample;      ///< Index of the step that stopped it, 0 for the first.
  double stop_value;         ///< What passed the limit.
  double stop_limit;         ///< The level it passed, the margin taken off.
  double gain;               ///< Gain of the ramp at the newest sample, 0 ... 1.
  double injected;           ///< Newest sample that the step gave.
  double oscillation;        ///< Rms of the oscillation that is watched.
  double oscillation_threshold;
} resonid_guard_results;

/// What may be injected of `excitation`, given torque command, velocity and position of this sample, not a
/// number where they are not measured. When the call fails *injected is 0, if it is there at all. Real-time
/// safe.
RESONID_API resonid_status resonid_guard_step(resonid_handle* guard, double excitation, double torque,
                                              double velocity, double position,
                                              double* injected) RESONID_NOEXCEPT;
/// Newest amplitude of a tracker, for watch_limit and watch_timeout_s of a guard. Real-time safe.
RESONID_API resonid_status resonid_watch(resonid_handle* guard, double amplitude) RESONID_NOEXCEPT;
/// Ends the injection of a guard or an axis with the ramp out. Real-time safe.
RESONID_API resonid_status resonid_stop(resonid_handle* guard) RESONID_NOEXCEPT;
/// After a guard has stopped, allows the next start; *accepted is 0 while it still injects. Real-time safe.
RESONID_API resonid_status resonid_acknowledge(resonid_handle* guard, uint32_t* accepted) RESONID_NOEXCEPT;
/// The reason as a clause for a person; "unknown" for any other number. Any thread, real-time safe.
RESONID_API const char* resonid_stop_reason_string(uint32_t reason) RESONID_NOEXCEPT;

RESONID_END

#endif
