// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <fit/drive/output_error_fitter.hpp>
#include <resonid/base/detail/statistics.hpp>
#include <resonid/fit/detail/controller_estimate.hpp>
#include <resonid/fit/detail/projected_input.hpp>
#include <resonid/fit/output_error.hpp>

#include "linalg/decompositions.hpp"

namespace resonid::fit {
namespace {

using detail::DriveSignals;

/// Direction of the measured motion, from centred differences where the output is a position.
std::vector<double> direction_of(const data::Record& record) {
  const auto& y = record.output.samples;
  const std::size_t n = y.size();
  std::vector<double> direction(n, 0.0);
  for (std::size_t k = 0; k < n; ++k) {
    double v = y[k];
    if (record.output_quantity == data::OutputQuantity::position)
      v = y[std::min(k + 1, n - 1)] - y[k == 0 ? 0 : k - 1];
    direction[k] = v > 0.0 ? 1.0 : (v < 0.0 ? -1.0 : 0.0);
  }
  return direction;
}

/// Whether both directions take part of the record, in more than one sample out of a hundred.
bool reverses(std::span<const double> direction) {
  const auto count = [&](double sign) {
    return std::count_if(direction.begin(), direction.end(), [&](double d) { return d * sign > 0.5; });
  };
  constexpr std::ptrdiff_t kPart = 100;
  return std::min(count(1.0), count(-1.0)) * kPart > static_cast<std::ptrdiff_t>(direction.size());
}

/// What of a record drives the simulation.
expected<DriveSignals, Error> signals_of(const data::Record& record, const OutputErrorConfig& config) {
  DriveSignals s;
  const std::size_t n = record.samples();
  s.output = record.output.samples;
  if (config.predictor == Predictor::joint) {
    auto input = projected_input(record);
    if (!input) return unexpected(input.error());
    s.input = std::move(*input);
  } else if (config.predictor == Predictor::closed_loop) {
    s.input = record.excitation.present() ? record.excitation.samples : std::vector<double>(n, 0.0);
    s.reference =
        record.reference.present() ? record.reference.samples : std::vector<double>(n, mean(s.output));
  } else {
    s.input = record.input.samples;
  }
  return s;
}

expected<void, Error> check(const data::Record& record, const OutputErrorConfig& config) {
  if (record.samples() < 50)
    return refuse("record", "needs at least 50 samples", static_cast<double>(record.samples()));
  if (record.input.samples.size() != record.samples())
    return refuse("record", "needs an input of the output's length");
  if (!(config.known_delay_s >= 0.0)) return refuse("known_delay_s", "must be >= 0", config.known_delay_s);
  if (config.known_delay_s > 0.25 * record.duration_s())
    return refuse("known_delay_s", "must be a small part of the recording", config.known_delay_s);
  if ((config.delay || config.fixed_model) &&
      config.known_delay_s + config.initial.delay_s > detail::kDelayedPart * record.duration_s())
    return refuse("initial", "must have a delay that leaves half of the recording", config.initial.delay_s);
  for (int i = 0; i < kParameterCount; ++i) {
    const double value = config.initial.value(static_cast<Parameter>(i));
    if (has_parameter(config.initial.structure, i) && !(value > 0.0 && std::isfinite(value)))
      return refuse("initial", "must have positive inertias, stiffnesses and dampings");
  }
  for (const auto& torque : config.friction_torque)
    if (config.coulomb_friction && !torque.empty())
      return refuse("friction_torque", "is known or coulomb_friction estimated, not both");
  const auto& further = config.further_friction;
  if (further.load_coulomb && config.initial.structure == Structure::rigid)
    return refuse("further_friction", "of a load needs one: a structure with two masses or more");
  if (further.breakaway.has_value() != further.stribeck_velocity.has_value())
    return refuse("further_friction", "needs breakaway and Stribeck velocity together");
  if (further.any() && config.coulomb_friction != config.coulomb_start.has_value())
    return refuse("coulomb_start", "is needed with more of dry friction, unless that is the load's alone");
  if (!config.coulomb_friction && further.breakaway)
    return refuse("further_friction", "of the driven side needs coulomb_friction");
  if ((config.coulomb_friction || further.any()) &&
      record.output_quantity == data::OutputQuantity::acceleration)
    return refuse("coulomb_friction", "needs a velocity or a position, whose direction can be told");
  if (further.any() && !config.friction_torque.empty())
    return refuse("friction_torque", "is known or further_friction estimated, not both");
  if (config.at_load && (config.coulomb_friction || further.any() || !config.friction_torque.empty() ||
                         !config.load_friction_torque.empty() || config.predictor != Predictor::open_loop ||
                         config.initial.velocity == Velocity::differences))
    return refuse("at_load", "needs the open-loop predictor, sampled velocities and no dry friction");
  if (config.predictor != Predictor::closed_loop) return {};
  if (!config.controller || config.controller->numerator.empty() || config.controller->denominator.empty() ||
      config.controller->denominator.front() == 0.0)
    return refuse("controller", "is needed for the closed loop");
  const auto coefficients = static_cast<Eigen::Index>(config.controller->numerator.size() +
                                                      config.controller->denominator.size() - 1);
  const auto& doubt = config.controller_covariance;
  if (doubt.size() != 0 && (doubt.rows() != coefficients || doubt.cols() != coefficients))
    return refuse("controller_covariance", "must be of the controller's coefficients");
  constexpr std::size_t kHighest = 11;
  if (std::max(config.controller->numerator.size(), config.controller->denominator.size()) > kHighest)
    return refuse("controller", "must be of order 10 at most");
  if (record.output_quantity != data::OutputQuantity::velocity)
    return refuse("predictor", "closed loop needs a velocity, which is what the controller sees");
  for (const auto* channel : {&record.excitation, &record.reference})
    if (channel->present() && channel->samples.size() != record.samples())
      return refuse("record", "needs excitation and reference of the output's length");
  if (!record.excitation.present() && !record.reference.present())
    return refuse("record", "needs an excitation or a reference for the closed loop");
  return {};
}

/// The joint approach by the controller that the record shows, with or without noise on the input; by the
/// projected input where it shows none.
OutputErrorConfig with_controller(const data::Record& record, const OutputErrorConfig& asked) {
  OutputErrorConfig config = asked;
  if (config.predictor != Predictor::joint || record.output_quantity != data::OutputQuantity::velocity)
    return config;
  auto shown = estimate_controller(record);
  if (!shown) return config;
  config.predictor = Predictor::closed_loop;
  config.controller = std::move(shown->controller);
  if (shown->model) config.controller_covariance = shown->model->covariance;
  return config;
}

expected<JointOutputErrorFit, Error> solve(std::span<const data::Record> records,
                                           const OutputErrorConfig& asked) {
  const OutputErrorConfig config = with_controller(records.front(), asked);
  if (!config.noise_start.empty() && config.noise_start.size() != records.size())
    return refuse("noise_start", "needs a noise model of every recording");
  std::vector<detail::RecordPart> parts;
  bool both_ways = false;
  for (const auto& record : records) {
    if (const auto ok = check(record, config); !ok) return unexpected(ok.error());
    auto signals = signals_of(record, config);
    if (!signals) return unexpected(signals.error());
    if (!config.holdout.empty()) signals->unused.assign(record.samples(), false);
    for (const auto& [from, to] : config.holdout)
      for (std::size_t k = from; k < std::min(to, record.samples()); ++k) signals->unused[k] = true;
    const auto hold = data::output_hold(record.output.samples);
    const auto stale = hold.stale(record.samples());
    if (signals->unused.empty()) signals->unused = stale;
    for (std::size_t k = 0; k < stale.size(); ++k)
      if (stale[k]) signals->unused[k] = true;
    const auto& filled = record.sampling.filled;  // what was interpolated says nothing
    if (!filled.empty() && signals->unused.empty()) signals->unused.assign(record.samples(), false);
    for (const std::size_t k : filled)
      if (k < record.samples()) signals->unused[k] = true;
    parts.push_back({&record, std::move(*signals), hold});
    if ((config.coulomb_friction || config.further_friction.any()) && !both_ways)
      both_ways = reverses(direction_of(record));
  }
  for (std::size_t r = 0; r < config.friction_torque.size() && r < parts.size(); ++r)
    detail::take_friction(config.friction_torque[r], parts[r].raw);
  for (std::size_t r = 0; r < config.load_friction_torque.size() && r < parts.size(); ++r)
    detail::take_load_friction(config.load_friction_torque[r], parts[r].raw);
  if (both_ways)
    for (auto& p : parts) {
      p.raw.direction = direction_of(*p.record);
      p.raw.stuck.assign(p.raw.direction.size(), 0.0);
    }
  return detail::fit_drive(std::move(parts), config);
}

/// (own - common)' P^-1 (own - common), positive parameters as logarithms.
double squared_distance(const DriveModel& own, const DriveModel& common) {
  std::vector<int> active;
  for (int i = 0; i < kParameterCount; ++i)
    if (own.estimated[static_cast<std::size_t>(i)]) active.push_back(i);
  const auto n = static_cast<Eigen::Index>(active.size());
  Eigen::VectorXd apart(n), scale(n);
  Eigen::MatrixXd covariance(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto p = static_cast<Parameter>(active[static_cast<std::size_t>(i)]);
    const bool positive = has_parameter(own.structure, p);
    scale(i) = positive ? 1.0 / own.value(p) : 1.0;
    apart(i) = positive ? std::log(own.value(p) / common.value(p)) : own.value(p) - common.value(p);
    for (Eigen::Index j = 0; j < n; ++j)
      covariance(i, j) = own.covariance(p, active[static_cast<std::size_t>(j)]);
  }
  covariance = (scale.asDiagonal() * covariance * scale.asDiagonal()).eval();
  const Eigen::VectorXd size = covariance.diagonal().cwiseSqrt();
  const Eigen::VectorXd inverse = size.cwiseInverse();
  const Eigen::MatrixXd correlation = inverse.asDiagonal() * covariance * inverse.asDiagonal();
  const Eigen::VectorXd whitened = inverse.asDiagonal() * apart;
  return whitened.dot(linalg::RealLdlt(correlation).solve(whitened));
}

/// Each record's own fit, from the common one, and how far they are from it.
void compare(std::span<const data::Record> records, const OutputErrorConfig& config,
             JointOutputErrorFit& joint) {
  OutputErrorConfig alone = config;
  alone.initial = joint.model;
  Consistency test;
  for (const auto& record : records) {
    auto own = solve(std::span(&record, 1), alone);
    if (!own || !own->converged) {
      joint.own.clear();
      return;
    }
    test.chi_square += squared_distance(own->model, joint.model);
    joint.own.push_back(std::move(own->model));
  }
  const auto& estimated = joint.model.estimated;
  test.degrees = static_cast<int>(records.size() - 1) *
                 static_cast<int>(std::count(estimated.begin(), estimated.end(), true));
  test.probability = chi_square_tail(test.chi_square, static_cast<std::size_t>(test.degrees));
  joint.consistency = test;
}

}  // namespace

expected<OutputErrorFit, Error> fit_output_error(const data::Record& record,
                                                 const OutputErrorConfig& config) {
  auto solution = solve(std::span(&record, 1), config);
  if (!solution) return unexpected(solution.error());
  return std::move(solution->records.front());
}

expected<JointOutputErrorFit, Error> fit_output_error(std::span<const data::Record> records,
                                                      const OutputErrorConfig& config) {
  if (records.empty()) return refuse("records", "needs at least one");
  for (const auto& record : records) {
    if (std::abs(record.sample_rate_hz - records[0].sample_rate_hz) > 1e-9 * records[0].sample_rate_hz)
      return refuse("records", "must have the same sample rate", record.sample_rate_hz);
    if (record.output_quantity != records[0].output_quantity)
      return refuse("records", "must all measure velocity, position or acceleration");
  }
  auto joint = solve(records, config);
  if (joint && records.size() > 1 && config.consistency && !config.fixed_model)
    compare(records, config, *joint);
  return joint;
}

}  // namespace resonid::fit
