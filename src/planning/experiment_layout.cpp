// SPDX-License-Identifier: MIT
#include "planning/experiment_layout.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <resonid/base/constants.hpp>
#include <resonid/online/excitation/chirp.hpp>
#include <resonid/online/excitation/metrics.hpp>
#include <resonid/online/excitation/prbs.hpp>

namespace resonid::planning::detail {
namespace {

double most_time_s(const Limits& l) { return std::isfinite(l.time_s) ? l.time_s : kMostTime_s; }

}  // namespace

Task::Task(const PlanConfig& c)
    : config(c),
      sample_rate_hz(1.0 / c.drive.model.sample_time_s),
      drives(possible_drives(c.drive, c.spread)),
      most_samples(
          static_cast<std::size_t>(std::min(kMostSamples, most_time_s(c.limits) * sample_rate_hz + 1e-6))) {
  for (const auto& target : c.targets) names.push_back(target.figure);
  const auto figures = figures_of(c.drive, names);
  for (std::size_t i = 0; i < names.size(); ++i)
    wanted.push_back(c.targets[i].relative ? c.targets[i].accuracy * std::abs(figures[i].value)
                                           : c.targets[i].accuracy);
  for (const auto& drive : drives) {
    Eigen::MatrixXd gradients = figure_gradients(drive, names);
    const auto own = figures_of(drive, names);
    for (std::size_t i = 0; i < names.size(); ++i)
      gradients.row(static_cast<Eigen::Index>(i)) /=
          c.targets[i].relative ? c.targets[i].accuracy * std::abs(own[i].value) : c.targets[i].accuracy;
    targets.push_back(gradients);
    noise.push_back(fisher_information_of_noise(drive));
  }
  const double most = 0.4 * sample_rate_hz;
  band_given = c.band_hz.has_value();
  if (band_given) {
    low_hz = c.band_hz->first;
    high_hz = c.band_hz->second;
  } else if (c.drive.model.structure != fit::Structure::rigid) {
    low_hz = most;
    for (const auto& drive : drives) {  // the truth may lie as far off as any of them
      const auto modes = modes_of(drive.model);
      low_hz = std::min(low_hz, 0.1 * modes.front().frequency_hz.value);
      high_hz = std::max(high_hz, std::min(2.3 * modes.back().frequency_hz.value, most));
    }
  } else {
    low_hz = 0.002 * sample_rate_hz;
    high_hz = 0.04 * sample_rate_hz;
  }
}

PeakValues peaks_of(const Task& task, std::span<const double> excitation) {
  PeakValues e;
  e.excitation = online::measure(excitation).peak;
  for (const auto& drive : task.drives) {
    const auto motion = simulate(drive, excitation);
    const auto torque = online::measure(motion.torque);
    const auto [low, high] = std::minmax_element(motion.position.begin(), motion.position.end());
    e.torque = std::max(e.torque, torque.peak);
    e.torque_rms = std::max(e.torque_rms, torque.rms);
    e.velocity = std::max(e.velocity, online::measure(motion.velocity).peak);
    e.stroke = std::max(e.stroke, *high - *low);
  }
  return e;
}

std::pair<double, std::string> most_used(const Limits& limits, const PeakValues& e) {
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
  const auto peaks = peaks_of(task, x.excitation);
  const auto [use, name] = most_used(task.config.limits, peaks);
  const double factor = 1.0 / use;
  for (double& v : x.excitation) v *= factor;
  for (double& a : x.line_amplitude) a *= factor;
  x.peaks = {peaks.excitation * factor, peaks.torque * factor, peaks.torque_rms * factor,
             peaks.velocity * factor, peaks.stroke * factor};
  x.amplitude = x.peaks.excitation;
  x.binding = name;
  x.crest_factor = online::measure(x.excitation).crest_factor;
}

namespace {

/// Squares of deviation over wanted deviation, expected over the drives; infinite where unknown. [target]
Eigen::VectorXd squares(const Task& task, const std::vector<FisherInformation>& told, double amplitude) {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(task.names.size()));
  for (std::size_t s = 0; s < told.size(); ++s) {
    const auto& gradients = task.targets[s];
    sum += (gradients * told[s].covariance(amplitude)).cwiseProduct(gradients).rowwise().sum();
  }
  sum /= static_cast<double>(told.size());
  return sum.unaryExpr([](double v) { return std::isfinite(v) ? std::max(0.0, v) : HUGE_VAL; });
}

std::vector<FisherInformation> fisher_informations(const Task& task, std::span<const double> excitation) {
  std::vector<FisherInformation> told;
  for (std::size_t s = 0; s < task.drives.size(); ++s)
    told.push_back(fisher_information(task.drives[s], excitation, task.noise[s]));
  return told;
}

}  // namespace

void evaluate(const Task& task, Experiment& x) {
  x.duration_s = static_cast<double>(x.excitation.size()) / task.sample_rate_hz;
  const auto told = fisher_informations(task, x.excitation);
  const Eigen::VectorXd square = squares(task, told, 1.0);
  x.figures = figures_of(with_covariance(task.drives.front(), told.front().covariance()));
  x.targeted = figures_of(task.config.drive, task.names);
  for (std::size_t i = 0; i < task.names.size(); ++i)
    x.targeted[i].std = std::sqrt(square(static_cast<Eigen::Index>(i))) * task.wanted[i];
  x.ratio = std::sqrt(square.maxCoeff());
  x.needed_s.reset();
  if (std::isfinite(x.ratio)) x.needed_s = x.duration_s * x.ratio * x.ratio;
}

void evaluate_amplitude(const Task& task, Experiment& x) {
  auto told = fisher_informations(task, x.excitation);
  const auto ratio = [&](double amplitude) { return std::sqrt(squares(task, told, amplitude).maxCoeff()); };
  constexpr double kMost = 1e6;
  x.needed_amplitude.reset();
  if (double low = 0.0, high = kMost; ratio(kMost) <= 1.0) {
    for (low = 1.0 / kMost; high / low > 1.001;)
      (ratio(std::sqrt(low * high)) > 1.0 ? low : high) = std::sqrt(low * high);
    x.needed_amplitude = high;
  }
  for (auto& t : told) t.noise.setZero();
  const double alone = ratio(1.0);  // half of the Fisher information: half of the variance is missing
  x.noise_dominates = alone > std::sqrt(2.0) * x.ratio;
}

Experiment lay_out_chirp(const Task& task, std::size_t samples) {
  Experiment x;
  x.type = ExcitationType::chirp;
  x.from_hz = task.high_hz;
  x.to_hz = task.low_hz;
  online::ChirpConfig c;
  c.sample_rate_hz = task.sample_rate_hz;
  c.from_hz = x.from_hz;
  c.to_hz = x.to_hz;
  c.duration_s = static_cast<double>(samples) / task.sample_rate_hz;
  x.excitation.resize(samples);
  online::Chirp::create(c)->fill(x.excitation);
  scale_to_limits(task, x);
  evaluate(task, x);
  return x;
}

namespace {

Experiment lay_out_prbs(const Task& task, std::size_t samples, std::size_t divider) {
  Experiment x;
  x.type = ExcitationType::prbs;
  x.clock_divider = divider;
  x.register_length = 7;  // long enough not to repeat
  while (x.register_length < online::Prbs::kMaxRegister &&
         ((std::size_t{1} << x.register_length) - 1) * divider < samples)
    ++x.register_length;
  online::PrbsConfig c;
  c.sample_rate_hz = task.sample_rate_hz;
  c.register_length = x.register_length;
  c.clock_divider = divider;
  x.excitation.resize(samples);
  online::Prbs::create(c)->fill(x.excitation);
  scale_to_limits(task, x);
  evaluate(task, x);
  return x;
}

constexpr double kMostPrbsAbove = 0.1;  // of a PRBS's power: its main lobe holds 90 %
constexpr double kMostPrbsBelow = 0.2;

/// Part of the power of a long PRBS that lies below a frequency: bits of d samples have the triangle
/// 1 - |k|/d as autocorrelation, the integral over whose spectrum this is.
double power_below(double frequency_hz, double sample_rate_hz, std::size_t divider) {
  const double cycles = frequency_hz / sample_rate_hz;
  double part = 2.0 * cycles;
  for (std::size_t k = 1; k < divider; ++k) {
    const auto lag = static_cast<double>(k);
    part += 2.0 * (1.0 - lag / static_cast<double>(divider)) * std::sin(kTwoPi * lag * cycles) / (kPi * lag);
  }
  return part;
}

double power_above(const Task& task, std::size_t divider) {
  return 1.0 - power_below(task.high_hz, task.sample_rate_hz, divider);
}

/// Clock dividers to choose from. A band that was asked for binds: its upper end holds the main lobe.
std::vector<std::size_t> dividers_of(const Task& task) {
  std::vector<std::size_t> list;
  if (task.band_given) {
    std::size_t shortest = 1;
    while (power_above(task, shortest) > kMostPrbsAbove) ++shortest;
    return {shortest, shortest + (shortest + 1) / 2, 2 * shortest};
  }
  for (std::size_t divider = 1;
       0.44 * task.sample_rate_hz / static_cast<double>(divider) > 0.7 * task.high_hz; divider *= 2)
    list.push_back(divider);
  // A band up to half the sample rate leaves no choice.
  if (list.empty()) list.push_back(1);
  return list;
}

}  // namespace

std::optional<std::string> prbs_outside_band(const Task& task) {
  if (!task.band_given) return {};
  const std::size_t divider = dividers_of(task).front();
  const double below = power_below(task.low_hz, task.sample_rate_hz, divider);
  const double bit_s = static_cast<double>(divider) / task.sample_rate_hz;
  if (bit_s * task.low_hz > 0.5 || below > kMostPrbsBelow)
    return fmt::format(
        "{:.0f} % of its power would lie below {:.4g} Hz with bits of {:.3g} ms, long enough to keep {:.0f} "
        "% "
        "below {:.4g} Hz; at most {:.0f} % are let through",
        100.0 * below, task.low_hz, 1000.0 * bit_s, 100.0 * (1.0 - kMostPrbsAbove), task.high_hz,
        100.0 * kMostPrbsBelow);
  return {};
}

Experiment lay_out_prbs(const Task& task, std::size_t samples) {
  constexpr std::size_t kEnough = 20000;  // to tell which bit length serves the targets best
  Experiment best;
  for (const std::size_t divider : dividers_of(task)) {
    const bool first = best.excitation.empty();
    if (!first && task.band_given && power_below(task.low_hz, task.sample_rate_hz, divider) > kMostPrbsBelow)
      continue;
    Experiment x = lay_out_prbs(task, std::min(samples, kEnough), divider);
    if (first || x.ratio < best.ratio) best = std::move(x);
  }
  if (samples > kEnough) best = lay_out_prbs(task, samples, best.clock_divider);
  best.power_below_band = power_below(task.low_hz, task.sample_rate_hz, best.clock_divider);
  best.power_above_band = power_above(task, best.clock_divider);
  return best;
}

}  // namespace resonid::planning::detail
