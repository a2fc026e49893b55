// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <drive_bound.hpp>
#include <optional>
#include <resonid/fit/output_error.hpp>
#include <resonid/io/shipped_experiments.hpp>
#include <string_view>
#include <vector>

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

/// The first `length_s` of a record.
inline data::Record cut_to(data::Record record, double length_s) {
  const auto samples = static_cast<std::size_t>(std::lround(length_s * record.sample_rate_hz));
  for (auto* channel :
       {&record.input, &record.output, &record.excitation, &record.reference, &record.position})
    if (channel->present()) channel->samples.resize(samples);
  return record;
}

/// Fits to the windows of `length_s` that follow each other in the first `total_s` of a shipped Publication
/// VI experiment, noise 0.1 rad/s: each window's own bound of the resonance, and for every seed and window
/// the error over that bound and over the stated error bar.
struct WindowErrors {
  std::vector<double> bound, over_bound, over_bar;
  int refused = 0;

  /// `wanted(k)`: whether window k is fitted.
  template <class Wanted>
  WindowErrors(std::string_view experiment, double length_s, double total_s, int seeds, Wanted wanted) {
    auto c = io::shipped_experiment(experiment);
    c.measurement.noise_rms = 0.1;
    c.run.duration_s = total_s;
    const double truth = drive_figures(drive_parameters(c))(kResonance);
    const int windows = static_cast<int>(std::lround(total_s / length_s));
    for (int seed = 1; seed <= seeds; ++seed) {
      c.run.seed = static_cast<std::uint64_t>(seed);
      const auto whole = simulated(c, std::vector<double>{5.0}).record;
      std::size_t at = 0;
      for (int k = 0; k < windows; ++k) {
        if (!wanted(k)) continue;
        const auto record = cut_to(cut_from(whole, length_s * k), length_s);
        if (seed == 1) bound.push_back(std::sqrt(bound_of_logarithms(c, record)(kResonance, kResonance)));
        add(fitted_from_scratch(record, c.measurement.delay_s), truth, bound[at++]);
      }
    }
  }
  [[nodiscard]] static double rms(const std::vector<double>& x) {
    double sum = 0.0;
    for (const double v : x) sum += v * v;
    return std::sqrt(sum / static_cast<double>(x.size()));
  }
  /// Errors of more than three bars, among `count` from `first` on.
  [[nodiscard]] int beyond(int first, int count) const {
    const auto begin = over_bar.begin() + first;
    return static_cast<int>(std::count_if(begin, begin + count, [](double z) { return std::abs(z) > 3.0; }));
  }
  [[nodiscard]] int beyond() const { return beyond(0, static_cast<int>(over_bar.size())); }

 private:
  static constexpr int kResonance = 4;

  void add(const std::optional<fit::OutputErrorFit>& fit, double truth, double own_bound) {
    if (!fit) {
      ++refused;
      return;
    }
    const auto e = fit->model.resonance();
    over_bound.push_back((e.value / truth - 1.0) / own_bound);
    over_bar.push_back((e.value - truth) / e.std);
  }
};

}  // namespace resonid::test
