// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <identification/criteria.hpp>
#include <identification/identify/judge/constancy.hpp>
#include <identification/identify/select/drive_candidate.hpp>
#include <identification/identify/select/motion_model.hpp>
#include <resonid/base/detail/statistics.hpp>
#include <resonid/fit/detail/order_selection.hpp>
#include <resonid/fit/output_error.hpp>

namespace resonid::identification::detail {
namespace {

using fit::InverseDynamics;
using fit::Structure;

/// Velocity, and the input less dry friction and offset: what a drive without them would have moved by.
data::Record without_friction(const data::Record& record, const InverseDynamics& motion,
                              const std::vector<double>& friction) {
  data::Record net = record;
  net.input.samples.resize(friction.size());
  net.output.samples.resize(friction.size());
  for (std::size_t k = 0; k < friction.size(); ++k) net.input.samples[k] += motion.offset.value - friction[k];
  auto& y = net.output.samples;
  if (record.output_quantity == data::OutputQuantity::position) {
    for (std::size_t k = y.size() - 1; k > 0; --k) y[k] = (y[k] - y[k - 1]) * record.sample_rate_hz;
    y[0] = y[1];
    net.output_quantity = data::OutputQuantity::velocity;
  }
  net.excitation = net.reference = net.position = {};
  constexpr std::size_t kEnough = 10'000;  // a motion shows a resonance at once or not at all
  return data::part_of(net, 0, std::min(kEnough, net.samples()));
}

class MotionModel {
 public:
  MotionModel(const Experiment& experiment, const Options& options, const data::FrequencyResponse& response)
      : record_(experiment.record),
        motion_(*experiment.motion),
        options_(options),
        response_(response),
        net_(without_friction(record_, motion_, motion_.friction_torque)) {}

  std::optional<Selection> run() const {
    if (options_.model == ModelChoice::three_mass) return std::nullopt;
    Selection s;
    s.in_motion = true;
    s.result.coulomb_friction = motion_.coulomb_friction;
    s.result.offset = motion_.offset;
    s.result.from_record = true;
    s.result.drive = rigid();
    auto two = two_masses();
    if (!two && options_.model == ModelChoice::two_mass) return std::nullopt;
    const auto& estimated = two ? two->model.estimated : s.result.drive.estimated;
    const Variant variant{two ? Structure::two_mass : Structure::rigid, options_.friction != Friction::dry,
                          estimated[fit::kDelay], true};
    s.choice = {"structure", name_of(variant), ""};
    s.choice.because =
        options_.model != ModelChoice::automatic ? "as specified"
        : two ? "less its friction, the recording shows two masses: they predict the hold-out samples better"
              : fmt::format("inverse dynamics below {:.3g} Hz explain {:.5g} % of the torque",
                            motion_.bandwidth_hz, 100.0 * motion_.explained);
    if (two) {
      s.result.drive = two->model;
      s.inconstant = inconstant(std::move(two->constancy));
    }
    s.structures.emplace_back();
    s.structures.front().name = name_of(variant);
    s.structures.front().chosen = true;
    const auto& mask = s.result.drive.estimated;
    s.structures.front().parameters = static_cast<std::size_t>(std::count(mask.begin(), mask.end(), true));
    s.fit_percent = two ? two->fit_percent : fit_percent_of(1.0 - motion_.explained, 1.0);
    s.fit_percents = {s.fit_percent};
    if (two) {
      s.residual = std::move(two->residual);
      s.residual_start = two->first_sample;
    }
    s.result.model_error = difference(s.result.drive, thinned(response_)).unexplained;
    return s;
  }

 private:
  /// Half a sample of a velocity made of positions.
  [[nodiscard]] double known_delay_s() const {
    const bool position = record_.output_quantity == data::OutputQuantity::position;
    return options_.delay_s + (position ? 0.5 * record_.sample_time_s() : 0.0);
  }

  /// Whether the motion tells a further delay: of more than its error bar and a twentieth of a sample.
  [[nodiscard]] bool later() const {
    const auto& delay = motion_.further_delay_s;
    constexpr double kSmall = 0.05;
    return std::abs(delay.value) > std::max(4.0 * delay.std, kSmall * record_.sample_time_s());
  }

  [[nodiscard]] fit::DriveModel rigid() const {
    fit::DriveModel model;
    model.structure = Structure::rigid;
    model.sample_time_s = record_.sample_time_s();
    model.known_delay_s = options_.delay_s;
    model.parameters.driven_inertia = motion_.inertia.value;
    const bool viscous = options_.friction != Friction::dry;
    if (viscous) model.parameters.viscous_friction = motion_.viscous_friction.value;
    if (later()) model.delay_s = motion_.further_delay_s.value;
    model.estimated = fit::estimated_parameters(Structure::rigid, viscous, later());
    const std::array<std::pair<int, int>, 3> places = {{{fit::kDrivenInertia, fit::kInertiaTerm},
                                                        {fit::kViscousFriction, fit::kViscousTerm},
                                                        {fit::kDelay, fit::kDelayTerm}}};
    for (const auto& [i, a] : places)
      for (const auto& [j, b] : places)
        if (model.estimated[static_cast<std::size_t>(i)] && model.estimated[static_cast<std::size_t>(j)])
          model.covariance(i, j) = motion_.covariance(a, b);
    return model;
  }

  [[nodiscard]] fit::OutputErrorConfig config_of(const fit::DriveModel& start, bool delay) const {
    fit::OutputErrorConfig config;
    config.initial = start;
    config.viscous_friction = options_.friction != Friction::dry;
    config.known_delay_s = known_delay_s();
    config.delay = delay;
    return config;
  }

  [[nodiscard]] std::optional<fit::OutputErrorFit> simulate(const fit::DriveModel& model, bool delay) const {
    auto fit = fit::fit_output_error(net_, config_of(model, delay));
    if (!fit || !fit->converged) return std::nullopt;
    return std::move(*fit);
  }

  [[nodiscard]] std::optional<double> holdout_score(const fit::DriveModel& model) const {
    if (net_.samples() < kCriteria.holdout_samples) return std::nullopt;
    auto config = config_of(model, model.estimated[fit::kDelay]);
    config.holdout = fit::holdout_parts(net_.samples());
    const auto fit = fit::fit_output_error(net_, config);
    if (!fit || !fit->converged || !fit->holdout) return std::nullopt;
    return fit->holdout->score;
  }

  [[nodiscard]] bool of_this_machine(const fit::DriveModel& model) const {
    const double total = model.parameters.driven_inertia + model.parameters.load_inertia;
    constexpr double kAlike = 0.01, kDeviations = 4.0;
    return std::abs(total / motion_.inertia.value - 1.0) <
           kAlike + kDeviations * motion_.inertia.std / motion_.inertia.value;
  }

  [[nodiscard]] std::optional<fit::OutputErrorFit> two_masses() const {
    const bool asked = options_.model == ModelChoice::two_mass;
    if (options_.model == ModelChoice::rigid || (motion_.rigid && !asked)) return std::nullopt;
    std::optional<fit::OutputErrorFit> best;
    // What inverse dynamics take for a delay may be the coupling's.
    for (const bool delay : {false, true}) {
      if (delay && !later()) continue;
      const double further = delay ? motion_.further_delay_s.value : 0.0;
      for (auto start : fit::initial_models(net_, std::max(0.0, known_delay_s() + further))) {
        start.delay_s = further;
        auto fit = simulate(start, delay);
        if (fit && (!best || fit->bic < best->bic)) best = std::move(fit);
      }
    }
    if (!best || !of_this_machine(best->model)) return std::nullopt;
    const auto parts = inconstant(best->constancy);
    widen(parts, best->model);
    if (asked) return best;
    // Two masses that parts of the record see differently say less than the inertia in all does.
    for (const bool over_frequency : {false, true}) {
      const auto found = inspect_constancy(parts, best->model, over_frequency);
      if (found && found->severity == diagnostics::Severity::error) return std::nullopt;
    }
    const auto resonance = best->model.resonance();
    if (resonance.std > kCriteria.known_resonance * resonance.value ||
        !(resonance.value < 0.5 * record_.sample_rate_hz))
      return std::nullopt;
    const auto one = simulate(rigid(), later());
    if (!one || best->bic + kCriteria.clearly_better > one->bic) return std::nullopt;
    const auto alone = holdout_score(one->model), together = holdout_score(best->model);
    if (!alone || !together || !(*alone - *together > kCriteria.holdout_clear)) return std::nullopt;
    return best;
  }

  const data::Record& record_;
  const InverseDynamics& motion_;
  const Options& options_;
  const data::FrequencyResponse& response_;
  const data::Record net_;
};

}  // namespace

std::optional<diagnostics::Finding> inspect_against_motion(const data::Record& record, const Options& options,
                                                           const ModelResult& model) {
  if (record.output_quantity == data::OutputQuantity::acceleration) return std::nullopt;
  // A spring to the ground takes torque that inverse dynamics have no place for.
  if (model.drive.grounded()) return std::nullopt;
  fit::InverseDynamicsConfig config;
  config.known_delay_s = options.delay_s;
  const auto motion = fit::fit_inverse_dynamics(record, config);
  if (!motion || !(motion->explained > kCriteria.motion_share) || !motion->coulomb_friction)
    return std::nullopt;
  const auto& dry = *motion->coulomb_friction;
  if (!(dry.value > kCriteria.dry_friction_found * dry.std)) return std::nullopt;
  const auto total = [](const fit::DriveModel& m) {
    double sum = 0.0;
    for (const auto p : {fit::kDrivenInertia, fit::kMiddleInertia, fit::kLoadInertia})
      if (fit::has_parameter(m.structure, p)) sum += m.value(p);
    return sum;
  };
  const double own = total(model.drive), own_std = model.drive.standard_deviation_of(total);
  const double apart = std::abs(own - motion->inertia.value);
  const double off = apart / motion->inertia.value;
  if (!(apart > kCriteria.contradicted_deviations * std::hypot(own_std, motion->inertia.std)) ||
      !(off > kCriteria.contradicted_inertia))
    return std::nullopt;
  return diagnostics::Finding{
      "dry-friction", diagnostics::Severity::error, off, kCriteria.contradicted_inertia,
      fmt::format(
          "The model's inertia in all, {:.4g}, is {:.2g} % off what the motion took torque for, {:.4g} "
          "+- {:.1g}, at dry friction of {:.3g}: the model takes friction for something else. Move "
          "during the experiment, without turning back, or leave out what excites (a motion profile "
          "alone tells inertia and friction).",
          own, 100.0 * off, motion->inertia.value, motion->inertia.std, dry.value)};
}

std::optional<Selection> model_in_motion(const Experiment& experiment, const Options& options,
                                         const data::FrequencyResponse& response) {
  return MotionModel(experiment, options, response).run();
}

}  // namespace resonid::identification::detail
