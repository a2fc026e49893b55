// SPDX-License-Identifier: MIT
// Discrete model of a drive, sample by sample: ARX, output error, closed-loop output error, instrumental
// variables.
#ifndef RESONID_C_MODEL_H
#define RESONID_C_MODEL_H

#include <resonid/c/rls.h>

RESONID_BEGIN

/// Estimator of  y(k) = -a_1 y(k-1) - ... - a_n y(k-n) + b_1 u(k-d-1) + ... + b_n u(k-d-n).  A two-mass drive
/// has n = 3, a rigid one 1, a three-mass one 5. Double precision.
typedef struct resonid_model resonid_model;

enum {
  RESONID_ARX = 0,          ///< Least squares: direct; biased by output noise. Orders 1 ... 6.
  RESONID_OE = 1,           ///< Output error along the regressor (RPLR): direct. Orders 1 ... 5.
  RESONID_OE_FILTERED = 2,  ///< Output error along the regressor filtered by 1/A (RPEM). Orders 1 ... 5.
  RESONID_CLOE = 3,         ///< Closed-loop output error: needs ru and the controller. Orders 1 ... 6.
  RESONID_F_CLOE = 4,       ///< The same, filtered by S/A of the start model, which must be given.
  RESONID_CLOE_DAMPED =
      5,          ///< The same, filtered by 1/A of the current model: the most accurate of the three.
  RESONID_IV = 6  ///< Instrumental variables: needs ru, the controller and a start model. Orders 2 ... 5.
};
#define RESONID_MODEL_MAX_ORDER 6

/// Where the predictor of the closed-loop methods takes its input from.
enum {
  RESONID_INPUT_EXCITATION = 0,  ///< ru - C yh: the loop driven by ru alone.
  RESONID_INPUT_MEASURED =
      1  ///< u + C (y - yh): the same whatever else drives the loop, such as a reference.
};

/// Arrays are read by init and create only.
typedef struct resonid_model_config {
  uint32_t struct_size;       ///< Set by resonid_model_defaults().
  uint32_t method;            ///< RESONID_ARX ... RESONID_IV.
  uint32_t order;             ///< n.
  uint32_t delay_samples;     ///< d: known delay of the output, 0 ... 63.
  double sample_rate_hz;      ///< Rate at which step() is called, > 0.
  const double* start_b;      ///< [n] b_1 ... b_n before the first sample, or NULL: 0.
  const double* start_a;      ///< [n] a_1 ... a_n likewise.
  const double* scale;        ///< All but IV: [2 n] typical sizes of the regressors of b, then a; or NULL: 1.
  uint32_t fixed_integrator;  ///< Not 0: the machine's integrator, z = 1, is known, not estimated.
  uint32_t load_torque;       ///< ARX, OE: not 0: also estimates a constant torque beside u.
  uint32_t coulomb;           ///< ARX, IV: not 0: also estimates friction against the sign of the velocity.
  uint32_t forgetting;        ///< All but IV: RESONID_FORGETTING_...
  double high_pass_hz;        ///< All but IV: corner of what takes offsets out of all signals alike; 0: none.
  double hold_below;      ///< All but IV: estimates are held while the excitation's rms is below this share
                          ///< of its largest, in [0, 1); 0: never.
  double start_variance;  ///< All but IV: as in resonid_rls_config, like the next five.
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
} resonid_model_config;

typedef struct resonid_model_info {
  uint32_t struct_size;  ///< Bytes that were filled.
  uint32_t order;
  uint32_t ready;            ///< The start no longer matters, and there was excitation enough.
  uint32_t excited;          ///< Whether there is.
  uint64_t samples;          ///< Since init or reset, missing ones included.
  uint64_t skipped_samples;  ///< Of these, missing ones.
  double residual;           ///< Newest output minus what was predicted for it.
  double load_torque;        ///< In the unit of u; 0 where it is not estimated.
  double coulomb_torque;     ///< Likewise.
} resonid_model_info;

/// An oscillation of the model, or, as an anti-resonance, of its inverse.
typedef struct resonid_mode {
  double frequency_hz;  ///< Undamped.
  double damping_ratio;
  double std_hz;  ///< Standard deviation of the frequency; infinite until it is known.
} resonid_mode;

/// As resonid_line_bank_defaults(), for one method. RESONID_ERROR_RANGE: no such method.
RESONID_API resonid_status resonid_model_defaults(resonid_model_config* config, size_t struct_size,
                                                  uint32_t method) RESONID_NOEXCEPT;
/// Bytes that a handle of this configuration needs; 0: there is no such handle.
RESONID_API size_t resonid_model_size(const resonid_model_config* config) RESONID_NOEXCEPT;
/// As resonid_line_bank_init().
RESONID_API resonid_status resonid_model_init(void* memory, size_t size, const resonid_model_config* config,
                                              resonid_model** handle, resonid_error* error) RESONID_NOEXCEPT;
/// As resonid_line_bank_create().
RESONID_API resonid_status resonid_model_create(const resonid_model_config* config, resonid_model** handle,
                                                resonid_error* error) RESONID_NOEXCEPT;
/// One sample of excitation, input and output; methods that do not need ru ignore it. Real-time safe.
RESONID_API resonid_status resonid_model_step(resonid_model* handle, double ru, double u,
                                              double y) RESONID_NOEXCEPT;
/// `count` samples at once, [sample]; `ru` may be NULL: 0.
RESONID_API resonid_status resonid_model_run(resonid_model* handle, const double* ru, const double* u,
                                             const double* y, size_t count) RESONID_NOEXCEPT;
/// `count` samples were lost: as many missing ones, in bounded time. Real-time safe.
RESONID_API resonid_status resonid_model_miss(resonid_model* handle, uint64_t count) RESONID_NOEXCEPT;
/// Back to the state after init, without the cost of it. Real-time safe.
RESONID_API resonid_status resonid_model_reset(resonid_model* handle) RESONID_NOEXCEPT;
/// Newest estimate: b_1 ... b_n and a_1 ... a_n, [order] each; `order` must be the model's. Real-time safe.
RESONID_API resonid_status resonid_model_coefficients(const resonid_model* handle, double* b, double* a,
                                                      size_t order) RESONID_NOEXCEPT;
/// Covariance of [b_1 ... b_n, a_1 ... a_n], [row][column], `count` = (2 n)^2; infinite until it is known.
/// Heap-free, but takes some 60 us with the output-error methods: not for a fast servo thread.
RESONID_API resonid_status resonid_model_covariance(const resonid_model* handle, double* covariance,
                                                    size_t count) RESONID_NOEXCEPT;
/// The estimate describes the machine of so many samples ago. Takes some 50 us with the output-error methods.
RESONID_API resonid_status resonid_model_lag_samples(const resonid_model* handle,
                                                     double* lag_samples) RESONID_NOEXCEPT;
/// Resonances in ascending order: *count of them, of which at most `room` are written. Takes the time of the
/// covariance and more.
RESONID_API resonid_status resonid_model_resonances(const resonid_model* handle, resonid_mode* mode,
                                                    size_t room, size_t* count) RESONID_NOEXCEPT;
/// The same for the anti-resonances.
RESONID_API resonid_status resonid_model_antiresonances(const resonid_model* handle, resonid_mode* mode,
                                                        size_t room, size_t* count) RESONID_NOEXCEPT;
/// Fills the first `struct_size` bytes of `info`. Real-time safe.
RESONID_API resonid_status resonid_model_get_info(const resonid_model* handle, resonid_model_info* info,
                                                  size_t struct_size) RESONID_NOEXCEPT;

RESONID_END

#endif
