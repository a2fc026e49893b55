// SPDX-License-Identifier: MIT
#include "check.h"

static const double kRate = 500.0;
static const double kController[] = {0.2}, kOne[] = {1.0};

/// Drives without the fast sampling and light damping that output-error methods dislike: poles and zeros well
/// inside the unit circle, from the first `order` of these factors.
static difference_equation drive(int order) {
  static const double pole[6][2] = {{0.8, 0.0},  {0.3, 0.5}, {0.3, -0.5},
                                    {-0.4, 0.0}, {0.2, 0.3}, {0.2, -0.3}};
  difference_equation e = {0};
  double re[8] = {1.0}, im[8] = {0.0};
  if (order == 2 || order == 5) {  // whole pairs
    static const double even[5][2] = {{0.5, 0.4}, {0.5, -0.4}, {-0.3, 0.3}, {-0.3, -0.3}, {0.7, 0.0}};
    for (int n = 0; n < order; ++n)
      for (int i = n + 1; i > 0; --i) {
        const double r = re[i - 1], m = im[i - 1];
        re[i] -= even[n][0] * r - even[n][1] * m;
        im[i] -= even[n][0] * m + even[n][1] * r;
      }
  } else {
    for (int n = 0; n < order; ++n)
      for (int i = n + 1; i > 0; --i) {
        const double r = re[i - 1], m = im[i - 1];
        re[i] -= pole[n][0] * r - pole[n][1] * m;
        im[i] -= pole[n][0] * m + pole[n][1] * r;
      }
  }
  e.order = order;
  for (int i = 0; i < order; ++i) {
    e.a[i] = re[i + 1];
    e.b[i] = 0.4 / (1 + i);
  }
  return e;
}

static resonid_model_settings configuration(uint32_t method, uint32_t order) {
  resonid_model_settings c;
  CHECK_OK(resonid_defaults(&c.head, sizeof c, method));
  c.order = order;
  c.sample_rate_hz = kRate;
  c.factor = 0.998;
  c.start_variance = 1e4;
  if (method >= RESONID_CLOE) {
    c.controller_numerator = kController;
    c.controller_denominator = kOne;
    c.controller_numerator_count = c.controller_denominator_count = 1;
  }
  c.fixed_integrator = 0;
  c.offsets = 0;
  return c;
}

/// Every method of every order that it has finds the coefficients of a drive in closed loop without noise.
static void recovers_the_coefficients(uint32_t method, uint32_t order, double tolerance) {
  resonid_model_settings c = configuration(method, order);
  difference_equation plant = drive((int)order);
  double start_b[6], start_a[6];
  for (uint32_t i = 0; i < order; ++i) {
    start_b[i] = 0.97 * plant.b[i];
    start_a[i] = 0.97 * plant.a[i];
  }
  if (method == RESONID_F_CLOE || method == RESONID_IV) {
    c.start_b = start_b;
    c.start_a = start_a;
  }
  c.memory_samples = method == RESONID_IV ? 500.0 : 0.0;
  resonid_handle* model = NULL;
  resonid_error error = RESONID_ERROR_INIT;
  const resonid_status status = resonid_create(&c.head, &model, &error);
  if (status != RESONID_OK) {
    printf("method %u order %u: %s %s\n", method, order, error.field, error.requirement);
    CHECK(status == RESONID_OK);
    return;
  }
  uint64_t random = 1 + order;
  for (int k = 0; k < 12000; ++k) {
    const double ru = noise(&random), y = next_output(&plant), u = ru - kController[0] * y;
    CHECK_OK(resonid_step(model, ru, u, y));
    push(&plant, u, y);
  }
  double b[12], worst = 0.0, largest = 0.0;
  CHECK_OK(resonid_parameters(model, b, 2 * order));
  for (uint32_t i = 0; i < order; ++i)
    worst = fmax(worst, fmax(fabs(b[i] - plant.b[i]), fabs(b[order + i] - plant.a[i])));
  if (!(worst < tolerance)) printf("method %u order %u: coefficients off by %g\n", method, order, worst);
  CHECK(worst < tolerance);
  double covariance[144];
  CHECK_OK(resonid_covariance(model, covariance, 4 * (size_t)order * order));
  for (uint32_t i = 0; i < 2 * order; ++i) {
    CHECK(covariance[i * (2 * order) + i] >= 0.0);
    largest = fmax(largest, covariance[i * (2 * order) + i]);
  }
  CHECK(sqrt(largest) < 100.0 * tolerance);
  resonid_model_results info;
  CHECK_OK(resonid_read(model, RESONID_ARX, &info.head, sizeof info));
  CHECK(info.order == order && info.ready && info.excited && info.samples == 12000 &&
        info.skipped_samples == 0);
  CHECK_NEAR(info.residual, 0.0, 100.0 * tolerance);
  CHECK_OK(resonid_miss(model, 30));
  CHECK_OK(resonid_read(model, RESONID_ARX, &info.head, sizeof info));
  CHECK(info.samples == 12030 && info.skipped_samples == 30);
  CHECK_OK(resonid_parameters(model, b, 2 * order));
  for (uint32_t i = 0; i < order; ++i) CHECK_NEAR(b[order + i], plant.a[i], 2.0 * tolerance);
  CHECK_STATUS(resonid_parameters(model, b, 2 * order + 1), RESONID_ERROR_RANGE);
  CHECK_STATUS(resonid_covariance(model, covariance, 1), RESONID_ERROR_RANGE);
  resonid_destroy(model);
}

/// Resonance and anti-resonance of a sampled two-mass drive, exact by partial fractions: with poles at 1 and
/// e^{(-d +- j w) T},  G(s) = (s^2 + 2 za wa s + wa^2)/(J s (s^2 + 2 z w s + w^2)).
static difference_equation two_mass(double rate, double inertia, double w, double z, double wa, double za) {
  const double t = 1.0 / rate, d = z * w, wd = w * sqrt(1.0 - z * z);
  // Step response of G: c0 t + c1 + e^{-d t} (p cos wd t + q sin wd t); coefficients by matching at s = 0 and
  // the pair.
  const double c0 = wa * wa / (w * w) / inertia;
  // residue of G(s)/s at the pole p = -d + j wd:  N(p)/(J p^2 (p - p*)),  N = s^2 + 2 za wa s + wa^2
  const double pr = -d, pi = wd;
  const double p2r = pr * pr - pi * pi, p2i = 2.0 * pr * pi;
  const double nr = p2r + 2.0 * za * wa * pr + wa * wa, ni = p2i + 2.0 * za * wa * pi;
  const double dr = -p2i * 2.0 * wd, di = p2r * 2.0 * wd;  // p^2 (2 j wd)
  const double power = inertia * (dr * dr + di * di);
  const double rr = (nr * dr + ni * di) / power, ri = (ni * dr - nr * di) / power;
  const double c1 = -2.0 * rr;  // the step response begins at 0
  double s[4];
  for (int k = 0; k < 4; ++k)
    s[k] = c0 * k * t + c1 + exp(-d * k * t) * 2.0 * (rr * cos(wd * k * t) - ri * sin(wd * k * t));
  difference_equation e = {0};
  const double a1 = -2.0 * exp(-d * t) * cos(wd * t), a2 = exp(-2.0 * d * t);
  const double a[4] = {1.0, a1 - 1.0, a2 - a1, -a2};
  double g[4] = {0.0, s[1], s[2] - s[1], s[3] - s[2]};  // impulse response of the sampled system
  e.order = 3;
  for (int i = 1; i <= 3; ++i) {
    e.a[i - 1] = a[i];
    for (int j = 0; j <= i; ++j) e.b[i - 1] += a[j] * g[i - j];
  }
  return e;
}

static void finds_the_modes_of_a_two_mass_drive(uint32_t method) {
  const double resonance_hz = 15.09, antiresonance_hz = 10.67, rate = 100.0;
  difference_equation plant =
      two_mass(rate, 0.02, kTwoPi * resonance_hz, 0.1, kTwoPi * antiresonance_hz, 0.07);
  difference_equation start = two_mass(rate, 0.021, kTwoPi * 14.5, 0.12, kTwoPi * 10.9, 0.08);
  resonid_model_settings c = configuration(method, 3);
  c.sample_rate_hz = rate;
  c.fixed_integrator = method == RESONID_IV;
  c.factor = 0.999;
  c.start_b = start.b;
  c.start_a = start.a;
  c.memory_samples = method == RESONID_IV ? 1000.0 : 0.0;
  resonid_handle* model = NULL;
  CHECK_OK(resonid_create(&c.head, &model, NULL));
  uint64_t random = 23;
  for (int k = 0; k < 20000; ++k) {
    const double ru = noise(&random), y = next_output(&plant);
    const double measured = y + (method == RESONID_ARX ? 0.0 : 0.002 * noise(&random));
    const double u = ru - kController[0] * measured;
    CHECK_OK(resonid_step(model, ru, u, measured));
    push(&plant, u, y);
  }
  resonid_mode mode[2];
  size_t count = 0;
  CHECK_OK(resonid_modes(model, RESONID_RESONANCES, mode, 2, &count));
  CHECK(count == 1);
  CHECK_NEAR(mode[0].frequency_hz, resonance_hz, fmax(1e-5, 4.0 * mode[0].std_hz));
  CHECK_NEAR(mode[0].frequency_hz, resonance_hz, 0.1);
  CHECK_NEAR(mode[0].damping_ratio, 0.1, 0.01);
  CHECK_OK(resonid_modes(model, RESONID_ANTIRESONANCES, mode, 2, &count));
  CHECK(count == 1);
  CHECK_NEAR(mode[0].frequency_hz, antiresonance_hz, 0.1);
  CHECK_OK(resonid_modes(model, RESONID_ANTIRESONANCES, NULL, 0, &count));
  CHECK(count == 1);
  double lag = -1.0;
  CHECK_OK(resonid_lag_samples(model, &lag));
  CHECK(lag > 0.0 && lag < 2000.0);
  resonid_destroy(model);
}

static void load_torque_is_found(void) {
  resonid_model_settings c = configuration(RESONID_ARX, 2);
  c.load_torque = 1;
  resonid_handle* model = NULL;
  CHECK_OK(resonid_create(&c.head, &model, NULL));
  difference_equation plant = drive(2);
  uint64_t random = 4;
  for (int k = 0; k < 4000; ++k) {
    const double u = noise(&random), y = next_output(&plant);
    CHECK_OK(resonid_step(model, 0.0, u, y));
    push(&plant, u + 0.6, y);
  }
  resonid_model_results info;
  CHECK_OK(resonid_read(model, RESONID_ARX, &info.head, sizeof info));
  CHECK_NEAR(info.load_torque, 0.6, 1e-5);
  CHECK(info.coulomb_torque == 0.0);
  resonid_destroy(model);
}

static void refusals_name_the_field(void) {
  resonid_handle* model = NULL;
  resonid_model_settings c;
  CHECK_STATUS(resonid_defaults(&c.head, sizeof c, RESONID_IV + 1), RESONID_ERROR_RANGE);
  c = configuration(RESONID_ARX, 3);
  c.order = 7;
  CHECK_REFUSED(resonid_create(&c.head, &model, &error), "order");
  CHECK(resonid_size(&c.head) == 0);
  c = configuration(RESONID_IV, 1);
  CHECK_REFUSED(resonid_create(&c.head, &model, &error), "order");
  c = configuration(RESONID_ARX, 3);
  c.delay_samples = 64;
  CHECK_REFUSED(resonid_create(&c.head, &model, &error), "delay_samples");
  c = configuration(RESONID_ARX, 3);
  const double scale[] = {1.0, 1.0, 1.0, 1.0, 1.0, -1.0};
  c.scale = scale;
  CHECK_REFUSED(resonid_create(&c.head, &model, &error), "scale");
  c = configuration(RESONID_OE, 3);
  c.factor = 1.5;
  CHECK_REFUSED(resonid_create(&c.head, &model, &error), "factor");
  c = configuration(RESONID_OE_FILTERED, 3);
  c.filter_contraction = 0.0;
  CHECK_REFUSED(resonid_create(&c.head, &model, &error), "filter_contraction");
  c = configuration(RESONID_CLOE, 3);
  c.controller_numerator = NULL;
  CHECK_REFUSED(resonid_create(&c.head, &model, &error), "controller_numerator");
  c = configuration(RESONID_CLOE, 3);
  c.predictor_input = 2;
  CHECK_REFUSED(resonid_create(&c.head, &model, &error), "predictor_input");
  c = configuration(RESONID_F_CLOE, 3);
  CHECK_REFUSED(resonid_create(&c.head, &model, &error), "start_a");
  c = configuration(RESONID_IV, 3);
  CHECK_REFUSED(resonid_create(&c.head, &model, &error), "start_b");
  CHECK(model == NULL);
}

int main(void) {
  for (uint32_t order = 1; order <= 6; ++order) recovers_the_coefficients(RESONID_ARX, order, 1e-6);
  for (uint32_t order = 1; order <= 5; ++order) {
    recovers_the_coefficients(RESONID_OE, order, 1e-5);
    recovers_the_coefficients(RESONID_OE_FILTERED, order, 1e-5);
  }
  for (uint32_t order = 1; order <= 6; ++order) {
    recovers_the_coefficients(RESONID_CLOE, order, 1e-5);
    recovers_the_coefficients(RESONID_F_CLOE, order, 1e-5);
    recovers_the_coefficients(RESONID_CLOE_DAMPED, order, 1e-5);
  }
  for (uint32_t order = 2; order <= 5; ++order) recovers_the_coefficients(RESONID_IV, order, 1e-4);
  finds_the_modes_of_a_two_mass_drive(RESONID_ARX);
  finds_the_modes_of_a_two_mass_drive(RESONID_OE_FILTERED);
  finds_the_modes_of_a_two_mass_drive(RESONID_CLOE_DAMPED);
  finds_the_modes_of_a_two_mass_drive(RESONID_IV);
  load_torque_is_found();
  refusals_name_the_field();
  return verdict();
}
