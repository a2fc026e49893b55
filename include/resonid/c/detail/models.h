// SPDX-License-Identifier: MIT
// Parameters sample by sample: least squares of any equation, discrete models of a drive, and inertias,
// stiffness and damping of a two-mass drive.
#ifndef RESONID_C_MODELS_H
#define RESONID_C_MODELS_H

#include <resonid/c/detail/types.h>

RESONID_BEGIN

/// Newest estimate, [parameter]; `count` must be that of the parameters: of least squares `parameters`, of a
/// model b_1 ... b_n, a_1 ... a_n, of the physical tracker RESONID_PHYSICAL_PARAMETERS. Real-time safe.
RESONID_API resonid_status resonid_parameters(const resonid_handle* handle, double* parameters,
                                              size_t count) RESONID_NOEXCEPT;
/// Covariance of these, [row][column], `count` = parameters squared; infinite until it is known. Right for
/// white equation errors with least squares. Heap-free and fast, but some 60 us with output-error methods:
/// not for a fast servo thread.
RESONID_API resonid_status resonid_covariance(const resonid_handle* handle, double* covariance,
                                              size_t count) RESONID_NOEXCEPT;
/// The estimate of a model or of the physical tracker describes the machine of so many samples ago. Takes
/// some 50 us with the output-error methods.
RESONID_API resonid_status resonid_lag_samples(const resonid_handle* handle,
                                               double* lag_samples) RESONID_NOEXCEPT;

/// An oscillation of the model, or, as an anti-resonance, of its inverse.
typedef struct resonid_mode {
  double frequency_hz;  ///< Undamped.
  double damping_ratio;
  double std_hz;  ///< Standard deviation of the frequency; infinite until it is known.
} resonid_mode;
enum { RESONID_RESONANCES = 0, RESONID_ANTIRESONANCES = 1 };
/// RESONID_RESONANCES or RESONID_ANTIRESONANCES of a model in ascending order: *count of them, of which at
/// most `room` are written. Takes the time of the covariance and more.
RESONID_API resonid_status resonid_modes(const resonid_handle* model, uint32_t which, resonid_mode* mode,
                                         size_t room, size_t* count) RESONID_NOEXCEPT;

// ---- Recursive least squares of any equation that is linear in its parameters ----

/// How older samples lose weight.
enum {
  RESONID_FORGETTING_NONE = 0,        ///< Never: for a constant machine.
  RESONID_FORGETTING_CONSTANT = 1,    ///< By `factor` per sample.
  RESONID_FORGETTING_VARIABLE = 2,    ///< The faster, the larger the newest error is against the usual one.
  RESONID_FORGETTING_DIRECTIONAL = 3  ///< Only what the newest regressor tells about.
};
#define RESONID_RLS_MAX_PARAMETERS 12
#define RESONID_RLS_SIZE 2560  ///< Enough for all settings.

typedef struct resonid_rls_settings {
  resonid_settings head;
  uint32_t parameters;    ///< 1 ... RESONID_RLS_MAX_PARAMETERS.
  uint32_t forgetting;    ///< RESONID_FORGETTING_...
  const double* start;    ///< [parameter] before the first sample, or NULL: 0.
  const double* scale;    ///< [parameter] typical size of its regressor, > 0, or NULL: 1.
  const uint32_t* fixed;  ///< [parameter] not 0: stays at its start; or NULL: none does.
  /// Variance of each parameter's start per unit variance of the residual, times its scale squared; > 0.
  double start_variance;
  double factor;             ///< Weight that a sample keeps per sample, in (0, 1].
  double smallest_factor;    ///< Least factor of variable forgetting, in (0, factor].
  double noise_variance;     ///< Usual variance of the error, for variable forgetting; 0: learned.
  double largest_variance;   ///< Upper limit of each parameter's variance over its start's, >= 1.
  double smallest_variance;  ///< Lower limit likewise: stays alert without forgetting; 0 ... 1.
  uint32_t precision;        ///< RESONID_DOUBLE or RESONID_FLOAT.
  uint32_t reserved;         ///< 0.
} resonid_rls_settings;

typedef struct resonid_rls_results {
  resonid_results head;
  uint64_t samples;          ///< Since init or reset, missing ones included.
  uint64_t skipped_samples;  ///< Missing ones among them: anything in them was not finite.
  uint32_t parameters;
  uint32_t excited;          ///< 0 while the samples of the memory tell next to nothing new.
  double residual;           ///< Newest value minus its prediction from the estimate before it.
  double residual_variance;  ///< Equation error's variance over the memory; infinite before the first sample.
  double memory_samples;     ///< Sum of the weights that forgetting has left.
  double mean_age_samples;   ///< Mean age of the remembered samples by their weights.
} resonid_rls_results;

/// One equation  value = regressor' parameters + error,  `count` = parameters, `weight` > 0 times as certain
/// as usual (1). Real-time safe.
RESONID_API resonid_status resonid_rls_step(resonid_handle* rls, const double* regressor, size_t count,
                                            double value, double weight) RESONID_NOEXCEPT;

// ---- Discrete model: RESONID_ARX, _OE, _OE_FILTERED, _CLOE, _F_CLOE, _CLOE_DAMPED, _IV ----

#define RESONID_MODEL_MAX_ORDER 6

/// Where the predictor of the closed-loop methods takes its input from.
enum {
  RESONID_INPUT_EXCITATION = 0,  ///< ru - C yh: the loop driven by ru alone.
  RESONID_INPUT_MEASURED =
      1  ///< u + C (y - yh): the same whatever else drives the loop, such as a reference.
};

/// Estimator of  y(k) = -a_1 y(k-1) - ... - a_n y(k-n) + b_1 u(k-d-1) + ... + b_n u(k-d-n).  A two-mass drive
/// has n = 3, a rigid one 1, a three-mass one 5. Double precision.
typedef struct resonid_model_settings {
  resonid_settings head;
  uint32_t order;             ///< n.
  uint32_t delay_samples;     ///< d: known delay of the output, 0 ... 63.
  double sample_rate_hz;      ///< Rate of resonid_step(), > 0.
  const double* start_b;      ///< [n] b_1 ... b_n before the first sample, or NULL: 0.
  const double* start_a;      ///< [n] a_1 ... a_n likewise.
  const double* scale;        ///< All but IV: [2 n] typical sizes of the regressors of b, then a; or NULL: 1.
  uint32_t fixed_integrator;  ///< Not 0: the machine's integrator, z = 1, is known, not estimated.
  uint32_t load_torque;       ///< ARX, OE: not 0: also estimates a constant torque beside u.
  uint32_t coulomb;           ///< ARX, IV: not 0: also estimates friction against the sign of the velocity.
  uint32_t forgetting;        ///< All but IV: RESONID_FORGETTING_...
  double high_pass_hz;        ///< All but IV: corner of what takes offsets out of all signals alike; 0: none.
  double freeze_below;    ///< All but IV: estimates are frozen while the excitation's rms is below this share
                          ///< of its largest, in [0, 1); 0: never.
  double start_variance;  ///< All but IV: as in resonid_rls_settings, like the next five.
  double factor;
  double smallest_factor;
  double noise_variance;
  double largest_variance;
  double smallest_variance;
  double filter_contraction;  ///< OE_FILTERED, CLOE_DAMPED: poles of 1/A are drawn in by this, in (0, 1].
  double
      largest_pole_radius;  ///< OE, CLOE: of the predictor; above 1 leaves room to an estimated integrator.
  const double* controller_numerator;  ///< CLOE, IV: C in powers of z^-1, from measured output to -u.
  const double* controller_denominator;
  uint32_t
      controller_numerator_count;  ///< 1 ... 5 with CLOE, 1 ... 7 with IV; OE: 0 ... 5, for the lag only.
  uint32_t controller_denominator_count;  ///< Likewise.
  uint32_t predictor_input;               ///< CLOE: RESONID_INPUT_...
  uint32_t refined;                       ///< IV: not 0: filter by 1/A of the auxiliary model.
  uint32_t offsets;          ///< IV: not 0: all signals pass one high-pass, for offsets and slow loads.
  uint32_t extrapolate;      ///< IV: not 0: no lag but that of the oscillation, 1.8 times the variance.
  double memory_samples;     ///< IV: 1/(1 - lambda), > 1; infinite: no forgetting; 0: chosen from the start.
  double start_deviation;    ///< IV: how far the start may be off, relative standard deviation, > 0.
  double largest_deviation;  ///< IV: the same for what is no longer excited, > 0.
  double noise_rms;          ///< IV: of the measured output, for these two; 0: learned.
  uint32_t refresh_samples;  ///< IV: between changes of the auxiliary model; 0: chosen from the start model.
  uint32_t reserved;         ///< 0.
} resonid_model_settings;

typedef struct resonid_model_results {
  resonid_results head;
  uint64_t samples;          ///< Since init or reset, missing ones included.
  uint64_t skipped_samples;  ///< Missing ones among them.
  uint32_t order;
  uint32_t ready;    ///< The start no longer matters, and there was excitation enough.
  uint32_t excited;  ///< Whether there is.
  uint32_t reserved;
  double residual;        ///< Newest output minus what was predicted for it.
  double load_torque;     ///< In the unit of u; 0 where it is not estimated.
  double coulomb_torque;  ///< Likewise.
} resonid_model_results;

// ---- Physical tracker of a two-mass drive ----

/// Parameters, in this order everywhere.
enum {
  RESONID_DRIVEN_INERTIA = 0,    ///< J1, kgm2
  RESONID_LOAD_INERTIA = 1,      ///< J2, kgm2
  RESONID_STIFFNESS = 2,         ///< K, Nm/rad
  RESONID_DAMPING = 3,           ///< D, Nms/rad
  RESONID_TORQUE_OFFSET = 4,     ///< Constant torque that u does not hold, Nm
  RESONID_STIFFNESS_RATE = 5,    ///< Relative change of K per second, 1/s
  RESONID_VISCOUS_FRICTION = 6,  ///< On the driven side, Nms/rad
  RESONID_COULOMB_FRICTION = 7,  ///< Likewise, Nm
  RESONID_PHYSICAL_PARAMETERS = 8
};

/// What is known of a positive parameter at the start.
typedef struct resonid_start {
  double value;         ///< > 0.
  double relative_std;  ///< By which factor it may be off: standard deviation of its logarithm; 0: known.
} resonid_start;
/// The same of a parameter of any sign, in its own unit; 0: known, not estimated.
typedef struct resonid_start_friction {
  double value;
  double std;
} resonid_start_friction;

/// The four starting values must be set. ru of a sample only tells whether there is any. Linear machines: kg,
/// N/m, Ns/m, N in place of kgm2, Nm/rad, Nms/rad, Nm.
typedef struct resonid_physical_settings {
  resonid_settings head;
  double sample_rate_hz;         ///< Rate of resonid_step(), > 0.
  double delay_s;                ///< Known delay of the measured velocity, 0 ... 64 samples; any fraction.
  resonid_start driven_inertia;  ///< J1, kgm2
  resonid_start load_inertia;    ///< J2, kgm2
  resonid_start stiffness;       ///< K, Nm/rad
  resonid_start damping;         ///< D, Nms/rad
  resonid_start_friction viscous_friction_nms_rad;
  resonid_start_friction coulomb_friction_nm;
  double torque_offset_std_nm;         ///< How far a constant torque that u does not hold may lie from 0.
  double torque_offset_drift_nm_rt_s;  ///< How it wanders: standard deviation after a second.
  double stiffness_drift_per_s;   ///< Relative change of K per second while the machine moves; 0: it stays.
  double damping_drift_per_rt_s;  ///< How ln D wanders with it: standard deviation after a second.
  double noise_rms;               ///< White noise of the output; 0: estimated.
  double noise_memory_s;          ///< Memory of that estimate; 0: all samples.
  double start_velocity_std;      ///< Velocities about the first output, > 0.
  double plant_noise_variance;    ///< Process noise of each plant state per sample, >= 0: hardly any.
  uint32_t refresh_samples;       ///< Between two exact discretisations, >= 1.
  uint32_t replay_speed;          ///< Remembers the first 16384 samples, in 230 kB of the handle, and goes
                          ///< over so many of them per new one while the estimate moves far; 0: never,
                          ///< in a small handle: for a machine that changes from the start.
} resonid_physical_settings;

typedef struct resonid_physical_results {
  resonid_results head;
  uint64_t samples;  ///< Since init or reset, missing ones included.
  uint64_t skipped_samples;
  uint32_t ready;       ///< Converged and consistent.
  uint32_t converged;   ///< All that is estimated of J1, J2, K, D is known twice as well as at the start.
  uint32_t consistent;  ///< Innovations are about as large as the filter expects them.
  uint32_t excited;     ///< The twist moves enough to tell about the stiffness; else the estimate is frozen.
  uint32_t plausible;   ///< No friction below 0 by more than twice its error, a resonance that can be seen.
  uint32_t reserved;
  double value[8];               ///< RESONID_DRIVEN_INERTIA ... RESONID_COULOMB_FRICTION, SI units.
  double standard_deviation[8];  ///< Standard deviations of these; 0: not estimated.
  double resonance_hz;           ///< Undamped, sqrt(K (1/J1 + 1/J2)).
  double resonance_std_hz;
  double antiresonance_hz;  ///< Undamped, sqrt(K/J2).
  double antiresonance_std_hz;
  double residual;     ///< Newest output minus what was predicted for it.
  double noise_rms;    ///< Noise of the output, as given or estimated.
  double lag_samples;  ///< The estimate describes the machine of so many samples ago.
} resonid_physical_results;

RESONID_END

#endif
