// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <fit/black_box/structure_search.hpp>
#include <limits>
#include <numeric>
#include <resonid/fit/detail/order_selection.hpp>

namespace resonid::fit {
namespace {

using detail::Attempt;
using detail::StructureSearch;

struct Candidate {
  Attempt attempt;
  OrderTrial trial;
};

double square(double x) { return x * x; }

/// Mean and standard error of the difference of two squared errors; neighbours are correlated, so the error
/// is that of stretches: two of each hold-out part.
void compare(Candidate& s, const Candidate& best,
             const std::vector<std::pair<std::size_t, std::size_t>>& parts) {
  const auto &own = s.attempt.fit.holdout, &other = best.attempt.fit.holdout;
  double sum = 0.0, squares = 0.0, n = 0.0;
  const auto add = [&](std::size_t from, std::size_t to) {
    double mean = 0.0, count = 0.0;
    for (std::size_t k = from; k < to; ++k)
      if (std::isfinite(own[k]) && std::isfinite(other[k]))
        mean += square(own[k]) - square(other[k]), count += 1.0;
    if (count == 0.0) return;
    sum += mean / count;
    squares += square(mean / count);
    n += 1.0;
  };
  for (const auto& [from, to] : parts) {
    const std::size_t middle = (from + to) / 2;
    add(from, middle);
    add(middle, to);
  }
  s.trial.excess = s.trial.mean_square - best.trial.mean_square;
  s.trial.standard_error = std::sqrt(std::max(0.0, squares / n - square(sum / n)) / std::max(1.0, n - 1.0));
}

bool is_sound(const OrderTrial& trial) { return trial.converged && trial.stable; }

double mean_square(const std::vector<double>& x) {
  double sum = 0.0, count = 0.0;
  for (const double v : x)
    if (std::isfinite(v)) sum += square(v), count += 1.0;
  return count > 0.0 ? sum / count : std::numeric_limits<double>::infinity();
}

OrderTrial trial_of(const Attempt& a) {
  OrderTrial t;
  t.order = a.config.order;
  t.delay_samples = a.config.delay_samples;
  t.direct_term = a.config.direct_term;
  t.integrator = a.config.integrator;
  t.converged = a.fit.converged;
  t.stable = a.fit.stable;
  t.mean_square = mean_square(a.fit.holdout);
  t.fit_percent = a.fit.holdout_fit_percent;
  t.bic = a.fit.bic;
  return t;
}

bool criterion_has_grown(const std::vector<Candidate>& all) {
  constexpr std::size_t kTimes = 3;
  if (all.size() <= kTimes) return false;
  const auto least = std::min_element(all.begin(), all.end(), [](const Candidate& a, const Candidate& b) {
    return a.trial.bic < b.trial.bic;
  });
  return static_cast<std::size_t>(all.end() - least) > kTimes;
}

/// Of the chosen structure, to the whole record. A further delay becomes a parameter.
expected<BlackBoxFit, Error> whole_fit(const data::Record& record, const Attempt& chosen,
                                       const BlackBoxConfig& asked, bool further_delay) {
  BlackBoxConfig config = asked;
  config.order = chosen.config.order;
  config.delay_samples = chosen.config.delay_samples;
  config.direct_term = chosen.config.direct_term;
  config.integrator = chosen.config.integrator;
  config.start = chosen.fit.model.realisation;
  if (further_delay && config.delay_samples > 0) config.direct_term = true;
  return fit_black_box(record, config);
}

}  // namespace

double OrderTrial::holdout_score(std::size_t holdout) const {
  return static_cast<double>(holdout) * std::log(std::max(mean_square, 1e-300));
}

std::vector<std::pair<std::size_t, std::size_t>> holdout_parts(std::size_t samples) {
  constexpr std::size_t kParts = 10;
  std::vector<std::pair<std::size_t, std::size_t>> parts;
  for (std::size_t i = 0; i < kParts; ++i)
    parts.emplace_back((10 * i + 7) * samples / (10 * kParts), (i + 1) * samples / kParts);
  return parts;
}

expected<OrderSelection, Error> select_order(const data::Record& record, const OrderSelectionConfig& config) {
  if (config.lowest < 1 || config.highest > 20 || config.lowest > config.highest)
    return refuse("highest", "orders must be 1 ... 20, the lowest first", config.highest);
  const auto parts = holdout_parts(record.samples());
  StructureSearch search(record, config);
  std::vector<Candidate> all;
  std::optional<Error> why_not;
  for (int order = config.lowest; order <= config.highest && !criterion_has_grown(all); ++order) {
    auto attempt = search.of_order(order);
    if (!attempt && !why_not) why_not = attempt.error();
    if (!attempt) continue;
    const auto trial = trial_of(*attempt);
    if (std::isfinite(trial.mean_square)) all.push_back({std::move(*attempt), trial});
  }
  if (all.empty()) {
    if (why_not) return unexpected(*why_not);
    return refuse("record", "is too short to spare hold-out data");
  }
  // What neither converged nor is stable competes only when nothing else is left.
  const bool sound =
      std::any_of(all.begin(), all.end(), [](const Candidate& s) { return is_sound(s.trial); });
  const auto best = std::min_element(all.begin(), all.end(), [=](const Candidate& a, const Candidate& b) {
    if (sound && is_sound(a.trial) != is_sound(b.trial)) return is_sound(a.trial);
    return a.trial.mean_square < b.trial.mean_square;
  });
  OrderSelection selection;
  selection.holdout = static_cast<std::size_t>(std::count_if(best->attempt.fit.holdout.begin(),
                                                             best->attempt.fit.holdout.end(),
                                                             [](double e) { return std::isfinite(e); }));
  constexpr double kStandardErrors = 2.0, kClearly = 10.0;  // the latter in N ln(mean square)
  // Errors of the size of rounding tell nothing apart.
  double power = 0.0;
  for (const double y : record.output.samples) power += y * y / static_cast<double>(record.samples());
  const double rounding = 1e-18 * power;
  for (auto& s : all) compare(s, *best, parts);
  for (const auto& s : all) selection.trials.push_back(s.trial);
  for (const auto& s : all) {
    if (is_sound(s.trial) != sound) continue;
    const bool beyond_chance = s.trial.excess > kStandardErrors * s.trial.standard_error + rounding;
    const double lost =
        s.trial.holdout_score(selection.holdout) - best->trial.holdout_score(selection.holdout);
    if (beyond_chance && lost > kClearly) continue;
    const bool further = search.has_further_delay(s.attempt);
    auto fit = whole_fit(record, s.attempt, config.model, further);
    if (!fit) return unexpected(fit.error());
    const bool done = fit->converged && fit->stable;
    if (selection.order != 0 && !done) continue;
    selection.order = s.trial.order;
    selection.further_delay = further;
    selection.fit = std::move(*fit);
    if (done) break;
  }
  return selection;
}

}  // namespace resonid::fit
