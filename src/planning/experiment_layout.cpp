// SPDX-License-Identifier: MIT
#include "planning/experiment_layout.hpp"

#include <algorithm>
#include <cmath>
#include <resonid/excitation/chirp.hpp>
#include <resonid/excitation/metrics.hpp>
#include <resonid/excitation/prbs.hpp>

namespace resonid::planning::detail {
namespace {

constexpr double kMostSamples = 2e6;

double resonance_of(const RoughDrive& drive) { return data::resonance_hz(drive.model.parameters); }
bool elastic(const RoughDrive& drive) { return drive.model.structure == fit::Structure::two_mass; }

}  // namespace

Task::Task(const PlanConfig& c)
    : config(c),
      sample_rate_hz(1.0 / c.drive.model.sample_time_s),
      drives(possible_drives(c.drive, c.spread)),
      most_samples(
          static_cast<std::size_t>(std::min(kMostSamples, c.limits.time_s * sample_rate_hz + 1e-6))) {
  for (const auto& wish : c.wishes) names.push_back(wish.figure);
  const auto figures = figures_of(c.drive, names);
  for (std::size_t i = 0; i < names.size(); ++i)
    wanted.push_back(c.wishes[i].relative ? c.wishes[i].accuracy * std::abs(figures[i].value)
                                          : c.wishes[i].accuracy);
  for (const auto& drive : drives) {
    Eigen::MatrixXd gradients = figure_gradients(drive, names);
    const auto own = figures_of(drive, names);
    for (std::size_t i = 0; i < names.size(); ++i)
      gradients.row(static_cast<Eigen::Index>(i)) /=
          c.wishes[i].relative ? c.wishes[i].accuracy * std::abs(own[i].value) : c.wishes[i].accuracy;
    wishes.push_back(gradients);
  }
  const double most = 0.4 * sample_rate_hz;
  if (c.band_hz) {
    low_hz = c.band_hz->first;
    high_hz = c.band_hz->second;
  } else if (elastic(c.drive)) {
    low_hz = 0.1 * data::antiresonance_hz(c.drive.model.parameters);
    high_hz = std::min(2.3 * resonance_of(c.drive), most);
  } else {
    low_hz = 0.002 * sample_rate_hz;
    high_hz = 0.04 * sample_rate_hz;
  }
}

Extremes extremes_of(const Task& task, std::span<const double> excitation) {
  Extremes e;
  e.excitation = excitation::measure(excitation).peak;
  for (const auto& drive : task.drives) {
    const auto motion = simulate(drive, excitation);
    const auto torque = excitation::measure(motion.torque);
    const auto [low, high] = std::minmax_element(motion.position.begin(), motion.position.end());
    e.torque = std::max(e.torque, torque.peak);
    e.torque_rms = std::max(e.torque_rms, torque.rms);
    e.velocity = std::max(e.velocity, excitation::measure(motion.velocity).peak);
    e.stroke = std::max(e.stroke, *high - *low);
  }
  return e;
}

std::pair<double, std::string> most_used(const Limits& limits, const Extremes& e) {
  std::pair<double, std::string> most{0.0, "torque"};
  const auto consider = [&](double use, const char* name) {
    if (use > most.first) most = {use, name};
  };
  consider(e.torque / limits.torque, "torque");
  consider(e.excitation / limits.excitation, "excitation");
  consider(e.torque_rms / limits.torque_rms, "torque rms");
  consider(e.velocity / limits.velocity, "velocity");
  consider(e.stroke / limits.stroke, "stroke");
  return most;
}

void scale_to_limits(const Task& task, Experiment& x) {
  const auto extremes = extremes_of(task, x.excitation);
  const auto [use, name] = most_used(task.config.limits, extremes);
  const double factor = 1.0 / use;
  for (double& v : x.excitation) v *= factor;
  for (double& a : x.line_amplitude) a *= factor;
  x.extremes = {extremes.excitation * factor, extremes.torque * factor, extremes.torque_rms * factor,
                extremes.velocity * factor, extremes.stroke * factor};
  x.amplitude = x.extremes.excitation;
  x.binding = name;
  x.crest_factor = excitation::measure(x.excitation).crest_factor;
}

void evaluate(const Task& task, Experiment& x) {
  x.duration_s = static_cast<double>(x.excitation.size()) / task.sample_rate_hz;
  std::vector<double> square(task.names.size(), 0.0);
  for (std::size_t s = 0; s < task.drives.size(); ++s) {
    const RoughDrive told = predicted(task.drives[s], x.excitation);
    if (s == 0) x.figures = figures_of(told);
    const auto figures = figures_of(told, task.names);
    for (std::size_t i = 0; i < figures.size(); ++i) {
      const double wanted = task.config.wishes[i].relative
                                ? task.config.wishes[i].accuracy * std::abs(figures[i].value)
                                : task.config.wishes[i].accuracy;
      square[i] +=
          std::pow(figures[i].standard_deviation / wanted, 2) / static_cast<double>(task.drives.size());
    }
  }
  x.wished = figures_of(task.config.drive, task.names);
  x.ratio = 0.0;
  for (std::size_t i = 0; i < square.size(); ++i) {
    x.wished[i].standard_deviation = std::sqrt(square[i]) * task.wanted[i];
    x.ratio = std::max(x.ratio, std::sqrt(square[i]));
  }
  x.needed_s.reset();
  if (std::isfinite(x.ratio)) x.needed_s = x.duration_s * x.ratio * x.ratio;
}

Experiment lay_out_chirp(const Task& task, std::size_t samples) {
  Experiment x;
  x.type = ExcitationType::chirp;
  x.from_hz = task.high_hz;
  x.to_hz = task.low_hz;
  excitation::ChirpConfig c;
  c.sample_rate_hz = task.sample_rate_hz;
  c.from_hz = x.from_hz;
  c.to_hz = x.to_hz;
  c.duration_s = static_cast<double>(samples) / task.sample_rate_hz;
  x.excitation.resize(samples);
  excitation::Chirp::create(c)->fill(x.excitation);
  scale_to_limits(task, x);
  evaluate(task, x);
  return x;
}

/// The bit length that serves the wishes best; the register is long enough not to repeat.
Experiment lay_out_prbs(const Task& task, std::size_t samples) {
  Experiment best;
  best.ratio = HUGE_VAL;
  for (std::size_t divider = 1;
       0.44 * task.sample_rate_hz / static_cast<double>(divider) > 0.7 * task.high_hz; divider *= 2) {
    Experiment x;
    x.type = ExcitationType::prbs;
    x.clock_divider = divider;
    x.register_length = 7;
    while (x.register_length < excitation::Prbs::kMaxRegister &&
           ((std::size_t{1} << x.register_length) - 1) * divider < samples)
      ++x.register_length;
    excitation::PrbsConfig c;
    c.sample_rate_hz = task.sample_rate_hz;
    c.register_length = x.register_length;
    c.clock_divider = divider;
    x.excitation.resize(samples);
    excitation::Prbs::create(c)->fill(x.excitation);
    scale_to_limits(task, x);
    evaluate(task, x);
    if (x.ratio < best.ratio) best = std::move(x);
  }
  return best;
}

}  // namespace resonid::planning::detail
