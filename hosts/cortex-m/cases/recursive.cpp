// SPDX-License-Identifier: MIT
#include <new>
#include <resonid/online/models/arx.hpp>
#include <resonid/online/models/closed_loop_output_error.hpp>
#include <resonid/online/models/output_error.hpp>
#include <resonid/online/models/physical_tracker.hpp>
#include <resonid/online/models/rls.hpp>

#include "../define_case.hpp"
#include "../record.hpp"
#include "cases.hpp"

using namespace resonid::online;

namespace {

/// The bare recursion for six parameters: regressor of a two-mass drive.
struct RlsCase {
  using Estimator = RecursiveLeastSquares<float, 6>;
  static inline Storage<Estimator> rls;
  static inline std::array<float, 6> regressor;

  static bool create() {
    regressor = {};
    return rls.hold(Estimator::create({.start_variance = 1e3, .factor = 0.998}));
  }
  static void step(const Sample& s) {
    rls->step(regressor, s.y);
    regressor = {s.u, regressor[0], regressor[1], -s.y, regressor[3], regressor[4]};
  }
  static void report(Output& out) {
    const auto& p = rls->parameters();
    out.floats("b", std::span(p).first<3>());
    out.floats("a", std::span(p).last<3>());
  }
};

template <class Made>
void model(Output& out, Made& estimator) {
  const auto m = estimator->model();
  out.floats("b", m.b);
  out.floats("a", m.a);
}

ModelEstimatorConfig common() {
  ModelEstimatorConfig c;
  c.sample_rate_hz = drive::kSampleRateHz;
  c.adaptation.factor = 0.998;
  return c;
}

struct ArxCase {
  using Estimator = Arx<float, 3>;
  static inline Storage<Estimator> arx;

  static bool create() { return arx.hold(Estimator::create({.common = common()})); }
  static void step(const Sample& s) { arx->step(s.ru, s.u, s.y); }
  static void report(Output& out) { model(out, arx); }
};

struct OutputErrorCase {
  using Estimator = OutputError<float, 3>;
  static inline Storage<Estimator> error;

  static bool create() {
    OutputErrorConfig config;
    config.common = common();
    config.gradient = OutputErrorGradient::filtered;
    return error.hold(Estimator::create(config));
  }
  static void step(const Sample& s) { error->step(s.ru, s.u, s.y); }
  static void report(Output& out) { model(out, error); }
};

/// From starts that are off by 20 to 30 %; nothing is gone over again.
struct PhysicalTrackerCase {
  using Estimator = PhysicalTracker<float, 0>;
  static inline Storage<Estimator> tracker;

  static bool create() {
    PhysicalTrackerConfig c;
    c.sample_rate_hz = drive::kSampleRateHz;
    c.driven_inertia = {1.2 * drive::kDrivenInertiaKgm2, 0.3};
    c.load_inertia = {0.8 * drive::kLoadInertiaKgm2, 0.3};
    c.stiffness = {0.8 * drive::kStiffnessNmPerRad, 0.3};
    c.damping = {0.7 * drive::kDampingNmsPerRad, 0.3};
    return tracker.hold(Estimator::create(c));
  }
  static void step(const Sample& s) { tracker->step(s.ru, s.u, s.y); }
  static void report(Output& out) {
    for (const auto p : {PhysicalParameter::driven_inertia, PhysicalParameter::load_inertia,
                         PhysicalParameter::stiffness, PhysicalParameter::damping})
      out.floats("parameter", std::array{static_cast<float>(tracker->value(p))});
  }
};

struct CloeCase {
  using Estimator = ClosedLoopOutputError<float, 3>;
  static inline Storage<Estimator> cloe;

  static bool create() {
    ClosedLoopOutputErrorConfig config;
    config.common = common();
    config.controller_numerator = drive::kControllerNumerator;
    config.controller_denominator = drive::kControllerDenominator;
    return cloe.hold(Estimator::create(config));
  }
  static void step(const Sample& s) { cloe->step(s.ru, s.u, s.y); }
  static void report(Output& out) { model(out, cloe); }
};

}  // namespace

const Case rls_6 = case_of<RlsCase>("rls_6", Injection::prbs);
const Case cloe_3 = case_of<CloeCase>("cloe_3", Injection::prbs);
const Case arx_3 = case_of<ArxCase>("arx_3", Injection::prbs);
const Case output_error_3 = case_of<OutputErrorCase>("output_error_3", Injection::prbs);
const Case physical_tracker = case_of<PhysicalTrackerCase>("physical_tracker", Injection::prbs);
