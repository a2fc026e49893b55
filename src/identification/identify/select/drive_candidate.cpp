// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cmath>
#include <identification/criteria.hpp>
#include <identification/identify/select/drive_candidate.hpp>
#include <limits>
#include <numbers>
#include <resonid/base/constants.hpp>
#include <resonid/base/detail/statistics.hpp>
#include <resonid/fit/detail/order_selection.hpp>
#include <utility>

namespace resonid::identification::detail {
namespace {

using fit::Structure;

const char* plain_name(Structure structure) {
  switch (structure) {
    case Structure::rigid:
      return "rigid";
    case Structure::two_mass:
      return "two-mass";
    case Structure::three_mass:
      break;
  }
  return "three-mass";
}

/// Friction that pushes: such a fit imitates noise. Beside dry friction viscous friction may well be nothing,
/// and its estimate on either side of it.
bool self_excited(const fit::DriveModel& model, bool dry) {
  const auto viscous = model.estimate(fit::kViscousFriction);
  return viscous.value < (dry ? -3.0 * viscous.std : 0.0);
}

/// Dry friction that the fit tells from none.
bool finds_dry_friction(const std::optional<RecordFit>& fit) {
  return fit && fit->coulomb_friction &&
         fit->coulomb_friction->value > kCriteria.dry_friction_found * fit->coulomb_friction->std;
}

}  // namespace

std::string name_of(const Variant& v) {
  std::vector<const char*> parts;
  if (v.friction) parts.push_back("viscous friction");
  if (v.dry) parts.push_back("dry friction");
  if (v.has(fit::kLoadViscousFriction)) parts.push_back("viscous friction of the load");
  if (v.has(fit::kMotorGroundStiffness)) parts.push_back("spring to ground");
  if (v.has(fit::kLoadGroundStiffness)) parts.push_back("spring from load to ground");
  if (v.has(fit::kTorqueLag)) parts.push_back("torque lag");
  if (v.delay) parts.push_back("delay");
  if (v.velocity == fit::Velocity::differences) parts.push_back("velocity by differences");
  std::string name = plain_name(v.structure);
  for (std::size_t i = 0; i < parts.size(); ++i)
    name += std::string(i == 0 ? " with " : i + 1 == parts.size() ? " and " : ", ") + parts[i];
  return name;
}

Difference difference(const fit::DriveModel& model, const data::FrequencyResponse& response) {
  const auto fitted = model.values(response.frequency_hz, true);
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

data::FrequencyResponse thinned(const data::FrequencyResponse& g) {
  constexpr std::size_t kLines = 2000;
  if (g.lines() <= kLines) return g;
  std::vector<std::size_t> usable;
  for (std::size_t k = 0; k < g.lines(); ++k)
    if (g.std[k] < kCriteria.usable_line * std::abs(g.value[k])) usable.push_back(k);
  if (usable.size() < 10) return g;
  data::FrequencyResponse few;
  const std::size_t count = std::min(kLines, usable.size());
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t k = usable[i * usable.size() / count];
    few.frequency_hz.push_back(g.frequency_hz[k]);
    few.value.push_back(g.value[k]);
    few.std.push_back(g.std[k]);
  }
  return few;
}

bool modes_are_seen(const fit::DriveModel& model, const Plan& plan) {
  const auto modes = model.modes();
  const bool one_pair = modes.size() == 2;
  for (std::size_t i = 0; i < modes.size(); ++i) {
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

bool CandidateFits::offered(const Variant& variant, fit::Parameter parameter) const {
  if (!fit::may_have_parameter(variant.structure, parameter) || variant.has(parameter)) return false;
  switch (parameter) {
    case fit::kViscousFriction:
      return !variant.friction && allowed(true);
    case fit::kLoadViscousFriction:
      return allowed(true);
    case fit::kDelay:
      return !variant.delay;
    case fit::kTorqueLag:
      return !options_.torque_lag_s.has_value();
    default:
      return options_.ground == Ground::automatic;
  }
}

namespace {

/// The variant with one parameter more.
Variant with(Variant variant, fit::Parameter parameter) {
  if (parameter == fit::kViscousFriction)
    variant.friction = true;
  else if (parameter == fit::kDelay)
    variant.delay = true;
  else
    variant.further.push_back(parameter);
  return variant;
}

/// What a variant has beside its structure.
std::size_t parameters_of(const Variant& v) {
  return v.further.size() + (v.friction ? 1 : 0) + (v.delay ? 1 : 0);
}

/// The model of one variant as a start for another: a delay that is left out may have been a lag.
fit::DriveModel start_of_other(const Variant& other, const Variant& own, fit::DriveModel model) {
  const double delay_s = other.delay ? 0.0 : std::exchange(model.delay_s, 0.0);
  if (other.has(fit::kTorqueLag) && !own.has(fit::kTorqueLag)) model.torque_lag_s = std::max(0.0, delay_s);
  return model;
}

/// Springs that push, friction that drives: an imitation of something else.
bool implausible(const Variant& variant, const fit::DriveModel& model) {
  constexpr double kClearly = 3.0;  // standard deviations
  return std::any_of(variant.further.begin(), variant.further.end(), [&](fit::Parameter p) {
    const auto e = model.estimate(p);
    return !(e.value > kClearly * e.std);
  });
}

constexpr std::array kExtras = {fit::kViscousFriction,      fit::kDelay,
                                fit::kLoadViscousFriction,  fit::kTorqueLag,
                                fit::kMotorGroundStiffness, fit::kLoadGroundStiffness};
constexpr int kMostExtras = 3;
constexpr double kNear = 0.05;  ///< Model error of a start that a fit to the response goes on from.

/// Stiffness to the ground by the lowest lines, where the velocity leads: |G| = w/K. 0: it does not.
double ground_of(const data::FrequencyResponse& g) {
  std::vector<double> stiffness;
  const std::size_t few = std::max<std::size_t>(3, g.lines() / 20);
  for (std::size_t i = 0; i < g.lines() && stiffness.size() < few; ++i) {
    if (!(g.std[i] < kCriteria.usable_line * std::abs(g.value[i]))) continue;
    stiffness.push_back((std::complex<double>(0.0, kTwoPi * g.frequency_hz[i]) / g.value[i]).real());
  }
  return stiffness.empty() ? 0.0 : std::max(0.0, median(std::move(stiffness)));
}

/// The response without a spring that ties the driven side to the ground: impedances add up.
data::FrequencyResponse released(data::FrequencyResponse g, double stiffness) {
  for (std::size_t i = 0; i < g.lines(); ++i) {
    const std::complex<double> spring = stiffness / std::complex<double>(0.0, kTwoPi * g.frequency_hz[i]);
    const auto value = 1.0 / (1.0 / g.value[i] - spring);
    g.std[i] *= std::norm(value / g.value[i]);
    g.value[i] = value;
  }
  return g;
}

}  // namespace

/// What a fit to the record must hold against the measured response.
struct CandidateFits::Acceptance {
  bool by_the_lines = true;  ///< False: the lines have already said that the drive is not linear.
  double difference = 0.0;   ///< Largest one.
  double fit_percent = 0.0;  ///< That of the simulation with which a larger one is a correction.
};

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
  if (start) {
    config.initial = start_of(variant, *start);
    if (near) config.initial_error = kNear;
  }
  const double ground =
      start || (!variant.has(fit::kMotorGroundStiffness) && !variant.has(fit::kLoadGroundStiffness))
          ? 0.0
          : ground_of(response_);
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

void CandidateFits::extend_by_response(DriveCandidate& candidate) const {
  for (int round = 0; round < kMostExtras; ++round) {
    const Variant variant = candidate.variants.front().first;
    const fit::ResponseFit told = candidate.variants.front().second;
    const double repeated = told.repetition;
    std::optional<std::pair<Variant, fit::ResponseFit>> best;
    double least = told.bic_for(repeated);
    const auto consider = [&](const Variant& wider) {
      std::vector<std::optional<fit::DriveModel>> starts = {start_of_other(wider, variant, told.model)};
      if (wider.has(fit::kMotorGroundStiffness) || wider.has(fit::kLoadGroundStiffness))
        starts.emplace_back(std::nullopt);
      for (const auto& start : starts) {
        auto fit = response_fit(wider, start, true);
        if (!fit || implausible(wider, fit->model)) continue;
        const double price = parameters_of(wider) > parameters_of(variant) ? kCriteria.biased_lines : 0.0;
        const double cost = fit->bic_for(repeated) + price;
        if (!(cost < least)) continue;
        least = cost;
        best.emplace(wider, std::move(*fit));
      }
    };
    auto lacking = told.lacking;
    std::sort(lacking.begin(), lacking.end(), [](const auto& a, const auto& b) { return a.gain > b.gain; });
    constexpr std::size_t kFew = 2;
    std::size_t tried = 0;
    for (const auto& [p, gain] : lacking) {
      // Noise may explain what is left.
      if (tried == kFew || !(told.model_error > 0.0) || gain < kCriteria.clearly_better * repeated) break;
      if (p == fit::kDelay || !offered(variant, p)) continue;
      ++tried;
      consider(with(variant, p));
    }
    for (const auto& instead : instead_of_delay(variant)) consider(instead);
    if (!best) return;
    candidate.variants.insert(candidate.variants.begin(), std::move(*best));
  }
}

DriveCandidate CandidateFits::fit_to_response(Structure structure, const Variant* like) const {
  DriveCandidate candidate;
  candidate.structure = structure;
  for (const bool friction : {false, true}) {
    if (!allowed(friction)) continue;
    std::optional<fit::DriveModel> start;
    for (const bool delay : {false, true}) {
      if (like != nullptr && (friction != like->friction || delay != like->delay)) continue;
      const Variant variant{structure, friction, delay, false,
                            like != nullptr ? like->further : demanded(structure)};
      auto fit = response_fit(variant, start);
      if (delay && start) {  // a delay that was left out may have spoilt the start
        auto afresh = response_fit(variant, std::nullopt);
        if (afresh && (!fit || afresh->bic < fit->bic)) fit = std::move(afresh);
      }
      if (!fit) continue;
      start = fit->model;
      candidate.variants.emplace_back(variant, std::move(*fit));
    }
  }
  // Lines that repeat one another, smoothed ones or those that a model misses in a smooth way, count as the
  // fewer that they are worth; by the variant that leaves least unexplained.
  double repeated = std::numeric_limits<double>::infinity();
  for (const auto& v : candidate.variants) repeated = std::min(repeated, v.second.repetition);
  const auto price = [&](const std::pair<Variant, fit::ResponseFit>& v) {
    return v.second.bic_for(repeated) + (v.first.friction ? kCriteria.more_parameters : 0.0) +
           (v.first.delay ? kCriteria.more_parameters : 0.0);
  };
  std::sort(candidate.variants.begin(), candidate.variants.end(),
            [&](const auto& a, const auto& b) { return price(a) < price(b); });
  if (like == nullptr && !candidate.variants.empty()) extend_by_response(candidate);
  return candidate;
}

fit::DriveModel CandidateFits::start_of(const Variant& variant, fit::DriveModel model) const {
  model.velocity = variant.velocity;
  for (const auto p : kExtras)
    if (p != fit::kViscousFriction && p != fit::kDelay && !variant.has(p))
      model.set(p, p == fit::kTorqueLag ? options_.torque_lag_s.value_or(0.0) : 0.0);
  return model;
}

fit::OutputErrorConfig CandidateFits::config_of(const Variant& variant, const fit::DriveModel& start) const {
  fit::OutputErrorConfig config;
  config.initial = start_of(variant, start);
  config.viscous_friction = variant.friction;
  config.delay = variant.delay;
  config.coulomb_friction = variant.dry;
  config.further = variant.further;
  config.known_delay_s = options_.delay_s;
  use_predictor(records_, options_, plan_.loop_controller, config);
  return config;
}

std::optional<RecordFit> CandidateFits::fit_to_records(const Variant& variant,
                                                       const fit::DriveModel& start) const {
  auto config = config_of(variant, start);
  // A position drifts with what the start misses of friction, and a noise model of that drift leads astray.
  if (records_.front().output_quantity == data::OutputQuantity::position) {
    auto plain = config;
    plain.noise_model = false;
    if (const auto first = fit_records(records_, plain); first && first->converged)
      config.initial = first->model;
  }
  auto fit = fit_records(records_, config);
  if (!fit || !fit->converged || (friction_is_free() && self_excited(fit->model, variant.dry)))
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

void CandidateFits::fit_variants(DriveCandidate& candidate, const Acceptance& acceptable) const {
  // The lines may have taken a delay for a lag; the record tells them apart.
  const auto& first = candidate.variants.front().first;
  const bool ask_for_delay =
      first.delay || first.has(fit::kTorqueLag) || first.velocity == fit::Velocity::differences;
  auto variants = candidate.variants;
  std::stable_sort(variants.begin(), variants.end(),
                   [](const auto& a, const auto& b) { return a.first.delay < b.first.delay; });
  for (const auto& [variant, told] : variants) {
    if (variant.delay && !ask_for_delay) continue;
    std::vector<fit::DriveModel> starts = {told.model};
    if (candidate.record_fit) starts.push_back(candidate.record_fit->model);
    for (const auto& start : starts_)
      if (start.structure == variant.structure) starts.push_back(start);
    for (const auto& start : starts) {
      auto fit = fit_to_records(variant, start);
      if (!fit) continue;
      if (difference(fit->model, response_).whole > acceptable.difference &&
          fit->fit_percent < acceptable.fit_percent)
        continue;
      if (candidate.record_fit && fit->bic >= candidate.record_fit->bic) continue;
      candidate.record_fit = std::move(*fit);
      candidate.record_variant = variant;
    }
  }
}

void CandidateFits::fit_to_record(DriveCandidate& candidate) const {
  if (!to_records_) return;
  const auto acceptable = acceptance(candidate);
  if (acceptable.by_the_lines) fit_variants(candidate, acceptable);
  try_dry_friction(candidate, acceptable);
  extend_by_record(candidate);
}

/// To the test a lag, the mean over a sample and the delay that stands in its place are alike.
std::vector<Variant> CandidateFits::instead_of_delay(const Variant& variant) const {
  std::vector<Variant> others;
  if (!variant.delay) return others;
  Variant without = variant;
  without.delay = false;
  if (offered(variant, fit::kTorqueLag)) {
    others.push_back(with(variant, fit::kTorqueLag));
    others.push_back(with(without, fit::kTorqueLag));
  }
  if (records_.front().output_quantity == data::OutputQuantity::velocity &&
      variant.velocity == fit::Velocity::sampled) {
    others.push_back(without);
    others.back().velocity = fit::Velocity::differences;
  }
  return others;
}

/// The score test says what would pay, before it is fitted.
void CandidateFits::extend_by_record(DriveCandidate& candidate) const {
  constexpr double kRounding = 1e-6;  // per cent of the output that a fit leaves
  for (int round = 0; round < kMostExtras && candidate.record_fit; ++round) {
    const bool exact = candidate.record_fit->fit_percent > 100.0 - kRounding;  // nothing is left to add
    std::array<double, fit::kParameterCount> gain{};
    for (const auto& record : candidate.record_fit->records)
      for (const auto& l : record.lacking) gain[static_cast<std::size_t>(l.parameter)] += l.gain;
    const Variant variant = candidate.record_variant;
    std::vector<Variant> wider;
    for (const auto p : kExtras) {
      if (exact || gain[static_cast<std::size_t>(p)] < kCriteria.clearly_better || !offered(variant, p))
        continue;
      wider.push_back(with(variant, p));
    }
    const auto instead = instead_of_delay(variant);
    wider.insert(wider.end(), instead.begin(), instead.end());
    std::optional<RecordFit> best;
    Variant chosen;
    double least = candidate.record_fit->bic;
    for (const auto& v : wider) {
      auto fit = fit_to_records(v, start_of_other(v, variant, candidate.record_fit->model));
      if (!fit || implausible(v, fit->model)) continue;
      const double price = parameters_of(v) > parameters_of(variant) ? kCriteria.clearly_better : 0.0;
      if (!(fit->bic + price < least)) continue;
      least = fit->bic + price;
      best = std::move(fit);
      chosen = v;
    }
    if (!best) return;
    candidate.record_fit = std::move(best);
    candidate.record_variant = chosen;
  }
}

/// Dry friction passes for viscous friction, colours the residual, or keeps a linear fit from coming out. A
/// motion that never reverses shows none.
bool CandidateFits::dry_friction_is_likely(const DriveCandidate& candidate) const {
  if (options_.friction == Friction::none || options_.friction == Friction::viscous) return false;
  if (records_.front().output_quantity == data::OutputQuantity::acceleration) return false;
  // A position that no linear drive explains drifts by more than friction.
  if (!candidate.record_fit) return records_.front().output_quantity == data::OutputQuantity::velocity;
  const auto& records = candidate.record_fit->records;
  return candidate.record_variant.friction ||
         std::any_of(records.begin(), records.end(),
                     [](const fit::OutputErrorFit& fit) { return fit.noise.order() > 0; });
}

std::optional<RecordFit> CandidateFits::with_dry_friction(Variant& variant,
                                                          const fit::DriveModel& start) const {
  variant.dry = true;
  variant.friction = options_.friction != Friction::dry;
  auto fit = fit_to_records(variant, start);
  if (!friction_is_free()) {
    if (fit || options_.friction == Friction::dry) return fit;
    Variant alone = variant;  // for a start
    alone.friction = false;
    auto without = fit_to_records(alone, start);
    return without ? fit_to_records(variant, without->model) : without;
  }
  if (finds_dry_friction(fit)) {
    const auto viscous = fit->model.estimate(fit::kViscousFriction);
    if (viscous.value > kCriteria.viscous_friction_found * viscous.std) return fit;
  }
  // Both together are one too many where the motion tells little of them.
  Variant alone = variant;
  alone.friction = false;
  auto without = fit_to_records(alone, fit ? fit->model : start);
  if (!finds_dry_friction(without)) return finds_dry_friction(fit) ? std::move(fit) : std::nullopt;
  if (!finds_dry_friction(fit)) {
    Variant both = variant;
    both.friction = true;
    auto again = fit_to_records(both, without->model);
    if (finds_dry_friction(again)) fit = std::move(again);
  }
  if (finds_dry_friction(fit) && without->bic > fit->bic) return fit;
  variant = alone;
  return without;
}

void CandidateFits::try_dry_friction(DriveCandidate& candidate, const Acceptance& acceptable) const {
  if (!dry_friction_is_likely(candidate)) return;
  Variant variant = candidate.variant();
  auto fit = with_dry_friction(variant, candidate.model());
  if (!fit) return;
  const bool better = !friction_is_free() ? true
                      : candidate.record_fit
                          ? fit->bic + kCriteria.clearly_better < candidate.record_fit->bic
                          : fit->fit_percent >= acceptable.fit_percent ||
                                difference(fit->model, response_).whole <= acceptable.difference;
  if (!better) return;
  candidate.record_fit = std::move(*fit);
  candidate.record_variant = variant;
}

void CandidateFits::validate(DriveCandidate& candidate) const {
  std::size_t longest = 0;
  for (const auto& record : records_) longest = std::max(longest, record.samples());
  auto config = config_of(candidate.record_variant, candidate.record_fit->model);
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
    Variant chosen;
    std::optional<RecordFit> best;
    for (const int further_delay : {0, 1, 2, 4, 8}) {  // in samples; the fit's valley is a few wide
      const Variant variant{Structure::two_mass, friction, further_delay > 0, false,
                            demanded(Structure::two_mass)};
      const double further_s = further_delay * record.sample_time_s();
      for (auto start : fit::initial_models(record, options_.delay_s + further_s)) {
        start.delay_s = further_s;
        start.torque_lag_s = options_.torque_lag_s.value_or(0.0);
        auto fit = fit_to_records(variant, start);
        if (!fit || (best && fit->bic >= best->bic)) continue;
        best = std::move(fit);
        chosen = variant;
      }
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

void CandidateFits::for_comparison(DriveCandidate& candidate, const Variant& chosen) const {
  Variant variant = chosen;
  variant.structure = candidate.structure;
  auto fit = fit_records(records_, config_of(variant, candidate.response_fit().model));
  if (!fit || !fit->converged) return;
  candidate.record_fit = std::move(*fit);
  candidate.record_variant = variant;
  validate(candidate);
}

}  // namespace resonid::identification::detail
