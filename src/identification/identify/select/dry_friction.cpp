// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <identification/criteria.hpp>
#include <identification/identify/select/drive_candidate.hpp>
#include <utility>

namespace resonid::identification::detail {
namespace {

/// Dry friction that the fit tells from none.
bool finds_dry_friction(const std::optional<RecordFit>& fit) {
  return fit && fit->coulomb_friction &&
         fit->coulomb_friction->value > kCriteria.dry_friction_found * fit->coulomb_friction->std;
}

/// What a variant has more when it has this too.
Variant with(Variant variant, const fit::FurtherFriction& friction) {
  variant.load_dry = friction.load_coulomb.has_value();
  variant.stribeck = friction.breakaway.has_value();
  return variant;
}

/// Torques and velocities of dry friction are told from none.
bool plausible(const RecordFit& fit) {
  constexpr double kClearly = 3.0;  // standard deviations
  const auto& f = fit.further_friction;
  for (const auto& e : {fit.coulomb_friction, f.load_coulomb, f.breakaway, f.stribeck_velocity})
    if (e && !(e->value > kClearly * e->std)) return false;
  // Coulomb's alone is no breakaway; as if the errors of both were independent.
  return !f.breakaway || !fit.coulomb_friction ||
         f.breakaway->value - fit.coulomb_friction->value >
             kClearly * std::hypot(f.breakaway->std, fit.coulomb_friction->std);
}

/// Step of a velocity that comes by counts, 0 for any other.
double step_of(const data::Record& record) {
  const auto& y = record.output.samples;
  std::vector<double> moves;
  for (std::size_t k = 1; k < y.size(); ++k)
    if (y[k] != y[k - 1]) moves.push_back(std::abs(y[k] - y[k - 1]));
  if (moves.empty()) return 0.0;
  constexpr double kRounding = 1e-6, kNear = 0.05, kMost = 0.02;
  const double largest = *std::max_element(moves.begin(), moves.end());
  double step = largest;
  for (const double m : moves)
    if (m > kRounding * largest) step = std::min(step, m);
  const auto off = std::count_if(moves.begin(), moves.end(),
                                 [&](double m) { return std::abs(m / step - std::round(m / step)) > kNear; });
  if (static_cast<double>(off) > kMost * static_cast<double>(moves.size())) return 0.0;
  return record.output_quantity == data::OutputQuantity::position ? step * record.sample_rate_hz : step;
}

/// Whether the record tells the speeds at which friction falls: at a count or two, errors are no noise.
bool resolves(std::span<const data::Record> records, const fit::FurtherFriction& friction) {
  constexpr double kSteps = 3.0;
  return !friction.stribeck_velocity ||
         std::none_of(records.begin(), records.end(), [&](const data::Record& record) {
           return friction.stribeck_velocity->value < kSteps * step_of(record);
         });
}

}  // namespace

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
  if (!finds_dry_friction(without)) {
    if (finds_dry_friction(fit)) return fit;
    const auto& told = fit ? fit : without;
    return told ? with_load_friction(variant = fit ? variant : alone, *told) : std::nullopt;
  }
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

std::optional<RecordFit> CandidateFits::with_load_friction(Variant& variant, const RecordFit& told) const {
  for (const auto& lack : told.lacking_friction) {
    if (!lack.start.load_coulomb || lack.gain < kCriteria.clearly_better) continue;
    Variant on_load = with(variant, lack.start);
    on_load.dry = false;
    auto fit = fit_to_records(on_load, told.model, FrictionStart{0.0, lack.start});
    if (!fit || !fit->further_friction.load_coulomb) continue;
    const auto& found = *fit->further_friction.load_coulomb;
    if (!(found.value > kCriteria.dry_friction_found * found.std)) continue;
    variant = on_load;
    return fit;
  }
  return std::nullopt;
}

void CandidateFits::try_dry_friction(DriveCandidate& candidate) const {
  if (!dry_friction_is_likely(candidate)) return;
  Variant variant = candidate.variant();
  auto fit = with_dry_friction(variant, candidate.model());
  if (!fit) return;
  extend_dry_friction(variant, *fit);
  const auto acceptable = [&] {
    const auto least = acceptance(candidate);
    return fit->fit_percent >= least.fit_percent ||
           difference(fit->model, response_).whole <= least.difference;
  };
  const bool better = !friction_is_free()    ? true
                      : candidate.record_fit ? fit->bic + kCriteria.clearly_better < candidate.record_fit->bic
                                             : acceptable();
  if (!better) return;
  candidate.record_fit = std::move(*fit);
  candidate.record_variant = variant;
}

void CandidateFits::extend_dry_friction(Variant& variant, RecordFit& found) const {
  constexpr int kRounds = 3;
  bool extended = false;
  for (int round = 0; round < kRounds && variant.any_dry(); ++round) {
    auto lacking = found.lacking_friction;
    std::sort(lacking.begin(), lacking.end(), [](const auto& a, const auto& b) { return a.gain > b.gain; });
    std::optional<RecordFit> best;
    Variant chosen = variant;
    double least = found.bic;
    const auto consider = [&](const Variant& wider, const FrictionStart& start) {
      auto fit = fit_to_records(wider, found.model, start);
      if (!fit || !plausible(*fit) || !resolves(records_, fit->further_friction)) return;
      const double cost = fit->bic + std::max(0.0, price_of(wider, variant, kCriteria.clearly_better));
      if (!(cost < least)) return;
      least = cost;
      best = std::move(fit);
      chosen = wider;
    };
    bool tried_load = false, tried_stribeck = false;  // each by the start that gains most
    for (const auto& lack : lacking) {
      if (lack.gain < kCriteria.clearly_better) break;
      const Variant wider = with(variant, lack.start);
      const bool load = wider.load_dry && !variant.load_dry, stribeck = wider.stribeck && !variant.stribeck;
      if (stribeck && (!variant.dry || !resolves(records_, lack.start))) continue;
      if ((load && std::exchange(tried_load, true)) || (stribeck && std::exchange(tried_stribeck, true)))
        continue;
      consider(wider, {lack.coulomb_start, lack.start});
      if (!load || wider.stribeck) continue;
      Variant instead = wider;
      instead.dry = false;
      FrictionStart start{0.0, lack.start};
      start.further.load_coulomb->value = lack.coulomb_start;
      consider(instead, start);
    }
    if (!best) break;
    extended = true;
    found = std::move(*best);
    variant = chosen;
  }
  if (extended || variant.load_dry) drop_imitations(variant, found);
}

void CandidateFits::drop_imitations(Variant& variant, RecordFit& found) const {
  constexpr double kClearly = 3.0;  // standard deviations
  const auto stays = demanded(variant.structure);
  for (const auto p : std::vector<fit::Parameter>(variant.further)) {
    if (std::find(stays.begin(), stays.end(), p) != stays.end()) continue;
    const auto e = found.model.estimate(p);
    if (e.value > kClearly * e.std) continue;
    Variant less = variant;
    std::erase(less.further, p);
    auto fit = fit_to_records(less, start_of(less, found.model), friction_of(found));
    if (!fit || !plausible(*fit) || !resolves(records_, fit->further_friction) ||
        !(fit->bic < found.bic + kCriteria.clearly_better))
      continue;
    found = std::move(*fit);
    variant = less;
  }
}

}  // namespace resonid::identification::detail
