// SPDX-License-Identifier: MIT
// Property: whatever the two-mass drive, excitation and loop, a noise-free record gives the parameters back.
// The seed is fixed; RC_PARAMS="seed=... max_success=..." in the environment tries others.
#include <rapidcheck.h>

#include <cstdlib>
#include <experiments.hpp>
#include <resonid/base/constants.hpp>

namespace resonid {
namespace {

/// Between the ends, evenly in the logarithm. Shrinks towards the lower end.
rc::Gen<double> between(double low, double high) {
  return rc::gen::map(rc::gen::inRange(0, 1001),
                      [=](int i) { return low * std::pow(high / low, static_cast<double>(i) / 1000.0); });
}

struct Case {
  data::TwoMassParameters drive;
  double resonance_hz;
};

Case random_drive() {
  const double inertia = *between(0.001, 1.0);
  const double ratio = *between(0.3, 3.0);  // load to driven
  const double damping_ratio = *between(0.02, 0.2);
  const double resonance_hz = *between(8.0, 60.0);
  const double omega = kTwoPi * resonance_hz;
  Case c{{}, resonance_hz};
  c.drive.driven_inertia = inertia;
  c.drive.load_inertia = ratio * inertia;
  const double inverse = 1.0 / c.drive.driven_inertia + 1.0 / c.drive.load_inertia;
  c.drive.stiffness = omega * omega / inverse;
  c.drive.damping = 2.0 * damping_ratio * omega / inverse;
  return c;
}

plant::ExperimentConfig random_experiment(const Case& c) {
  plant::ExperimentConfig e;
  e.drive.driven_inertia = c.drive.driven_inertia;
  e.drive.load_inertia = c.drive.load_inertia;
  e.drive.stiffness = c.drive.stiffness;
  e.drive.damping = c.drive.damping;
  e.run.sample_rate_hz = 500.0;
  e.measurement.delay_s = *rc::gen::element(0.0, 0.002, 0.004);
  if (*rc::gen::arbitrary<bool>()) {  // a loop slow enough to be stable at any of these resonances
    const double crossover_hz = 0.05 * c.resonance_hz;
    e.controller.kind = plant::ControllerKind::pi;
    e.controller.gain = kTwoPi * crossover_hz * (c.drive.driven_inertia + c.drive.load_inertia);
    e.controller.integral_time_s = 1.0 / crossover_hz;
  }
  if (*rc::gen::arbitrary<bool>()) {
    test::prbs(e);
  } else {
    e.excitation.kind = online::Kind::chirp;
    e.excitation.from_hz = 2.5 * c.resonance_hz;
    e.excitation.to_hz = 0.1 * c.resonance_hz;
    e.excitation.duration_s = 12.0;
  }
  return e;
}

double worst_relative_error(const data::TwoMassParameters& found, const data::TwoMassParameters& truth) {
  const auto relative = [](double a, double b) { return std::abs(a / b - 1.0); };
  return std::max({relative(found.driven_inertia, truth.driven_inertia),
                   relative(found.load_inertia, truth.load_inertia),
                   relative(found.stiffness, truth.stiffness), relative(found.damping, truth.damping)});
}

TEST(Recovery, NoiseFreeRecordsGiveTheParametersBack) {
  ::setenv("RC_PARAMS", "seed=20160617 max_success=12 noshrink=1", 0);
  EXPECT_TRUE(rc::check("parameters within 1e-3", [] {
    const Case c = random_drive();
    const auto experiment = random_experiment(c);
    const auto simulation = plant::simulate_closed_loop(experiment);
    RC_ASSERT(simulation.has_value());
    const auto result = identification::identify(simulation->record, test::known(experiment));
    RC_ASSERT(result.has_value());
    RC_ASSERT(result->model.has_value());
    RC_LOG() << "resonance " << c.resonance_hz << " Hz, ratio "
             << c.drive.load_inertia / c.drive.driven_inertia << ", damping ratio "
             << data::resonance_damping_ratio(c.drive) << ", "
             << (experiment.controller.kind == plant::ControllerKind::none ? "open" : "closed") << " loop, "
             << (experiment.excitation.kind == online::Kind::prbs ? "PRBS" : "chirp") << ", delay "
             << experiment.measurement.delay_s << " s\n";
    for (const auto& f : result->findings)
      if (f.severity == diagnostics::Severity::error) RC_LOG() << f.meaning << "\n";
    RC_ASSERT(result->model->drive.structure == fit::Structure::two_mass);
    RC_ASSERT(worst_relative_error(result->model->drive.parameters, c.drive) < 1e-3);
    RC_ASSERT(result->trusted);
  }));
}

}  // namespace
}  // namespace resonid
