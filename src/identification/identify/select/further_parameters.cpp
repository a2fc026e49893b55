// SPDX-License-Identifier: MIT
#include <array>
#include <cmath>
#include <identification/criteria.hpp>
#include <identification/identify/select/drive_candidate.hpp>
#include <utility>

// Parameters that are added to a variant one after the other, as the score tests say that they would pay.
namespace resonid::identification::detail {
namespace {

constexpr int kMostExtras = 3;

/// The model of one variant as a start for another: a delay that is left out may have been a lag.
fit::DriveModel start_of_other(const Variant& other, const Variant& own, fit::DriveModel model) {
  const double delay_s = other.delay ? 0.0 : std::exchange(model.delay_s, 0.0);
  if (other.has(fit::kTorqueLag) && !own.has(fit::kTorqueLag)) model.torque_lag_s = std::max(0.0, delay_s);
  return model;
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
    default:
      return options_.ground == Ground::automatic;
  }
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
      if (wider.grounded()) starts.emplace_back(std::nullopt);
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

}  // namespace resonid::identification::detail
