// SPDX-License-Identifier: MIT
#include <array>
#include <resonid/online/models/arx.hpp>
#include <resonid/online/models/closed_loop_output_error.hpp>
#include <resonid/online/models/instrumental_variables.hpp>
#include <resonid/online/models/output_error.hpp>
#include <string_view>
#include <tooth_belt.hpp>

#include "subject.hpp"

namespace resonid::test {
namespace {

using namespace resonid::online;

const DiscreteModel<double, 3>& start() {
  static const DiscreteModel<double, 3> model = tooth_belt(0.82, 1.0 / kRateHz);
  return model;
}
const ControllerCoefficients& controller() {
  static const ControllerCoefficients c = tooth_belt_controller(1.0 / kRateHz);
  return c;
}
ModelEstimatorConfig common() {
  ModelEstimatorConfig c;
  c.sample_rate_hz = kRateHz;
  c.delay_samples = 1;
  c.start_b = start().b;
  c.start_a = start().a;
  c.high_pass_hz = 1.0;
  c.adaptation.start_variance = 0.01;
  c.adaptation.factor = 0.99;
  return c;
}

template <class Real>
struct OfModel {
  using Scalar = Real;
  static constexpr bool kTyped = true;
  static constexpr unsigned kArguments = kU | kY;
  static constexpr double kRecovered = 5e-3;
  static constexpr double kSpike = 1e9;
  static constexpr std::string_view kAsListed = "order 3";
  template <class E>
  static std::tuple<Real, Real, Real> arguments(const E&, const Sample& s) noexcept {
    return {static_cast<Real>(s[0]), static_cast<Real>(s[1]), static_cast<Real>(s[2])};
  }
  template <class E>
  static void observe(const E& e, Answers& answers) noexcept {
    const auto model = e.model();
    for (const Real x : model.b) answers.figure(static_cast<double>(x));
    for (const Real x : model.a) answers.figure(static_cast<double>(x));
    answers.add_all(e.covariance());
    answers.add(e.lag_samples());
    answers.add(static_cast<double>(e.residual()));
    answers.add(e.ready() ? 1.0 : 0.0);
    answers.add(e.excited() ? 1.0 : 0.0);
  }
};

template <class Real>
struct ArxTraits : OfModel<Real> {
  using Listed = Arx<Real, 3>;
  static constexpr std::string_view kName = "Arx",
                                    kCost = "parameters squared; every 16th sample looks at the limits";
  static Listed make() {
    return Listed::create({.common = common(), .load_torque = true, .coulomb = true}).value();
  }
};

template <class Real, OutputErrorGradient Gradient>
struct OutputErrorTraits : OfModel<Real> {
  using Listed = OutputError<Real, 3>;
  static constexpr std::string_view kName = Gradient == OutputErrorGradient::filtered
                                                ? "OutputError, filtered"
                                                : "OutputError, regressor",
                                    kCost = "as Arx; a step that is not stable is halved up to three times";
  static Listed make() {
    OutputErrorConfig c;
    c.common = common();
    c.gradient = Gradient;
    c.controller_numerator = controller().numerator;
    c.controller_denominator = controller().denominator;
    return Listed::create(c).value();
  }
};

template <class Real, ClosedLoopGradient Gradient>
struct ClosedLoopTraits : OfModel<Real> {
  using Listed = ClosedLoopOutputError<Real, 3>;
  static constexpr std::string_view kName = Gradient == ClosedLoopGradient::regressor
                                                ? "ClosedLoopOutputError, regressor"
                                            : Gradient == ClosedLoopGradient::fixed_filter
                                                ? "ClosedLoopOutputError, fixed filter"
                                                : "ClosedLoopOutputError, damped filter",
                                    kCost = "as OutputError";
  static constexpr double kSpike = 100.0;
  static constexpr unsigned kArguments = kRu | kY;
  static Listed make() {
    ClosedLoopOutputErrorConfig c;
    c.common = common();
    c.gradient = Gradient;
    c.controller_numerator = controller().numerator;
    c.controller_denominator = controller().denominator;
    return Listed::create(c).value();
  }
};

template <class Real>
struct InstrumentalVariablesTraits : OfModel<Real> {
  using Listed = InstrumentalVariables<Real, 3>;
  static constexpr std::string_view kName = "InstrumentalVariables",
                                    kCost = "parameters squared; every `refresh_samples` one linear solution";
  static constexpr unsigned kArguments = kRu | kU | kY;
  static Listed make() {
    InstrumentalVariablesConfig<3> c;
    c.start = start();
    c.controller_numerator = controller().numerator;
    c.controller_denominator = controller().denominator;
    c.delay_samples = 1;
    return Listed::create(c).value();
  }
};

template <class Real>
void add(std::vector<Case>& all) {
  all.push_back(case_of<ArxTraits<Real>>());
  all.push_back(case_of<OutputErrorTraits<Real, OutputErrorGradient::regressor>>());
  all.push_back(case_of<OutputErrorTraits<Real, OutputErrorGradient::filtered>>());
  all.push_back(case_of<ClosedLoopTraits<Real, ClosedLoopGradient::regressor>>());
  all.push_back(case_of<ClosedLoopTraits<Real, ClosedLoopGradient::fixed_filter>>());
  all.push_back(case_of<ClosedLoopTraits<Real, ClosedLoopGradient::damped_filter>>());
  all.push_back(case_of<InstrumentalVariablesTraits<Real>>());
}

}  // namespace

void add_model_cases(std::vector<Case>& all) {
  add<double>(all);
  add<float>(all);
}

}  // namespace resonid::test
