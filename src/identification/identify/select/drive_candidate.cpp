// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <identification/criteria.hpp>
#include <identification/identify/select/drive_candidate.hpp>
#include <identification/identify/select/ground.hpp>
#include <limits>
#include <numbers>
#include <resonid/base/constants.hpp>
#include <resonid/base/detail/statistics.hpp>
#include <resonid/fit/detail/order_selection.hpp>
#include <utility>

namespace resonid::identification::detail {
namespace {

using fit::Structure;

constexpr double kNear = 0.05;  ///< Model error of a start that a fit to the response goes on from.

constexpr double kNothing = 4.0;  ///< Chi-square of one degree of freedom that a chance of 5 % exceeds.

double least_bic(const DriveCandidate& candidate) {
  double least = std::numeric_limits<double>::infinity();
  for (const auto& v : candidate.variants) least = std::min(least, v.second.bic);
  return least;
}

bool holds(const fit::ResponseFit& fit) { return fit.model_error < kCriteria.true_enough; }

/// What a score test says that the parameter would gain; as much as may be where there is none.
double gain_of(const fit::ResponseFit& fit, fit::Parameter parameter) {
  const auto tested = std::find_if(fit.lacking.begin(), fit.lacking.end(),
                                   [&](const fit::Lacking& l) { return l.parameter == parameter; });
  return tested != fit.lacking.end() ? tested->gain : std::numeric_limits<double>::infinity();
}

/// Friction that pushes: such a fit imitates noise. Beside dry friction viscous friction may well be nothing,
/// and its estimate on either side of it.
bool self_excited(const fit::DriveModel& model, bool dry) {
  const auto viscous = model.estimate(fit::kViscousFriction);
  return viscous.value < (dry ? -3.0 * viscous.std : 0.0);
}

void begin_with_noise_of(const RecordFit& fit, fit::OutputErrorConfig& config) {
  config.noise_start.clear();
  for (const auto& record : fit.records) config.noise_start.push_back(record.noise);
}

}  // namespace

Difference difference(const fit::DriveModel& model, const data::FrequencyResponse& response) {
  return difference(model.values(response.frequency_hz, true), response);
}

Difference difference(const std::vector<std::complex<double>>& fitted,
                      const data::FrequencyResponse& response) {
  std::vector<double> squares, noise;
  for (std::size_t i = 0; i < response.lines(); ++i) {
    const double size = std::abs(response.value[i]);
    if (!(response.std[i] < kCriteria.usable_line * size)) continue;
    squares.push_back(std::norm((fitted[i] - response.value[i]) / size));
    noise.push_back(std::pow(response.std[i] / size, 2));
  }
  // The median of n exponential squares scatters by 1/(sqrt(n) ln 2) of itself.
  const double chance =
      1.0 + kCriteria.one_in_thousand /
                (std::numbers::ln2 * std::sqrt(std::max(1.0, static_cast<double>(squares.size()))));
  const double whole = median(squares) / std::numbers::ln2;
  return {std::sqrt(whole), std::sqrt(std::max(0.0, whole - chance * median(noise)))};
}

bool is_astray(const DriveCandidate& candidate, const DriveCandidate& rival) {
  return candidate.record_fit && rival.record_fit &&
         candidate.record_fit->bic > rival.record_fit->bic + kCriteria.ruled_out;
}

bool modes_are_seen(const fit::DriveModel& model, const Plan& plan) {
  const auto modes = model.modes();
  // The lowest one, on a spring to the ground, shows below itself in how the velocity leads.
  const std::size_t first = !modes.empty() && !modes.front().anti ? 1 : 0;
  const bool one_pair = modes.size() == first + 2;
  for (std::size_t i = first; i < modes.size(); ++i) {
    const auto& m = modes[i];
    const double f = m.frequency_hz.value;
    if (!std::isfinite(f) || !(m.damping_ratio.value < 1.0)) return false;
    // A single pair may lie a little beside the band, of several each must show in it.
    if (one_pair &&
        (m.anti ? f < kCriteria.lower_mode * plan.low_hz : f > kCriteria.upper_mode * plan.high_hz))
      return false;
    if (!one_pair && (f < plan.low_hz || f > plan.high_hz)) return false;
    if (!one_pair && m.frequency_hz.std > 0.1 * f) return false;
    if (!m.anti || i + 1 == modes.size()) continue;
    // A pair that cancels within its error bars is none.
    const auto gap = [i](const fit::DriveModel& d) {
      const auto moved = d.modes();
      if (i + 1 >= moved.size()) return 0.0;
      return moved[i + 1].frequency_hz.value - moved[i].frequency_hz.value;
    };
    const double least = one_pair ? 0.0 : 1e-3 * f;
    if (!(gap(model) > std::max(least, 3.0 * model.standard_deviation_of(gap)))) return false;
  }
  return true;
}

/// Whether such friction may be estimated.
bool CandidateFits::allowed(bool viscous) const {
  switch (options_.friction) {
    case Friction::automatic:
      return true;
    case Friction::none:
    case Friction::dry:
      return !viscous;
    case Friction::viscous:
    case Friction::both:
      break;
  }
  return viscous;
}

std::vector<fit::Parameter> CandidateFits::demanded(Structure structure) const {
  if (options_.ground == Ground::motor) return {fit::kMotorGroundStiffness};
  // A rigid machine has one side.
  if (options_.ground == Ground::load)
    return {structure == Structure::rigid ? fit::kMotorGroundStiffness : fit::kLoadGroundStiffness};
  return {};
}

CandidateFits::CandidateFits(std::span<const data::Record> records, const Plan& plan, const Options& options,
                             const data::FrequencyResponse& response, std::span<const fit::DriveModel> starts,
                             bool to_records)
    : records_(records),
      plan_(plan),
      options_(options),
      response_(thinned(response)),
      starts_(starts),
      to_records_(to_records) {}

std::optional<fit::ResponseFit> CandidateFits::response_fit(const Variant& variant,
                                                            const std::optional<fit::DriveModel>& start,
                                                            bool near) const {
  fit::ResponseFitConfig config;
  config.structure = variant.structure;
  config.sample_time_s = records_.front().sample_time_s();
  config.known_delay_s = options_.delay_s;
  config.viscous_friction = variant.friction;
  config.delay = variant.delay;
  config.further = variant.further;
  config.velocity = variant.velocity;
  config.torque_lag_s = options_.torque_lag_s.value_or(0.0);
  config.output_filter_s = options_.output_filter_s.value_or(0.0);
  if (start) {
    config.initial = start_of(variant, *start);
    if (near) config.initial_error = kNear;
  }
  const bool three_on_ground = !start && variant.structure == Structure::three_mass && variant.grounded();
  const double ground = three_on_ground ? ground_stiffness_of(response_) : 0.0;
  if (ground > 0.0) {  // a machine begun without its spring never finds it
    auto free = config;
    free.further.clear();
    if (auto first = fit::fit_response(released(response_, ground), free)) {
      config.initial = first->model;
      config.initial->set(
          variant.has(fit::kMotorGroundStiffness) ? fit::kMotorGroundStiffness : fit::kLoadGroundStiffness,
          ground);
    }
  }
  auto fit = fit::fit_response(response_, config);
  if (!fit || !std::isfinite(fit->bic) || self_excited(fit->model, false)) return std::nullopt;
  return std::move(*fit);
}

void CandidateFits::add_variants(DriveCandidate& candidate, const std::vector<fit::Parameter>& further,
                                 const Variant* like) const {
  for (const bool friction : {false, true}) {
    if (!allowed(friction)) continue;
    std::optional<fit::ResponseFit> without;
    for (const bool delay : {false, true}) {
      if (like != nullptr && (friction != like->friction || delay != like->delay)) continue;
      const Variant variant{candidate.structure, friction, delay, false, further};
      // Near the truth the score test says all that the fit would.
      if (delay && without && holds(*without) && gain_of(*without, fit::kDelay) < kNothing) continue;
      auto fit = response_fit(variant, without ? std::optional(without->model) : std::nullopt);
      // A delay that was left out may have spoilt the start.
      if (delay && without && !(fit && holds(*fit))) {
        auto afresh = response_fit(variant, std::nullopt);
        if (afresh && (!fit || afresh->bic < fit->bic)) fit = std::move(afresh);
      }
      if (!fit ||
          (further != demanded(candidate.structure) && like == nullptr && implausible(variant, fit->model)))
        continue;
      without = fit;
      candidate.variants.emplace_back(variant, std::move(*fit));
    }
  }
}

/// Parameters without which a machine that has them is hardly found, so that no score test asks for them: a
/// lag where nothing holds, a spring where nothing does with it either or the velocity leads.
void CandidateFits::add_likely_variants(DriveCandidate& candidate) const {
  const auto given = demanded(candidate.structure);
  const auto none_holds = [&] {
    return std::none_of(candidate.variants.begin(), candidate.variants.end(),
                        [](const auto& v) { return holds(v.second); });
  };
  const auto add = [&](fit::Parameter p) {
    if (offered({candidate.structure, false, false, false, given}, p)) add_variants(candidate, {p}, nullptr);
  };
  if (none_holds()) add(fit::kTorqueLag);
  if (!none_holds() && !leads_at_first(response_)) return;
  const double free = least_bic(candidate);
  add(fit::kMotorGroundStiffness);
  // Whichever side a spring holds, the driven side moves nearly alike.
  if (leads_at_first(response_) || least_bic(candidate) < free) add(fit::kLoadGroundStiffness);
}

DriveCandidate CandidateFits::fit_to_response(Structure structure, const Variant* like) const {
  DriveCandidate candidate;
  candidate.structure = structure;
  const auto given = like != nullptr ? like->further : demanded(structure);
  add_variants(candidate, given, like);
  if (like == nullptr) add_likely_variants(candidate);
  // Lines that repeat one another, smoothed ones or those that a model misses in a smooth way, count as the
  // fewer that they are worth; by the variant that leaves least unexplained.
  double repeated = std::numeric_limits<double>::infinity();
  for (const auto& v : candidate.variants) repeated = std::min(repeated, v.second.repetition);
  const auto price = [&](const std::pair<Variant, fit::ResponseFit>& v) {
    return v.second.bic_for(repeated) + static_cast<double>(parts_of(v.first)) * kCriteria.more_parameters;
  };
  std::sort(candidate.variants.begin(), candidate.variants.end(),
            [&](const auto& a, const auto& b) { return price(a) < price(b); });
  if (like != nullptr || candidate.variants.empty()) return candidate;
  extend_by_response(candidate);
  if (structure == Structure::two_mass) add_filtered(candidate);
  return candidate;
}

fit::DriveModel CandidateFits::start_of(const Variant& variant, fit::DriveModel model) const {
  model.velocity = variant.velocity;
  for (const auto p : kExtras)
    if (p != fit::kViscousFriction && p != fit::kDelay && !variant.has(p))
      model.set(p, p == fit::kTorqueLag      ? options_.torque_lag_s.value_or(0.0)
                   : p == fit::kOutputFilter ? options_.output_filter_s.value_or(0.0)
                                             : 0.0);
  return model;
}

std::optional<CandidateFits::FrictionStart> CandidateFits::friction_of(const RecordFit& fit) {
  if (!fit.coulomb_friction && !fit.further_friction.any()) return std::nullopt;
  return FrictionStart{fit.coulomb_friction ? fit.coulomb_friction->value : 0.0, fit.further_friction};
}

fit::OutputErrorConfig CandidateFits::config_of(const Variant& variant, const fit::DriveModel& start,
                                                const std::optional<FrictionStart>& dry) const {
  fit::OutputErrorConfig config;
  config.initial = start_of(variant, start);
  config.viscous_friction = variant.friction;
  config.delay = variant.delay;
  config.coulomb_friction = variant.dry;
  if (dry) {
    if (variant.dry) config.coulomb_start = dry->coulomb;
    auto& further = config.further_friction;
    if (variant.load_dry) further.load_coulomb = dry->further.load_coulomb;
    if (variant.stribeck) further.breakaway = dry->further.breakaway;
    if (variant.stribeck) further.stribeck_velocity = dry->further.stribeck_velocity;
  }
  config.further = variant.further;
  config.known_delay_s = options_.delay_s;
  use_predictor(records_, options_, plan_.loop_controller, config);
  return config;
}

fit::OutputErrorConfig CandidateFits::as_it_slides(const Variant& variant, const fit::DriveModel& start,
                                                   const RecordFit& found) const {
  auto config = config_of(without_dry_friction(variant), start);
  begin_with_noise_of(found, config);
  if (!variant.any_dry()) return config;
  const bool one_mass = variant.structure == Structure::rigid;  // it has all of the friction
  for (const auto& record : found.records) {
    auto torque = record.friction_torque;
    const auto& of_load = record.load_friction_torque;
    if (one_mass) {
      torque.resize(std::max(torque.size(), of_load.size()));
      std::transform(of_load.begin(), of_load.end(), torque.begin(), torque.begin(), std::plus());
    } else {
      config.load_friction_torque.push_back(of_load);
    }
    config.friction_torque.push_back(std::move(torque));
  }
  return config;
}

std::optional<RecordFit> CandidateFits::fit_to_records(const Variant& variant, const fit::DriveModel& start,
                                                       const std::optional<FrictionStart>& dry,
                                                       const RecordFit* near) const {
  auto config = config_of(variant, start, dry);
  if (near != nullptr) begin_with_noise_of(*near, config);
  // A position drifts with what the start misses of friction, and a noise model of that drift leads astray.
  if (records_.front().output_quantity == data::OutputQuantity::position) {
    auto plain = config;
    plain.noise_model = false;
    if (const auto first = fit_records(records_, plain); first && first->converged)
      config.initial = first->model;
  }
  auto fit = fit_records(records_, config);
  if (!fit || !fit->converged || !std::isfinite(fit->bic) || !std::isfinite(fit->fit_percent) ||
      (friction_is_free() && self_excited(fit->model, variant.any_dry())))
    return std::nullopt;
  return fit;
}

CandidateFits::Acceptance CandidateFits::acceptance(const DriveCandidate& candidate) const {
  const auto& told = candidate.response_fit();
  // Unbiased lines that differ from the model far beyond their noise have already said that the drive is
  // another.
  const bool lines_are_unbiased = plan_.period_samples != 0 && plan_.method != Method::local_polynomial;
  auto simulation = config_of(candidate.variants.front().first, told.model);
  simulation.fixed_model = true;
  const auto simulated = fit_records(records_, simulation);
  return {!(lines_are_unbiased && told.model_error > kCriteria.true_enough &&
            told.misfit > kCriteria.beyond_noise),
          1.5 * difference(told.model, response_).whole + 0.02,
          simulated
              ? std::max(simulated->fit_percent + kCriteria.better_simulation, kCriteria.some_simulation)
              : 100.0};
}

void CandidateFits::fit_variants(DriveCandidate& candidate, const Acceptance& acceptable,
                                 const DriveCandidate* larger) const {
  // The lines may have taken a delay for a lag; the record tells them apart.
  const auto& first = candidate.variants.front().first;
  const bool ask_for_delay = first.delay || first.has(fit::kTorqueLag) || first.has(fit::kOutputFilter) ||
                             first.velocity == fit::Velocity::differences;
  auto variants = candidate.variants;
  std::stable_sort(variants.begin(), variants.end(),
                   [](const auto& a, const auto& b) { return a.first.delay < b.first.delay; });
  double repeated = std::numeric_limits<double>::infinity();
  for (const auto& v : candidate.variants) repeated = std::min(repeated, v.second.repetition);
  const double least = candidate.response_fit().bic_for(repeated);
  for (const auto& [variant, told] : variants) {
    if (variant.delay && !ask_for_delay) continue;
    if (told.bic_for(repeated) > least + kCriteria.ruled_out) continue;
    // Of one mass there is one minimum. Where two masses need neither friction nor delay, neither makes up
    // for their mode.
    if (candidate.structure == Structure::rigid && larger != nullptr && is_astray(candidate, *larger) &&
        parts_of(larger->record_variant) == 0 && modes_are_seen(larger->record_fit->model, plan_))
      break;
    std::vector<fit::DriveModel> starts = {told.model};
    // Of one mass there is one minimum.
    if (candidate.structure != Structure::rigid && candidate.record_fit &&
        candidate.record_variant.further == variant.further)
      starts.push_back(candidate.record_fit->model);
    for (const auto& start : starts_)
      if (start.structure == variant.structure) starts.push_back(start);
    for (const auto& start : starts) {
      Variant tried = variant;
      auto fit = fit_to_records(tried, start);
      // What the lines ask for and the record does not show is an imitation of what bends the lines.
      if (fit && tried.further != demanded(tried.structure) && implausible(tried, fit->model)) {
        tried.further = demanded(tried.structure);
        fit = fit_to_records(tried, start_of(tried, fit->model));
      }
      if (!fit) continue;
      if (difference(fit->model, response_).whole > acceptable.difference &&
          fit->fit_percent < acceptable.fit_percent)
        continue;
      if (candidate.record_fit && fit->bic >= candidate.record_fit->bic) continue;
      candidate.record_fit = std::move(*fit);
      candidate.record_variant = tried;
    }
  }
}

void CandidateFits::fit_to_record(DriveCandidate& candidate, const DriveCandidate* larger) const {
  if (!to_records_) return;
  candidate.tried_on_record = true;
  const auto acceptable = acceptance(candidate);
  if (acceptable.by_the_lines) fit_variants(candidate, acceptable, larger);
}

void CandidateFits::extend_fit_to_record(DriveCandidate& candidate, const DriveCandidate* rival) const {
  if (!to_records_) return;
  // One that fits far less well is none: nothing that is added makes it the machine.
  if (friction_is_free() && rival != nullptr && !rival->record_variant.any_dry() &&
      is_astray(candidate, *rival))
    return;
  try_dry_friction(candidate);
  const std::string before = name_of(candidate.variant());
  extend_by_record(candidate);
  // What was taken for friction may have hidden it, or stood for it.
  if (candidate.record_fit && name_of(candidate.variant()) != before)
    extend_dry_friction(candidate.record_variant, *candidate.record_fit);
}

bool CandidateFits::fit_chosen(DriveCandidate& candidate) const {
  const auto& found = *candidate.record_fit;
  auto fit = fit_to_records(candidate.record_variant, found.model, friction_of(found));
  if (!fit) return false;
  candidate.record_fit = std::move(fit);
  extend_by_record(candidate, false);
  return true;
}

void CandidateFits::contest_ground(DriveCandidate& candidate) const {
  const Variant own = candidate.variant();
  if (options_.ground != Ground::automatic || candidate.structure != Structure::two_mass || !own.grounded() ||
      (own.has(fit::kMotorGroundStiffness) && own.has(fit::kLoadGroundStiffness)))
    return;
  const Variant other = grounded_on_other_side(own);
  const auto start = with_spring_on_other_side(candidate.model());
  DriveCandidate rival;
  rival.structure = candidate.structure;
  if (auto told = response_fit(other, start, true)) rival.variants.emplace_back(other, std::move(*told));
  for (const auto& v : candidate.variants)
    if (v.first.has(fit::kLoadGroundStiffness) == other.has(fit::kLoadGroundStiffness) &&
        v.first.has(fit::kMotorGroundStiffness) == other.has(fit::kMotorGroundStiffness))
      rival.variants.push_back(v);
  if (rival.variants.empty()) return;
  double repeated = candidate.response_fit().repetition;
  for (const auto& v : rival.variants) repeated = std::min(repeated, v.second.repetition);
  std::sort(rival.variants.begin(), rival.variants.end(), [&](const auto& a, const auto& b) {
    return a.second.bic_for(repeated) < b.second.bic_for(repeated);
  });
  fit_to_record(rival, nullptr);
  if (candidate.record_fit) {
    auto fit = fit_to_records(other, start, friction_of(*candidate.record_fit));
    if (fit && (!rival.record_fit || fit->bic < rival.record_fit->bic)) {
      rival.record_fit = std::move(fit);
      rival.record_variant = other;
    }
  }
  extend_fit_to_record(rival, &candidate);
  if (rival.variant().has(fit::kMotorGroundStiffness) && rival.variant().has(fit::kLoadGroundStiffness))
    return;
  const bool by_record = candidate.record_fit && rival.record_fit;
  if (!by_record && (candidate.record_fit || rival.record_fit)) {
    if (rival.record_fit) candidate = std::move(rival);
    return;
  }
  const double gain =
      by_record ? candidate.record_fit->bic - rival.record_fit->bic
                : candidate.response_fit().bic_for(repeated) - rival.response_fit().bic_for(repeated);
  if (gain > 0.0) std::swap(candidate, rival);
  if (std::abs(gain) < (by_record ? kCriteria.clearly_better : kCriteria.biased_lines))
    candidate.other_side = rival.model();
}

void CandidateFits::validate(DriveCandidate& candidate) const {
  const auto& found = *candidate.record_fit;
  judge_by_holdout(candidate, as_it_slides(candidate.record_variant, found.model, found));
}

void CandidateFits::judge_by_holdout(DriveCandidate& candidate, fit::OutputErrorConfig config) const {
  std::size_t longest = 0;
  for (const auto& record : records_) longest = std::max(longest, record.samples());
  config.initial = candidate.record_fit->model;
  begin_with_noise_of(*candidate.record_fit, config);
  if (longest < kCriteria.holdout_samples) return;
  config.holdout = fit::holdout_parts(longest);
  if (const auto fit = fit_records(records_, config); fit && fit->converged)
    candidate.validated = fit->holdout;
}

const data::Record& CandidateFits::record_of_most_output_energy() const {
  const auto energy = [](const data::Record& record) {
    const auto& y = record.output.samples;
    double mean = 0.0, sum = 0.0;
    for (const double v : y) mean += v / static_cast<double>(y.size());
    for (const double v : y) sum += (v - mean) * (v - mean);
    return sum;
  };
  return *std::max_element(
      records_.begin(), records_.end(),
      [&](const data::Record& a, const data::Record& b) { return energy(a) < energy(b); });
}

void CandidateFits::fit_to_record_alone(const DriveCandidate& rigid, DriveCandidate& two) const {
  if (two.remark.empty() || !rigid.record_fit) return;
  const data::Record& record = record_of_most_output_energy();
  // What brakes the rigid machine (the back-EMF of a voltage drive, for one) may be the mode that it lacks,
  // or brake this one too.
  for (const bool friction : {false, true}) {
    if (!allowed(friction) || (friction && friction_is_free() && !rigid.record_variant.friction)) continue;
    // Plain output error says which starts lead somewhere; the likelihood is worth its time for few.
    struct Start {
      double fit_percent;
      Variant variant;
      fit::DriveModel model;
    };
    std::vector<Start> starts;
    for (const int further_delay : {0, 1, 2, 4, 8}) {  // in samples; the fit's valley is a few wide
      const Variant variant{Structure::two_mass, friction, further_delay > 0, false,
                            demanded(Structure::two_mass)};
      const double further_s = further_delay * record.sample_time_s();
      for (auto start : fit::initial_models(record, options_.delay_s + further_s)) {
        start.delay_s = further_s;
        start.torque_lag_s = options_.torque_lag_s.value_or(0.0);
        start.output_filter_s = options_.output_filter_s.value_or(0.0);
        auto plain = config_of(variant, start);
        plain.noise_model = false;
        if (auto fit = fit_records(records_, plain); fit && std::isfinite(fit->fit_percent))
          starts.push_back({fit->fit_percent, variant, fit->model});
      }
    }
    constexpr std::size_t kFew = 3;
    std::sort(starts.begin(), starts.end(),
              [](const Start& x, const Start& y) { return x.fit_percent > y.fit_percent; });
    constexpr double kSame = 1e-4;
    starts.erase(std::unique(starts.begin(), starts.end(),
                             [](const Start& x, const Start& y) {
                               return x.variant.delay == y.variant.delay &&
                                      x.fit_percent - y.fit_percent < kSame;
                             }),
                 starts.end());
    starts.erase(starts.begin() + static_cast<std::ptrdiff_t>(std::min(kFew, starts.size())), starts.end());
    Variant chosen;
    std::optional<RecordFit> best;
    for (const auto& start : starts) {
      auto fit = fit_to_records(start.variant, start.model);
      if (!fit || (best && fit->bic >= best->bic)) continue;
      best = std::move(fit);
      chosen = start.variant;
    }
    if (!best || best->bic + kCriteria.clearly_better > rigid.record_fit->bic) continue;
    const auto resonance = best->model.resonance();
    if (resonance.std > kCriteria.known_resonance * resonance.value || !modes_are_seen(best->model, plan_))
      continue;
    two.record_fit = std::move(best);
    two.record_variant = chosen;
    two.remark.clear();
    return;
  }
}

void CandidateFits::for_comparison(DriveCandidate& candidate, const DriveCandidate& chosen) const {
  Variant variant = chosen.record_variant;
  variant.structure = candidate.structure;
  std::erase_if(variant.further,
                [&](fit::Parameter p) { return !fit::may_have_parameter(variant.structure, p); });
  auto config = as_it_slides(variant, candidate.response_fit().model, *chosen.record_fit);
  config.noise_start.clear();
  auto fit = fit_records(records_, config);
  if (!fit || !fit->converged) return;
  candidate.record_fit = std::move(*fit);
  candidate.record_variant = variant;
  judge_by_holdout(candidate, config);
}

}  // namespace resonid::identification::detail
