// SPDX-License-Identifier: MIT
// Margins of a measured loop, and detection of lasting changes in any tracked figure.
#ifndef RESONID_C_SUPERVISION_H
#define RESONID_C_SUPERVISION_H

#include <resonid/c/detail/types.h>

RESONID_BEGIN

// ---- Margins ----

/// Not a number: the band does not show it.
typedef struct resonid_loop_margins {
  uint32_t struct_size;  ///< Bytes that were filled.
  uint32_t reserved;
  double crossover_hz;            ///< First downward crossing of |L| = 1.
  double phase_margin_deg;        ///< 180 + arg L there, in (-180, 180].
  double worst_phase_margin_deg;  ///< Smallest over all crossings of |L| = 1, upward ones too.
  double modulus_margin;          ///< min |1 + L| over the whole band.
  double modulus_margin_hz;       ///< Where that is.
  double gain_margin_db;          ///< Smallest factor > 1 at arg L = -180 deg, in dB.
  double gain_margin_hz;
} resonid_loop_margins;

/// Margins of a loop L = C Gd, delays included, at ascending frequencies, [line] both. A line that is not
/// finite is a gap, across which nothing is interpolated. Real-time safe; some 100 ns per line.
/// RESONID_ERROR_SETTINGS: frequencies that do not ascend.
RESONID_API resonid_status resonid_margins(const double* frequency_hz, const resonid_complex* loop,
                                           size_t count, resonid_loop_margins* margins, size_t struct_size,
                                           resonid_error* error) RESONID_NOEXCEPT;

/// L = C G e^{-jw delay_s}, [line], from a measured response G whose known delay was removed, and the
/// controller's coefficients in powers of z^-1, 1 ... 16 each. `loop` may be `response`. Real-time safe.
RESONID_API resonid_status resonid_loop_response(const double* numerator, size_t numerator_count,
                                                 const double* denominator, size_t denominator_count,
                                                 double sample_rate_hz, double delay_s,
                                                 const double* frequency_hz, const resonid_complex* response,
                                                 resonid_complex* loop, size_t count,
                                                 resonid_error* error) RESONID_NOEXCEPT;

// ---- Change detection: RESONID_CUSUM for a change of about the size that `reference` is made for,
//      RESONID_LIKELIHOOD_RATIO for one of any size ----

/// The times must be set.
typedef struct resonid_change_settings {
  resonid_settings head;
  double sample_rate_hz;  ///< Rate of resonid_change_step(), > 0.
  double block_s;         ///< Values are averaged over so long: twice the memory of their estimator, or more.
  double baseline_s;      ///< Learning before the first alarm is possible, at least 16 blocks.
  double false_alarm_interval_s;  ///< Mean time between false alarms, at least 50 blocks.
  double reference;        ///< CUSUM: half the change to be found soonest, in standard deviations of a block.
  uint32_t window_blocks;  ///< Likelihood ratio: 1 ... 256.
  uint32_t reserved;       ///< 0.
} resonid_change_settings;

typedef struct resonid_change_results {
  resonid_results head;
  uint64_t samples;  ///< Since init or reset, missing ones included.
  uint64_t skipped_samples;
  uint32_t ready;     ///< The baseline is learned: changes can be found from now on.
  uint32_t alarm;     ///< A change was found; it stays until reset or relearn.
  uint32_t reliable;  ///< Blocks are as independent as the stated rate of false alarms needs.
  uint32_t reserved;
  double level;       ///< Value of the statistic; an alarm from 1 on.
  double baseline;    ///< Mean before the change.
  double block_std;   ///< Standard deviation of what is new in a block.
  double time_s;      ///< After an alarm: when the change began, as far as it shows, since reset.
  double detected_s;  ///< After an alarm: when it came.
  double size;        ///< After an alarm: mean since then minus the mean before.
  double size_std;
} resonid_change_results;

/// One value of the figure with its standard deviation (1 when there is none; only ratios count). What an
/// estimator merely holds should be given as not a number. Real-time safe.
RESONID_API resonid_status resonid_change_step(resonid_handle* change, double value,
                                               double standard_deviation) RESONID_NOEXCEPT;
/// Takes what comes for a new baseline, keeping the time. Real-time safe.
RESONID_API resonid_status resonid_change_relearn(resonid_handle* change) RESONID_NOEXCEPT;

RESONID_END

#endif
