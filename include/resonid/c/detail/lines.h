// SPDX-License-Identifier: MIT
// Phasors of signals at given lines, sample by sample: the line bank over u, y and ru, trackers of one
// signal, the response with error bars; and velocity from a raw encoder counter.
#ifndef RESONID_C_LINES_H
#define RESONID_C_LINES_H

#include <resonid/c/detail/types.h>

RESONID_BEGIN

// ---- Line bank: two or three signals over the same lines, in the least time and memory ----

#define RESONID_LINE_BANK_MAX_LINES 32
#define RESONID_LINE_BANK_SIZE 4096  ///< Enough for all settings.
enum { RESONID_CHANNEL_U = 0, RESONID_CHANNEL_Y = 1, RESONID_CHANNEL_RU = 2 };

typedef struct resonid_line_bank_settings {
  resonid_settings head;
  double sample_rate_hz;       ///< Rate of resonid_step(), > 0.
  const double* frequency_hz;  ///< [lines] in (0, sample_rate_hz/2), no two equal.
  uint32_t lines;              ///< 1 ... RESONID_LINE_BANK_MAX_LINES.
  uint32_t channels;           ///< 2: u, y; 3: u, y, ru.
  uint32_t offset;             ///< Not 0: a state for a constant part of each signal.
  uint32_t gain;               ///< RESONID_GAIN_...
  double lambda;               ///< Fixed gain: larger is quieter and slower; > -(lines + offset)/2.
  double pole_radius;          ///< Placed poles: in (0, 1); nearer to 1 is quieter and slower.
  double known_delay_s;        ///< Delay in y that is taken out of the response, >= 0.
  uint32_t precision;          ///< RESONID_DOUBLE or RESONID_FLOAT.
  uint32_t reserved;           ///< 0.
} resonid_line_bank_settings;

typedef struct resonid_line_bank_results {
  resonid_results head;
  uint64_t samples;          ///< Since init or reset, missing ones included.
  uint64_t skipped_samples;  ///< Missing ones among them: any channel was not finite.
  uint32_t lines;
  uint32_t channels;
  uint64_t settling_samples;  ///< Until ready; UINT64_MAX: never.
  uint32_t ready;             ///< Whether the start no longer matters for any line.
  uint32_t reserved;
  double innovation_u;  ///< Newest sample minus what was predicted for it.
  double innovation_y;
} resonid_line_bank_results;

/// Phasor of one channel of a line bank (RESONID_CHANNEL_...) over that of another at the newest sample,
/// delay removed, [line]: Y over U is the response, Y over RU the closed loop; 0 while the divisor is 0.
/// `count` must be that of the lines. Real-time safe.
RESONID_API resonid_status resonid_ratios(const resonid_handle* line_bank, uint32_t of, uint32_t over,
                                          resonid_complex* ratio, size_t count) RESONID_NOEXCEPT;
/// Rotating phasors at the newest sample, in the unit of the signal (peak value), [line], of one channel of a
/// line bank or, with channel 0, of a tracker. `count` must be that of the lines. Real-time safe.
RESONID_API resonid_status resonid_phasors(const resonid_handle* handle, uint32_t channel,
                                           resonid_complex* phasor, size_t count) RESONID_NOEXCEPT;

// ---- Trackers of one signal: RESONID_KALMAN_BANK, _SLIDING_DFT, _CHIRP_TRACKER ----

enum { RESONID_WINDOW_RECTANGULAR = 0, RESONID_WINDOW_HANN = 1 };
#define RESONID_TRACKER_MAX_LINES 32
#define RESONID_TRACKER_MAX_WINDOW 4096

/// Phases: signal = sum over lines of Re phasor.
typedef struct resonid_tracker_settings {
  resonid_settings head;
  double sample_rate_hz;       ///< Rate of resonid_step(), > 0.
  const double* frequency_hz;  ///< Kalman bank, sliding DFT: [lines], > 0 and below half the sample rate.
  uint32_t lines;              ///< 1 ... RESONID_TRACKER_MAX_LINES.
  uint32_t offset;             ///< Kalman bank, chirp: not 0: a state for a constant part of the signal.
  uint32_t gain;               ///< Kalman bank, chirp: RESONID_GAIN_...
  uint32_t sweep;              ///< Chirp: RESONID_SWEEP_...
  double lambda;               ///< Fixed gain: larger is quieter and slower; > -(lines + offset)/2.
  double pole_radius;          ///< Placed poles: in (0, 1); nearer to 1 is quieter and slower.
  uint32_t window_samples;     ///< Sliding DFT: N, 3 ... RESONID_TRACKER_MAX_WINDOW.
  uint32_t window;             ///< Sliding DFT: RESONID_WINDOW_...
  double from_hz;              ///< Chirp: at sample 0, > 0 and below half the sample rate.
  double to_hz;                ///< Chirp: at the end, likewise; the tracker stays there.
  double duration_s;           ///< Chirp: length of the sweep, > 0.
} resonid_tracker_settings;

typedef struct resonid_tracker_results {
  resonid_results head;
  uint64_t samples;          ///< Since init or reset, missing ones included.
  uint64_t skipped_samples;  ///< Missing ones among them.
  uint32_t lines;
  uint32_t ready;     ///< Whether the start no longer matters for any line.
  double innovation;  ///< Newest sample minus what was predicted for it; not a number for a sliding DFT.
} resonid_tracker_results;

/// What a tracker knows of one line.
typedef struct resonid_tracker_line {
  uint32_t struct_size;    ///< Bytes that were filled.
  uint32_t settled;        ///< Whether the start no longer matters for this line.
  double frequency_hz;     ///< Frequency of the line; of a chirp at the newest sample.
  resonid_complex phasor;  ///< Rotating, at the newest sample, in the unit of the signal (peak value).
  resonid_complex
      amplitude;       ///< The same with its phase referred to sample 0 (chirp: to the chirp of phase 0).
  double noise_gain;   ///< Rms of the phasor's error per unit standard deviation of white noise.
  double lag_samples;  ///< How far the phasor lags behind slow changes of the line.
  uint64_t settling_samples;  ///< Until settled; UINT64_MAX: never.
} resonid_tracker_line;

/// Fills the first `struct_size` bytes of `info`. Real-time safe.
RESONID_API resonid_status resonid_read_tracker_line(const resonid_handle* tracker, uint32_t line,
                                                     resonid_tracker_line* info,
                                                     size_t struct_size) RESONID_NOEXCEPT;

// ---- Response of the plant with error bars ----

/// How the response is formed from the phasors of excitation ru, input u and output y.
enum {
  RESONID_DIRECT = 0,    ///< Y/U
  RESONID_INDIRECT = 1,  ///< Gcl/(1 - C Gcl) with Gcl = Y/Ru: needs the excitation and the controller.
  RESONID_JOINT = 2      ///< (Y/Ru)/(U/Ru): needs the excitation.
};

typedef struct resonid_response_settings {
  resonid_settings head;
  const resonid_tracker_settings* tracker;    ///< Tracker of each of the three signals, of any kind.
  const resonid_complex* controller_at_line;  ///< Controller C at the lines (not with a chirp), or ...
  const double* controller_numerator;         ///< ... its coefficients in powers of z^-1, or neither.
  const double* controller_denominator;
  uint32_t controller_numerator_count;    ///< 0 ... 16.
  uint32_t controller_denominator_count;  ///< 0 ... 16.
  uint32_t controller_lines;              ///< Values of controller_at_line: 0, or one for every line.
  uint32_t reserved;                      ///< 0.
  double known_delay_s;                   ///< Delay in y that is taken out of the response, >= 0.
  double noise_memory_samples;            ///< Memory of the noise estimate; 0: 100 times the tracker's lag.
} resonid_response_settings;

typedef struct resonid_response_results {
  resonid_results head;
  uint64_t samples;          ///< Since init or reset, missing ones included.
  uint64_t skipped_samples;  ///< Missing ones among them: any of the three signals was not finite.
  uint32_t lines;
  uint32_t ready;  ///< Whether the start no longer matters for any line.
} resonid_response_results;

typedef struct resonid_response_line {
  uint32_t struct_size;       ///< Bytes that were filled.
  uint32_t settled;           ///< Whether the start no longer matters for this line.
  double frequency_hz;        ///< Frequency of the line; of a chirp at the newest sample.
  resonid_complex response;   ///< Delay removed; not a number where the approach lacks what it needs.
  double standard_deviation;  ///< Total, of the complex response: std^2 = E|error|^2; infinite until it is
                              ///< known.
  double coherence;           ///< 1/(1 + (std/|G|)^2); 0 until it is known.
  double lag_samples;         ///< How far the response lags behind slow changes of the machine.
} resonid_response_line;

/// One line by one approach (RESONID_DIRECT ...): fills the first `struct_size` bytes of `info`. Real-time
/// safe.
RESONID_API resonid_status resonid_read_response_line(const resonid_handle* response, uint32_t line,
                                                      uint32_t approach, resonid_response_line* info,
                                                      size_t struct_size) RESONID_NOEXCEPT;

// ---- Encoder: RESONID_ENCODER_COUNTER, whose start says nothing, or RESONID_ENCODER_ABSOLUTE ----

typedef struct resonid_encoder_settings {
  resonid_settings head;
  double sample_rate_hz;     ///< Rate of resonid_encoder_step(), > 0.
  uint64_t counts_per_turn;  ///< All four edges of a quadrature line count; > 0, below 2^63.
  double travel_per_turn;    ///< 2 pi rad; of a linear scale the metres that these counts stand for.
  double largest_velocity;   ///< That the machine can have, > 0: larger steps are bit errors.
  uint32_t bits;             ///< Width of the raw value, 8 ... 64; higher bits of it are ignored.
  uint32_t reversed;         ///< Not 0: rising counts are backward motion.
} resonid_encoder_settings;

typedef struct resonid_encoder_results {
  resonid_results head;
  uint64_t samples;  ///< Since init or reset, missing ones included.
  uint64_t skipped_samples;
  uint64_t implausible_samples;
  int64_t position_counts;  ///< Unwrapped, of the newest accepted sample; 0 before the first.
  double position;          ///< The same in rad (m).
  double velocity;          ///< Newest velocity (rad/s, m/s); not a number where it is missing or the first.
  double last_velocity;     ///< The last one there was, for a controller; 0 before.
  double resolution;        ///< Velocity of one count per sample.
  uint32_t certain;         ///< 0 once the machine may have passed half the counter's range unseen.
  uint32_t reserved;
} resonid_encoder_results;

/// The newest raw value; *velocity (may be NULL) is then that of this sample, not a number where it is
/// implausible or the first, which is what trackers take for missing. Real-time safe.
RESONID_API resonid_status resonid_encoder_step(resonid_handle* encoder, uint64_t raw,
                                                double* velocity) RESONID_NOEXCEPT;
/// Homing: what the position of the newest accepted sample is from now on. Real-time safe.
RESONID_API resonid_status resonid_encoder_set_position(resonid_handle* encoder,
                                                        int64_t counts) RESONID_NOEXCEPT;

RESONID_END

#endif
