// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <identification/black_box_selection.hpp>
#include <identification/uncertainty.hpp>
#include <resonid/base/constants.hpp>
#include <resonid/fit/order_selection.hpp>

namespace resonid::identification::detail {
namespace {

fit::BlackBoxConfig configured(const data::Record& record, const Options& options) {
  fit::BlackBoxConfig config;
  config.delay_samples = static_cast<std::size_t>(std::lround(options.delay_s * record.sample_rate_hz));
  if (options.approach == Approach::joint) config.predictor = fit::Predictor::joint;
  if (options.approach == Approach::indirect) {
    config.predictor = fit::Predictor::closed_loop;
    config.controller = options.controller;
  }
  return config;
}

std::string name_of_order(int order) { return fmt::format("black-box of order {}", order); }

std::vector<diagnostics::Finding> inspected(const BlackBoxResult& result) {
  std::vector<diagnostics::Finding> findings;
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

BlackBoxSelection taken(fit::BlackBoxFit fit) {
  BlackBoxSelection s;
  s.result = {std::move(fit.model), fit.fit_percent, fit.converged, fit.stable};
  s.findings = inspected(s.result);
  s.residual = std::move(fit.residual);
  s.residual_start = fit.first_sample;
  return s;
}

}  // namespace

expected<BlackBoxSelection, Refusal> select_black_box(const data::Record& record, const Options& options) {
  if (options.approach == Approach::indirect && record.output_quantity != data::OutputQuantity::velocity)
    return tl::unexpected(
        Refusal{"approach",
                "indirect with --model black-box needs a recorded velocity, which is what the "
                "controller is fed; found another output"});
  auto config = configured(record, options);
  const auto refused = [](const ConfigError& error) {
    return tl::unexpected(Refusal{"model", fmt::format("black-box: {} {}", error.field, error.requirement)});
  };
  if (options.order != 0) {
    config.order = static_cast<int>(options.order);
    auto fit = fit::fit_black_box(record, config);
    if (!fit) return refused(fit.error());
    auto s = taken(std::move(*fit));
    s.choice = {"structure", name_of_order(config.order), "asked for"};
    return s;
  }
  fit::OrderSelectionConfig search;
  search.model = config;
  auto selected = fit::select_order(record, search);
  if (!selected) return refused(selected.error());
  auto s = taken(std::move(selected->fit));
  s.choice = {"structure", name_of_order(selected->order),
              s.findings.empty() ? "lowest order that simulates the part held back as well as any whose fit "
                                   "converged and is stable"
                                 : "lowest order that simulates the part held back as well as any"};
  for (const auto& t : selected->trials) {
    StructureTrial trial;
    trial.name = name_of_order(t.order);
    trial.parameters = static_cast<std::size_t>(2 * t.order);
    trial.information = t.information;
    trial.validation_fit_percent = t.fit_percent;
    trial.chosen = t.order == selected->order;
    if (!t.converged)
      trial.remark = "did not converge";
    else if (!t.stable)
      trial.remark = "unstable";
    s.structures.push_back(std::move(trial));
  }
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
