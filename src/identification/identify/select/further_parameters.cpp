// SPDX-License-Identifier: MIT
#include <array>
#include <cmath>
#include <complex>
#include <identification/criteria.hpp>
#include <identification/identify/select/drive_candidate.hpp>
#include <resonid/base/constants.hpp>
#include <set>
#include <string>
#include <utility>

#include "linalg/parallel.hpp"

// Parameters that are added to a variant one after the other, as the score tests say that they would pay.
namespace resonid::identification::detail {
namespace {

constexpr int kMostExtras = 3;

/// The model of one variant as a start for another: by what the other lacks of delay and lags, its new one is
/// longer.
fit::DriveModel start_of_other(const Variant& other, const Variant& own, fit::DriveModel model) {
  double late_s = 0.0;
  if (other.velocity != own.velocity)
    late_s += (own.velocity == fit::Velocity::differences ? 0.5 : -0.5) * model.sample_time_s;
  if (!other.delay) late_s += std::exchange(model.delay_s, 0.0);
  for (const auto p : {fit::kTorqueLag, fit::kOutputFilter})
    if (own.has(p) && !other.has(p)) {
      late_s += model.value(p);
      model.set(p, 0.0);
    }
  for (const auto p : {fit::kTorqueLag, fit::kOutputFilter})
    if (other.has(p) && !own.has(p)) {
      model.set(p, std::max(0.0, late_s));
      return model;
    }
  return model;
}

/// Where the load has all of the friction, noise may turn the motor's into one that drives: no fit then.
bool divides_friction(const Variant& variant) {
  return variant.friction && variant.has(fit::kLoadViscousFriction);
}

/// Lets the error bars hold by how much an alternative that is better to one test, and not to the other,
/// disagrees.
void hold_alternative(const fit::DriveModel& before, const fit::DriveModel& after, fit::DriveModel& model) {
  fit::ParameterVector moved = fit::ParameterVector::Zero();
  for (int i = 0; i < fit::kParameterCount; ++i)
    if (model.estimated[static_cast<std::size_t>(i)] && before.estimated[static_cast<std::size_t>(i)] &&
        after.estimated[static_cast<std::size_t>(i)])
      moved(i) = after.value(static_cast<fit::Parameter>(i)) - before.value(static_cast<fit::Parameter>(i));
  model.covariance += moved * moved.transpose();
}

/// The response without a filter of the measured velocity.
data::FrequencyResponse unfiltered(data::FrequencyResponse g, double filter_s, double sample_time_s) {
  const double pole = std::exp(-sample_time_s / filter_s);
  for (std::size_t i = 0; i < g.lines(); ++i) {
    const auto by =
        (1.0 - pole * std::polar(1.0, -kTwoPi * g.frequency_hz[i] * sample_time_s)) / (1.0 - pole);
    g.value[i] *= by;
    g.std[i] *= std::abs(by);
  }
  return g;
}

/// What the score tests say that the better of the two lags would gain.
double gain_of_lags(const RecordFit& fit) {
  double lag = 0.0, filter = 0.0;
  for (const auto& record : fit.records)
    for (const auto& l : record.lacking) {
      if (l.parameter == fit::kTorqueLag) lag += l.gain;
      if (l.parameter == fit::kOutputFilter) filter += l.gain;
    }
  return std::max(lag, filter);
}

/// A variant as it was fitted in the end, and what came out.
template <class Fit>
struct Trial {
  Variant variant;
  std::optional<Fit> fit;
  bool bare = false;          ///< Without the lags that were asked for.
  bool frictionless = false;  ///< Without the driven side's friction that was asked for.

  [[nodiscard]] bool is_another() const { return bare || frictionless; }
};

/// Fits a variant that is wider than `own`; where it makes no sense, what is left of it without the friction
/// of the driven side, and without its lags from the model found.
template <class Fit, class First, class Again>
Trial<Fit> trial(const Variant& wider, const Variant& own, const First& first, const Again& again) {
  Trial<Fit> t{wider, first(wider)};
  if (!t.fit && divides_friction(t.variant)) {
    t.variant.friction = false;
    t.frictionless = true;
    t.fit = first(t.variant);
  }
  if (t.fit && implausible(t.variant, t.fit->model) && lags(own) && lags(t.variant)) {
    t.variant = without_lags(t.variant);
    t.bare = true;
    t.fit = again(t.variant, t.fit->model);
  }
  return t;
}

}  // namespace

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
    case fit::kOutputFilter:
      return !options_.output_filter_s.has_value() &&
             records_.front().output_quantity == data::OutputQuantity::velocity;
    default:
      return options_.ground == Ground::automatic;
  }
}

void CandidateFits::extend_by_response(DriveCandidate& candidate) const {
  for (int round = 0; round < kMostExtras; ++round) {
    const Variant variant = candidate.variants.front().first;
    const fit::ResponseFit told = candidate.variants.front().second;
    const double repeated = told.repetition;
    std::vector<std::pair<Variant, std::optional<fit::DriveModel>>> tries;
    const auto consider = [&](const Variant& wider) {
      tries.emplace_back(wider, start_of_other(wider, variant, told.model));
      if (wider.grounded()) tries.emplace_back(wider, std::nullopt);
    };
    auto lacking = told.lacking;
    std::sort(lacking.begin(), lacking.end(), [](const auto& a, const auto& b) { return a.gain > b.gain; });
    constexpr std::size_t kFew = 2;
    std::size_t tried = 0;
    for (const auto& [p, gain] : lacking) {
      // Noise may explain what is left.
      if (tried == kFew || !(told.model_error > 0.0) || gain < kCriteria.clearly_better * repeated) break;
      // What a filter gains, a lag gains nearly alike; the filter is tried in the lag's stead after.
      if (p == fit::kOutputFilter && offered(variant, fit::kTorqueLag)) continue;
      if (p == fit::kDelay || !offered(variant, p)) continue;
      ++tried;
      consider(with(variant, p));
    }
    for (const auto& instead : instead_of_delay(variant, false)) consider(instead);
    std::vector<Trial<fit::ResponseFit>> trials(tries.size());
    linalg::for_each_index(tries.size(), 0, [&](std::size_t i) {
      const Variant& wider = tries[i].first;
      const auto& start = tries[i].second;
      trials[i] = trial<fit::ResponseFit>(
          wider, variant, [&](const Variant& v) { return response_fit(v, start, true); },
          [&](const Variant& v, const fit::DriveModel& model) {
            return response_fit(v, start_of_other(v, wider, model), true);
          });
    });
    std::optional<std::pair<Variant, fit::ResponseFit>> best;
    double least = told.bic_for(repeated);
    std::set<std::string> bare;
    for (auto& t : trials) {
      if (t.bare && !bare.insert(name_of(t.variant)).second) continue;
      if (!t.fit || implausible(t.variant, t.fit->model)) continue;
      const double price = std::max(0.0, price_of(t.variant, variant, kCriteria.biased_lines));
      const double cost = t.fit->bic_for(repeated) + price;
      if (!(cost < least)) continue;
      least = cost;
      best.emplace(t.variant, std::move(*t.fit));
    }
    if (!best) return;
    candidate.variants.insert(candidate.variants.begin(), std::move(*best));
  }
}

/// A low-pass bends the magnitudes from which a start is found: where no variant holds, the lines without
/// such filters give others. What of it is a torque lag, the search finds after.
void CandidateFits::add_filtered(DriveCandidate& candidate) const {
  for (const auto& v : candidate.variants)
    if (v.second.model_error < kCriteria.true_enough) return;
  const Variant plain{candidate.structure, false, false, false, demanded(candidate.structure)};
  if (!allowed(false) || !offered(plain, fit::kOutputFilter)) return;
  const Variant filtered = with(plain, fit::kOutputFilter);
  std::optional<fit::ResponseFit> best;
  for (const double samples : {0.7, 1.4, 2.8, 5.6, 11.0, 22.0}) {
    fit::ResponseFitConfig config;
    config.structure = candidate.structure;
    config.sample_time_s = records_.front().sample_time_s();
    config.known_delay_s = options_.delay_s;
    config.further = plain.further;
    config.torque_lag_s = options_.torque_lag_s.value_or(0.0);
    const double filter_s = samples * config.sample_time_s;
    auto start = fit::fit_response(unfiltered(response_, filter_s, config.sample_time_s), config);
    if (!start) continue;
    start->model.output_filter_s = filter_s;
    auto fit = response_fit(filtered, start->model, true);
    constexpr double kSame = 1e-3;
    const bool again = fit && best && std::abs(fit->likelihood - best->likelihood) < kSame;
    if (fit && (!best || fit->likelihood < best->likelihood)) best = std::move(fit);
    if (again || (best && best->model_error < kCriteria.true_enough)) break;
  }
  if (!best) return;
  const auto& front = candidate.variants.front().second;
  const double repeated = std::min(front.repetition, best->repetition);
  if (!(best->bic_for(repeated) + kCriteria.biased_lines < front.bic_for(repeated))) return;
  candidate.variants.insert(candidate.variants.begin(), {filtered, std::move(*best)});
  extend_by_response(candidate);
}

/// To the test a lag, a filter, the mean over a sample and the delay that stands in their place are alike.
std::vector<Variant> CandidateFits::instead_of_delay(const Variant& variant, bool combined) const {
  std::vector<Variant> others;
  if (!variant.delay && !lags(variant)) return others;
  Variant bare = without_lags(variant);
  bare.delay = false;
  for (const auto velocity : {fit::Velocity::sampled, fit::Velocity::differences}) {
    const bool own = velocity == variant.velocity, differs = velocity == fit::Velocity::differences;
    if (differs && records_.front().output_quantity != data::OutputQuantity::velocity) continue;
    bare.velocity = velocity;
    if (differs && (!own || lags(variant))) others.push_back(bare);
    for (const auto p : {fit::kTorqueLag, fit::kOutputFilter}) {
      if (!offered(bare, p) || (differs && !own && !combined)) continue;
      if (!own || variant.delay || !variant.has(p)) others.push_back(with(bare, p));
      if (own && variant.delay && !variant.has(p) && (combined || p == fit::kTorqueLag))
        others.push_back(with(variant, p));
    }
  }
  return others;
}

void CandidateFits::drop_ruled_out(std::vector<Variant>& variants, const Variant& own,
                                   const fit::DriveModel& found) const {
  if (variants.empty()) return;
  const auto by_lines = [&](Variant v) {
    auto fit = response_fit(v, start_of_other(v, own, found), true);
    if (fit || !v.friction) return fit;
    v.friction = false;  // it came out as one that drives: the least there is, is none
    return response_fit(v, start_of_other(v, own, found), true);
  };
  const auto told = by_lines(own);
  if (!told || told->model_error > kCriteria.misfit) return;
  std::vector<std::optional<fit::ResponseFit>> others(variants.size());
  linalg::for_each_index(variants.size(), options_.jobs,
                         [&](std::size_t i) { others[i] = by_lines(variants[i]); });
  std::vector<Variant> left;
  for (std::size_t i = 0; i < variants.size(); ++i) {
    const auto& other = others[i];
    const double repeated = other ? std::min(told->repetition, other->repetition) : 1.0;
    if (!other || other->bic_for(repeated) <= told->bic_for(repeated) + kCriteria.ruled_out)
      left.push_back(variants[i]);
  }
  variants = std::move(left);
}

std::optional<RecordFit> CandidateFits::fit_to_records_as_it_slides(const Variant& variant,
                                                                    const fit::DriveModel& start,
                                                                    const RecordFit& found) const {
  if (!variant.any_dry()) return fit_to_records(variant, start, std::nullopt, &found);
  auto fit = fit_records(records_, as_it_slides(variant, start, found));
  if (!fit || !fit->converged) return std::nullopt;
  return fit;
}

/// The score test says what would pay, before it is fitted. Along a motion with dry friction every fit takes
/// long: what is to be compared is fitted with the friction that was found, and only the best with its own.
void CandidateFits::extend_by_record(DriveCandidate& candidate, bool instead_of_others) const {
  constexpr double kRounding = 1e-6;  // per cent of the output that a fit leaves
  for (int round = 0; round < kMostExtras && candidate.record_fit; ++round) {
    const RecordFit& found = *candidate.record_fit;
    const bool exact = found.fit_percent > 100.0 - kRounding;  // nothing is left to add
    std::array<double, fit::kParameterCount> gain{};
    for (const auto& record : found.records)
      for (const auto& l : record.lacking) gain[static_cast<std::size_t>(l.parameter)] += l.gain;
    // What chance alone adds up to over several records, one degree of freedom each, with three deviations.
    const double others = static_cast<double>(found.records.size() - 1);
    const double clearly = kCriteria.clearly_better + others + 3.0 * std::sqrt(2.0 * others);
    const Variant variant = candidate.record_variant;
    std::vector<Variant> wider;
    for (const auto p : kExtras) {
      if (exact || gain[static_cast<std::size_t>(p)] < clearly || !offered(variant, p)) continue;
      if (p == fit::kOutputFilter && offered(variant, fit::kTorqueLag) &&
          gain[fit::kTorqueLag] > gain[fit::kOutputFilter])
        continue;
      wider.push_back(with(variant, p));
    }
    auto instead = instead_of_others ? instead_of_delay(variant, true) : std::vector<Variant>();
    drop_ruled_out(instead, variant, found.model);
    wider.insert(wider.end(), instead.begin(), instead.end());
    if (wider.empty()) return;
    const auto fitted = [&](const Variant& v, const fit::DriveModel& start) {
      return fit_to_records_as_it_slides(v, start, found);
    };
    auto best = variant.any_dry() ? fitted(variant, found.model) : std::optional(found);
    if (!best) return;
    const fit::DriveModel before = best->model;
    double least = best->bic;
    std::optional<Variant> chosen;
    std::set<std::string> names;
    std::erase_if(wider, [&](const Variant& v) { return !names.insert(name_of(v)).second; });
    std::optional<RecordFit> by_differences;
    const auto compare = [&](const std::vector<Variant>& variants) {
      std::vector<Trial<RecordFit>> trials(variants.size());
      linalg::for_each_index(variants.size(), 0, [&](std::size_t i) {
        trials[i] = trial<RecordFit>(
            variants[i], variant,
            [&](const Variant& v) { return fitted(v, start_of_other(v, variant, found.model)); },
            [&](const Variant& v, const fit::DriveModel& model) { return fitted(v, start_of(v, model)); });
      });
      for (auto& t : trials) {
        if (t.is_another() && !names.insert(name_of(t.variant)).second) continue;
        if (!t.fit || implausible(t.variant, t.fit->model)) continue;
        if (!lags(t.variant) && t.variant.velocity == fit::Velocity::differences) by_differences = t.fit;
        const double price = price_of(t.variant, variant, kCriteria.clearly_better);
        if (!(t.fit->bic + price < least)) continue;
        least = t.fit->bic + price;
        best = std::move(t.fit);
        chosen = t.variant;
      }
    };
    // What differences alone leave says what a lag beside them can gain at most: score tests are of a
    // parabola, a bound to three times as much leaves room.
    const auto lagging = std::stable_partition(wider.begin(), wider.end(), [](const Variant& v) {
      return !lags(v) || v.velocity != fit::Velocity::differences;
    });
    compare({wider.begin(), lagging});
    constexpr double kRoom = 3.0;
    if (!by_differences || by_differences->bic - kRoom * gain_of_lags(*by_differences) <= least)
      compare({lagging, wider.end()});
    if (!chosen) return;
    if (variant.any_dry()) {
      const fit::DriveModel as_it_slides = best->model;
      best = fit_to_records(*chosen, best->model, friction_of(found));
      if (!best || implausible(*chosen, best->model) ||
          !(best->bic + price_of(*chosen, variant, kCriteria.clearly_better) < found.bic)) {
        hold_alternative(before, as_it_slides, candidate.record_fit->model);
        return;
      }
    }
    candidate.record_fit = std::move(best);
    candidate.record_variant = *chosen;
  }
}

}  // namespace resonid::identification::detail
