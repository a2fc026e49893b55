// SPDX-License-Identifier: MIT
#include <algorithm>
#include <identification/criteria.hpp>
#include <identification/identify/select/drive_candidate.hpp>

namespace resonid::identification::detail {
namespace {

/// Dry friction that the fit tells from none.
bool finds_dry_friction(const std::optional<RecordFit>& fit) {
  return fit && fit->coulomb_friction &&
         fit->coulomb_friction->value > kCriteria.dry_friction_found * fit->coulomb_friction->std;
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

void CandidateFits::try_dry_friction(DriveCandidate& candidate) const {
  if (!dry_friction_is_likely(candidate)) return;
  Variant variant = candidate.variant();
  auto fit = with_dry_friction(variant, candidate.model());
  if (!fit) return;
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

}  // namespace resonid::identification::detail
