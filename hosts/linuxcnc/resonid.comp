component resonid "resonance, anti-resonance and margins of an axis, identified in the servo thread";

description """
Adds a small excitation to the torque command of an axis that a \\fBpid\\fR holds, tracks the response from torque to
velocity at lines (frequencies) in every period, and shows what follows from it: resonance and anti-resonance of a
drive with an elastic coupling to its load, both inertias, and the stability margins of the loop as it is.

\\fBloadrt resonid lines=10:110:21 period_ns=500000\\fR makes one axis, resonid.0, that tracks 21 lines from 10 to 110 Hz.
The order in the servo thread is: encoder, pid, \\fBresonid.N.excite\\fR, sum2 (pid.output + excitation), limits,
\\fBresonid.N.identify\\fR, then what hands the torque to the drive.

Raise \\fBenable\\fR to start. The excitation ramps in; when \\fBsettled\\fR is true the results are renewed many times a
second; drop \\fBenable\\fR and the excitation ramps out, the results stay. A limit that is passed stops the excitation at
once for good: \\fBstop-reason\\fR says which, and \\fBreset\\fR followed by \\fBenable\\fR starts anew.

Units are those of the machine: \\fIT\\fR stands for its unit of torque (or force), \\fIv\\fR for that of velocity. For
inertias in kgm2 use Nm and rad/s.
""";

notes """
A result that is not known is NaN. Comparisons with NaN are false, so comp(9) on a margin does not act on it.

The margins are those of the loop as measured, L = Ru/U - 1, where Ru is the excitation and U the total torque:
whatever acts on the velocity is in it, delays included, and no gain has to be told. The reference must not move at
the frequencies of the lines. With \\fBloop\\fR 1 or 2 they are those that the gains \\fBpgain\\fR, \\fBigain\\fR and
\\fBdgain\\fR of a pid on velocity or on position would have: try them before the machine does.
""";

see_also """\\fBpid\\fR(9), \\fBsum2\\fR(9), \\fBsampler\\fR(9)""";

modparam dummy lines """Lines of each axis, FIRST:LAST:COUNT in Hz, separated by commas; 3 to 40, evenly spaced, at most 8
axes. The default is 10:110:21. They must hold the anti-resonance, the resonance and the crossover.""";
modparam int period_ns = 1000000 "Period of the servo thread in ns.";
modparam int memory_ms = 300 """Time constant of the trackers: longer is quieter and slower. The results settle after about
seven of them.""";

pin in bit enable = 0 "Rising: start. Falling: ramp out and keep the results.";
pin in bit reset = 0 "Rising: forget results and stop-reason.";
pin in bit valid = 1 "False: torque or velocity of this period are missing. Such samples are counted and bridged.";
pin in float control "Output of the controller in this period, without excitation (T).";
pin in float torque "Total torque command of this period as the drive gets it, after all limits (T).";
pin in float velocity "Velocity of the motor, as this period's pid sees it (v).";
pin in float position "Position of the motor, for position-low and position-high only.";
pin in float pgain = 0 "As Pgain of pid, for loop 1 and 2.";
pin in float igain = 0 "As Igain of pid, likewise.";
pin in float dgain = 0 "As Dgain of pid, likewise.";

pin out float excitation "To be added to the torque command (T).";
pin out bit running "The excitation is not zero: ramping in, steady or ramping out.";
pin out bit settled "The trackers have settled: results are renewed.";
pin out bit trusted "The results can be relied upon: trust-reason is 0.";
pin out signed trust_reason """0: trusted. 1: nothing measured yet. 2: not settled. 3: stopped by a limit. 4: more than 5 % of
the newest samples are missing. 5: the response shows no anti-resonance below a damped resonance. 6: they lie outside
the lines. 7: their standard deviation is larger than max-std (resonance) or twice that (anti-resonance). 8: a
parameter was refused, or period_ns is not the thread's period (see the log).""";
pin out signed stop_reason """Why the excitation ended: 0 it has not. 1: enable fell. 2: finished as planned. 3: torque. 4: velocity.
5: end of travel. 6: growing oscillation. 7: velocity or position missing for too long. 8: velocity at a line. 9: not
watched any more. From 3 on nothing is injected before a reset.""";
pin out float resonance_hz "Undamped natural frequency of motor and load against one another.";
pin out float resonance_std_hz "Its standard deviation.";
pin out float resonance_damping "Its damping ratio, 1 being critical.";
pin out float antiresonance_hz "Undamped natural frequency of the load with the motor clamped.";
pin out float antiresonance_std_hz "Its standard deviation.";
pin out float antiresonance_damping "Its damping ratio.";
pin out float motor_inertia "Inertia of the motor side (T/(v/s): kgm2).";
pin out float load_inertia "Inertia of the load side, likewise.";
pin out float stiffness "Of what couples them (Nm/rad).";
pin out float crossover_hz "Where the loop gain first falls below 1.";
pin out float phase_margin_deg "There.";
pin out float phase_margin_std_deg "Standard deviation of that.";
pin out float worst_phase_margin_deg "The smallest at any frequency where the loop gain passes 1.";
pin out float modulus_margin "Least distance of the loop's Nyquist curve from -1.";
pin out float modulus_margin_std "Standard deviation of that.";
pin out float modulus_margin_hz "Where that is.";
pin out float gain_margin_db "Factor by which the gain may still rise.";
pin out float gain_margin_hz "Where that is.";
pin out float coherence "Mean over the lines, 0 to 1: share of the response that is not noise.";
pin out unsigned samples "Periods taken since the start.";
pin out unsigned skipped_samples "Those of them that were missing.";
pin out unsigned updates "How often the results were renewed.";
pin out signed period_clocks "Clocks since the period before: what .time of the functions is to be compared with.";

param rw signed excitation_kind = 0 "0: multisine at the lines (recommended). 1: chirp. 2: PRBS.";
param rw float amplitude = 0 "Peak value of the excitation (T). 0: none, the start is refused.";
param rw float ramp = 0.5 "Time of ramping in and out (s).";
param rw float sweep_time = 5 "Time of one sweep of the chirp (s).";
param rw float margin = 0.9 "Share of each of the limits below at which the excitation stops.";
param rw float max_torque = 0 "Limit of the torque command with the excitation; 0: none (T).";
param rw float max_velocity = 0 "Limit of the velocity; 0: none (v).";
param rw float position_low = 0 "Lower end of travel; both ends 0: none.";
param rw float position_high = 0 "Upper end of travel.";
param rw float deceleration = 0 "With which the axis is sure to stop before an end of travel (v/s).";
param rw float max_growth = 0 """Factor by which the velocity's oscillation may grow over what it was in the first second after
the ramp; 0: not watched.""";
param rw float least_oscillation = 0 "Rms of the velocity below which nothing is an oscillation, > 0 with max-growth (v).";
param rw float max_line_velocity = 0 "Limit of the velocity's amplitude at any of the lines; 0: none (v).";
param rw float delay = 0 """Known delay between torque command and measured velocity beyond the period's own (s): current
loop, filter of the encoder. It is taken out of the response; the margins keep it.""";
param rw float max_std = 0.01 "Relative standard deviation up to which a resonance is trusted.";
param rw signed loop = 0 "Margins of: 0 the loop as measured, 1 a pid on velocity, 2 a pid on position.";

function excite fp "Computes the excitation of this period and watches the limits. After pid, before sum2.";
function identify fp "Takes the sample of this period and goes on with the identification. After the torque's last limit.";

option extra_setup yes;
option no_convenience_defines yes;
variable int axis;
variable unsigned last_clocks;
variable int wrong_period;
license "MIT";
author "resonid contributors";
;;

#include "core.h"
#include "rtapi_math.h"
#include <stdlib.h>

static char* lines[RESONID_MAX_AXES];
RTAPI_MP_ARRAY_STRING(lines, RESONID_MAX_AXES, "FIRST:LAST:COUNT of each axis");

static int parse_lines(const char* text, struct resonid_axis_shape* shape) {
  char* end;
  shape->first_hz = strtod(text, &end);
  if (*end != ':') return -1;
  shape->last_hz = strtod(end + 1, &end);
  if (*end != ':') return -1;
  shape->lines = (int)strtol(end + 1, &end, 10);
  return *end == '\0' ? 0 : -1;
}

/* Instance variables go by their own names in the structures of core.h too, so that the short forms of halcompile
 * are switched off. */
#define PIN(name) (*inst->name)
#define FUNCTION(name) static void name(struct __comp_state* inst, long period)
#define EXTRA_SETUP() static int extra_setup(struct __comp_state* inst, char* prefix, long extra_arg)

EXTRA_SETUP() {
  struct resonid_axis_shape shape = {period_ns * 1e-9, 10.0, 110.0, 21, memory_ms * 1e-3};
  struct resonid_axis_error error;
  const char* text = extra_arg < RESONID_MAX_AXES ? lines[extra_arg] : 0;
  inst->axis = (int)extra_arg;
  if (text && parse_lines(text, &shape) != 0) {
    rtapi_print_msg(RTAPI_MSG_ERR, "%s: lines=%s: must be FIRST:LAST:COUNT\n", prefix, text);
    return -EINVAL;
  }
  if (resonid_axis_create(inst->axis, &shape, &error) != 0) {
    rtapi_print_msg(RTAPI_MSG_ERR, "%s: %s %s\n", prefix, error.field, error.requirement);
    return -EINVAL;
  }
  return 0;
}

static void read_settings(const struct __comp_state* inst, struct resonid_axis_settings* s) {
  s->excitation = inst->excitation_kind;
  s->amplitude = inst->amplitude;
  s->ramp_s = inst->ramp;
  s->sweep_s = inst->sweep_time;
  s->margin = inst->margin;
  s->max_torque = inst->max_torque;
  s->max_velocity = inst->max_velocity;
  s->position_low = inst->position_low;
  s->position_high = inst->position_high;
  s->deceleration = inst->deceleration;
  s->max_growth = inst->max_growth;
  s->least_oscillation = inst->least_oscillation;
  s->max_line_velocity = inst->max_line_velocity;
  s->delay_s = inst->delay;
  s->max_std = inst->max_std;
  s->loop = inst->loop;
  s->pgain = PIN(pgain);
  s->igain = PIN(igain);
  s->dgain = PIN(dgain);
}

static void read_sample(const struct __comp_state* inst, struct resonid_axis_sample* s) {
  s->enable = PIN(enable);
  s->reset = PIN(reset);
  s->valid = PIN(valid);
  s->control = PIN(control);
  s->torque = PIN(torque);
  s->velocity = PIN(velocity);
  s->position = PIN(position);
}

FUNCTION(excite) {
  struct resonid_axis_settings settings;
  struct resonid_axis_sample sample;
  const struct resonid_axis_results* r = resonid_axis_read(inst->axis);
  const unsigned now = (unsigned)rtapi_get_clocks();
  PIN(period_clocks) = (int)(now - inst->last_clocks);
  inst->last_clocks = now;
  read_settings(inst, &settings);
  read_sample(inst, &sample);
  /* The lines stand where they should only in a thread of the period that was told. */
  if (labs(period - period_ns) > period_ns / 100) {
    if (!inst->wrong_period)
      rtapi_print_msg(RTAPI_MSG_ERR, "resonid: the thread's period is %ld ns, period_ns says %ld: nothing is injected\n",
                      period, (long)period_ns);
    inst->wrong_period = 1;
    sample.enable = 0;
  }
  PIN(excitation) = resonid_axis_excite(inst->axis, &settings, &sample);
  PIN(running) = r->running;
  PIN(stop_reason) = r->stop_reason;
}

FUNCTION(identify) {
  struct resonid_axis_settings settings;
  struct resonid_axis_sample sample;
  const struct resonid_axis_results* r = resonid_axis_read(inst->axis);
  (void)period;
  read_settings(inst, &settings);
  read_sample(inst, &sample);
  resonid_axis_identify(inst->axis, &settings, &sample);
  PIN(resonance_hz) = r->resonance_hz;
  PIN(resonance_std_hz) = r->resonance_std_hz;
  PIN(resonance_damping) = r->resonance_damping;
  PIN(antiresonance_hz) = r->antiresonance_hz;
  PIN(antiresonance_std_hz) = r->antiresonance_std_hz;
  PIN(antiresonance_damping) = r->antiresonance_damping;
  PIN(motor_inertia) = r->motor_inertia;
  PIN(load_inertia) = r->load_inertia;
  PIN(stiffness) = r->stiffness;
  PIN(crossover_hz) = r->crossover_hz;
  PIN(phase_margin_deg) = r->phase_margin_deg;
  PIN(phase_margin_std_deg) = r->phase_margin_std_deg;
  PIN(worst_phase_margin_deg) = r->worst_phase_margin_deg;
  PIN(modulus_margin) = r->modulus_margin;
  PIN(modulus_margin_std) = r->modulus_margin_std;
  PIN(modulus_margin_hz) = r->modulus_margin_hz;
  PIN(gain_margin_db) = r->gain_margin_db;
  PIN(gain_margin_hz) = r->gain_margin_hz;
  PIN(coherence) = r->coherence;
  PIN(settled) = r->settled;
  PIN(trusted) = r->trusted;
  PIN(trust_reason) = inst->wrong_period ? RESONID_REFUSED : r->trust_reason;
  PIN(samples) = r->samples;
  PIN(skipped_samples) = r->skipped_samples;
  PIN(updates) = r->updates;
}
