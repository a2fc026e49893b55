// SPDX-License-Identifier: MIT
#include "identification/tune/law.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>

#include "data/pole_at_one.hpp"
#include "design/course.hpp"
#include "design/figures.hpp"
#include "design/pid.hpp"
#include "design/polynomial.hpp"
#include "linalg/decompositions.hpp"

namespace resonid::identification {
namespace {

std::string words_of(const design::FilteredPi& pi) {
  const std::size_t count = pi.biquads.size();
  const char* base = pi.ki > 0.0 ? "PI" : "P";
  return count == 0 ? base : fmt::format("{} + {} biquad{}", base, count, count == 1 ? "" : "s");
}

/// What is left of terms that cancel: a term below 1e-13 of the largest of them is none.
double without_dust(double sum, double largest) {
  constexpr double kDust = 1e-13;
  return std::abs(sum) < kDust * largest ? 0.0 : sum;
}
void drop_last_zeros(std::vector<double>& polynomial) {
  while (polynomial.size() > 1 && polynomial.back() == 0.0) polynomial.pop_back();
}

/// By its impulse response and its poles: b = a * h. Delays of whole samples are poles at 0, which come out
/// of both as zeros but for rounding.
data::TransferFunction transfer_function_of(const design::ControllerStates& states, double sample_time_s) {
  const Eigen::VectorXcd poles = linalg::eigenvalues(states.a);
  std::vector<std::complex<double>> denominator = {1.0};
  std::vector<double> sizes = {1.0};  // of the terms that its coefficients are sums of
  for (const auto& pole : poles) {
    denominator.emplace_back(0.0);
    sizes.push_back(0.0);
    for (std::size_t i = denominator.size() - 1; i > 0; --i) {
      denominator[i] -= pole * denominator[i - 1];
      sizes[i] += std::abs(pole) * sizes[i - 1];
    }
  }
  const double largest = *std::max_element(sizes.begin(), sizes.end());
  data::TransferFunction f;
  f.sample_time_s = sample_time_s;
  for (const auto& c : denominator) f.denominator.push_back(without_dust(c.real(), largest));
  std::vector<double> impulse = {states.d};
  Eigen::VectorXd x = states.b;
  for (std::size_t k = 1; k < f.denominator.size(); ++k) {
    impulse.push_back(states.c * x);
    x = (states.a * x).eval();
  }
  for (std::size_t k = 0; k < f.denominator.size(); ++k) {
    double sum = 0.0, largest_term = 0.0;
    for (std::size_t i = 0; i <= k; ++i) {
      const double term = f.denominator[i] * impulse[k - i];
      sum += term;
      largest_term = std::max(largest_term, std::abs(term));
    }
    f.numerator.push_back(without_dust(sum, largest_term));
  }
  drop_last_zeros(f.numerator);
  drop_last_zeros(f.denominator);
  return f;
}

/// Coefficients of a product of polynomials.
std::vector<double> product(const std::vector<double>& a, const std::vector<double>& b) {
  std::vector<double> both(a.size() + b.size() - 1, 0.0);
  for (std::size_t i = 0; i < a.size(); ++i)
    for (std::size_t j = 0; j < b.size(); ++j) both[i + j] += a[i] * b[j];
  return both;
}

/// By first + last z^-1, without what is left over.
std::vector<double> quotient(const std::vector<double>& polynomial, double first, double last) {
  std::vector<double> result;
  for (std::size_t i = 0; i + 1 < polynomial.size(); ++i)
    result.push_back((polynomial[i] - (i == 0 ? 0.0 : last * result[i - 1])) / first);
  return result;
}

/// With or without biquads; a P is one whose ki is 0.
bool is_pi(const TunedController& c) { return c.gains && !c.position_gain && !c.derivative_gain; }
/// T = b R + (1 - b) R(1), which is a PI's set-point weight for any R: without b a number.
std::vector<double> weighted_reference(const std::vector<double>& r, double weight) {
  const double rest = (1.0 - weight) * std::accumulate(r.begin(), r.end(), 0.0);
  if (weight == 0.0) return {rest};
  std::vector<double> t;
  for (const double term : r) t.push_back(weight * term);
  t.front() += rest;
  return t;
}
/// From reference to torque.
design::FilteredPi weighted(const TunedController& c) {
  auto way = *c.gains;
  way.kp *= c.set_point_weight;
  return way;
}

/// The same states with another way of the reference into them.
struct ReferencePath {
  Eigen::VectorXd b;
  double d = 0.0;
};
ReferencePath reference_path(const Law& law, double sample_time_s) {
  const auto& what = law.what;
  if (is_pi(what)) {
    const auto states = design::states_of(weighted(what), sample_time_s);
    return {states.b, states.d};
  }
  if (!what.reference_numerator.empty()) {
    auto numerator = what.reference_numerator;
    numerator.resize(std::max(numerator.size(), what.feedback.numerator.size()));  // as many states
    const auto states =
        design::states_of(data::TransferFunction{numerator, what.feedback.denominator, sample_time_s});
    return {states.b, states.d};
  }
  return {law.linear.states().b, law.linear.states().d};
}

}  // namespace

Law law_of(const design::FilteredPi& controller, double sample_time_s) {
  Law law{design::LinearController(controller, sample_time_s)};
  law.what.structure = !controller.biquads.empty() ? "pi+biquads" : controller.ki > 0.0 ? "pi" : "p";
  law.what.name = words_of(controller);
  law.what.gains = controller;
  law.what.feedback = controller.transfer_function(sample_time_s);
  return law;
}

Law law_of(const design::Cascade& cascade, double sample_time_s) {
  Law law{design::linear_controller(cascade, sample_time_s)};
  law.what.structure = "cascade";
  law.what.name = "P over " + words_of(cascade.velocity);
  law.what.gains = cascade.velocity;
  law.what.position_gain = cascade.kv;
  // 1 + kv q = (1 + kv Ts - z^-1)/(1 - z^-1)
  const auto velocity = cascade.velocity.transfer_function(sample_time_s);
  law.what.feedback = {product(velocity.numerator, {1.0 + cascade.kv * sample_time_s, -1.0}),
                       product(velocity.denominator, {1.0, -1.0}), sample_time_s};
  return law;
}

Law law_of(const design::Pid& pid, double sample_time_s) {
  Law law = law_of(pid.transfer_function(sample_time_s));
  law.what.structure = "pid";
  law.what.name = "PID";
  law.what.gains = design::FilteredPi{pid.kp, pid.ki, {}};
  law.what.derivative_gain = pid.kd;
  law.what.derivative_time_s = pid.filter_s;
  return law;
}

Law law_of(const design::Rst& rst, double sample_time_s) {
  const auto feedback = rst.controller(sample_time_s);
  Law law{design::LinearController(feedback)};
  law.what.structure = "rst";
  law.what.name = "RST";
  law.what.feedback = feedback;
  set_weight(law, 0.0);
  return law;
}

Law law_of(const design::StateFeedback& feedback, double sample_time_s) {
  Law law{design::LinearController(feedback.controller, sample_time_s)};
  law.what.structure = "state-feedback";
  law.what.name = "State feedback";
  law.what.feedback = transfer_function_of(feedback.controller, sample_time_s);
  for (const auto& state : feedback.states)
    law.what.states.push_back({state.name, state.unit, state.gain, state.observer_gain});
  set_weight(law, 0.0);
  return law;
}

Law law_of(const data::TransferFunction& controller) {
  const auto &n = controller.numerator, &d = controller.denominator;
  constexpr double kSame = 1e-9;
  const bool is_pi = n.size() == 2 && d.size() == 2 && std::abs(d[1] / d[0] + 1.0) < kSame;
  if (is_pi) {  // kp + ki Ts/(1 - z^-1)
    const double kp = -n[1] / d[0], ki = (n[0] + n[1]) / d[0] / controller.sample_time_s;
    if (kp >= 0.0 && ki > 0.0) return law_of(design::FilteredPi{kp, ki, {}}, controller.sample_time_s);
  }
  if (n.size() == 1 && d.size() == 1 && n[0] / d[0] > 0.0)
    return law_of(design::FilteredPi{n[0] / d[0], 0.0, {}}, controller.sample_time_s);
  Law law{design::LinearController(controller)};
  law.what.name = "Controller";
  law.what.feedback = controller;
  return law;
}

std::optional<Law> law_of(const data::TransferFunction& controller, double position_gain) {
  const double step = controller.sample_time_s;
  const Law velocity =
      law_of(data::TransferFunction{quotient(controller.numerator, 1.0 + position_gain * step, -1.0),
                                    quotient(controller.denominator, 1.0, -1.0), step});
  if (!velocity.what.gains || !(velocity.what.gains->ki > 0.0)) return std::nullopt;
  return law_of(design::Cascade{*velocity.what.gains, position_gain}, step);
}

Law law_of(const TunedController& controller) {
  const double step = controller.feedback.sample_time_s;
  if (controller.position_gain && controller.gains)
    return law_of(design::Cascade{*controller.gains, *controller.position_gain}, step);
  if (is_pi(controller)) {
    Law law = law_of(*controller.gains, step);
    set_weight(law, controller.set_point_weight);
    return law;
  }
  Law law{design::LinearController(controller.feedback)};
  law.what.feedback = controller.feedback;
  law.what.reference_numerator = controller.reference_numerator;
  return law;
}

TunedFeedForward feed_forward_of(const fit::DriveModel& machine, double coulomb) {
  const auto& p = machine.parameters;
  TunedFeedForward f{p.driven_inertia, p.viscous_friction, coulomb,
                     std::max(0.0, machine.known_delay_s + machine.delay_s)};
  if (machine.structure != fit::Structure::rigid) {
    f.inertia += p.load_inertia;
    f.viscous += p.load_viscous_friction;
  }
  if (machine.structure == fit::Structure::three_mass) f.inertia += p.middle_inertia;
  f.viscous = std::max(0.0, f.viscous);
  return f;
}

bool integrates(const TunedController& controller) {
  if (!controller.gains) return data::has_pole_at_one(controller.feedback);
  return controller.position_gain || controller.gains->ki > 0.0;
}

void set_weight(Law& law, double weight) {
  auto& what = law.what;
  what.set_point_weight = weight;
  if (is_pi(what) && weight != 1.0)
    what.reference_numerator = weighted(what).transfer_function(what.feedback.sample_time_s).numerator;
  if (!what.gains) {
    what.reference_numerator = weighted_reference(what.feedback.numerator, weight);
    return;
  }
  if (!what.derivative_gain) return;
  const design::Pid way{weight * what.gains->kp, what.gains->ki, 0.0, *what.derivative_time_s};
  what.reference_numerator = way.transfer_function(what.feedback.sample_time_s).numerator;
}

void set_reference(Law& law, const std::vector<double>& numerator) {
  const bool is_p = law.what.structure == "p" && law.what.gains->kp > 0.0;
  if (is_p && numerator.size() == 1) return set_weight(law, numerator[0] / law.what.gains->kp);
  if (!is_p && is_pi(law.what) && law.what.gains->biquads.empty() && numerator.size() == 2 &&
      law.what.gains->kp > 0.0)
    return set_weight(law, -numerator[1] / law.what.gains->kp);
  law.what.gains.reset();  // b is no number of a filtered one that is given
  law.what.reference_numerator = numerator;
}

namespace {

Law with_reference_lag(Law law, double lag_s) {
  auto& what = law.what;
  const double pole = std::exp(-what.feedback.sample_time_s / lag_s);
  const std::array lag = {1.0, -pole};
  what.feedback.numerator = design::polynomial_product(what.feedback.numerator, lag);
  what.feedback.denominator = design::polynomial_product(what.feedback.denominator, lag);
  for (double& term : what.reference_numerator) term *= 1.0 - pole;
  what.name += fmt::format(", reference lag {:.3g} ms", 1e3 * lag_s);
  return law;
}

}  // namespace

void limit_reference_torque(Law& law, std::span<const design::Machine> machines, double most) {
  if (law.what.gains || law.what.reference_numerator.empty()) return;
  const auto is_kept = [&](const Law& any) {
    return std::ranges::all_of(machines, [&](const design::Machine& machine) {
      return reference_step_of(machine, any).peak_torque <= most;
    });
  };
  if (is_kept(law)) return;
  constexpr double kLongest = 4096.0;  // samples
  constexpr int kHalvings = 12;
  const double step = law.what.feedback.sample_time_s;
  double low = 0.1 * step, high = step;
  while (high <= kLongest * step && !is_kept(with_reference_lag(law, high))) {
    low = high;
    high *= 2.0;
  }
  if (high > kLongest * step) return;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = std::sqrt(low * high);
    (is_kept(with_reference_lag(law, middle)) ? high : low) = middle;
  }
  law = with_reference_lag(std::move(law), high);
}

ReferenceStep reference_step_of(const design::Machine& machine, const Law& law) {
  const design::ClosedLoop loop = loop_of(machine, law);
  const double radius = loop.spectral_radius();
  constexpr std::size_t kMost = 20'000;
  const auto samples = std::min(kMost, design::most_samples(radius));
  ReferenceStep found;
  Eigen::VectorXd x = Eigen::VectorXd::Zero(loop.a.rows());
  for (std::size_t k = 0; k < samples; ++k) {
    found.overshoot = std::max(found.overshoot, (loop.load * x).value() - 1.0);
    found.peak_torque =
        std::max(found.peak_torque, std::abs((loop.torque * x).value() + loop.torque_by_reference));
    x = (loop.a * x + loop.reference).eval();
  }
  return found;
}

double largest_weight(const design::Machine& machine, const Law& law, const TuneOptions& options,
                      double most) {
  // The limit is 2 % unless told, as is the band in which a load has settled: one that peaks at its edge
  // would have settled before the peak on one machine, after it on the next.
  constexpr double kAim = 0.9;
  const auto is_too_much = [&](double weight) {
    Law weighted = law;
    set_weight(weighted, weight);
    const auto f = reference_step_of(machine, weighted);
    return f.overshoot > kAim * options.overshoot ||
           (options.torque_limit && f.peak_torque * options.reference_step > *options.torque_limit);
  };
  if (!is_too_much(most)) return most;
  double low = 0.0, high = most;
  constexpr int kHalvings = 20;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = 0.5 * (low + high);
    (is_too_much(middle) ? high : low) = middle;
  }
  return low;
}

design::ClosedLoop loop_of(const design::Machine& machine, const Law& law) {
  // States of one form whatever goes into them; those of an observer are of another.
  const auto states = law.what.reference_numerator.empty() || is_pi(law.what)
                          ? law.linear.states()
                          : design::states_of(law.what.feedback);
  design::ClosedLoop loop = design::closed_loop(machine.states(), states);
  const auto path = reference_path(law, machine.sample_time_s());
  loop.reference << path.d * machine.states().command, path.b;
  loop.torque_by_reference = path.d;
  return loop;
}

StepResponses step_responses(const design::Machine& machine, const Law& law, std::size_t samples) {
  const design::ClosedLoop loop = loop_of(machine, law);
  const double step = machine.sample_time_s();
  StepResponses found;
  Eigen::VectorXd x = Eigen::VectorXd::Zero(loop.a.rows()), by_torque = x;
  const auto kv = law.what.position_gain;
  double position_sum = 0.0, load_position = 0.0, load_position_by_torque = 0.0;
  for (std::size_t k = 0; k < samples; ++k) {
    // A cascade takes its position as one more way into C: r' + kv sum(Ts r') = kv r.
    const double reference = kv ? *kv * (1.0 - position_sum) / (1.0 + *kv * step) : 1.0;
    position_sum += step * reference;
    const double load = loop.load * x, load_by_torque = loop.load * by_torque;
    load_position += step * load;
    load_position_by_torque += step * load_by_torque;
    found.load_by_reference.push_back(kv ? load_position : load);
    found.load_by_torque.push_back(kv ? load_position_by_torque : load_by_torque);
    found.torque_by_reference.push_back(loop.torque * x + loop.torque_by_reference * reference);
    x = (loop.a * x + loop.reference * reference).eval();
    by_torque = (loop.a * by_torque - loop.load_torque).eval();
  }
  return found;
}

}  // namespace resonid::identification
