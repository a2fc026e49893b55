// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <limits>
#include <resonid/fit/order_selection.hpp>

namespace resonid::fit {
namespace {

data::Record part_of(const data::Record& record, std::size_t first, std::size_t last) {
  data::Record part = record;
  for (auto* channel : {&part.input, &part.output, &part.excitation, &part.reference, &part.position}) {
    auto& x = channel->samples;
    if (x.size() < last) continue;
    x.assign(x.begin() + static_cast<std::ptrdiff_t>(first), x.begin() + static_cast<std::ptrdiff_t>(last));
  }
  return part;
}

struct Squares {
  std::vector<double> values;
  OrderTrial trial;
};

/// Mean and standard error of the difference of two squared errors; neighbours are correlated, so the error
/// is that of stretches.
void compare(Squares& s, const Squares& best) {
  constexpr std::size_t kStretches = 20;
  const std::size_t length = s.values.size() / kStretches;
  double sum = 0.0, squares = 0.0;
  for (std::size_t i = 0; i < kStretches; ++i) {
    double mean = 0.0;
    for (std::size_t k = i * length; k < (i + 1) * length; ++k)
      mean += (s.values[k] - best.values[k]) / static_cast<double>(length);
    sum += mean;
    squares += mean * mean;
  }
  const double n = static_cast<double>(kStretches);
  s.trial.excess = s.trial.mean_square - best.trial.mean_square;
  s.trial.standard_error = std::sqrt(std::max(0.0, squares / n - sum * sum / (n * n)) / (n - 1.0));
}

bool is_sound(const OrderTrial& trial) { return trial.converged && trial.stable; }

double variance_of(const std::vector<double>& x) {
  double sum = 0.0, squares = 0.0;
  for (const double v : x) sum += v;
  const double mean = sum / static_cast<double>(x.size());
  for (const double v : x) squares += (v - mean) * (v - mean);
  return squares / static_cast<double>(x.size());
}

std::optional<Squares> tried(const data::Record& first, const data::Record& rest,
                             const BlackBoxConfig& model) {
  const auto fit = fit_black_box(first, model);
  if (!fit || !fit->model.realisation.present()) return std::nullopt;
  const auto left = simulation_residual(rest, fit->model, model);
  if (!left) return std::nullopt;
  Squares s;
  s.trial.order = model.order;
  s.trial.converged = fit->converged;
  s.trial.stable = fit->stable;
  s.trial.information = fit->information;
  // The initial state and the constant were fitted to the rest itself.
  const double n = static_cast<double>(left->size());
  const double lost = model.order + 1.0;
  for (const double e : *left) s.values.push_back(e * e * n / std::max(1.0, n - lost));
  for (const double v : s.values) s.trial.mean_square += v / static_cast<double>(s.values.size());
  if (!std::isfinite(s.trial.mean_square)) return std::nullopt;
  s.trial.fit_percent = 100.0 * (1.0 - std::sqrt(s.trial.mean_square / variance_of(rest.output.samples)));
  return s;
}

}  // namespace

expected<OrderSelection, ConfigError> select_order(const data::Record& record,
                                                   const OrderSelectionConfig& config) {
  if (config.lowest < 1 || config.highest > 20 || config.lowest > config.highest)
    return refuse("highest", "orders must be 1 ... 20, the lowest first", config.highest);
  if (!(config.estimation_share >= 0.3 && config.estimation_share <= 0.9))
    return refuse("estimation_share", "must be 0.3 ... 0.9", config.estimation_share);
  BlackBoxConfig model = config.model;
  const auto split =
      static_cast<std::size_t>(config.estimation_share * static_cast<double>(record.samples()));
  const auto first = part_of(record, 0, split), rest = part_of(record, split, record.samples());
  std::vector<Squares> all;
  for (model.order = config.lowest; model.order <= config.highest; ++model.order)
    if (auto s = tried(first, rest, model)) all.push_back(std::move(*s));
  if (all.empty()) {
    model.order = config.lowest;
    if (auto error = fit_black_box(first, model); !error) return unexpected(error.error());
    return refuse("record", "its last part is too short or does not vary");
  }
  // What neither converged nor is stable competes only when nothing else is left.
  const bool sound = std::any_of(all.begin(), all.end(), [](const Squares& s) { return is_sound(s.trial); });
  const Squares best = *std::min_element(all.begin(), all.end(), [=](const Squares& a, const Squares& b) {
    if (sound && is_sound(a.trial) != is_sound(b.trial)) return is_sound(a.trial);
    return a.trial.mean_square < b.trial.mean_square;
  });
  OrderSelection selection;
  constexpr double kStandardErrors = 2.0;
  // Errors of the size of rounding tell nothing apart.
  const double rounding = 1e-18 * variance_of(rest.output.samples);
  std::vector<int> equals;
  for (auto& s : all) {
    compare(s, best);
    if (is_sound(s.trial) == sound && s.trial.excess <= kStandardErrors * s.trial.standard_error + rounding)
      equals.push_back(s.trial.order);
    selection.trials.push_back(s.trial);
  }
  for (const int order : equals) {
    model.order = order;
    auto fit = fit_black_box(record, model);
    if (!fit) return unexpected(fit.error());
    const bool done = fit->converged && fit->stable;
    if (selection.order != 0 && !done) continue;
    selection.order = order;
    selection.fit = std::move(*fit);
    if (done) break;
  }
  return selection;
}

}  // namespace resonid::fit
