// SPDX-License-Identifier: MIT
// For a live machine: an excitation that stops at the machine's limits, and motion from a raw encoder
// counter.
#ifndef RESONID_C_SAFETY_H
#define RESONID_C_SAFETY_H

#include <resonid/c/types.h>

RESONID_BEGIN

// ---- Guarded excitation ----

/// Takes any excitation sample by sample and gives what of it may be injected: ramps it in and out, keeps it
/// within the torque that is left, and takes it away before the machine comes to a limit. It only takes the
/// excitation away: a moving machine has to be stopped by the host, for which `tripped` is the signal.
typedef struct resonid_guard resonid_guard;

/// Why the injection has ended or is ending.
enum {
  RESONID_STOP_NONE = 0,
  RESONID_STOP_REQUESTED = 1,  ///< resonid_guard_stop()
  RESONID_STOP_FINISHED = 2,   ///< duration_s
  RESONID_STOP_TORQUE = 3,
  RESONID_STOP_VELOCITY = 4,
  RESONID_STOP_POSITION = 5,
  RESONID_STOP_OSCILLATION = 6,
  RESONID_STOP_SIGNAL_LOST = 7,         ///< A measurement that a limit needs.
  RESONID_STOP_WATCHDOG_AMPLITUDE = 8,  ///< resonid_guard_watch()
  RESONID_STOP_WATCHDOG_SILENT = 9      ///< resonid_guard_watch() is not called any more.
};
enum { RESONID_OSCILLATION_OF_VELOCITY = 0, RESONID_OSCILLATION_OF_TORQUE = 1 };

/// Units of the driven side: Nm, rad, rad/s; N, m, m/s for linear motion. A limit that is 0 is not watched.
typedef struct resonid_guard_config {
  uint32_t struct_size;  ///< Set by resonid_guard_defaults().
  uint32_t
      torque_is_total;    ///< Not 0: the torque given is that of the last sample with the excitation in it.
  double sample_rate_hz;  ///< Rate at which step() is called, > 0.
  double amplitude;       ///< The excitation is clipped to this, > 0.
  double ramp_in_s;       ///< Raised cosine at the start, >= 0.
  double ramp_out_s;      ///< Likewise at the end and when it is stopped.
  double trip_ramp_s;     ///< Likewise when a limit stops it; 0: at once.
  double duration_s;      ///< Of the injection, both ramps included; 0: until it is stopped.
  double margin;          ///< Share of each of the machine's limits at which it stops, in (0, 1].
  double torque_limit;    ///< Of the drive, against the command with the excitation.
  double velocity_limit;  ///< Of the machine, either way.
  double position_low;    ///< Lower end of travel; both ends 0: none.
  double position_high;   ///< Upper end of travel.
  double deceleration;    ///< With which the machine is sure to stop, > 0 with a position window.
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
  double watch_limit;           ///< Of the amplitude given to resonid_guard_watch(); 0: none.
  double watch_timeout_s;       ///< Longest time between two calls of it; 0: any.
  uint32_t oscillation_signal;  ///< RESONID_OSCILLATION_OF_...
  uint32_t reserved;            ///< 0.
} resonid_guard_config;

typedef struct resonid_guard_info {
  uint32_t struct_size;  ///< Bytes that were filled.
  uint32_t reason;       ///< RESONID_STOP_...: the first that ended it.
  uint32_t tripped;      ///< Whether a limit stopped it, and not the plan or a request.
  uint32_t stopped;      ///< Nothing is injected any more until resonid_guard_acknowledge().
  uint32_t steady;       ///< The ramp in is over, and nothing has ended it yet.
  uint32_t reserved;
  uint64_t stop_sample;  ///< Index of the step that stopped it, 0 for the first.
  double stop_value;     ///< What passed the limit.
  double stop_limit;     ///< The level it passed, the margin taken off.
  double gain;           ///< Of the ramp at the newest sample, 0 ... 1.
  double injected;       ///< Newest sample that step() gave.
  double oscillation;    ///< Rms of the oscillation that is watched.
  double oscillation_threshold;
  uint64_t samples;
  uint64_t skipped_samples;  ///< At which a watched quantity was not measured.
} resonid_guard_info;

/// Fills a configuration of `struct_size` = sizeof(*config) bytes with defaults; without limits it guards
/// nothing.
RESONID_API resonid_status resonid_guard_defaults(resonid_guard_config* config,
                                                  size_t struct_size) RESONID_NOEXCEPT;
/// Bytes that a handle of this configuration needs; 0: there is no such handle.
RESONID_API size_t resonid_guard_size(const resonid_guard_config* config) RESONID_NOEXCEPT;
/// As resonid_line_bank_init().
RESONID_API resonid_status resonid_guard_init(void* memory, size_t size, const resonid_guard_config* config,
                                              resonid_guard** handle, resonid_error* error) RESONID_NOEXCEPT;
/// As resonid_line_bank_create().
RESONID_API resonid_status resonid_guard_create(const resonid_guard_config* config, resonid_guard** handle,
                                                resonid_error* error) RESONID_NOEXCEPT;
/// What may be injected of `excitation`, given torque command, velocity and position of this sample, not a
/// number where they are not measured. When the call fails *injected is 0, if it is there at all. Real-time
/// safe.
RESONID_API resonid_status resonid_guard_step(resonid_guard* handle, double excitation, double torque,
                                              double velocity, double position,
                                              double* injected) RESONID_NOEXCEPT;
/// `count` samples went by without step(): nothing was measured, and the ramps wait. Real-time safe.
RESONID_API resonid_status resonid_guard_miss(resonid_guard* handle, uint64_t count) RESONID_NOEXCEPT;
/// Newest amplitude of a tracker, for watch_limit and watch_timeout_s. Real-time safe.
RESONID_API resonid_status resonid_guard_watch(resonid_guard* handle, double amplitude) RESONID_NOEXCEPT;
/// Ends with the ramp out. Real-time safe.
RESONID_API resonid_status resonid_guard_stop(resonid_guard* handle) RESONID_NOEXCEPT;
/// After it has stopped, allows the next start; *accepted is 0 while it still injects. Real-time safe.
RESONID_API resonid_status resonid_guard_acknowledge(resonid_guard* handle,
                                                     uint32_t* accepted) RESONID_NOEXCEPT;
/// Back to the state after init, without the cost of it. Real-time safe.
RESONID_API resonid_status resonid_guard_reset(resonid_guard* handle) RESONID_NOEXCEPT;
/// Fills the first `struct_size` bytes of `info`. Real-time safe.
RESONID_API resonid_status resonid_guard_get_info(const resonid_guard* handle, resonid_guard_info* info,
                                                  size_t struct_size) RESONID_NOEXCEPT;
/// The reason as a clause for a person; "unknown" for any other number. Any thread, real-time safe.
RESONID_API const char* resonid_stop_reason_string(uint32_t reason) RESONID_NOEXCEPT;

// ---- Encoder ----

typedef struct resonid_encoder resonid_encoder;

enum {
  RESONID_ENCODER_COUNTER =
      0,  ///< Register that a quadrature decoder counts in; where it starts says nothing.
  RESONID_ENCODER_ABSOLUTE_TURN =
      1  ///< 0 ... counts_per_turn - 1 within one turn, right from the first sample on.
};

typedef struct resonid_encoder_config {
  uint32_t struct_size;      ///< Set by resonid_encoder_defaults().
  uint32_t kind;             ///< RESONID_ENCODER_...
  double sample_rate_hz;     ///< Rate at which step() is called, > 0.
  uint64_t counts_per_turn;  ///< All four edges of a quadrature line count; > 0, below 2^63.
  double travel_per_turn;    ///< 2 pi rad; of a linear scale the metres that these counts stand for.
  double largest_velocity;   ///< That the machine can have, > 0: larger steps are bit errors.
  uint32_t bits;             ///< Width of the raw value, 8 ... 64; higher bits of it are ignored.
  uint32_t reversed;         ///< Not 0: rising counts are backward motion.
} resonid_encoder_config;

typedef struct resonid_encoder_info {
  uint32_t struct_size;     ///< Bytes that were filled.
  uint32_t certain;         ///< 0 once the machine may have passed half the counter's range unseen.
  int64_t position_counts;  ///< Unwrapped, of the newest accepted sample; 0 before the first.
  double position;          ///< The same in rad (m).
  double velocity;  ///< Of the newest sample (rad/s, m/s); not a number where it is missing or the first.
  double held_velocity;  ///< The last one there was, for a controller; 0 before.
  double resolution;     ///< Velocity of one count per sample.
  uint64_t samples;
  uint64_t skipped_samples;
  uint64_t implausible_samples;
} resonid_encoder_info;

/// Fills a configuration of `struct_size` = sizeof(*config) bytes with defaults.
RESONID_API resonid_status resonid_encoder_defaults(resonid_encoder_config* config,
                                                    size_t struct_size) RESONID_NOEXCEPT;
/// Bytes that a handle of this configuration needs; 0: there is no such handle.
RESONID_API size_t resonid_encoder_size(const resonid_encoder_config* config) RESONID_NOEXCEPT;
/// As resonid_line_bank_init().
RESONID_API resonid_status resonid_encoder_init(void* memory, size_t size,
                                                const resonid_encoder_config* config,
                                                resonid_encoder** handle,
                                                resonid_error* error) RESONID_NOEXCEPT;
/// As resonid_line_bank_create().
RESONID_API resonid_status resonid_encoder_create(const resonid_encoder_config* config,
                                                  resonid_encoder** handle,
                                                  resonid_error* error) RESONID_NOEXCEPT;
/// The newest raw value; *velocity (may be NULL) is then that of this sample, not a number where it is
/// implausible or the first, which is what trackers take for missing. Real-time safe.
RESONID_API resonid_status resonid_encoder_step(resonid_encoder* handle, uint64_t raw,
                                                double* velocity) RESONID_NOEXCEPT;
/// `count` samples were lost; the next difference is spread over them. Real-time safe.
RESONID_API resonid_status resonid_encoder_miss(resonid_encoder* handle, uint64_t count) RESONID_NOEXCEPT;
/// Homing: what the position of the newest accepted sample is from now on. Real-time safe.
RESONID_API resonid_status resonid_encoder_set_position(resonid_encoder* handle,
                                                        int64_t counts) RESONID_NOEXCEPT;
/// Back to the state after init, without the cost of it. Real-time safe.
RESONID_API resonid_status resonid_encoder_reset(resonid_encoder* handle) RESONID_NOEXCEPT;
/// Fills the first `struct_size` bytes of `info`. Real-time safe.
RESONID_API resonid_status resonid_encoder_get_info(const resonid_encoder* handle, resonid_encoder_info* info,
                                                    size_t struct_size) RESONID_NOEXCEPT;

RESONID_END

#endif
