// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <resonid/base/constants.hpp>
#include <resonid/identification/tune.hpp>
#include <string>
#include <vector>

#include "results.hpp"

// Tunings as tune() gives them, filled by hand: system 2 of the method, whose loops are worked out here.
namespace resonid::report::test {

inline constexpr double kDelay_s = 0.004;

/// The drive with its delay, moved by relative stiffness and by delay.
inline fit::DriveModel tuned_machine(double stiffness = 1.0, double delay = 0.0) {
  fit::DriveModel m = two_mass();
  m.parameters.stiffness *= stiffness;
  m.known_delay_s = kDelay_s + delay;
  for (int i = 0; i < 3; ++i)
    m.covariance(i, i) = std::pow(0.02 * m.value(static_cast<fit::Parameter>(i)), 2);
  m.covariance(3, 3) = std::pow(0.06 * 0.3, 2);
  return m;
}

/// L, |S|, |T| and |T_load| at a frequency; T_load = T N (docs/methods/tune.md 2.4).
struct LoopAt {
  std::complex<double> loop;
  double sensitivity, complementary, load;
};
inline LoopAt loop_at(const fit::DriveModel& m, const data::TransferFunction& c, double hz) {
  const std::complex<double> s(0.0, kTwoPi * hz);
  const auto loop = c.response(hz) * m.response(hz) * std::exp(-s * m.known_delay_s);
  const auto& p = m.parameters;
  const auto n = (p.damping * s + p.stiffness) / (p.load_inertia * s * s + p.damping * s + p.stiffness);
  const auto one = 1.0 / (1.0 + loop);
  return {loop, std::abs(one), std::abs(loop * one), std::abs(loop * one * n)};
}

/// Velocity of the load and torque, sample by sample, after steps of the reference and of a torque on the
/// load; twenty steps of Euler's rule per sample.
struct StepAt {
  std::vector<double> load, torque;
};
inline StepAt step_of(const fit::DriveModel& m, const data::TransferFunction& c, double reference,
                      double weight_kp, double load_torque, std::size_t samples) {
  constexpr int kParts = 20;
  const auto& p = m.parameters;
  const double dt = m.sample_time_s / kParts;
  double v1 = 0.0, v2 = 0.0, twist = 0.0;
  std::vector<double> error, feedback, measured;
  StepAt out;
  const auto late = static_cast<std::size_t>(std::lround(m.known_delay_s / m.sample_time_s));
  for (std::size_t k = 0; k < samples; ++k) {
    measured.push_back(v1);
    error.push_back(reference - (k >= late ? measured[k - late] : 0.0));
    double u = 0.0;
    for (std::size_t i = 0; i < c.numerator.size() && i <= k; ++i) u += c.numerator[i] * error[k - i];
    for (std::size_t i = 1; i < c.denominator.size() && i <= k; ++i) u -= c.denominator[i] * feedback[k - i];
    feedback.push_back(u);
    const double torque = u - weight_kp * reference;
    out.load.push_back(v2);
    out.torque.push_back(torque);
    for (int part = 0; part < kParts; ++part) {
      const double shaft = p.stiffness * twist + p.damping * (v1 - v2);
      v1 += dt * (torque - shaft) / p.driven_inertia;
      v2 += dt * (shaft - load_torque) / p.load_inertia;
      twist += dt * (v1 - v2);
    }
  }
  return out;
}

/// The value of the first machine, and least and largest over all.
inline void put_band(identification::Band& band, const std::vector<double>& values) {
  band.value.push_back(values.front());
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  band.low.push_back(*low);
  band.high.push_back(*high);
}

inline std::vector<fit::DriveModel> possible_machines() {
  return {tuned_machine(), tuned_machine(0.94, -4e-4), tuned_machine(1.06, -4e-4), tuned_machine(0.94, 4e-4),
          tuned_machine(1.06, 4e-4)};
}

inline identification::LoopCurves curves_of(const data::TransferFunction& c, double weight_kp) {
  identification::LoopCurves curves;
  const auto machines = possible_machines();
  std::vector<double> phase(machines.size(), 0.0);
  for (int i = 0; i < 320; ++i) {
    const double hz = 0.3 * std::pow(240.0 / 0.3, i / 319.0);
    curves.frequency_hz.push_back(hz);
    std::vector<double> size, s, t, load;
    for (std::size_t k = 0; k < machines.size(); ++k) {
      const auto at = loop_at(machines[k], c, hz);
      if (k == 0) curves.loop.push_back(at.loop);
      size.push_back(std::abs(at.loop));
      const double degrees = std::arg(at.loop) * 360.0 / kTwoPi;
      phase[k] = degrees + 360.0 * std::round((phase[k] - degrees) / 360.0);
      s.push_back(at.sensitivity);
      t.push_back(at.complementary);
      load.push_back(at.load);
    }
    put_band(curves.loop_size, size);
    put_band(curves.loop_phase_deg, phase);
    put_band(curves.sensitivity, s);
    put_band(curves.complementary, t);
    put_band(curves.load_transfer, load);
  }
  for (const double hz : {3.0, 5.0, 12.0, 16.0, 25.0}) {
    identification::LoopCurves::Ellipse e;
    e.frequency_hz = hz;
    e.value = loop_at(machines[0], c, hz).loop;
    for (std::size_t k = 1; k < machines.size(); ++k) {
      const auto away = loop_at(machines[k], c, hz).loop - e.value;
      const Eigen::Vector2d v(away.real(), away.imag());
      e.covariance += 0.25 / 4.0 * v * v.transpose();
    }
    curves.ellipses.push_back(e);
  }
  constexpr std::size_t kSamples = 300;
  std::vector<StepAt> reference, torque;
  for (const auto& m : machines) {
    reference.push_back(step_of(m, c, 1.0, weight_kp, 0.0, kSamples));
    torque.push_back(step_of(m, c, 0.0, 0.0, 1.0, kSamples));
  }
  for (std::size_t k = 0; k < kSamples; ++k) {
    curves.time_s.push_back(0.002 * static_cast<double>(k));
    std::vector<double> load, made, after;
    for (std::size_t i = 0; i < machines.size(); ++i) {
      load.push_back(reference[i].load[k]);
      made.push_back(reference[i].torque[k]);
      after.push_back(torque[i].load[k]);
    }
    put_band(curves.load_by_reference, load);
    put_band(curves.torque_by_reference, made);
    put_band(curves.load_by_torque, after);
  }
  return curves;
}

/// The product of a PI and a biquad (docs/methods/tune.md 6.1), written out here.
inline data::TransferFunction feedback_of(const design::FilteredPi& c) {
  constexpr double kTs = 0.002;
  data::TransferFunction g{{c.kp + c.ki * kTs, -c.kp}, {1.0, -1.0}, kTs};
  for (const auto& b : c.biquads) {
    const double w = kTwoPi * b.frequency_hz, big = w / std::tan(0.5 * w * kTs);
    const auto side = [&](double damping) {
      return std::vector<double>{big * big + 2.0 * damping * w * big + w * w, 2.0 * (w * w - big * big),
                                 big * big - 2.0 * damping * w * big + w * w};
    };
    const auto times = [](const std::vector<double>& x, const std::vector<double>& y) {
      std::vector<double> out(x.size() + y.size() - 1, 0.0);
      for (std::size_t i = 0; i < x.size(); ++i)
        for (std::size_t k = 0; k < y.size(); ++k) out[i + k] += x[i] * y[k];
      return out;
    };
    auto numerator = side(b.numerator_damping), denominator = side(b.denominator_damping);
    const double first = denominator.front();
    for (auto* list : {&numerator, &denominator})
      for (double& v : *list) v /= first;
    g.numerator = times(g.numerator, numerator);
    g.denominator = times(g.denominator, denominator);
  }
  return g;
}

/// A controller with the figures that its curves show; bounds on |S| and |T_load|.
inline identification::TunedController tuned_controller(const std::string& structure, const std::string& name,
                                                        const design::FilteredPi& gains, double weight) {
  identification::TunedController c;
  c.structure = structure;
  c.name = name;
  c.gains = gains;
  c.feedback = feedback_of(gains);
  c.set_point_weight = weight;
  c.curves = curves_of(c.feedback, (1.0 - weight) * gains.kp);
  c.stable = true;
  c.spectral_radius = 0.97;
  const auto peak = [&](const char* figure_name, const identification::Band& band, double bound) {
    const auto at = std::max_element(band.value.begin(), band.value.end());
    identification::LoopFigure figure{figure_name, "", *at, {}, {}, {}, {}, {}, {}};
    figure.frequency_hz = c.curves.frequency_hz[static_cast<std::size_t>(at - band.value.begin())];
    const double high = *std::max_element(band.high.begin(), band.high.end());
    figure.low = 2.0 * *at - high;
    figure.high = high;
    figure.worst = high + 0.02;
    if (bound > 0.0) {
      figure.bound = bound;
      figure.probability = *at > bound ? 0.9 : high > bound ? 0.021 : 0.0;
    }
    c.figures.push_back(figure);
  };
  peak("sensitivity_peak", c.curves.sensitivity, 1.4);
  peak("complementary_peak", c.curves.complementary, 0.0);
  peak("load_peak", c.curves.load_transfer, 1.3);
  double iae = 0.0, least = 0.0, most = 0.0;
  for (const double v : c.curves.load_by_torque.value) {
    iae += 0.002 * std::abs(v);
    least = std::min(least, v);
    most = std::max(most, v);
  }
  const auto put = [&](const char* figure_name, const char* unit, double value, double spread) {
    c.figures.push_back({figure_name, unit, value, {}, value - spread, value + spread, {}, {}, {}});
  };
  put("controller_sensitivity_peak", "Nm/(rad/s)", 1.4 * gains.kp, 0.1 * gains.kp);
  put("phase_margin_deg", "deg", 63.2, 2.4);
  put("gain_margin_db", "dB", 11.9, 0.8);
  put("delay_margin_s", "s", 0.0084, 0.0006);
  put("crossover_hz", "Hz", 4.9 * gains.kp / 2.1, 0.1);
  put("load_bandwidth_hz", "Hz", 7.1, 0.3);
  put("load_step_iae", "rad", iae, 0.04 * iae);
  put("load_step_peak", "rad/s", -least, 0.02);
  put("load_step_rebound", "", most / -least, 0.004);
  put("noise_gain", "Nm/(rad/s)", 1.1 * gains.kp, 0.02);
  put("reference_overshoot", "", 0.004, 0.003);
  put("reference_settling_s", "s", 0.142, 0.012);
  put("reference_peak_torque", "Nm", 1.05 * weight * gains.kp, 0.02);
  c.draws = 10'000;
  return c;
}

/// A design with all that can be told.
inline identification::Tuning tuning() {
  identification::Tuning t;
  t.files = {"run/axis_x.csv"};
  t.units = bare().units;
  t.sample_time_s = 0.002;
  t.machines = {tuned_machine()};
  t.delay_std_s = 5e-4;
  t.delay_std_assumed = true;
  t.input_scale = 2.5;
  t.output_scale = 60.0 / kTwoPi;
  t.input_unit = "A";
  t.output_unit = "rpm";
  t.trusted = true;
  auto best = tuned_controller("pi+biquads", "PI + 1 biquad", {2.2, 20.4, {{151.0, 1.2, 0.6}}}, 0.5);
  best.exceeding = 420;
  best.radius = 1.92;
  best.limits = {"sensitivity_peak", "load_peak"};
  best.within = true;
  best.crossings = {{{5.1, 63.2, true}, 5.0, 5.2, 60.8, 65.6, 60.1}};
  best.modes = {{5.2, 0.71}, {16.3, 0.37}};
  auto plain = tuned_controller("pi", "PI", {1.91, 18.0, {}}, 0.5);
  plain.exceeding = 437;
  plain.within = true;
  plain.remark = "a larger error of the load";
  t.candidates = {best, plain};
  for (auto& c : t.candidates)
    if (&c != t.candidates.data()) c.curves = {};
  t.running = tuned_controller("running", "running", {1.036, 7.05, {}}, 1.0);
  t.nominal = tuned_controller("pi+biquads", "PI + 1 biquad", {2.4, 25.1, {{150.0, 1.5, 0.5}}}, 0.5);
  t.nominal->exceeding = 5620;
  t.nominal->curves = {};
  for (int i = 0; i < 9; ++i) {
    const double ms = 1.2 + 0.1 * i;
    t.over_sensitivity.push_back({ms, 1.3, 1.2 + ms, 12.0 * (ms - 1.0) + 14.0, 0.08 - 0.02 * ms});
    t.over_load_transfer.push_back({1.4, 1.1 + 0.1 * i, 2.1, 16.0 + 2.5 * i, 0.06 - 0.002 * i});
  }
  t.experiment = {{1.0, 20.4, 0.0531}, {0.25, 22.3, 0.0488}, {0.0, 25.1, 0.0441}, {1.0, 21.9, 0.0500, 0.0}};
  t.findings = {{"delay-unknown",
                 diagnostics::Severity::warning,
                 5e-4,
                 {},
                 "The result tells no standard deviation of the delay; a quarter of a sample was assumed."}};
  return t;
}

/// tuning() with what only some have: schedule, shapers, simulated runs.
inline identification::Tuning full_tuning() {
  auto t = tuning();
  t.schedule = identification::TunedSchedule{{{0.1, 1.6, 14.0}, {0.4, 2.1, 20.0}, {0.9, 2.4, 17.5}},
                                             {{"sensitivity_peak", "", 1.39, {}, {}, {}, {}, 1.4, {}},
                                              {"load_peak", "", 1.303, {}, {}, {}, {}, 1.3, {}}},
                                             0.9,
                                             0.77,
                                             0.62,
                                             true,
                                             {{0.1, 0.041}, {0.4, 0.03}, {0.9, 0.047}},
                                             0.8,
                                             1.25,
                                             2.0};
  t.shapers = {{"zv", 0.031, 0.083, false, {0.6, 0.4}, {0.0, 0.031}},
               {"mzv", 0.046, 0.041, true, {0.4, 0.35, 0.25}, {0.0, 0.023, 0.046}}};
  const auto& curves = t.candidates.front().curves;
  identification::SimulatedRun run;
  run.what = "load step";
  run.time_s = curves.time_s;
  run.reference = std::vector<double>(run.time_s.size(), 0.0);
  run.velocity = curves.load_by_torque.value;
  run.torque = curves.torque_by_reference.value;
  run.figures = {{"load_step_iae", "rad", 0.0531, 0.0549}, {"load_step_rebound", "", 0.02, 0.024}};
  t.simulated = {run};
  auto old = run;
  old.what += " with the running controller";
  old.velocity = t.running->curves.load_by_torque.value;
  old.figures.clear();
  for (std::size_t k = 0; k < 100; ++k) {
    old.time_s.push_back(old.time_s.back() + 0.002);
    old.velocity.push_back(0.0);
    old.torque.push_back(1.0);
  }
  t.simulated.push_back(old);
  t.simulated.push_back({"move", {}, {}, {}, {}, {{"velocity_error", "rad/s", {}, 0.031}}});
  t.shaped_mode = design::ClosedLoopMode{16.3, 0.1};
  t.second_shaped_mode = design::ClosedLoopMode{41.0, 0.05};
  t.candidates.front().feed_forward = identification::TunedFeedForward{0.064, 0.05, 0.4, 0.004};
  t.options.running = data::Controller(data::Controller::Pi{1.036, 0.147});
  return t;
}

/// tuning() with a recording under its controller, of a machine that is 15 % stiffer.
inline identification::Tuning checked() {
  auto t = tuning();
  identification::TuningCheck check;
  check.record = "run/after.csv";
  const auto& c = t.candidates.front().feedback;
  for (double hz = 2.0; hz <= 34.0; hz += 0.5) {
    check.frequency_hz.push_back(hz);
    check.predicted.push_back(loop_at(tuned_machine(), c, hz).loop);
    check.measured.push_back(loop_at(tuned_machine(1.15), c, hz).loop);
    check.predicted_std.push_back(0.02 * std::abs(check.predicted.back()));
    check.measured_std.push_back(0.03 * std::abs(check.measured.back()));
  }
  check.figures = {{"phase_margin_deg", "deg", {63.2, 1.2}, {64.9, 0.9}, 0.26},
                   {"delay_margin_s", "s", {0.0084, 0.0003}, {0.0066, 0.0002}, 6e-7}};
  check.probability = 3e-9;
  check.worst_line_hz = 15.5;
  check.agrees = false;
  check.cause = "the stiffness (+15 %)";
  check.gain_change = data::Estimate{0.021, 0.012};
  check.delay_change_s = data::Estimate{-0.0003, 0.0002};
  check.detectable_gain = 0.066;
  check.detectable_delay_s = 0.0007;
  t.check = check;
  t.trusted = false;
  t.findings.push_back({"prediction-fails", diagnostics::Severity::error, 3e-9, 0.001,
                        "Under this controller the loop is another one than was promised."});
  return t;
}

/// A given controller that does not keep the bounds.
inline identification::Tuning evaluation() {
  auto t = tuning();
  t.options.evaluate = data::Controller(data::Controller::Pi{1.8, 0.0375});
  auto given = tuned_controller("given", "PI", {1.8, 48.0, {}}, 1.0);
  given.exceeding = 9973;
  t.candidates = {given};
  t.nominal.reset();
  t.over_sensitivity.clear();
  t.over_load_transfer.clear();
  t.experiment.clear();
  t.trusted = false;
  return t;
}

}  // namespace resonid::report::test
