// SPDX-License-Identifier: MIT
// Inertias, stiffness and damping of a two-mass drive, sample by sample.
#ifndef RESONID_C_PHYSICAL_H
#define RESONID_C_PHYSICAL_H

#include <resonid/c/types.h>

RESONID_BEGIN

typedef struct resonid_physical resonid_physical;

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

/// Linear machines: kg, N/m, Ns/m, N in place of kgm2, Nm/rad, Nms/rad, Nm.
typedef struct resonid_physical_config {
  uint32_t struct_size;   ///< Set by resonid_physical_defaults().
  uint32_t replay;        ///< Not 0: remembers the first 16384 samples and goes over them again while the
                          ///< estimate moves far; takes 230 kB of memory.
  double sample_rate_hz;  ///< Rate at which step() is called, > 0.
  double delay_s;         ///< Known delay of the measured velocity, 0 ... 64 samples; any fraction.
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
  double noise_memory_s;          ///< Of that estimate; 0: all samples.
  double start_velocity_std;      ///< Of the velocities about the first output, > 0.
  double plant_noise_variance;    ///< Of each plant state per sample, >= 0: hardly any.
  uint32_t refresh_samples;       ///< Between two exact discretisations, >= 1.
  uint32_t replay_speed;          ///< Old samples per new one while the start is gone over; 0: never.
} resonid_physical_config;

typedef struct resonid_physical_info {
  uint32_t struct_size;  ///< Bytes that were filled.
  uint32_t ready;        ///< Converged and consistent.
  uint32_t converged;    ///< All that is estimated of J1, J2, K, D is known twice as well as at the start.
  uint32_t consistent;   ///< Innovations are about as large as the filter expects them.
  uint32_t excited;      ///< The twist moves enough to tell about the stiffness; else the estimate is held.
  uint32_t plausible;    ///< No friction below 0 by more than twice its error, a resonance that can be seen.
  uint64_t samples;      ///< Since init or reset, missing ones included.
  uint64_t skipped_samples;
  double value[8];               ///< RESONID_DRIVEN_INERTIA ... RESONID_COULOMB_FRICTION, SI units.
  double standard_deviation[8];  ///< Of these; 0: not estimated.
  double resonance_hz;           ///< Undamped, sqrt(K (1/J1 + 1/J2)).
  double resonance_std_hz;
  double antiresonance_hz;  ///< Undamped, sqrt(K/J2).
  double antiresonance_std_hz;
  double residual;     ///< Newest output minus what was predicted for it.
  double noise_rms;    ///< Of the output, as given or estimated.
  double lag_samples;  ///< The estimate describes the machine of so many samples ago.
} resonid_physical_info;

/// Fills a configuration of `struct_size` = sizeof(*config) bytes with defaults; the four starting values
/// must be set.
RESONID_API resonid_status resonid_physical_defaults(resonid_physical_config* config,
                                                     size_t struct_size) RESONID_NOEXCEPT;
/// Bytes that a handle of this configuration needs; 0: there is no such handle.
RESONID_API size_t resonid_physical_size(const resonid_physical_config* config) RESONID_NOEXCEPT;
/// As resonid_line_bank_init().
RESONID_API resonid_status resonid_physical_init(void* memory, size_t size,
                                                 const resonid_physical_config* config,
                                                 resonid_physical** handle,
                                                 resonid_error* error) RESONID_NOEXCEPT;
/// As resonid_line_bank_create().
RESONID_API resonid_status resonid_physical_create(const resonid_physical_config* config,
                                                   resonid_physical** handle,
                                                   resonid_error* error) RESONID_NOEXCEPT;
/// One sample of excitation (only tells whether there is any), torque u and velocity y. Real-time safe.
RESONID_API resonid_status resonid_physical_step(resonid_physical* handle, double ru, double u,
                                                 double y) RESONID_NOEXCEPT;
/// `count` samples at once, [sample]; `ru` may be NULL: 0.
RESONID_API resonid_status resonid_physical_run(resonid_physical* handle, const double* ru, const double* u,
                                                const double* y, size_t count) RESONID_NOEXCEPT;
/// `count` samples were lost: as many missing ones, in bounded time. Real-time safe.
RESONID_API resonid_status resonid_physical_miss(resonid_physical* handle, uint64_t count) RESONID_NOEXCEPT;
/// Back to the state after init, without the cost of it. Real-time safe.
RESONID_API resonid_status resonid_physical_reset(resonid_physical* handle) RESONID_NOEXCEPT;
/// Covariance of the values, [row][column], `count` = 64. Real-time safe.
RESONID_API resonid_status resonid_physical_covariance(const resonid_physical* handle, double* covariance,
                                                       size_t count) RESONID_NOEXCEPT;
/// Fills the first `struct_size` bytes of `info`. Real-time safe.
RESONID_API resonid_status resonid_physical_get_info(const resonid_physical* handle,
                                                     resonid_physical_info* info,
                                                     size_t struct_size) RESONID_NOEXCEPT;

RESONID_END

#endif
