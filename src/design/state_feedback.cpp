// SPDX-License-Identifier: MIT
#include "design/state_feedback.hpp"

#include <fmt/format.h>

#include <cmath>
#include <resonid/base/constants.hpp>
#include <resonid/fit/detail/sampled_states.hpp>
#include <utility>
#include <vector>

#include "design/rational_response.hpp"
#include "design/structure_search.hpp"
#include "linalg/decompositions.hpp"
#include "linalg/riccati.hpp"

namespace resonid::design {
namespace {

/// Without the states that nothing follows from: a torque loop without lag, a delay of whole samples.
std::vector<Eigen::Index> busy_states(const fit::SampledStates& all) {
  std::vector<Eigen::Index> kept;
  for (Eigen::Index i = 0; i < all.a.cols(); ++i)
    if (!all.a.col(i).isZero(0.0) || all.measured(i) != 0.0 || all.load(i) != 0.0) kept.push_back(i);
  return kept;
}
fit::SampledStates only(const fit::SampledStates& all, const std::vector<Eigen::Index>& kept) {
  return {all.a(kept, kept),  all.command(kept), all.load_torque(kept),
          all.measured(kept), all.load(kept),    all.sample_time_s};
}

/// A spring's frequency between two inertias, by which the states scale its twist.
double swing_of(double stiffness, double near, double far) {
  return std::sqrt(stiffness * (1.0 / near + 1.0 / far));
}

/// Driven less load angle by the states.
Eigen::RowVectorXd twist_row(const fit::DriveModel& model, Eigen::Index states) {
  Eigen::RowVectorXd row = Eigen::RowVectorXd::Zero(states);
  const auto& p = model.parameters;
  if (model.structure == fit::Structure::two_mass) {
    row(2) = 1.0 / swing_of(p.stiffness, p.driven_inertia, p.load_inertia);
  } else if (model.structure == fit::Structure::three_mass) {
    row(3) = 1.0 / swing_of(p.stiffness, p.driven_inertia, p.middle_inertia);
    row(4) = 1.0 / swing_of(p.stiffness_2, p.middle_inertia, p.load_inertia);
  }
  return row;
}

/// Name and unit of a state of fit::SampledStates; gains are put in later.
FeedbackState described_state(const fit::DriveModel& model, const fit::SampledStates& all, Eigen::Index i) {
  const bool has_two = model.structure == fit::Structure::two_mass,
             has_three = model.structure == fit::Structure::three_mass;
  const Eigen::Index masses = has_three ? 3 : has_two ? 2 : 1;
  if (i < masses) {
    const char* of = i == 0 ? "the driven side" : i + 1 == masses ? "the load" : "the middle mass";
    return {fmt::format("velocity of {}", of), "rad/s"};
  }
  if (i < 2 * masses - 1) {
    const char* of = has_two ? "the coupling" : i == masses ? "the first coupling" : "the second coupling";
    return {fmt::format("twist of {}", of), "rad"};
  }
  if (i < all.motion) return {"place of the driven side", "rad"};
  if (i == all.motion) return {"torque behind its lag", "Nm"};
  if (i == all.motion + 1) return {"torque of the sample before", "Nm"};
  if (i == all.motion + 2) return {"load torque of the sample before", "Nm"};
  const Eigen::Index samples = all.a.cols() - 1 - i;
  if (samples == 0) return {"velocity that is measured now", "rad/s"};
  return {fmt::format("velocity that is measured {} sample{} later", samples, samples == 1 ? "" : "s"),
          "rad/s"};
}

std::optional<Eigen::RowVectorXd> feedback_gain(const fit::DriveModel& model, const fit::SampledStates& drive,
                                                const StateWeights& w) {
  const Eigen::Index n = drive.a.rows();
  const Eigen::RowVectorXd twist = twist_row(model, n);
  Eigen::MatrixXd q =
      w.load_speed * drive.load.transpose() * drive.load + w.twist * twist.transpose() * twist;
  q(0, 0) += w.motor_speed;
  const Eigen::MatrixXd r = Eigen::MatrixXd::Constant(1, 1, w.torque);
  const auto x = linalg::solve_riccati(drive.a, drive.command, q, r);
  if (!x) return std::nullopt;
  const Eigen::RowVectorXd bx = drive.command.transpose() * *x;
  return Eigen::RowVectorXd(bx * drive.a / (w.torque + bx * drive.command));
}

/// State and torque that a load torque of 1 Nm leaves when the measured velocity has come to rest.
std::optional<std::pair<Eigen::VectorXd, double>> at_rest(const fit::SampledStates& drive) {
  const Eigen::Index n = drive.a.rows();
  Eigen::MatrixXd system = Eigen::MatrixXd::Zero(n + 1, n + 1);
  system.topLeftCorner(n, n) = drive.a - Eigen::MatrixXd::Identity(n, n);
  system.topRightCorner(n, 1) = drive.command;
  system.bottomLeftCorner(1, n) = drive.measured;
  Eigen::VectorXd right = Eigen::VectorXd::Zero(n + 1);
  right.head(n) = -drive.load_torque;
  const Eigen::VectorXd rest = linalg::RealLu(system).solve(right);
  if (!rest.allFinite()) return std::nullopt;
  return std::pair(Eigen::VectorXd(rest.head(n)), rest(n));
}

/// What weights are measured in, so that a search fits machines of any size: squares of the torque per speed
/// with which a loop reaches the anti-resonance, and of the stiffness.
struct Scales {
  double speed = 1.0, twist = 1.0;
};
Scales scales_of(const fit::DriveModel& model) {
  const auto& p = model.parameters;
  const auto modes = model.modes();
  double inertia = p.driven_inertia;
  if (model.structure != fit::Structure::rigid) inertia += p.load_inertia;
  if (model.structure == fit::Structure::three_mass) inertia += p.middle_inertia;
  const double reached_hz = modes.empty() ? 0.05 / model.sample_time_s : modes.front().frequency_hz.value;
  const double per_speed = inertia * kTwoPi * reached_hz;
  return {per_speed * per_speed, p.stiffness > 0.0 ? p.stiffness * p.stiffness : 1.0};
}

/// The controller's values as a ratio of polynomials in z - 1, by Leverrier's and Faddeev's recursion, as
/// RationalResponse: what a search asks for again and again.
LinearController::Response quick_response(const ControllerStates& s, double sample_time_s) {
  const Eigen::Index n = s.a.rows();
  const Eigen::MatrixXd a = s.a - Eigen::MatrixXd::Identity(n, n);
  Eigen::MatrixXd m = Eigen::MatrixXd::Identity(n, n);
  std::vector<double> denominator(static_cast<std::size_t>(n) + 1, 1.0), numerator = denominator;
  for (Eigen::Index k = 1; k <= n; ++k) {
    const auto power = static_cast<std::size_t>(n - k);
    numerator[power] = s.c * m * s.b;
    m = (a * m).eval();
    denominator[power] = -m.trace() / static_cast<double>(k);
    m.diagonal().array() += denominator[power];
  }
  numerator.back() = 0.0;
  for (std::size_t k = 0; k < numerator.size(); ++k) numerator[k] += s.d * denominator[k];
  return [=](std::span<const double> frequencies_hz) {
    std::vector<std::complex<double>> values;
    values.reserve(frequencies_hz.size());
    for (const double f : frequencies_hz) {
      const auto step = std::polar(1.0, kTwoPi * f * sample_time_s) - 1.0;
      std::complex<double> upper = numerator.back(), lower = denominator.back();
      for (std::size_t k = numerator.size() - 1; k-- > 0;) {
        upper = plain_product(upper, step) + numerator[k];
        lower = plain_product(lower, step) + denominator[k];
      }
      values.push_back(upper / lower);
    }
    return values;
  };
}

}  // namespace

std::optional<StateFeedback> state_feedback(const fit::DriveModel& model, const StateWeights& weights) {
  const auto all = fit::sampled_states(model);
  const auto kept = busy_states(all);
  const auto drive = only(all, kept);
  const Eigen::Index n = drive.a.rows();
  const auto gain = feedback_gain(model, drive, weights);
  const auto rest = at_rest(drive);
  if (!gain || !rest) return std::nullopt;

  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(n + 1, n + 1);
  a.topLeftCorner(n, n) = drive.a;
  a.topRightCorner(n, 1) = drive.load_torque;
  a(n, n) = 1.0;
  Eigen::VectorXd command = Eigen::VectorXd::Zero(n + 1);
  command.head(n) = drive.command;
  Eigen::RowVectorXd measured = Eigen::RowVectorXd::Zero(n + 1);
  measured.head(n) = drive.measured;
  Eigen::MatrixXd noise = weights.torque_noise * command * command.transpose();
  noise(n, n) += weights.load_torque_walk;
  const auto covariance = linalg::solve_riccati(a.transpose(), measured.transpose(), noise,
                                                Eigen::MatrixXd::Constant(1, 1, weights.measurement_noise));
  if (!covariance) return std::nullopt;

  StateFeedback s;
  s.gain.resize(n + 1);
  s.gain << *gain, -rest->second - *gain * rest->first;
  s.load_speed.setZero(n + 1);
  s.load_speed.head(n) = drive.load;
  s.twist.setZero(n + 1);
  s.twist.head(n) = twist_row(model, n);
  const Eigen::VectorXd seen = *covariance * measured.transpose();
  s.observer_gain = seen / (weights.measurement_noise + measured * seen);
  const Eigen::MatrixXd unseen = Eigen::MatrixXd::Identity(n + 1, n + 1) - s.observer_gain * measured;
  const Eigen::MatrixXd driven = a - command * s.gain;
  s.controller = {driven * unseen, -driven * s.observer_gain, -s.gain * unseen, s.gain * s.observer_gain};
  for (Eigen::Index i = 0; i <= n; ++i) {
    FeedbackState state = i < n ? described_state(model, all, kept[static_cast<std::size_t>(i)])
                                : FeedbackState{"load torque", "Nm"};
    const double scale = s.twist(i) != 0.0 ? s.twist(i) : 1.0;  // rad per unit of the state
    state.gain = s.gain(i) / scale;
    state.observer_gain = s.observer_gain(i) * scale;
    s.states.push_back(std::move(state));
  }
  return s;
}

std::optional<StateFeedbackDesign> search_state_feedback(Machines& machines, const Bounds& bounds,
                                                         const GlobalSearch::Effort& effort,
                                                         const GlobalSearch::Point& from) {
  const fit::DriveModel& model = machines.all.front().model();
  const Scales scales = scales_of(model);
  const auto weights_of = [&](const GlobalSearch::Point& x) {
    StateWeights w;
    w.load_speed = scales.speed * std::exp(x[0]);
    w.twist = scales.twist * std::exp(x[1]);
    w.motor_speed = scales.speed * std::exp(x[2]);
    w.load_torque_walk = scales.speed * std::exp(x[3]);
    w.torque_noise = scales.speed * std::exp(x[4]);
    return w;
  };
  const MakeController make = [&](const GlobalSearch::Point& x) -> std::optional<LinearController> {
    const auto s = state_feedback(model, weights_of(x));
    if (!s) return std::nullopt;
    return LinearController(s->controller, quick_response(s->controller, model.sample_time_s));
  };
  const auto range = [](double low, double high) {
    return GlobalSearch::Range{std::log(low), std::log(high)};
  };
  // Soft and stiff, by the twist and by the speeds: there are several minima.
  std::vector<GlobalSearch::Point> starts = {{0.1, 5.0, 0.05, 0.01, 0.1},
                                             {50.0, 1.0, 3.0, 2e-3, 0.4},
                                             {100.0, 1e-6, 10.0, 1e-4, 0.1},
                                             {1e3, 1e-5, 50.0, 2e-3, 0.01}};
  for (auto& start : starts)
    for (double& x : start) x = std::log(x);
  const auto found = search_structure(
      machines, bounds, make,
      {range(1e-4, 1e5), range(1e-8, 1e4), range(1e-4, 1e4), range(1e-6, 1e2), range(1e-5, 1e4)}, effort,
      starts, from);
  if (!found) return std::nullopt;
  const StateWeights weights = weights_of(found->point);
  return StateFeedbackDesign{weights, *state_feedback(model, weights), found->iae, found->exceeded,
                             found->point};
}

}  // namespace resonid::design
