/* SPDX-License-Identifier: MIT */
/* What the HAL component (C, written by halcompile) and the identification (C++20) say to each other. An axis
 * lives in static memory; its number is that of the component's instance. */
#ifndef RESONID_LINUXCNC_CORE_H
#define RESONID_LINUXCNC_CORE_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { RESONID_MAX_AXES = 8, RESONID_MAX_LINES = 40 };

/* Fixed when the component is loaded. */
struct resonid_axis_shape {
  double period_s; /* of the servo thread */
  double first_hz; /* lowest tracked line */
  double last_hz;  /* highest one */
  int lines;       /* evenly spaced, 3 ... RESONID_MAX_LINES */
  double memory_s; /* time constant of the trackers */
};

struct resonid_axis_error {
  char field[32];
  char requirement[96];
  double value;
};

enum resonid_excitation { RESONID_MULTISINE = 0, RESONID_CHIRP = 1, RESONID_PRBS = 2 };
enum resonid_loop { RESONID_LOOP_MEASURED = 0, RESONID_LOOP_VELOCITY_PID = 1, RESONID_LOOP_POSITION_PID = 2 };

/* Read in every period; the first part counts from the next start of the excitation on. */
struct resonid_axis_settings {
  int excitation;   /* enum resonid_excitation */
  double amplitude; /* peak value of the excitation, unit of torque */
  double ramp_s;    /* time of ramping in and out */
  double sweep_s;   /* time of one sweep of the chirp */
  /* Limits of the guard (guarded_excitation.hpp); 0: none. */
  double margin, max_torque, max_velocity;
  double position_low, position_high, deceleration;
  double max_growth, least_oscillation;
  double max_line_velocity;

  double delay_s; /* known delay of the measured velocity */
  double max_std; /* largest relative standard deviation of a trusted resonance */
  int loop;       /* enum resonid_loop */
  double pgain, igain, dgain;
};

struct resonid_axis_sample {
  int enable, reset, valid;
  double control; /* output of the controller, without excitation */
  double torque;  /* total command as the drive gets it */
  double velocity;
  double position;
};

enum resonid_trust {
  RESONID_TRUSTED = 0,
  RESONID_NOT_MEASURED = 1,
  RESONID_NOT_SETTLED = 2,
  RESONID_STOPPED = 3,
  RESONID_SAMPLES_MISSING = 4,
  RESONID_NO_RESONANCE = 5,
  RESONID_OUTSIDE_THE_LINES = 6,
  RESONID_UNCERTAIN = 7,
  RESONID_REFUSED = 8
};

/* Not a number: not known. */
struct resonid_axis_results {
  double resonance_hz, resonance_std_hz, resonance_damping;
  double antiresonance_hz, antiresonance_std_hz, antiresonance_damping;
  double motor_inertia, load_inertia, stiffness;
  double crossover_hz, phase_margin_deg, phase_margin_std_deg, worst_phase_margin_deg;
  double modulus_margin, modulus_margin_std, modulus_margin_hz, gain_margin_db, gain_margin_hz;
  double coherence;
  double excitation_peak;
  int running, settled, trusted, trust_reason, stop_reason;
  uint32_t samples, skipped_samples, updates;
};

/* 0, or -1 with the reason in *error. Not for the servo thread: it takes up to a tenth of a second. */
int resonid_axis_create(int axis, const struct resonid_axis_shape* shape, struct resonid_axis_error* error);
/* Before the controller's output is summed: the excitation of this period. */
double resonid_axis_excite(int axis, const struct resonid_axis_settings* settings,
                           const struct resonid_axis_sample* sample);
/* After the sum and all limits on it: takes the sample, goes on with the identification. */
void resonid_axis_identify(int axis, const struct resonid_axis_settings* settings,
                           const struct resonid_axis_sample* sample);
const struct resonid_axis_results* resonid_axis_read(int axis);

#ifdef __cplusplus
}
#endif
#endif
