// SPDX-License-Identifier: MIT
// Frequency response of the plant with error bars, sample by sample.
#ifndef RESONID_C_RESPONSE_H
#define RESONID_C_RESPONSE_H

#include <resonid/c/tracking.h>

RESONID_BEGIN

typedef struct resonid_response resonid_response;

/// How the response is formed from the phasors of excitation ru, input u and output y.
enum {
  RESONID_DIRECT = 0,    ///< Y/U
  RESONID_INDIRECT = 1,  ///< Gcl/(1 - C Gcl) with Gcl = Y/Ru: needs the excitation and the controller.
  RESONID_JOINT = 2      ///< (Y/Ru)/(U/Ru): needs the excitation.
};

/// Arrays, and the tracker's configuration, are read by init and create only.
typedef struct resonid_response_config {
  uint32_t struct_size;                       ///< Set by resonid_response_defaults().
  uint32_t controller_lines;                  ///< Values of controller_at_line: 0, or one for every line.
  const resonid_tracker_config* tracker;      ///< Of each of the three signals: any kind.
  const resonid_complex* controller_at_line;  ///< Controller C at the lines (not with a chirp), or ...
  const double* controller_numerator;         ///< ... its coefficients in powers of z^-1, or neither.
  const double* controller_denominator;
  uint32_t controller_numerator_count;    ///< 0 ... 16.
  uint32_t controller_denominator_count;  ///< 0 ... 16.
  double known_delay_s;                   ///< Delay in y that is taken out of the response, >= 0.
  double noise_memory_samples;            ///< Of the noise estimate; 0: 100 times the tracker's lag.
} resonid_response_config;

typedef struct resonid_response_info {
  uint32_t struct_size;  ///< Bytes that were filled.
  uint32_t lines;
  uint32_t ready;  ///< Whether the start no longer matters for any line.
  uint32_t reserved;
  uint64_t samples;          ///< Since init or reset, missing ones included.
  uint64_t skipped_samples;  ///< Of these, missing ones: any of the three signals was not finite.
} resonid_response_info;

typedef struct resonid_response_line {
  uint32_t struct_size;       ///< Bytes that were filled.
  uint32_t settled;           ///< Whether the start no longer matters for this line.
  double frequency_hz;        ///< Of a chirp: at the newest sample.
  resonid_complex response;   ///< Delay removed; not a number where the approach lacks what it needs.
  double standard_deviation;  ///< Of the complex response, total: std^2 = E|error|^2; infinite until it is
                              ///< known.
  double coherence;           ///< 1/(1 + (std/|G|)^2); 0 until it is known.
  double lag_samples;         ///< How far the response lags behind slow changes of the machine.
} resonid_response_line;

/// Fills a configuration of `struct_size` = sizeof(*config) bytes with defaults; the tracker's is the
/// caller's.
RESONID_API resonid_status resonid_response_defaults(resonid_response_config* config,
                                                     size_t struct_size) RESONID_NOEXCEPT;
/// Bytes that a handle of this configuration needs; 0: there is no such handle.
RESONID_API size_t resonid_response_size(const resonid_response_config* config) RESONID_NOEXCEPT;
/// As resonid_line_bank_init().
RESONID_API resonid_status resonid_response_init(void* memory, size_t size,
                                                 const resonid_response_config* config,
                                                 resonid_response** handle,
                                                 resonid_error* error) RESONID_NOEXCEPT;
/// As resonid_line_bank_create().
RESONID_API resonid_status resonid_response_create(const resonid_response_config* config,
                                                   resonid_response** handle,
                                                   resonid_error* error) RESONID_NOEXCEPT;
/// One sample of excitation, input and output; without excitation give 0, and take RESONID_DIRECT. Real-time
/// safe.
RESONID_API resonid_status resonid_response_step(resonid_response* handle, double ru, double u,
                                                 double y) RESONID_NOEXCEPT;
/// `count` samples at once, [sample]; `ru` may be NULL.
RESONID_API resonid_status resonid_response_run(resonid_response* handle, const double* ru, const double* u,
                                                const double* y, size_t count) RESONID_NOEXCEPT;
/// `count` samples were lost: as many missing ones, in bounded time. Real-time safe.
RESONID_API resonid_status resonid_response_miss(resonid_response* handle, uint64_t count) RESONID_NOEXCEPT;
/// Back to the state after init, without the cost of it. Real-time safe.
RESONID_API resonid_status resonid_response_reset(resonid_response* handle) RESONID_NOEXCEPT;
/// One line by one approach (RESONID_DIRECT ...): fills the first `struct_size` bytes of `info`. Real-time
/// safe.
RESONID_API resonid_status resonid_response_get_line(const resonid_response* handle, uint32_t line,
                                                     uint32_t approach, resonid_response_line* info,
                                                     size_t struct_size) RESONID_NOEXCEPT;
/// Fills the first `struct_size` bytes of `info`. Real-time safe.
RESONID_API resonid_status resonid_response_get_info(const resonid_response* handle,
                                                     resonid_response_info* info,
                                                     size_t struct_size) RESONID_NOEXCEPT;

RESONID_END

#endif
