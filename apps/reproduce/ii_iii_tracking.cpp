// SPDX-License-Identifier: MIT
#include "reproduce/ii_iii_tracking.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <memory>
#include <resonid/base/constants.hpp>
#include <resonid/base/detail/discrete_filter.hpp>
#include <resonid/base/detail/linear_system.hpp>
#include <resonid/online/models/arx.hpp>
#include <resonid/online/models/closed_loop_output_error.hpp>
#include <resonid/online/models/instrumental_variables.hpp>
#include <resonid/online/models/modes.hpp>
#include <resonid/online/models/output_error.hpp>
#include <resonid/online/models/physical_tracker.hpp>

#include "reproduce/runs.hpp"

namespace resonid::reproduction::ii_iii {
namespace {

using online::ClosedLoopGradient;
using online::PhysicalParameter;
using Tracker = online::PhysicalTracker<double>;

constexpr std::size_t kEvery = 10, kLagEvery = 50;  // samples; the lag of a recursion takes 50 us
constexpr std::size_t kMostOrder = 31;              // of a controller
constexpr double kMemory_s = 0.4;
constexpr double kDriftPerSecond = 0.05;  // of the stiffness, of a cart at 0.06 m/s

double at(const std::vector<double>& time_s, const std::vector<double>& value, double t) {
  const auto above = std::upper_bound(time_s.begin(), time_s.end(), t) - time_s.begin();
  const auto i = static_cast<std::size_t>(
      std::clamp<std::ptrdiff_t>(above, 1, static_cast<std::ptrdiff_t>(time_s.size()) - 1));
  const double part = std::clamp((t - time_s[i - 1]) / (time_s[i] - time_s[i - 1]), 0.0, 1.0);
  return value[i - 1] + part * (value[i] - value[i - 1]);
}

double resonance_of(const Model& model, double rate_hz) {
  const auto found = online::SampledModes<3>(model, rate_hz).resonances();
  return found.empty() ? 0.0 : found[0].frequency_hz;
}

std::size_t delay_samples(const Run& run) {
  return static_cast<std::size_t>(std::lround(run.simulation.truth.delay_s * run.rate_hz()));
}

online::ModelEstimatorConfig common_config(const Run& run, const Model& start, bool forget) {
  online::ModelEstimatorConfig c;
  c.sample_rate_hz = run.rate_hz();
  c.delay_samples = delay_samples(run);
  c.start_b = start.b;
  c.start_a = start.a;
  c.adaptation.start_variance = 0.01;
  c.adaptation.forgetting = forget ? online::Forgetting::constant : online::Forgetting::none;
  c.adaptation.factor = 1.0 - 1.0 / (kMemory_s * run.rate_hz());
  return c;
}

template <class Estimator>
std::vector<Estimate> follow(Estimator estimator, const Run& run) {
  std::vector<Estimate> estimates;
  const auto& r = run.simulation.record;
  const auto first = static_cast<std::size_t>(run.rate_hz());
  double lag = 0.0;
  for (std::size_t k = 0; k < r.samples(); ++k) {
    estimator.step(r.excitation.samples[k], r.input.samples[k], r.output.samples[k]);
    const bool last = k + 1 == r.samples();
    if (!last && (k < first || k % kEvery != 0)) continue;
    if (estimates.empty() || k % kLagEvery == 0) lag = estimator.lag_samples();
    Estimate e;
    e.sample = k;
    e.described = std::max(0.0, static_cast<double>(k) - lag);
    e.model = estimator.model();
    e.resonance_hz = resonance_of(e.model, run.rate_hz());
    estimates.push_back(e);
  }
  return estimates;
}

std::vector<Estimate> follow_closed_loop(const Run& run, const Model& start, ClosedLoopGradient gradient,
                                         bool forget) {
  online::ClosedLoopOutputErrorConfig c;
  c.common = common_config(run, start, forget);
  c.controller_numerator = run.simulation.truth.controller->numerator;
  c.controller_denominator = run.simulation.truth.controller->denominator;
  c.input = online::PredictorInput::measured;
  c.gradient = gradient;
  return follow(*online::ClosedLoopOutputError<double, 3>::create(c), run);
}

std::vector<Estimate> follow_output_error(const Run& run, const Model& start, bool forget) {
  online::OutputErrorConfig c;
  c.common = common_config(run, start, forget);
  if (run.simulation.truth.controller) {
    c.controller_numerator = run.simulation.truth.controller->numerator;
    c.controller_denominator = run.simulation.truth.controller->denominator;
  }
  return follow(*online::OutputError<double, 3>::create(c), run);
}

std::vector<Estimate> follow_refined_iv(const Run& run, const Model& start, bool forget) {
  online::InstrumentalVariablesConfig<3> c;
  c.start = start;
  c.controller_numerator = run.simulation.truth.controller->numerator;
  c.controller_denominator = run.simulation.truth.controller->denominator;
  c.delay_samples = delay_samples(run);
  if (!forget) c.memory_samples = std::numeric_limits<double>::infinity();
  return follow(*online::InstrumentalVariables<double, 3>::create(c), run);
}

std::vector<Estimate> follow_physical(const Run& run, bool forget) {
  online::PhysicalTrackerConfig c;
  c.sample_rate_hz = run.rate_hz();
  c.delay_s = run.simulation.truth.delay_s;
  c.driven_inertia = {run.start.driven_inertia, 0.1};
  c.load_inertia = {run.start.load_inertia, 0.1};
  c.stiffness = {run.start.stiffness, 0.5};
  c.damping = {run.start.damping, 0.3};
  c.stiffness_drift_per_s = forget ? kDriftPerSecond : 0.0;
  const auto tracker = std::make_unique<Tracker>(*Tracker::create(c));  // it remembers the record's start
  std::vector<Estimate> estimates;
  const auto& r = run.simulation.record;
  const auto first = static_cast<std::size_t>(run.rate_hz());
  for (std::size_t k = 0; k < r.samples(); ++k) {
    tracker->step(0.0, r.input.samples[k], r.output.samples[k]);
    const bool last = k + 1 == r.samples();
    if (!last && (k < first || k % kEvery != 0)) continue;
    Estimate e;
    e.sample = k;
    e.described = std::max(0.0, static_cast<double>(k) - tracker->lag_samples());
    e.model = sampled(
        {tracker->value(PhysicalParameter::driven_inertia), tracker->value(PhysicalParameter::load_inertia),
         tracker->value(PhysicalParameter::stiffness), tracker->value(PhysicalParameter::damping)},
        run.rate_hz());
    e.resonance_hz = tracker->resonance_hz();
    estimates.push_back(e);
  }
  return estimates;
}

double square(double x) { return x * x; }

std::array<double, 6> coefficients(const Model& m) {
  return {m.b[0], m.b[1], m.b[2], m.a[0], m.a[1], m.a[2]};
}

}  // namespace

const char* name(Method method) {
  switch (method) {
    case Method::arx:
      return "RLS-ARX, direct";
    case Method::output_error:
      return "OE (RPLR), direct";
    case Method::closed_loop:
      return "CLOE, indirect";
    case Method::fixed_filter:
      return "F-CLOE, fixed filter";
    case Method::damped_filter:
      return "CLOE, damped gradient";
    case Method::refined_iv:
      return "refined IV";
    case Method::physical:
      return "physical tracker";
    case Method::simulated_truth:
      break;
  }
  return "the machine itself";
}

Model sampled(const TwoMass& m, double sample_rate_hz) {
  LinearSystem<double, 3> drive;  // both velocities, twist
  drive.a << -m.damping / m.driven_inertia, m.damping / m.driven_inertia, -m.stiffness / m.driven_inertia,
      m.damping / m.load_inertia, -m.damping / m.load_inertia, m.stiffness / m.load_inertia, 1.0, -1.0, 0.0;
  drive.b << 1.0 / m.driven_inertia, 0.0, 0.0;
  drive.c << 1.0, 0.0, 0.0;
  const auto zoh = zero_order_hold(drive, 1.0 / sample_rate_hz);
  // Faddeev and Leverrier: coefficients of det(z - A) and of c adj(z - A) b.
  Eigen::Matrix3d adjoint = Eigen::Matrix3d::Identity();
  Model model;
  for (int i = 0; i < 3; ++i) {
    model.b[static_cast<std::size_t>(i)] = zoh.c * adjoint * zoh.b;
    const double a = -(zoh.a * adjoint).trace() / (i + 1);
    model.a[static_cast<std::size_t>(i)] = a;
    adjoint = zoh.a * adjoint + a * Eigen::Matrix3d::Identity();
  }
  return model;
}

TwoMass machine_at(const plant::DriveConfig& drive, double position_m) {
  const auto system = plant::mass_system(drive, 1.0, position_m);
  TwoMass m{system.inertia[0], system.inertia[1], 0.0, 0.0};
  for (const auto& coupling : system.couplings) {
    m.stiffness += coupling.stiffness;
    m.damping += coupling.damping;
  }
  return m;
}

double resonance_hz(const TwoMass& m) {
  return std::sqrt(m.stiffness * (1.0 / m.driven_inertia + 1.0 / m.load_inertia)) / kTwoPi;
}

Reference reference(const TwoMass& machine, double sample_rate_hz) {
  Reference r;
  r.value = r.lower = r.upper = coefficients(sampled(machine, sample_rate_hz));
  for (int corner = 0; corner < 8; ++corner) {
    const auto scaled = [&](int bit, double band) {
      return (corner >> bit & 1) != 0 ? 1.0 + band : 1.0 - band;
    };
    auto m = machine;
    m.stiffness *= scaled(0, kStiffnessBand);
    m.damping *= scaled(1, kDampingBand);
    m.driven_inertia *= scaled(2, kInertiaBand);
    const auto c = coefficients(sampled(m, sample_rate_hz));
    for (std::size_t i = 0; i < c.size(); ++i) {
      r.lower[i] = std::min(r.lower[i], c[i]);
      r.upper[i] = std::max(r.upper[i], c[i]);
    }
  }
  return r;
}

bool Run::moves() const {
  return simulation.truth.over_time && !simulation.truth.over_time->position_m.empty();
}
double Run::position_m(double sample) const {
  if (!moves()) return experiment.motion.from;
  const auto& over = *simulation.truth.over_time;
  return at(over.time_s, over.position_m, sample / rate_hz());
}
double Run::resonance_hz(double sample) const {
  if (!simulation.truth.over_time) return simulation.truth.resonances.front().frequency_hz;
  const auto& over = *simulation.truth.over_time;
  return at(over.time_s, over.resonance_hz, sample / rate_hz());
}
TwoMass Run::machine(double sample) const { return machine_at(experiment.drive, position_m(sample)); }

Run run(const plant::ExperimentConfig& experiment, double start_m) {
  return {experiment, simulated(experiment), machine_at(experiment.drive, start_m)};
}

std::vector<Estimate> track(const Run& run, Method method, bool forget) {
  const Model start = sampled(run.start, run.rate_hz());
  switch (method) {
    case Method::arx:
      return follow(*online::Arx<double, 3>::create({common_config(run, start, forget)}), run);
    case Method::output_error:
      return follow_output_error(run, start, forget);
    case Method::closed_loop:
      return follow_closed_loop(run, start, ClosedLoopGradient::regressor, forget);
    case Method::fixed_filter:
      return follow_closed_loop(run, start, ClosedLoopGradient::fixed_filter, forget);
    case Method::damped_filter:
      return follow_closed_loop(run, start, ClosedLoopGradient::damped_filter, forget);
    case Method::refined_iv:
      return follow_refined_iv(run, start, forget);
    case Method::physical:
      return follow_physical(run, forget);
    case Method::simulated_truth:
      break;
  }
  return truth(run);
}

std::vector<Estimate> truth(const Run& run) {
  std::vector<Estimate> estimates;
  for (auto k = static_cast<std::size_t>(run.rate_hz()); k < run.simulation.record.samples(); k += 5) {
    const auto sample = static_cast<double>(k);
    estimates.push_back({k, sample, sampled(run.machine(sample), run.rate_hz()), run.resonance_hz(sample)});
  }
  return estimates;
}

Errors errors(const Run& run, const std::vector<Estimate>& estimates) {
  Errors e;
  const double count = static_cast<double>(estimates.size());
  const auto apart = static_cast<std::size_t>(std::lround(0.2 * run.rate_hz())) / kEvery;
  for (std::size_t j = 0; j < estimates.size(); ++j) {
    const auto& x = estimates[j];
    const auto newest = static_cast<double>(x.sample);
    const auto off = [&](double sample) { return 100.0 * (x.resonance_hz / run.resonance_hz(sample) - 1.0); };
    e.newest += square(off(newest)) / count;
    e.described += square(off(x.described)) / count;
    e.largest = std::max(e.largest, std::abs(off(x.described)));
    const auto found = coefficients(x.model);
    const auto now = coefficients(sampled(run.machine(newest), run.rate_hz()));
    const auto described = reference(run.machine(x.described), run.rate_hz());
    for (std::size_t i = 0; i < found.size(); ++i) {
      const bool numerator = i < 3;
      (numerator ? e.b : e.a) += square(found[i] - now[i]) / (3.0 * count);
      if (found[i] >= described.lower[i] && found[i] <= described.upper[i])
        (numerator ? e.b_within : e.a_within) += 100.0 / (3.0 * count);
      if (numerator && j >= apart)
        e.b_change += square(found[i] - estimates[j - apart].model.b[i]) / (3.0 * count);
    }
  }
  for (double* sum : {&e.newest, &e.described, &e.a, &e.b, &e.b_change}) *sum = std::sqrt(*sum);
  return e;
}

Validation validate(const std::vector<Estimate>& estimates, const Run& on, bool described) {
  const auto& record = on.simulation.record;
  const auto time = [&](const Estimate& e) {
    return described ? e.described : static_cast<double>(e.sample);
  };
  const std::size_t delay = delay_samples(on), begin = static_cast<std::size_t>(on.rate_hz());
  const std::size_t from = 2 * begin;  // a second at constant velocity is for the loop to settle
  const auto& law = *on.simulation.truth.controller;
  auto controller = *DiscreteFilter<double, kMostOrder>::create(law.numerator, law.denominator);
  const auto& u = record.input.samples;
  const auto& y = record.output.samples;
  std::vector<double> simulated_u = u, simulated_y = y, residual, shown, input, excitation;
  std::size_t newest = 0;
  for (std::size_t k = begin; k < from + kValidationSamples; ++k) {
    while (newest + 1 < estimates.size() && time(estimates[newest + 1]) <= static_cast<double>(k)) ++newest;
    const Model& m = estimates[newest].model;
    double sum = 0.0;
    for (std::size_t i = 0; i < 3; ++i)
      sum += m.b[i] * simulated_u[k - delay - 1 - i] - m.a[i] * simulated_y[k - 1 - i];
    simulated_y[k] = sum;
    simulated_u[k] = u[k] + controller.step(y[k] - sum);  // ru + C (r - yh), whatever r is
    if (k < from) continue;
    residual.push_back(y[k] - sum);
    shown.push_back(sum);
    input.push_back(u[k]);
    excitation.push_back(record.excitation.samples[k]);
  }
  Validation v;
  v.test = diagnostics::test_residual({residual, shown, input, excitation}, 40, 3 + delay);
  v.noise_share = v.test.rms / on.experiment.measurement.noise_rms;
  return v;
}

}  // namespace resonid::reproduction::ii_iii
