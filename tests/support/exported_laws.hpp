// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "design/controller.hpp"
#include "design/export.hpp"
#include "design/pid.hpp"

// What exported texts are run on, and the law by its definition: for the tests on the host and on a Cortex-M.
namespace resonid::test {

using design::ExportedController;

/// What a controller is given sample by sample.
struct Sample {
  double reference, velocity;
};

/// Steps of the reference, and a velocity that follows with noise; whole multiples of 2^-10, so that every
/// text says them exactly.
inline std::vector<Sample> exported_samples() {
  std::vector<Sample> samples;
  double velocity = 0.0;
  unsigned noise = 1;
  for (int k = 0; k < 600; ++k) {
    const double reference = k < 20 ? 0.0 : k < 250 ? 10.0 : k < 450 ? -4.0 : 1.5;
    noise = noise * 1664525U + 1013904223U;
    velocity += 0.02 * (reference - velocity);
    const double measured = velocity + static_cast<double>(noise >> 24) / 256.0 - 0.5;
    samples.push_back({reference, std::round(1024.0 * measured) / 1024.0});
  }
  return samples;
}

/// PI with a notch and a broad lead, 1 kHz.
inline design::ExportedController exported_controller() {
  design::ExportedController exported;
  exported.controller = {0.6, 25.0, {{54.0, 0.2, 0.6}, {210.0, 1.2, 0.5}}};
  exported.sample_time_s = 0.001;
  return exported;
}

/// With and without filters, limit and set-point weight.
inline std::vector<design::ExportedController> exported_variants() {
  std::vector<design::ExportedController> all(6, exported_controller());
  all[1].controller.biquads.clear();
  all[2].torque_limit = 3.0;
  all[3].set_point_weight = 0.4;
  all[3].torque_limit = 2.0;
  all[4].controller.biquads.resize(1);
  all[4].set_point_weight = 0.0;
  all[4].name = "Axis_2";
  all[5].controller = {all[5].controller.kp, 0.0, {}};  // a P
  all[5].torque_limit = 3.0;
  return all;
}

/// All that a controller may be told at a sample.
struct Told {
  double reference, velocity, position, velocity_feed_forward, torque_feed_forward;
};

/// Whole multiples of 2^-10, so that every text says them exactly. The axis follows with noise, and its
/// position comes from elsewhere: nothing is in a loop.
inline std::vector<Told> told_samples() {
  std::vector<Told> samples;
  const auto grid = [](double x) { return std::round(1024.0 * x) / 1024.0; };
  int k = 0;
  for (const Sample& sample : exported_samples()) {
    const double t = 0.01 * k++;
    samples.push_back({grid(0.1 * sample.reference), sample.velocity,
                       grid(0.7 * std::sin(t) + 0.02 * sample.velocity), grid(std::cos(t)),
                       k % 90 < 30 ? 0.5 : 0.0});
  }
  return samples;
}

inline constexpr double Told::*kAllColumns[] = {&Told::reference, &Told::velocity, &Told::position,
                                                &Told::velocity_feed_forward, &Told::torque_feed_forward};

/// In the order of the arguments of the C function.
struct Column {
  const char* name;
  double Told::*value;
};
inline std::vector<Column> columns_of(const ExportedController& exported) {
  std::vector<Column> columns = {{"reference", &Told::reference}};
  if (exported.kv > 0.0)
    columns = {{"position_reference", &Told::reference},
               {"velocity_feed_forward", &Told::velocity_feed_forward},
               {"torque_feed_forward", &Told::torque_feed_forward}};
  columns.push_back({"velocity", &Told::velocity});
  if (exported.needs_position() && !exported.sums_velocity) columns.push_back({"position", &Told::position});
  return columns;
}

/// F by its states, gains by GainSchedule, the rest by definition. HAL: the sum behind the filters, and
/// stopped one period later (export_test.cpp).
enum class Meaning { texts, hal };
inline std::vector<double> by_definition(const ExportedController& exported,
                                         Meaning meaning = Meaning::texts) {
  const double step = exported.sample_time_s, limit = exported.torque_limit.value_or(INFINITY);
  const auto filters = design::states_of(design::FilteredPi{1.0, 0.0, exported.controller.biquads}, step);
  Eigen::VectorXd x = Eigen::VectorXd::Zero(filters.a.rows());
  const auto filtered = [&](double value) {
    const double out = filters.c * x + filters.d * value;
    x = (filters.a * x + filters.b * value).eval();
    return out;
  };
  double sum = 0.0, summed = 0.0, kp_before = 0.0, deviation = 0.0, at_limit = 0.0;
  std::vector<double> torque;
  for (const Told& told : told_samples()) {
    summed += step * told.velocity;
    const double position = exported.sums_velocity ? summed : told.position;
    const design::FilteredPi gains = exported.schedule.empty()
                                         ? exported.controller
                                         : design::GainSchedule(exported.schedule).at(position);
    if (at_limit == 0.0) sum -= (gains.kp - kp_before) * deviation;
    kp_before = gains.kp;
    const double reference = exported.kv > 0.0
                                 ? exported.kv * (told.reference - position) + told.velocity_feed_forward
                                 : told.reference;
    const double error = reference - told.velocity;
    deviation = exported.set_point_weight * reference - told.velocity;
    double u = 0.0;
    if (meaning == Meaning::texts) {
      u = filtered(gains.kp * deviation + sum + step * gains.ki * error);
    } else {
      const double late = filtered(error);
      if (late * at_limit <= 0.0) sum += step * gains.ki * late;
      u = gains.kp * late + sum;
    }
    if (exported.kv > 0.0) u += told.torque_feed_forward;
    at_limit = u > limit ? 1.0 : u < -limit ? -1.0 : 0.0;
    if (meaning == Meaning::texts && error * at_limit <= 0.0) sum += step * gains.ki * error;
    torque.push_back(std::clamp(u, -limit, limit));
  }
  return torque;
}

/// A PID, with and without limit and set-point weight, and an RST of third order, whose S begins with 2.
struct RstVariant {
  design::ExportedRst law;
  std::vector<double> observer;  ///< What its torque at the limit is forgotten by.
};
inline std::vector<RstVariant> rst_variants() {
  constexpr double kStep = 0.001, kHalf = 0.5;
  const design::Pid pid{0.6, 25.0, 0.004, 0.003};
  const auto law = pid.transfer_function(kStep);
  design::ExportedRst plain;
  plain.r = law.numerator;
  plain.s = law.denominator;
  plain.sample_time_s = kStep;
  plain.what = "PID";
  // The integrator decays with the integral time, kp/ki, the lag of the derivative as it does.
  const double integral = std::exp(-kStep * pid.ki / pid.kp), lag = std::exp(-kStep / pid.filter_s);
  std::vector<RstVariant> all(4, {plain, {1.0, -integral - lag, integral * lag}});
  all[1].law.torque_limit = 3.0;
  all[2].law.t = design::Pid{kHalf * pid.kp, pid.ki, 0.0, pid.filter_s}.transfer_function(kStep).numerator;
  all[2].law.torque_limit = 2.0;
  all[3].law.r = {4.0, -6.0, 2.8};
  all[3].law.s = {2.0, -3.2, 1.8, -0.6};  // 2 (1 - x)(1 - 0.6 x + 0.3 x^2)
  all[3].law.t = {0.8};
  all[3].law.what = "RST";
  all[3].law.torque_limit = 1.0;
  const double quick = std::exp(-1.0);  // its integral time is less than a sample
  all[3].observer = {1.0, -0.6 - quick, 0.3 + 0.6 * quick, -0.3 * quick};
  return all;
}

/// A v = T r - R y + (A - S) u, u being v within the limit.
inline std::vector<double> by_definition(const RstVariant& variant, const std::vector<Sample>& samples) {
  const design::ExportedRst& law = variant.law;
  const auto& t = law.t.empty() ? law.r : law.t;
  const double limit = law.torque_limit.value_or(INFINITY);
  std::vector<double> torque, unlimited;
  for (std::size_t k = 0; k < samples.size(); ++k) {
    double sum = 0.0;
    for (std::size_t i = 0; i < t.size() && i <= k; ++i) sum += t[i] * samples[k - i].reference;
    for (std::size_t i = 0; i < law.r.size() && i <= k; ++i) sum -= law.r[i] * samples[k - i].velocity;
    sum /= law.s.front();
    for (std::size_t i = 1; i < law.s.size() && i <= k; ++i) {
      const double a = variant.observer[i];
      sum += (a - law.s[i] / law.s.front()) * torque[k - i] - a * unlimited[k - i];
    }
    unlimited.push_back(sum);
    torque.push_back(std::clamp(sum, -limit, limit));
  }
  return torque;
}

inline ExportedController cascade(bool sums) {
  ExportedController exported = exported_controller();
  exported.name = "axis_position_control";  // as long as HAL allows
  exported.kv = 30.0;
  exported.sums_velocity = sums;
  return exported;
}
inline ExportedController scheduled() {
  ExportedController exported = exported_controller();
  exported.controller.kp = exported.controller.ki = 0.0;
  exported.schedule = {{-0.5, 0.3, 10.0}, {0.0, 0.9, 40.0}, {0.25, 0.4, 60.0}};
  return exported;
}
/// Position loops, schedules, and both; with and without limit and set-point weight.
inline std::vector<ExportedController> position_variants() {
  std::vector<ExportedController> all = {cascade(false), cascade(true), cascade(false), scheduled(),
                                         scheduled(),    scheduled(),   cascade(true),  scheduled()};
  all[2].torque_limit = 4.0;
  all[4].set_point_weight = 0.4;
  all[4].torque_limit = 0.3;
  all[4].controller.biquads.clear();
  all[5].sums_velocity = true;
  all[6].controller = scheduled().controller;
  all[6].schedule = scheduled().schedule;
  all[6].torque_limit = 5.0;
  all[7].schedule.resize(1);
  return all;
}

}  // namespace resonid::test
