// SPDX-License-Identifier: MIT
// A designed controller in the drive: PI behind biquads, gains over position, a position loop.
#ifndef RESONID_C_CONTROL_H
#define RESONID_C_CONTROL_H

#include <resonid/c/detail/types.h>

RESONID_BEGIN

#define RESONID_CONTROL_MAX_BIQUADS 4
#define RESONID_CONTROL_MAX_NODES 17
#define RESONID_CONTROL_SIZE 2048  ///< Enough for all settings.

/// (s^2 + 2 zn w s + w^2)/(s^2 + 2 zd w s + w^2) by Tustin's rule, prewarped at its own frequency.
typedef struct resonid_biquad {
  double frequency_hz;         ///< > 0 and below half the sample rate.
  double numerator_damping;    ///< zn, >= 0.
  double denominator_damping;  ///< zd, > 0.
} resonid_biquad;

/// Gains at a position.
typedef struct resonid_gain_node {
  double position;  ///< In the unit of the measured position.
  double kp, ki;    ///< >= 0.
} resonid_gain_node;

///   r = reference, or kv (reference - x) + velocity feed-forward        e = r - velocity
///   i = i + ki Ts e                                                     x: measured, or x + Ts velocity
///   torque = F (kp (b r - velocity) + i) + torque feed-forward, within +-torque_limit
///
/// F: the biquads in series. Where the torque is cut and e drives it further out, i stays as it was. A sample
/// of which a value in use is not finite is missing: the torque and all states stay for up to
/// longest_gap_samples in a row; then the controller is at rest with torque 0 until the next good sample.
typedef struct resonid_control_settings {
  resonid_settings head;
  double sample_rate_hz;              ///< Rate of resonid_control_step(), > 0.
  double kp;                          ///< Nm/(rad/s), >= 0; 0 where a schedule gives it.
  double ki;                          ///< Nm/rad, >= 0; 0 where a schedule gives it.
  double set_point_weight;            ///< b, 0 ... 1; 1 where kv is used.
  double torque_limit;                ///< Nm, > 0; infinite: none.
  double kv;                          ///< 1/s; > 0: the reference is a position.
  const resonid_biquad* biquads;      ///< [biquad_count]; NULL with a count of 0.
  const resonid_gain_node* schedule;  ///< [node_count], ascending in position; linear between them.
  uint32_t biquad_count;              ///< 0 ... RESONID_CONTROL_MAX_BIQUADS.
  uint32_t node_count;                ///< 0 ... RESONID_CONTROL_MAX_NODES; 0: kp and ki everywhere.
  uint32_t sums_velocity;             ///< Not 0: the position is the sum of the velocity, from 0 on.
  uint32_t longest_gap_samples;       ///< Missing samples in a row over which the torque stays.
  uint32_t precision;                 ///< RESONID_DOUBLE or RESONID_FLOAT.
  uint32_t reserved;                  ///< 0.
} resonid_control_settings;

typedef struct resonid_control_results {
  resonid_results head;
  uint64_t samples;           ///< Since init or reset, missing ones included.
  uint64_t skipped_samples;   ///< Missing ones.
  double torque;              ///< Newest, Nm.
  double integral;            ///< i, Nm.
  double kp, ki;              ///< In use at the newest sample.
  double position;            ///< Measured or summed, where one is in use.
  double velocity_reference;  ///< r
  uint32_t limited;           ///< The newest torque was cut.
  uint32_t exchanging;        ///< Biquads are being exchanged.
  uint32_t in_gap;            ///< Too many samples in a row are missing: it is at rest.
  uint32_t position_certain;  ///< 0: a summed position has lost its way in a gap.
} resonid_control_results;

/// Torque of this sample, Nm. What the settings do not use is ignored. When the call fails *torque is 0, if
/// it is there at all. Real-time safe.
RESONID_API resonid_status resonid_control_step(resonid_handle* control, double reference, double velocity,
                                                double position, double velocity_feed_forward,
                                                double torque_feed_forward, double* torque) RESONID_NOEXCEPT;
/// Other gains, in place of a schedule too, without a jump of the torque. Real-time safe.
RESONID_API resonid_status resonid_control_set_gains(resonid_handle* control, double kp, double ki,
                                                     resonid_error* error) RESONID_NOEXCEPT;
/// Another schedule of 1 ... RESONID_CONTROL_MAX_NODES nodes, in place of gains too, without a jump of the
/// torque where the position stays. Real-time safe.
RESONID_API resonid_status resonid_control_set_schedule(resonid_handle* control,
                                                        const resonid_gain_node* schedule, size_t count,
                                                        resonid_error* error) RESONID_NOEXCEPT;
/// Goes over to other biquads, which run along for `warm_up_samples` and then take over linearly within
/// `fade_samples`, >= 1; no state is reset. Refused while an exchange is under way. Real-time safe.
RESONID_API resonid_status resonid_control_exchange_filters(resonid_handle* control,
                                                            const resonid_biquad* biquads, size_t count,
                                                            uint32_t warm_up_samples, uint32_t fade_samples,
                                                            resonid_error* error) RESONID_NOEXCEPT;
/// Homing of a summed position: what it is at the newest sample; the reference has to move along. Real-time
/// safe.
RESONID_API resonid_status resonid_control_set_position(resonid_handle* control,
                                                        double position) RESONID_NOEXCEPT;

RESONID_END

#endif
