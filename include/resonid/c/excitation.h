// SPDX-License-Identifier: MIT
// What is injected, sample by sample: PRBS, multisine, chirp, stepped sine.
#ifndef RESONID_C_EXCITATION_H
#define RESONID_C_EXCITATION_H

#include <resonid/c/types.h>

RESONID_BEGIN

typedef struct resonid_excitation resonid_excitation;

enum { RESONID_PRBS = 0, RESONID_MULTISINE = 1, RESONID_CHIRP = 2, RESONID_STEPPED_SINE = 3 };
enum {
  RESONID_PHASES_RANDOM = 0,
  RESONID_PHASES_SCHROEDER = 1,
  RESONID_PHASES_ZERO = 2,
  RESONID_PHASES_GIVEN = 3
};
#define RESONID_EXCITATION_MAX_LINES 64

/// `kind` decides which of the fields below the amplitude count. Arrays are read by init and create only.
typedef struct resonid_excitation_config {
  uint32_t struct_size;   ///< Set by resonid_excitation_defaults().
  uint32_t kind;          ///< RESONID_PRBS ... RESONID_STEPPED_SINE.
  double sample_rate_hz;  ///< Rate at which step() is called, > 0.
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
} resonid_excitation_config;

typedef struct resonid_excitation_info {
  uint32_t struct_size;     ///< Bytes that were filled.
  uint32_t lines;           ///< Multisine, stepped sine; else 0.
  uint64_t length_samples;  ///< One period, sweep or stepped measurement; 0: there is none.
  uint64_t period_samples;  ///< After which the signal repeats; 0: it does not.
  double low_hz, high_hz;   ///< Band that the signal reaches.
  uint32_t line;  ///< Stepped sine: index of the frequency of the newest sample; `lines` when all are done.
  uint32_t measuring;  ///< Stepped sine: whether that sample is to be measured.
} resonid_excitation_info;

/// Fills a configuration of `struct_size` = sizeof(*config) bytes with the kind's defaults.
/// RESONID_ERROR_RANGE: no such kind.
RESONID_API resonid_status resonid_excitation_defaults(resonid_excitation_config* config, size_t struct_size,
                                                       uint32_t kind) RESONID_NOEXCEPT;
/// Bytes that a handle of this configuration needs; 0 when no handle can be made of its kind.
RESONID_API size_t resonid_excitation_size(const resonid_excitation_config* config) RESONID_NOEXCEPT;
/// Makes the generator in the caller's memory of `size` bytes, aligned to RESONID_ALIGNMENT; *handle is then
/// the same address. `error` may be NULL. RESONID_ERROR_CONFIG, _SIZE, _ALIGNMENT, _NULL.
RESONID_API resonid_status resonid_excitation_init(void* memory, size_t size,
                                                   const resonid_excitation_config* config,
                                                   resonid_excitation** handle,
                                                   resonid_error* error) RESONID_NOEXCEPT;
/// The same in memory from the heap, for resonid_destroy(). RESONID_ERROR_MEMORY as well.
RESONID_API resonid_status resonid_excitation_create(const resonid_excitation_config* config,
                                                     resonid_excitation** handle,
                                                     resonid_error* error) RESONID_NOEXCEPT;
/// The next sample, in the unit of the amplitude. Real-time safe.
RESONID_API resonid_status resonid_excitation_step(resonid_excitation* handle,
                                                   double* sample) RESONID_NOEXCEPT;
/// The next `count` samples.
RESONID_API resonid_status resonid_excitation_fill(resonid_excitation* handle, double* samples,
                                                   size_t count) RESONID_NOEXCEPT;
/// Back to the state after init, without the cost of it. Real-time safe.
RESONID_API resonid_status resonid_excitation_reset(resonid_excitation* handle) RESONID_NOEXCEPT;
/// Fills the first `struct_size` bytes of `info`.
RESONID_API resonid_status resonid_excitation_get_info(const resonid_excitation* handle,
                                                       resonid_excitation_info* info,
                                                       size_t struct_size) RESONID_NOEXCEPT;

RESONID_END

#endif
