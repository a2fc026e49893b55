// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstdint>
#include <functional>
#include <memory>
#include <random>
#include <resonid/base/error_text.hpp>
#include <resonid/io/shipped_experiments.hpp>
#include <resonid/online/models/closed_loop_output_error.hpp>
#include <resonid/online/models/detail/model_response.hpp>
#include <resonid/online/models/instrumental_variables.hpp>
#include <resonid/online/models/modes.hpp>
#include <resonid/online/models/physical_tracker.hpp>
#include <resonid/online/supervision/detail/loop_errors.hpp>
#include <resonid/plant/detail/mass_system.hpp>
#include <resonid/plant/experiment.hpp>
#include <stdexcept>
#include <string>
#include <tooth_belt.hpp>
#include <vector>

// The tooth belts of Publications II and III with 0.5 Nm of load that nobody knows of, followed on line from
// a stiffness that is 10 % off: resonance, margins and gap against the truth of the simulated loop (the
// cascade's own law, the cart where it is), at the time that the estimate describes.
namespace resonid::test {

struct MovingBelt {
  plant::ExperimentConfig config;
  plant::Simulation simulation;
  double stiffness_factor = 1.1;  ///< Start over truth.

  [[nodiscard]] double rate() const { return config.run.sample_rate_hz; }
  [[nodiscard]] plant::MassSystem machine(double place_m) const {
    return plant::mass_system(config.drive, 1.0, place_m);
  }
  [[nodiscard]] online::DiscreteModel<double, 3> sampled(double place_m, double factor = 1.0) const {
    const auto m = machine(place_m);
    return two_masses(m.inertia[0], m.inertia[1], m.couplings[0].stiffness * factor, m.couplings[0].damping,
                      1.0 / rate());
  }
  /// Of the cart, a fraction of a sample included.
  [[nodiscard]] double place(double sample) const {
    const auto& x = simulation.record.position.samples;
    const double at = std::clamp(sample, 0.0, static_cast<double>(x.size() - 2));
    const auto i = static_cast<std::size_t>(at);
    return x[i] + (at - static_cast<double>(i)) * (x[i + 1] - x[i]);
  }
  [[nodiscard]] std::complex<double> controller(double hz) const {
    return simulation.truth.controller->response(hz);
  }
  [[nodiscard]] std::complex<double> around(double hz) const {
    return controller(hz) * std::polar(1.0, -kTwoPi * hz * config.measurement.delay_s);
  }
};

inline MovingBelt moving_belt(const std::string& experiment, std::uint64_t seed, double stiffness_factor) {
  auto config = io::shipped_experiment(experiment);
  config.disturbance.load_torque = 0.5;
  config.run.seed = seed;
  auto simulation = plant::simulate_closed_loop(config);
  if (!simulation) throw std::runtime_error(message_of(simulation.error()));
  return {config, std::move(*simulation), stiffness_factor};
}

/// What an estimator says at one row.
struct BeltReading {
  bool ready = false;
  double lag_samples = 0.0, resonance_hz = 0.0, resonance_std_hz = 0.0;
  online::DiscreteModel<double, 3> model{};
  std::function<online::RelativeError(double)> error_at;
};

/// Errors of a figure, and over their standard deviations.
struct FigureErrors {
  double squares = 0.0, normalised_squares = 0.0, count = 0.0;
  void add(double error, double std) {
    squares += error * error;
    normalised_squares += error * error / (std * std);
    count += 1.0;
  }
  void add(const FigureErrors& o) {
    squares += o.squares;
    normalised_squares += o.normalised_squares;
    count += o.count;
  }
  [[nodiscard]] double rms() const { return std::sqrt(squares / count); }
  [[nodiscard]] double normalised() const { return normalised_squares / count; }
};
struct BeltErrors {
  FigureErrors resonance, crossover;  ///< Relative.
  FigureErrors phase_margin_deg, modulus_margin, gap;
  double trusted = 0.0, rows = 0.0;  ///< From the first ready row on.

  void add(const BeltErrors& o) {
    resonance.add(o.resonance);
    crossover.add(o.crossover);
    phase_margin_deg.add(o.phase_margin_deg);
    modulus_margin.add(o.modulus_margin);
    gap.add(o.gap);
    trusted += o.trusted;
    rows += o.rows;
  }
};

/// Margins and gap of a model, and its errors' bars.
inline online::LoopMargins<double> scanned(const MovingBelt& belt, const online::DiscreteModel<double, 3>& m,
                                           double resonance_hz,
                                           const online::DiscreteModel<double, 3>& reference,
                                           online::GapScan& gap) {
  std::vector<double> grid;
  const double rate = belt.rate();
  for (int i = 0; i < 200; ++i) grid.push_back(0.0005 * rate * std::pow(0.499 / 0.0005, i / 199.0));
  for (int i = 0; i < 160; ++i) {
    const double hz = resonance_hz / 1.4 * std::pow(1.96, i / 159.0);
    if (hz < 0.499 * rate) grid.push_back(hz);
  }
  std::sort(grid.begin(), grid.end());
  online::MarginScan<double> scan;
  for (const double hz : grid) {
    const auto g = online::response(m, hz, rate);
    const auto c = belt.controller(hz);
    scan.step(hz, belt.around(hz) * g);
    gap.step(hz, c * g, c * online::response(reference, hz, rate));
  }
  return scan.margins();
}

/// A row every 40 ms; `margins`: every tenth of them is held against margins and gap too.
template <class Step, class Read>
BeltErrors followed(const MovingBelt& belt, Step&& step, Read&& read, bool margins) {
  BeltErrors errors;
  const auto& r = belt.simulation.record;
  const auto every = static_cast<std::size_t>(0.04 * belt.rate());
  const auto baseline = belt.sampled(belt.config.motion.from);
  std::size_t rows = 0;
  for (std::size_t k = 0; k < r.samples(); ++k) {
    step(r.excitation.samples[k], r.input.samples[k], r.output.samples[k]);
    if ((k + 1) % every != 0) continue;
    const BeltReading now = read();
    if (!now.ready && errors.rows == 0.0) continue;
    errors.rows += 1.0;
    if (!now.ready || !(now.resonance_std_hz < 0.02 * now.resonance_hz)) continue;
    errors.trusted += 1.0;
    const double place = belt.place(static_cast<double>(k) - now.lag_samples);
    const double truth_hz = plant::resonances(belt.machine(place))[0].frequency_hz;
    errors.resonance.add(now.resonance_hz / truth_hz - 1.0, now.resonance_std_hz / truth_hz);
    if (!margins || ++rows % 10 != 0) continue;
    online::GapScan gap, true_gap;
    const auto found = scanned(belt, now.model, now.resonance_hz, baseline, gap);
    const auto truth = scanned(belt, belt.sampled(place), truth_hz, baseline, true_gap);
    const auto std = online::margin_stds(found, now.error_at, [&](double hz) {
      return belt.around(hz) * online::response(now.model, hz, belt.rate());
    });
    errors.crossover.add(found.crossover_hz / truth.crossover_hz - 1.0,
                         std.crossover_hz / truth.crossover_hz);
    errors.phase_margin_deg.add(found.phase_margin_deg - truth.phase_margin_deg, std.phase_margin_deg);
    errors.modulus_margin.add(found.modulus_margin - truth.modulus_margin, std.modulus_margin);
    errors.gap.add(gap.gap() - true_gap.gap(),
                   online::gap_std(gap.value(), gap.reference(), now.error_at(gap.gap_hz())));
  }
  return errors;
}

/// Masses and damping of the start are drawn with the standard deviations that the tracker is told.
inline BeltErrors physical_on(const MovingBelt& belt, bool margins) {
  using P = online::PhysicalParameter;
  const auto machine = belt.machine(belt.config.motion.from);
  std::mt19937_64 generator(belt.config.run.seed + 99);
  const auto drawn = [&](double value, double deviation) {  // uniform with that standard deviation
    const double u = static_cast<double>(generator() >> 11) * 0x1p-53;
    return online::StartingValue{value * std::exp(deviation * std::sqrt(12.0) * (u - 0.5)), deviation};
  };
  online::PhysicalTrackerConfig c;
  c.sample_rate_hz = belt.rate();
  c.delay_s = belt.config.measurement.delay_s;
  c.driven_inertia = drawn(machine.inertia[0], 0.1);
  c.load_inertia = drawn(machine.inertia[1], 0.1);
  c.stiffness = {machine.couplings[0].stiffness * belt.stiffness_factor, 0.1};
  c.damping = drawn(machine.couplings[0].damping, 0.3);
  c.stiffness_drift_per_s = 0.08;  // 1.6 times the cart's speed over its stroke, as `track` has it
  c.at_best_known_time = true;
  using Tracker = online::PhysicalTracker<double>;
  const auto t = std::make_unique<Tracker>(Tracker::create(c).value());
  return followed(
      belt, [&](double ru, double u, double y) { t->step(ru, u, y); },
      [&] {
        BeltReading r{t->ready() && t->excited() && t->plausible(),
                      t->lag_samples(),
                      t->resonance_hz(),
                      t->resonance_std_hz(),
                      {},
                      {}};
        if (!margins) return r;
        const online::TwoMassPoint<double> p{t->value(P::driven_inertia), t->value(P::load_inertia),
                                             t->value(P::stiffness), t->value(P::damping),
                                             t->value(P::viscous_friction)};
        online::TwoMassResponse::Covariance covariance = online::TwoMassResponse::Covariance::Zero();
        covariance.topLeftCorner<4, 4>() = t->log_covariance().topLeftCorner<4, 4>();
        const auto drive = std::make_shared<online::TwoMassResponse>(p, belt.rate());
        r.model = two_masses(p.driven_inertia, p.load_inertia, p.stiffness, p.damping, 1.0 / belt.rate());
        r.error_at = [=](double hz) { return drive->relative_error_at(hz, covariance); };
        return r;
      },
      margins);
}

template <class Estimator>
BeltErrors discrete_on(const MovingBelt& belt, Estimator estimator, bool margins) {
  return followed(
      belt, [&](double ru, double u, double y) { estimator.step(ru, u, y); },
      [&] {
        const auto covariance = estimator.covariance();
        BeltReading r;
        r.model = estimator.model();
        const auto modes = online::SampledModes<3>(r.model, belt.rate()).resonances(covariance);
        r.ready = estimator.ready() && !modes.empty() && roots_within(r.model.a, 1.002);
        if (!r.ready) return r;
        r.lag_samples = estimator.lag_samples();
        r.resonance_hz = modes[0].frequency_hz;
        r.resonance_std_hz = modes[0].std_hz;
        r.error_at = [=, model = r.model, rate = belt.rate()](double hz) {
          return online::relative_error(model, covariance, hz, rate);
        };
        return r;
      },
      margins);
}

inline BeltErrors instrumental_on(const MovingBelt& belt, bool margins) {
  online::InstrumentalVariablesConfig<3> c;
  c.start = belt.sampled(belt.config.motion.from, belt.stiffness_factor);
  c.controller_numerator = belt.simulation.truth.controller->numerator;
  c.controller_denominator = belt.simulation.truth.controller->denominator;
  c.delay_samples = static_cast<std::size_t>(std::lround(belt.config.measurement.delay_s * belt.rate()));
  return discrete_on(belt, online::InstrumentalVariables<double, 3>::create(c).value(), margins);
}

/// Memory of 24 periods of the resonance, as `track` has it.
inline BeltErrors damped_closed_loop_on(const MovingBelt& belt, bool margins) {
  const auto start = belt.sampled(belt.config.motion.from, belt.stiffness_factor);
  const double resonance = online::SampledModes<3>(start, 1.0).resonances()[0].frequency_hz;
  online::ClosedLoopOutputErrorConfig c;
  c.common.sample_rate_hz = belt.rate();
  c.common.delay_samples =
      static_cast<std::size_t>(std::lround(belt.config.measurement.delay_s * belt.rate()));
  c.common.start_b = start.b;
  c.common.start_a = start.a;
  c.common.fixed_integrator = true;
  c.common.adaptation.start_variance = 0.01;
  c.common.adaptation.factor = 1.0 - 1.0 / std::max(50.0, 24.0 / resonance);
  c.controller_numerator = belt.simulation.truth.controller->numerator;
  c.controller_denominator = belt.simulation.truth.controller->denominator;
  c.input = online::PredictorInput::measured;
  c.gradient = online::ClosedLoopGradient::damped_filter;
  return discrete_on(belt, online::ClosedLoopOutputError<double, 3>::create(c).value(), margins);
}

}  // namespace resonid::test
