// SPDX-License-Identifier: MIT
// One axis of a machine, followed sample by sample: guarded excitation, one estimator, margins of the loop
// and gap to a baseline with standard deviations, change detection, and a verdict. docs/methods/axis.md.
#ifndef RESONID_C_AXIS_H
#define RESONID_C_AXIS_H

#include <resonid/c/detail/excitation.h>
#include <resonid/c/detail/lines.h>
#include <resonid/c/detail/models.h>
#include <resonid/c/detail/supervision.h>
#include <resonid/c/detail/types.h>

RESONID_BEGIN

#define RESONID_AXIS_MAX_LINES 256
#define RESONID_AXIS_MAX_WINDOW 16384
#define RESONID_AXIS_MAX_BASELINE 1024
#define RESONID_AXIS_PARAMETERS 8

/// What y is. Plant and parameters are always those of the velocity.
enum { RESONID_AXIS_OF_VELOCITY = 0, RESONID_AXIS_OF_POSITION = 1, RESONID_AXIS_OF_ACCELERATION = 2 };

/// Where the loop comes from whose margins the rows hold.
enum {
  RESONID_LOOP_NONE = 0,
  RESONID_LOOP_CONTROLLER = 1,           ///< C Gd, Gd of the model that fits, else at the lines.
  RESONID_LOOP_CONTROLLER_AT_LINES = 2,  ///< The same at the lines, whatever fits them.
  RESONID_LOOP_MEASURED = 3              ///< Ru/U - 1 at the lines: of _LINES and _SLIDING_DFT.
};

/// A figure that is watched for a lasting change.
enum {
  RESONID_FIGURE_NONE = 0,
  RESONID_FIGURE_RESONANCE = 1,
  RESONID_FIGURE_ANTIRESONANCE = 2,
  RESONID_FIGURE_CROSSOVER = 3,
  RESONID_FIGURE_PHASE_MARGIN = 4,
  RESONID_FIGURE_MODULUS_MARGIN = 5,
  RESONID_FIGURE_GAP = 6
};

/// Thresholds of what a row is judged by.
typedef struct resonid_axis_criteria {
  double weak_excitation;    ///< Rms in the band over the strongest so far; below: no excitation.
  double restless;           ///< Relative distance of the resonance from its mean over a stretch.
  double residual_growth;    ///< Rms of the residual over a stretch against its usual one.
  double resonance_std;      ///< Largest relative standard deviation of the resonance.
  double antiresonance_std;  ///< The same of the anti-resonance; 0: not asked for.
  double gain_std;           ///< The same of b_1 of a rigid machine, which has no resonance.
  double line_std;           ///< The same of the lines (median), where no model fits them.
  double missing;            ///< Share of the newest samples that may be missing.
  uint32_t inside_lines;     ///< Not 0: both modes must lie between the first and the last line.
  uint32_t reserved;         ///< 0.
} resonid_axis_criteria;

/// Must be set: sample_rate_hz; of lines and sliding DFT lines_hz; of the chirp its sweep; of discrete models
/// start_b, start_a; of the physical tracker `physical`. Double precision.
typedef struct resonid_axis_settings {
  resonid_settings head;
  double sample_rate_hz;  ///< Rate of the samples, > 0.
  uint32_t output;        ///< RESONID_AXIS_OF_...
  uint32_t approach;      ///< For lines, sliding DFT, chirp: RESONID_DIRECT, _INDIRECT, _JOINT.
  double known_delay_s;   ///< In the measured output, >= 0: taken out of the plant, in the margins.
  const double* controller_numerator;  ///< C in powers of z^-1, from y to -u; NULL: not known.
  const double* controller_denominator;
  uint32_t controller_numerator_count;  ///< 1 ... 32; CLOE 1 ... 5, IV 1 ... 7.
  uint32_t controller_denominator_count;
  uint32_t controller_of_position;  ///< Not 0: C acts on the integral of y.
  uint32_t loop;                    ///< RESONID_LOOP_...; without a controller: none.

  const double* lines_hz;             ///< [line] ascending: of lines and sliding DFT, and of the multisine.
  uint32_t lines;                     ///< 1 ... RESONID_AXIS_MAX_LINES.
  uint32_t sweep;                     ///< RESONID_SWEEP_...
  double from_hz, to_hz, duration_s;  ///< Sweep of the chirp; whatever the kind, where a chirp is injected.
  uint32_t window_samples;            ///< Sliding DFT: 3 ... RESONID_AXIS_MAX_WINDOW; 0: memory_s.
  uint32_t window;                    ///< Sliding DFT: RESONID_WINDOW_...
  double lambda, pole_radius;         ///< Lines, chirp: instead of memory_s; 0: not given.
  double
      averaged_memories;  ///< Lines: averages in place of the newest phasors, in trackers' memories; 0: none.
  uint32_t signal_offset;  ///< Lines, chirp: not 0: a state for the constant part of the signals.
  uint32_t forgetting;     ///< ARX ... damped CLOE: RESONID_FORGETTING_...; the factor follows from memory_s.
  double memory_s;         ///< 0: chosen by each kind. Not of the physical tracker.
  double start_variance;   ///< ARX ... damped CLOE: as in resonid_rls_settings, like the next four.
  double smallest_factor;
  double noise_variance;
  double largest_variance;
  double smallest_variance;
  double start_deviation;  ///< IV: of each parameter over its size.
  double high_pass_hz;     ///< ARX ... damped CLOE: takes offsets out of all signals; 0: none.

  const double* start_b;  ///< [order] b_1 ... without the known delay.
  const double* start_a;  ///< [order] a_1 ...; an integrator at z = 1 is kept.
  uint32_t order;         ///< 1 (rigid) or 3 (two masses).
  uint32_t extrapolate;   ///< IV: not 0: no lag but that of the oscillation, 1.8 times the variance.
  uint32_t load_torque;   ///< ARX, OE, RPEM, IV: not 0: a constant or slow torque beside u.
  uint32_t coulomb;       ///< ARX, IV: not 0: also friction against the sign of the velocity.
  const resonid_physical_settings* physical;  ///< Physical tracker; its rate and delay are not used.

  uint32_t row_every_samples;  ///< Samples from row to row, >= 1.
  uint32_t spread_samples;     ///< Samples over which a row's work is spread, 1 ... row_every_samples.
  double loop_from_hz;         ///< Lower end of the band of the margins; 0: 0.0005 of the rate.
  const double* baseline_b;    ///< What the gap is to: a model, [baseline_order] each, up to 7 ...
  const double* baseline_a;
  const double* baseline_hz;                 ///< ... or a response, [baseline_lines] ascending. NULL: no gap.
  const resonid_complex* baseline_response;  ///< [line] without the known delay.
  uint32_t baseline_order;
  uint32_t baseline_lines;                ///< 0 ... RESONID_AXIS_MAX_BASELINE.
  const resonid_change_settings* change;  ///< Where change_of is not none; the rate is that of the rows.
  uint32_t change_of;                     ///< RESONID_FIGURE_...
  uint32_t has_excitation;                ///< Not 0: ru is in the samples; else excitation is judged by u.
  resonid_axis_criteria criteria;
  double centre_hz;   ///< About which excitation is looked for; 0: from the start, else from the lines.
  uint32_t injects;   ///< Not 0: resonid_axis_start() will be called.
  uint32_t reserved;  ///< 0.
} resonid_axis_settings;

/// A value with its standard deviation; not a number: not known.
typedef struct resonid_figure {
  double value, std;
} resonid_figure;

/// Why a row is not trusted: the first gate that is closed.
enum {
  RESONID_VERDICT_TRUSTED = 0,
  RESONID_VERDICT_NOT_MEASURED = 1,  ///< No row yet.
  RESONID_VERDICT_NOT_READY = 2,     ///< The start still matters.
  RESONID_VERDICT_STOPPED = 3,       ///< A limit ended the injection.
  RESONID_VERDICT_SAMPLES_MISSING = 4,
  RESONID_VERDICT_NOT_EXCITED = 5,
  RESONID_VERDICT_UNPHYSICAL = 6,
  RESONID_VERDICT_OUTSIDE_LINES = 7,
  RESONID_VERDICT_NOT_CONVERGED = 8,
  RESONID_VERDICT_RESIDUAL_GROWN = 9
};

/// Gates that are open, a bit each.
enum {
  RESONID_GATE_READY = 1,
  RESONID_GATE_EXCITED = 2,
  RESONID_GATE_CONVERGED = 4,
  RESONID_GATE_PHYSICAL = 8,
  RESONID_GATE_RESIDUAL = 16,
  RESONID_GATE_COMPLETE = 32,
  RESONID_GATE_COVERED = 64
};

/// The newest row, and what is known beside it.
typedef struct resonid_axis_results {
  resonid_results head;
  uint64_t samples;  ///< Since init, reset or start, missing ones included.
  uint64_t skipped_samples;
  uint64_t rows;          ///< So far; of these ...
  uint64_t trusted_rows;  ///< ... trusted.
  uint64_t row_sample;    ///< Index of the newest sample in the newest row, 0 for the first.
  uint32_t trusted;
  uint32_t verdict;    ///< RESONID_VERDICT_...
  uint32_t gates;      ///< RESONID_GATE_... of the row.
  uint32_t has_model;  ///< resonid_axis_response() answers.
  double lag_samples;  ///< The row describes the machine of so many samples before row_sample.
  resonid_figure parameter[RESONID_AXIS_PARAMETERS];  ///< resonid_axis_parameter_name() says which.
  resonid_figure resonance_hz;                        ///< Undamped.
  resonid_figure antiresonance_hz;
  double resonance_damping, antiresonance_damping;
  double driven_inertia, load_inertia, stiffness;  ///< Parameters of a two-mass machine.
  resonid_figure crossover_hz;                     ///< First downward crossing of |L| = 1.
  resonid_figure phase_margin_deg;                 ///< There.
  resonid_figure modulus_margin;                   ///< min |1 + L|
  resonid_figure gap;                              ///< Largest chordal distance to the baseline, 0 ... 1.
  double worst_phase_margin_deg, modulus_margin_hz;
  double gain_margin_db, gain_margin_hz;
  double coherence;              ///< Mean over the lines.
  double residual_rms;           ///< Over the last stretch, in the unit of y.
  double uncertainty;            ///< Relative, of what has to converge ...
  double most_uncertainty;       ///< ... and its largest value.
  double controller_difference;  ///< Relative difference at the lines that differ; 0: none does.
  uint32_t controller_differs;   ///< ru, u and y do not show the controller told.
  uint32_t changed;              ///< The watched figure; since when, by how much:
  double change_time_s, change_detected_s, change_size, change_size_std;
  uint32_t lines;        ///< That resonid_axis_line() gives.
  uint32_t injecting;    ///< Ramping in, steady or ramping out.
  uint32_t settled;      ///< Rows are made.
  uint32_t stop_reason;  ///< RESONID_STOP_...
} resonid_axis_results;

/// One sample, as resonid_step(); *row is 1 where it completed a row, else 0. Real-time safe.
RESONID_API resonid_status resonid_axis_step(resonid_handle* axis, double ru, double u, double y,
                                             uint32_t* row) RESONID_NOEXCEPT;
/// Samples, [sample], up to and with the one that completes a row: *taken of them, *row as above. Call it
/// again with the rest after having read the row. `ru` may be NULL, which is 0. Real-time safe.
RESONID_API resonid_status resonid_axis_run(resonid_handle* axis, const double* ru, const double* u,
                                            const double* y, size_t count, size_t* taken,
                                            uint32_t* row) RESONID_NOEXCEPT;

/// What is injected.
enum {
  RESONID_INJECT_MULTISINE = 0,  ///< At the axis' lines, Schroeder's phases.
  RESONID_INJECT_CHIRP = 1,      ///< From the first line to the last one, or along the axis' chirp.
  RESONID_INJECT_PRBS = 2,       ///< PRBS of 13 cells, flat up to the last line.
  RESONID_INJECT_GIVEN = 3       ///< What resonid_axis_excite() is handed.
};
/// Begins to inject with ramps and within the limits of `guard`, whose amplitude is the peak value, and
/// forgets what was estimated; the guard's rate is the axis'. `sweep_s`: of one sweep of a chirp. Real-time
/// safe but for the first sample of a PRBS. RESONID_ERROR_SETTINGS: nothing is injected.
RESONID_API resonid_status resonid_axis_start(resonid_handle* axis, uint32_t inject, double sweep_s,
                                              const resonid_guard_settings* guard,
                                              resonid_error* error) RESONID_NOEXCEPT;
/// Once per sample, before resonid_axis_step(): what is to be added to the controller's torque, given torque
/// command, velocity and position of this sample (not a number where they are not measured); `given`: for
/// RESONID_INJECT_GIVEN. It is the step's ru. When the call fails *injected is 0. Real-time safe.
RESONID_API resonid_status resonid_axis_excite(resonid_handle* axis, double torque, double velocity,
                                               double position, double given,
                                               double* injected) RESONID_NOEXCEPT;

/// The plant's response at one line, at the newest row.
typedef struct resonid_axis_line_info {
  uint32_t struct_size;  ///< Bytes that were filled.
  uint32_t settled;
  double frequency_hz;        ///< Frequency of the line; of a chirp, that which the value belongs to.
  resonid_complex response;   ///< For velocity, known delay removed.
  double standard_deviation;  ///< std^2 = E|error|^2
} resonid_axis_line_info;
/// RESONID_ERROR_RANGE: no such line. Real-time safe.
RESONID_API resonid_status resonid_axis_line(const resonid_handle* axis, uint32_t line,
                                             resonid_axis_line_info* info,
                                             size_t struct_size) RESONID_NOEXCEPT;
/// The model's response at any frequency, as of the newest row, without the known delay; not a number where
/// no model is known. Real-time safe.
RESONID_API resonid_status resonid_axis_response(const resonid_handle* axis, double frequency_hz,
                                                 resonid_complex* response) RESONID_NOEXCEPT;
/// The loop whose margins the next rows hold: as in the settings. Real-time safe.
RESONID_API resonid_status resonid_axis_set_loop(resonid_handle* axis, const double* numerator,
                                                 size_t numerator_count, const double* denominator,
                                                 size_t denominator_count, uint32_t of_position,
                                                 uint32_t loop, double known_delay_s,
                                                 resonid_error* error) RESONID_NOEXCEPT;
/// By what the next rows are judged. Real-time safe.
RESONID_API resonid_status resonid_axis_set_criteria(resonid_handle* axis,
                                                     const resonid_axis_criteria* criteria) RESONID_NOEXCEPT;
/// Name of the i-th parameter of a row: "b1" ..., "driven_inertia" ...; "" beyond the last one and of no
/// axis. Real-time safe.
RESONID_API const char* resonid_axis_parameter_name(const resonid_handle* axis, uint32_t i) RESONID_NOEXCEPT;
/// "trusted", "not-measured", ...; "unknown" for any other number. Any thread, real-time safe.
RESONID_API const char* resonid_verdict_string(uint32_t verdict) RESONID_NOEXCEPT;

RESONID_END

#endif
