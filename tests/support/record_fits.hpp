// SPDX-License-Identifier: MIT
#pragma once

#include <drive_bound.hpp>
#include <optional>
#include <resonid/fit/output_error.hpp>
#include <resonid/io/shipped_experiments.hpp>
#include <string_view>

// Physical fits to records alone: the start is found from the record, nothing is told but the delay.
namespace resonid::test {

inline std::optional<fit::OutputErrorFit> fitted_from_scratch(const data::Record& record,
                                                              double known_delay_s, bool at_rest = false) {
  std::optional<fit::OutputErrorFit> best;
  fit::OutputErrorConfig config;
  config.known_delay_s = known_delay_s;
  config.initial_state = config.offset = !at_rest;
  for (const auto& start : fit::initial_models(record, known_delay_s)) {
    config.initial = start;
    auto fit = fit::fit_output_error(record, config);
    if (fit && fit->converged && (!best || fit->bic < best->bic)) best = std::move(*fit);
  }
  return best;
}

/// Shipped Publication VI experiment with noise 0.1 rad/s, `duration_s` of it (0: all) from `from_s` on.
inline Efficiency efficiency(std::string_view experiment, double from_s, double duration_s,
                             std::uint64_t first, int seeds) {
  Efficiency result;
  auto c = io::shipped_experiment(experiment);
  c.measurement.noise_rms = 0.1;
  if (duration_s > 0.0) c.run.duration_s = from_s + duration_s;
  std::optional<Eigen::MatrixXd> bound;
  for (int i = 0; i < seeds; ++i) {
    c.run.seed = first + static_cast<std::uint64_t>(i);
    const auto record = cut_from(simulated(c, std::vector<double>{5.0}).record, from_s);
    if (!bound) bound = bound_of_logarithms(c, record);  // of one seed: the input's noise hardly matters
    const auto fit = fitted_from_scratch(record, c.measurement.delay_s);
    if (!fit) {
      ADD_FAILURE() << "no fit for seed " << c.run.seed;
      continue;
    }
    result.add(fit->model, c, *bound);
  }
  return result;
}

}  // namespace resonid::test
