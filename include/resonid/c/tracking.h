// SPDX-License-Identifier: MIT
// Phasors of signals at given lines, sample by sample: the line bank over u, y and ru, and single-signal
// trackers.
#ifndef RESONID_C_TRACKING_H
#define RESONID_C_TRACKING_H

#include <resonid/c/types.h>

RESONID_BEGIN

// ---- Line bank: two or three signals over the same lines, and the response, in the least time and memory
// ----

typedef struct resonid_line_bank resonid_line_bank;

#define RESONID_LINE_BANK_MAX_LINES 32
#define RESONID_LINE_BANK_SIZE 4096  ///< Enough for every configuration.
enum { RESONID_CHANNEL_U = 0, RESONID_CHANNEL_Y = 1, RESONID_CHANNEL_RU = 2 };

typedef struct resonid_line_bank_config {
  uint32_t struct_size;   ///< Set by resonid_line_bank_defaults().
  uint32_t precision;     ///< RESONID_DOUBLE or RESONID_FLOAT.
  double sample_rate_hz;  ///< Rate at which step() is called, > 0.
  const double*
      frequency_hz;      ///< [lines] in (0, sample_rate_hz/2), no two equal; read by init and create only.
  uint32_t lines;        ///< 1 ... RESONID_LINE_BANK_MAX_LINES.
  uint32_t channels;     ///< 2: u, y; 3: u, y, ru.
  uint32_t offset;       ///< Not 0: a state for a constant part of each signal.
  uint32_t gain;         ///< RESONID_GAIN_...
  double lambda;         ///< Fixed gain: larger is quieter and slower; > -(lines + offset)/2.
  double pole_radius;    ///< Placed poles: in (0, 1); nearer to 1 is quieter and slower.
  double known_delay_s;  ///< Delay in y that is taken out of the response, >= 0.
} resonid_line_bank_config;

typedef struct resonid_line_bank_info {
  uint32_t struct_size;  ///< Bytes that were filled.
  uint32_t lines;
  uint32_t channels;
  uint32_t ready;             ///< Whether the start no longer matters for any line.
  uint64_t settling_samples;  ///< Until ready; UINT64_MAX: never.
  uint64_t samples;           ///< Since init or reset, missing ones included.
  uint64_t skipped_samples;   ///< Of these, missing ones: any channel was not finite.
  double innovation_u;        ///< Newest sample minus what was predicted for it.
  double innovation_y;
} resonid_line_bank_info;

/// Fills a configuration of `struct_size` = sizeof(*config) bytes with defaults.
RESONID_API resonid_status resonid_line_bank_defaults(resonid_line_bank_config* config,
                                                      size_t struct_size) RESONID_NOEXCEPT;
/// Bytes that a handle of this configuration needs, at most RESONID_LINE_BANK_SIZE; 0: there is no such
/// handle.
RESONID_API size_t resonid_line_bank_size(const resonid_line_bank_config* config) RESONID_NOEXCEPT;
/// Makes the bank in the caller's memory of `size` bytes, aligned to RESONID_ALIGNMENT; *handle is then the
/// same address. `error` may be NULL. RESONID_ERROR_CONFIG, _SIZE, _ALIGNMENT, _NULL.
RESONID_API resonid_status resonid_line_bank_init(void* memory, size_t size,
                                                  const resonid_line_bank_config* config,
                                                  resonid_line_bank** handle,
                                                  resonid_error* error) RESONID_NOEXCEPT;
/// The same in memory from the heap, for resonid_destroy(). RESONID_ERROR_MEMORY as well.
RESONID_API resonid_status resonid_line_bank_create(const resonid_line_bank_config* config,
                                                    resonid_line_bank** handle,
                                                    resonid_error* error) RESONID_NOEXCEPT;
/// One sample of input and output of a bank of two channels. Real-time safe. RESONID_ERROR_UNSUPPORTED: it
/// has three.
RESONID_API resonid_status resonid_line_bank_step(resonid_line_bank* handle, double u,
                                                  double y) RESONID_NOEXCEPT;
/// The same with the excitation, of a bank of three channels. RESONID_ERROR_UNSUPPORTED: it has two.
RESONID_API resonid_status resonid_line_bank_step_excited(resonid_line_bank* handle, double ru, double u,
                                                          double y) RESONID_NOEXCEPT;
/// `count` samples at once, [sample]; `ru` is NULL with two channels.
RESONID_API resonid_status resonid_line_bank_run(resonid_line_bank* handle, const double* ru, const double* u,
                                                 const double* y, size_t count) RESONID_NOEXCEPT;
/// The same from single-precision signals; the bank's own precision stays.
RESONID_API resonid_status resonid_line_bank_run_float(resonid_line_bank* handle, const float* ru,
                                                       const float* u, const float* y,
                                                       size_t count) RESONID_NOEXCEPT;
/// `count` samples were lost: as many missing ones, in bounded time. Real-time safe.
RESONID_API resonid_status resonid_line_bank_miss(resonid_line_bank* handle, uint64_t count) RESONID_NOEXCEPT;
/// Back to the state after init, without the cost of it. Real-time safe.
RESONID_API resonid_status resonid_line_bank_reset(resonid_line_bank* handle) RESONID_NOEXCEPT;
/// Response Y/U of all lines at the newest sample, delay removed, [line]; 0 while U is 0. `count` must be
/// that of the lines. Real-time safe.
RESONID_API resonid_status resonid_line_bank_responses(const resonid_line_bank* handle,
                                                       resonid_complex* response,
                                                       size_t count) RESONID_NOEXCEPT;
/// Phasor of one channel over that of another (RESONID_CHANNEL_...), delay removed: Y/RU is the closed loop.
RESONID_API resonid_status resonid_line_bank_ratio(const resonid_line_bank* handle, uint32_t line,
                                                   uint32_t of, uint32_t over,
                                                   resonid_complex* ratio) RESONID_NOEXCEPT;
/// Rotating phasor at the newest sample, in the unit of the channel's signal (peak value).
RESONID_API resonid_status resonid_line_bank_phasor(const resonid_line_bank* handle, uint32_t line,
                                                    uint32_t channel,
                                                    resonid_complex* phasor) RESONID_NOEXCEPT;
/// Fills the first `struct_size` bytes of `info`.
RESONID_API resonid_status resonid_line_bank_get_info(const resonid_line_bank* handle,
                                                      resonid_line_bank_info* info,
                                                      size_t struct_size) RESONID_NOEXCEPT;

// ---- Trackers of one signal ----

typedef struct resonid_tracker resonid_tracker;

enum {
  RESONID_KALMAN_BANK = 0,   ///< Several fixed lines, which it separates however close they are.
  RESONID_SLIDING_DFT = 1,   ///< Fixed lines on the grid sample_rate_hz/window_samples, over a window.
  RESONID_CHIRP_TRACKER = 2  ///< One line, which follows a chirp.
};
enum { RESONID_WINDOW_RECTANGULAR = 0, RESONID_WINDOW_HANN = 1 };
#define RESONID_TRACKER_MAX_LINES 32
#define RESONID_TRACKER_MAX_WINDOW 4096

/// Phases: signal = sum over lines of Re phasor. Arrays are read by init and create only.
typedef struct resonid_tracker_config {
  uint32_t struct_size;        ///< Set by resonid_tracker_defaults().
  uint32_t kind;               ///< RESONID_KALMAN_BANK ... RESONID_CHIRP_TRACKER.
  double sample_rate_hz;       ///< Rate at which step() is called, > 0.
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
} resonid_tracker_config;

typedef struct resonid_tracker_info {
  uint32_t struct_size;  ///< Bytes that were filled.
  uint32_t lines;
  uint32_t ready;  ///< Whether the start no longer matters for any line.
  uint32_t reserved;
  uint64_t samples;          ///< Since init or reset, missing ones included.
  uint64_t skipped_samples;  ///< Of these, missing ones.
  double innovation;  ///< Newest sample minus what was predicted for it; not a number for a sliding DFT.
} resonid_tracker_info;

/// What a tracker knows of one line.
typedef struct resonid_tracker_line {
  uint32_t struct_size;    ///< Bytes that were filled.
  uint32_t settled;        ///< Whether the start no longer matters for this line.
  double frequency_hz;     ///< Of a chirp: at the newest sample.
  resonid_complex phasor;  ///< Rotating, at the newest sample, in the unit of the signal (peak value).
  resonid_complex
      amplitude;       ///< The same with its phase referred to sample 0 (chirp: to the chirp of phase 0).
  double noise_gain;   ///< Rms of the phasor's error per unit standard deviation of white noise.
  double lag_samples;  ///< How far the phasor lags behind slow changes of the line.
  uint64_t settling_samples;  ///< Until settled; UINT64_MAX: never.
} resonid_tracker_line;

/// As resonid_line_bank_defaults(), for one kind. RESONID_ERROR_RANGE: no such kind.
RESONID_API resonid_status resonid_tracker_defaults(resonid_tracker_config* config, size_t struct_size,
                                                    uint32_t kind) RESONID_NOEXCEPT;
/// Bytes that a handle of this configuration needs; 0: there is no such handle.
RESONID_API size_t resonid_tracker_size(const resonid_tracker_config* config) RESONID_NOEXCEPT;
/// As resonid_line_bank_init().
RESONID_API resonid_status resonid_tracker_init(void* memory, size_t size,
                                                const resonid_tracker_config* config,
                                                resonid_tracker** handle,
                                                resonid_error* error) RESONID_NOEXCEPT;
/// As resonid_line_bank_create().
RESONID_API resonid_status resonid_tracker_create(const resonid_tracker_config* config,
                                                  resonid_tracker** handle,
                                                  resonid_error* error) RESONID_NOEXCEPT;
/// One sample. Real-time safe.
RESONID_API resonid_status resonid_tracker_step(resonid_tracker* handle, double sample) RESONID_NOEXCEPT;
/// `count` samples at once.
RESONID_API resonid_status resonid_tracker_run(resonid_tracker* handle, const double* samples,
                                               size_t count) RESONID_NOEXCEPT;
/// `count` samples were lost: as many missing ones, in bounded time. Real-time safe.
RESONID_API resonid_status resonid_tracker_miss(resonid_tracker* handle, uint64_t count) RESONID_NOEXCEPT;
/// Back to the state after init, without the cost of it. Real-time safe.
RESONID_API resonid_status resonid_tracker_reset(resonid_tracker* handle) RESONID_NOEXCEPT;
/// Phasors of all lines as in resonid_tracker_line, [line]. `count` must be that of the lines. Real-time
/// safe.
RESONID_API resonid_status resonid_tracker_phasors(const resonid_tracker* handle, resonid_complex* phasor,
                                                   size_t count) RESONID_NOEXCEPT;
/// Fills the first `struct_size` bytes of `info`. Real-time safe.
RESONID_API resonid_status resonid_tracker_get_line(const resonid_tracker* handle, uint32_t line,
                                                    resonid_tracker_line* info,
                                                    size_t struct_size) RESONID_NOEXCEPT;
/// Fills the first `struct_size` bytes of `info`. Real-time safe.
RESONID_API resonid_status resonid_tracker_get_info(const resonid_tracker* handle, resonid_tracker_info* info,
                                                    size_t struct_size) RESONID_NOEXCEPT;

RESONID_END

#endif
