// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <fit/black_box/structure_search.hpp>

namespace resonid::fit::detail {
namespace {

constexpr std::size_t kMostFurther = 50;  // samples

/// A real pole that may be an integrator's, or that is kept at the edge of what a search allows.
bool may_integrate(const BlackBoxModel& model) {
  constexpr double kStandardDeviations = 3.0, kOutside = 1.0 + 1e-9;
  for (const auto& pole : model.poles()) {
    if (pole.value.imag() != 0.0) continue;
    const double away = std::abs(pole.value.real() - 1.0);
    if (pole.value.real() > kOutside ||
        away <= kStandardDeviations * std::sqrt(std::max(0.0, pole.covariance(0, 0))))
      return true;
  }
  return false;
}

}  // namespace

StructureSearch::StructureSearch(const data::Record& record, const OrderSelectionConfig& config)
    : record_(record), config_(config), base_(config.model) {
  base_.quick = true;
  base_.predictor = Predictor::open_loop;
  base_.holdout = holdout_parts(record.samples());
}

expected<Attempt, Error> StructureSearch::attempted(const BlackBoxConfig& config) const {
  auto fit = fit_black_box(record_, config);
  if (!fit) return unexpected(fit.error());
  if (!fit->model.realisation.present()) return refuse("order", "found no model", config.order);
  Attempt attempt{config, std::move(*fit)};
  attempt.config.start = attempt.fit.model.realisation;
  return attempt;
}

bool StructureSearch::has_further_delay(const Attempt& attempt) const {
  return attempt.config.delay_samples != base_.delay_samples ||
         attempt.config.direct_term != base_.direct_term;
}

void StructureSearch::try_integrator(Attempt& best) const {
  if (!config_.integrator || best.config.integrator || !may_integrate(best.fit.model)) return;
  BlackBoxConfig config = best.config;
  config.integrator = true;
  auto fixed = attempted(config);
  if (fixed && (fixed->fit.bic < best.fit.bic || !best.fit.converged || !best.fit.stable))
    best = std::move(*fixed);
}

void StructureSearch::try_delay(Attempt& best, std::size_t samples, bool direct) const {
  BlackBoxConfig config = best.config;
  config.delay_samples = samples;
  config.direct_term = direct;
  auto attempt = attempted(config);
  if (attempt && attempt->fit.bic < best.fit.bic) best = std::move(*attempt);
}

/// Whole samples, from the record's beginning without a noise model: the denominator hardly depends on them.
std::size_t StructureSearch::rough_delay(const Attempt& known) const {
  constexpr std::size_t kEnough = 6000;
  const auto part = data::part_of(record_, 0, std::min(kEnough, record_.samples()));
  BlackBoxConfig config = known.config;
  config.noise_model = false;
  config.holdout.clear();
  double least = 0.0;
  std::size_t best = base_.delay_samples;
  for (const std::size_t further : {0U, 1U, 2U, 3U, 4U, 6U, 8U, 11U, 16U, 22U, 32U, 45U}) {
    config.delay_samples = base_.delay_samples + further;
    const auto fit = fit_black_box(part, config);
    if (!fit || !fit->model.realisation.present() || (further > 0 && fit->bic >= least)) continue;
    least = fit->bic;
    best = config.delay_samples;
  }
  return best;
}

void StructureSearch::find_delay(Attempt& best) const {
  constexpr int kDescribed = 3;  // orders up to which the delay is looked for afresh
  const Attempt known = best;
  const auto lowest = base_.delay_samples > 0 ? base_.delay_samples - 1 : 0;
  if (known.config.order <= kDescribed || config_.lowest == config_.highest) {
    const std::size_t rough = rough_delay(known);
    if (rough != base_.delay_samples || base_.direct_term) try_delay(best, rough, false);
    for (std::size_t at = best.config.delay_samples;;) {
      if (at > lowest) try_delay(best, at - 1, false);
      if (best.config.delay_samples == at && at < base_.delay_samples + kMostFurther)
        try_delay(best, at + 1, false);
      if (best.config.delay_samples == at) break;
      at = best.config.delay_samples;
    }
    const std::size_t whole = best.config.delay_samples;
    for (const std::size_t late : {0U, 1U, 2U})
      if (whole + late > 0) try_delay(best, whole + late, true);
  } else if (before_ &&
             (before_->delay_samples != base_.delay_samples || before_->direct_term != base_.direct_term)) {
    try_delay(best, before_->delay_samples, before_->direct_term);
  }
  // The known delay is only given up for one that is clearly better.
  constexpr double kClearly = 10.0;  // in the criterion
  if (has_further_delay(best) && best.fit.bic + kClearly > known.fit.bic) best = known;
}

expected<Attempt, Error> StructureSearch::of_order(int order) {
  BlackBoxConfig config = base_;
  config.order = order;
  auto best = attempted(config);
  if (!best) return best;
  try_integrator(*best);
  if (config_.further_delay) {
    find_delay(*best);
    try_integrator(*best);
  }
  before_ = best->config;
  return best;
}

}  // namespace resonid::fit::detail
