// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <resonid/base/error_text.hpp>
#include <resonid/io/shipped_experiments.hpp>
#include <resonid/online/models/arx.hpp>
#include <resonid/online/models/closed_loop_output_error.hpp>
#include <resonid/online/models/modes.hpp>
#include <resonid/online/models/output_error.hpp>
#include <resonid/plant/experiment.hpp>
#include <stdexcept>
#include <tooth_belt.hpp>
#include <vector>

namespace resonid::test {

/// The signals of one run of ii_iii_tooth_prbs and the true resonance at each sample.
struct ToothBeltRun {
  double sample_rate_hz = 0.0;
  double gain = 1.0;  ///< Of the controller over the published one.
  std::vector<double> ru, u, y, resonance_hz;
  online::DiscreteModel<double, 3> start;
};

inline ToothBeltRun tooth_belt_run(plant::ExperimentConfig config, double gain, double start_m) {
  config.controller.gain *= gain;
  auto s = plant::simulate_closed_loop(config);
  if (!s) throw std::runtime_error(message_of(s.error()));
  ToothBeltRun run;
  run.sample_rate_hz = config.run.sample_rate_hz;
  run.gain = gain;
  run.ru = s->record.excitation.samples;
  run.u = s->record.input.samples;
  run.y = s->record.output.samples;
  run.start = tooth_belt(start_m, 1.0 / run.sample_rate_hz);
  run.resonance_hz.assign(run.y.size(), s->truth.resonances.front().frequency_hz);
  if (!s->truth.over_time) return run;
  const auto& t = s->truth.over_time->time_s;
  const auto& f = s->truth.over_time->resonance_hz;
  std::size_t j = 0;
  for (std::size_t k = 0; k < run.y.size(); ++k) {
    const double now = static_cast<double>(k) / run.sample_rate_hz;
    while (j + 2 < t.size() && t[j + 1] <= now) ++j;
    const double share = std::clamp((now - t[j]) / (t[j + 1] - t[j]), 0.0, 1.0);
    run.resonance_hz[k] = f[j] + share * (f[j + 1] - f[j]);
  }
  return run;
}

/// At 0.06 m/s, noise 0.1 rad/s, the estimator's start being the machine at 0.6 m as in the golden files.
inline ToothBeltRun moving_tooth_belt(std::uint64_t seed, double sample_rate_hz) {
  auto config = io::shipped_experiment("ii_iii_tooth_prbs");
  config.run.seed = seed;
  config.run.sample_rate_hz = sample_rate_hz;
  return tooth_belt_run(config, 1.0, 0.6);
}

/// A machine that stays as the tooth belt is at 0.4 m (a real cart wanders by some millimetres under a PRBS,
/// and its resonance by some tenths of a per cent), 4 ms, the start a little off.
inline ToothBeltRun constant_tooth_belt(std::uint64_t seed, double noise, double gain, double duration_s) {
  auto config = io::shipped_experiment("ii_iii_tooth_prbs");
  plant::DriveConfig drive;
  drive.driven_inertia = 0.0028;
  drive.load_inertia = 6.7 * 0.0199 * 0.0199;
  drive.stiffness = 1050436.2;
  drive.damping = 190.0968;
  drive.radius_m = 0.0199;
  config.drive = drive;
  config.motion = {};
  config.run.seed = seed;
  config.measurement.noise_rms = noise;
  config.run.duration_s = duration_s;
  return tooth_belt_run(config, gain, 0.42);
}

inline online::ModelEstimatorConfig estimator_config(
    const ToothBeltRun& run, online::Forgetting forgetting = online::Forgetting::constant) {
  online::ModelEstimatorConfig c;
  c.sample_rate_hz = run.sample_rate_hz;
  c.delay_samples = static_cast<std::size_t>(std::lround(0.004 * run.sample_rate_hz));
  c.start_b = run.start.b;
  c.start_a = run.start.a;
  c.adaptation.start_variance = 0.01;
  c.adaptation.forgetting = forgetting;
  c.adaptation.factor = run.sample_rate_hz > 300.0 ? 0.995 : 0.99;  // 0.4 s
  return c;
}
inline online::ClosedLoopOutputErrorConfig closed_loop_config(
    const ToothBeltRun& run, online::Forgetting forgetting = online::Forgetting::constant) {
  // Spans need a home.
  static thread_local online::ControllerCoefficients controller;
  controller = tooth_belt_controller(1.0 / run.sample_rate_hz, 0.12 * run.gain);
  online::ClosedLoopOutputErrorConfig c;
  c.common = estimator_config(run, forgetting);
  c.controller_numerator = std::span<const double>(controller.numerator).first(3);
  c.controller_denominator = std::span<const double>(controller.denominator).first(3);
  c.input = online::PredictorInput::measured;
  return c;
}

inline online::Arx<double, 3> arx(const ToothBeltRun& run,
                                  online::Forgetting forgetting = online::Forgetting::constant) {
  return online::Arx<double, 3>::create({estimator_config(run, forgetting)}).value();
}
inline online::OutputError<double, 3> output_error(
    const ToothBeltRun& run, online::OutputErrorGradient gradient,
    online::Forgetting forgetting = online::Forgetting::constant) {
  const auto loop = closed_loop_config(run, forgetting);
  online::OutputErrorConfig c;
  c.common = loop.common;
  c.gradient = gradient;
  c.controller_numerator = loop.controller_numerator;
  c.controller_denominator = loop.controller_denominator;
  return online::OutputError<double, 3>::create(c).value();
}
inline online::ClosedLoopOutputError<double, 3> closed_loop(
    const ToothBeltRun& run, online::ClosedLoopGradient gradient,
    online::Forgetting forgetting = online::Forgetting::constant) {
  auto c = closed_loop_config(run, forgetting);
  c.gradient = gradient;
  return online::ClosedLoopOutputError<double, 3>::create(c).value();
}

/// Relative error of the resonance at the time that the estimate describes.
class Deviation {
 public:
  void add(double relative) {
    square_ += relative * relative;
    most_ = std::max(most_, std::abs(relative));
    ++count_;
  }
  void add(const Deviation& other) {
    square_ += other.square_;
    most_ = std::max(most_, other.most_);
    count_ += other.count_;
  }
  [[nodiscard]] double rms_percent() const {
    return 100.0 * std::sqrt(square_ / static_cast<double>(count_));
  }
  [[nodiscard]] double most_percent() const { return 100.0 * most_; }

 private:
  double square_ = 0.0, most_ = 0.0;
  std::size_t count_ = 0;
};

/// From the first second on, every fifth sample.
template <class Estimator>
Deviation follow(Estimator estimator, const ToothBeltRun& run) {
  Deviation deviation;
  const auto first = static_cast<std::size_t>(run.sample_rate_hz);
  for (std::size_t k = 0; k < run.y.size(); ++k) {
    estimator.step(run.ru[k], run.u[k], run.y[k]);
    if (k < first || k % 5 != 0) continue;
    const auto found = online::SampledModes<3>(estimator.model(), run.sample_rate_hz).resonances();
    const double described = std::clamp(static_cast<double>(k) - estimator.lag_samples(), 0.0,
                                        static_cast<double>(run.y.size() - 2));
    const auto i = static_cast<std::size_t>(described);
    const double truth = run.resonance_hz[i] + (described - static_cast<double>(i)) *
                                                   (run.resonance_hz[i + 1] - run.resonance_hz[i]);
    deviation.add(found.empty() ? -1.0 : found[0].frequency_hz / truth - 1.0);
  }
  return deviation;
}

/// Estimate with its own standard deviation at the end of a run.
template <class Estimator>
online::DiscreteMode last_resonance(Estimator estimator, const ToothBeltRun& run) {
  for (std::size_t k = 0; k < run.y.size(); ++k) estimator.step(run.ru[k], run.u[k], run.y[k]);
  const auto found =
      online::SampledModes<3>(estimator.model(), run.sample_rate_hz).resonances(estimator.covariance());
  return found.empty() ? online::DiscreteMode{} : found[0];
}

/// Errors over their own standard deviations.
class NormalizedError {
 public:
  void add(const online::DiscreteMode& found, double truth_hz) {
    const double x = (found.frequency_hz - truth_hz) / found.std_hz;
    square_ += x * x;
    error_square_ += std::pow(found.frequency_hz / truth_hz - 1.0, 2);
    ++count_;
  }
  [[nodiscard]] double rms() const { return std::sqrt(square_ / count_); }
  [[nodiscard]] double rms_percent() const { return 100.0 * std::sqrt(error_square_ / count_); }

 private:
  double square_ = 0.0, error_square_ = 0.0;
  int count_ = 0;
};

}  // namespace resonid::test
