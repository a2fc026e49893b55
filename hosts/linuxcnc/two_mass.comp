component two_mass "simulated drive: a motor coupled elastically to its load";

description """
Exact zero-order-hold equivalent of a motor that turns a load through an elastic shaft, for trying out what sits in the
servo thread. Function \\fBtwo-mass.N.update\\fR goes last in the thread: it hands the torque of this period to the machine
and shows what an encoder reads at the beginning of the next one.

    J1 v1' = torque + load-torque1 - B v1 - K (p1 - p2) - D (v1 - v2)      J2 v2' = K (p1 - p2) + D (v1 - v2)

It has no dependency on resonid: what resonid finds is compared with the parameters given here.
""";

pin in float torque "Torque on the motor, held over the period (Nm).";
pin in float disturbance "Further torque on the motor (Nm).";
pin out float position "Of the motor, as the encoder shows it (rad).";
pin out float velocity "Of the motor, likewise, plus noise (rad/s).";
pin out float load_position "Of the load, exactly (rad).";
pin out float load_velocity "Of the load, exactly (rad/s).";

param rw float j1 = 0.0012 "Inertia of the motor (kgm2).";
param rw float j2 = 0.0018 "Inertia of the load (kgm2).";
param rw float k = 150 "Stiffness of the shaft (Nm/rad).";
param rw float d = 0.02 "Damping of the shaft (Nms/rad).";
param rw float b = 0 "Viscous friction of the motor (Nms/rad).";
param rw unsigned counts = 0 """Counts of the encoder in a turn; position and velocity then have its steps, and the velocity
is the difference of positions. 0: no encoder, both are exact.""";
param rw unsigned delay = 0 "Periods by which the drive takes the torque later, 0 to 7.";
param rw float noise = 0 "Standard deviation of white noise on the velocity (rad/s); the same in every run.";

function update fp "Takes a step of one period.";
option no_convenience_defines yes;

variable double x1;  // position of the motor
variable double v1;
variable double x2;
variable double v2;
variable double phi[20];   // 4 rows: 4 states, then the torque
variable double made[6];   // what phi was made of
variable double late[8];     // torques on their way
variable double shown;
variable unsigned seed;
license "MIT";
author "resonid contributors";
;;

#include "rtapi_math.h"

#define N 5

/* exp(a) of a 5 by 5 matrix by scaling and squaring of a Taylor series. */
static void exponential(double a[N][N], double e[N][N]) {
  double t[N][N], largest = 0.0;
  int i, j, l, term, squarings = 0;
  for (i = 0; i < N; i++)
    for (j = 0; j < N; j++) largest = fmax(largest, fabs(a[i][j]));
  while (largest * N > 0.5 && squarings < 60) {
    largest *= 0.5;
    squarings++;
  }
  for (i = 0; i < N; i++)
    for (j = 0; j < N; j++) {
      a[i][j] = ldexp(a[i][j], -squarings);
      e[i][j] = i == j;
    }
  for (term = 16; term >= 1; term--) {
    for (i = 0; i < N; i++)
      for (j = 0; j < N; j++) {
        t[i][j] = i == j;
        for (l = 0; l < N; l++) t[i][j] += a[i][l] * e[l][j] / term;
      }
    memcpy(e, t, sizeof t);
  }
  while (squarings-- > 0) {
    for (i = 0; i < N; i++)
      for (j = 0; j < N; j++) {
        t[i][j] = 0.0;
        for (l = 0; l < N; l++) t[i][j] += e[i][l] * e[l][j];
      }
    memcpy(e, t, sizeof t);
  }
}

/* Sum of twelve uniform numbers less six: near enough to a normal one, and the same on every machine. */
static double normal(unsigned* state) {
  double sum = -6.0;
  int i;
  for (i = 0; i < 12; i++) {
    *state = *state * 1664525u + 1013904223u;
    sum += *state / 4294967296.0;
  }
  return sum;
}

#define FUNCTION(name) static void name(struct __comp_state* inst, long period)
#define PIN(name) (*inst->name)

FUNCTION(update) {
  const double period_s = period * 1e-9;
  const double j1 = inst->j1, j2 = inst->j2, k = inst->k, d = inst->d;
  const double wanted[6] = {j1, j2, k, d, inst->b, period_s};
  double x[N] = {inst->x1, inst->v1, inst->x2, inst->v2, 0.0};
  double next[4], velocity;
  int i, j;
  for (i = 7; i > 0; i--) inst->late[i] = inst->late[i - 1];
  inst->late[0] = PIN(torque);
  x[4] = inst->late[inst->delay & 7] + PIN(disturbance);
  if (memcmp(inst->made, wanted, sizeof wanted) != 0 && j1 > 0.0 && j2 > 0.0) {
    double a[N][N] = {{0, 1, 0, 0, 0},
                      {-k / j1, -(d + inst->b) / j1, k / j1, d / j1, 1 / j1},
                      {0, 0, 0, 1, 0},
                      {k / j2, d / j2, -k / j2, -d / j2, 0},
                      {0, 0, 0, 0, 0}};
    double e[N][N];
    for (i = 0; i < N; i++)
      for (j = 0; j < N; j++) a[i][j] *= period_s;
    exponential(a, e);
    for (i = 0; i < 4; i++)
      for (j = 0; j < N; j++) inst->phi[N * i + j] = e[i][j];
    memcpy(inst->made, wanted, sizeof wanted);
  }
  for (i = 0; i < 4; i++) {
    next[i] = 0.0;
    for (j = 0; j < N; j++) next[i] += inst->phi[N * i + j] * x[j];
  }
  PIN(position) = inst->x1 = next[0];
  velocity = inst->v1 = next[1];
  PIN(load_position) = inst->x2 = next[2];
  PIN(load_velocity) = inst->v2 = next[3];
  if (inst->counts > 0) {
    const double count = 2.0 * M_PI / inst->counts;
    PIN(position) = floor(next[0] / count) * count;
    velocity = (PIN(position) - inst->shown) / period_s;
  }
  inst->shown = PIN(position);
  if (inst->noise > 0.0) velocity += inst->noise * normal(&inst->seed);
  PIN(velocity) = velocity;
}
