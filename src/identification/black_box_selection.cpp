// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <identification/black_box_selection.hpp>
#include <identification/trust.hpp>
#include <identification/uncertainty.hpp>
#include <resonid/base/constants.hpp>
#include <resonid/fit/detail/order_selection.hpp>

namespace resonid::identification::detail {
namespace {

std::string name_of_order(int order) { return fmt::format("black-box of order {}", order); }

std::vector<diagnostics::Finding> inspected(const BlackBoxResult& result) {
  std::vector<diagnostics::Finding> findings;
  if (result.further_delay)
    findings.push_back(further_delay(result.further_delay->value, result.model.known_delay_s));
  if (!result.converged)
    findings.push_back({"not-converged",
                        diagnostics::Severity::error,
                        {},
                        {},
                        "The search for the black-box model ended before it reached a minimum: its order is "
                        "probably too high for this record. Try a lower --order."});
  double largest = 0.0;
  for (const auto& pole : result.model.poles()) largest = std::max(largest, std::abs(pole.value));
  if (!result.stable)
    findings.push_back({"unstable-model", diagnostics::Severity::error, largest, 1.0,
                        fmt::format("The black-box model is unstable (a pole at |z| = {:.6g}), and its error "
                                    "bar does not excuse it: what the record holds is not that of a drive, "
                                    "or the order does not suit it. Try another --order.",
                                    largest)});
  return findings;
}

StructureTrial listed(const fit::OrderTrial& t, const fit::OrderSelection& selected) {
  StructureTrial trial;
  trial.name = name_of_order(t.order);
  trial.parameters = static_cast<std::size_t>(2 * t.order - (t.integrator ? 1 : 0) + (t.direct_term ? 1 : 0));
  trial.information = t.information;
  trial.validation_fit_percent = t.fit_percent;
  trial.validation_information = t.validation_information(selected.held_back);
  trial.chosen = t.order == selected.order;
  if (!t.converged)
    trial.remark = "did not converge";
  else if (!t.stable)
    trial.remark = "unstable";
  return trial;
}

std::vector<Choice> choices_of(const BlackBoxSelection& s, const fit::OrderSelection& selected, bool asked) {
  std::vector<Choice> choices;
  std::string why = "lowest order that predicts the parts held back as well as any";
  if (asked)
    why = "asked for";
  else if (s.result.converged && s.result.stable)
    why += " whose fit converged and is stable";
  choices.push_back({"structure", name_of_order(selected.order), why});
  const auto& model = s.result.model;
  if (model.realisation.integrator)
    choices.push_back({"integrator", "one pole fixed at z = 1",
                       "a pole lies within its error bar of 1, and the criterion is less with it there"});
  if (s.result.further_delay)
    choices.push_back({"delay",
                       fmt::format("{:.4g} +- {:.2g} ms further", 1e3 * s.result.further_delay->value,
                                   1e3 * s.result.further_delay->standard_deviation),
                       "the criterion is clearly less with it than with the known delay alone"});
  return choices;
}

}  // namespace

fit::BlackBoxConfig black_box_config(const data::Record& record, const Options& options) {
  fit::BlackBoxConfig config;
  constexpr double kWhole = 1e-3;  // of a sample
  const double samples = options.delay_s * record.sample_rate_hz;
  config.delay_samples = static_cast<std::size_t>(std::ceil(samples - kWhole));
  config.direct_term = std::abs(samples - std::round(samples)) > kWhole;
  config.known_delay_s = options.delay_s;
  if (options.approach == Approach::joint) config.predictor = fit::Predictor::joint;
  if (options.approach == Approach::indirect) {
    config.predictor = fit::Predictor::closed_loop;
    config.controller = options.controller;
  }
  return config;
}

fit::BlackBoxConfig black_box_config(const data::Record& record, const Options& options,
                                     const fit::BlackBoxModel& model) {
  auto config = black_box_config(record, options);
  const auto& r = model.realisation;
  config.order = static_cast<int>(model.transfer_function.denominator.size()) - 1;
  config.delay_samples = model.delay_samples;
  config.integrator = r.integrator;
  config.direct_term = r.taps.size() > (r.integrator ? 1 : 0);
  config.start = r;
  return config;
}

/// Where the poles are not those of a continuous plant, the sample within which the delay lies is known.
fit::Estimate delay_of(const fit::BlackBoxModel& model) {
  if (const auto delay = model.delay()) return *delay;
  const double ts = model.transfer_function.sample_time_s;
  constexpr double kUniform = 0.29;  // standard deviation over a sample
  return {(static_cast<double>(model.delay_samples) - 0.5) * ts, kUniform * ts};
}

expected<BlackBoxSelection, Error> select_black_box(const data::Record& record, const Options& options) {
  if (options.approach == Approach::indirect && record.output_quantity != data::OutputQuantity::velocity)
    return tl::unexpected(
        Error{"approach",
              "indirect with --model black-box needs a recorded velocity, which is what the "
              "controller is fed; found another output"});
  fit::OrderSelectionConfig search;
  search.model = black_box_config(record, options);
  search.further_delay = true;
  if (options.order != 0) search.lowest = search.highest = static_cast<int>(options.order);
  auto selected = fit::select_order(record, search);
  if (!selected)
    return tl::unexpected(Error{"model", fmt::format("black-box: {} {}", selected.error().field.view(),
                                                     selected.error().requirement.view())});
  BlackBoxSelection s;
  auto& fit = selected->fit;
  s.result = {fit.model, fit.fit_percent, fit.converged, fit.stable, {}};
  if (selected->further_delay) {
    s.result.further_delay = delay_of(fit.model);
    s.result.further_delay->value -= options.delay_s;
  }
  s.findings = inspected(s.result);
  s.residual = std::move(fit.residual);
  s.residual_start = fit.first_sample;
  s.choices = choices_of(s, *selected, options.order != 0);
  if (options.order == 0)
    for (const auto& t : selected->trials) s.structures.push_back(listed(t, *selected));
  return s;
}

std::vector<Resonance> resonances_of(const fit::BlackBoxModel& model, double low_hz, double high_hz) {
  std::vector<Resonance> found;
  for (const auto& root : roots_of(model)) {
    const double size = std::abs(root.value);
    const double f = size / kTwoPi;
    if (root.value.imag() <= 1e-9 * size || f < low_hz || f > high_hz) continue;
    const Eigen::Vector2d by_size(root.value.real() / size, root.value.imag() / size);
    const double std_hz = std::sqrt(std::max(0.0, by_size.dot(root.covariance * by_size))) / kTwoPi;
    const Eigen::Vector2d by_damping(-root.value.imag() * root.value.imag() / std::pow(size, 3),
                                     root.value.real() * root.value.imag() / std::pow(size, 3));
    const double damping_std = std::sqrt(std::max(0.0, by_damping.dot(root.covariance * by_damping)));
    found.push_back({root.kind == "zero", f, std_hz, -root.value.real() / size, true, damping_std});
  }
  std::sort(found.begin(), found.end(),
            [](const Resonance& a, const Resonance& b) { return a.frequency_hz < b.frequency_hz; });
  return found;
}

}  // namespace resonid::identification::detail
