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
double most_time_s(const Limits& l) { return std::isfinite(l.time_s) ? l.time_s : kMostTime_s; }
bool elastic(const RoughDrive& drive) { return drive.model.structure == fit::Structure::two_mass; }

}  // namespace

Task::Task(const PlanConfig& c)
    : config(c),
      sample_rate_hz(1.0 / c.drive.model.sample_time_s),
      drives(possible_drives(c.drive, c.spread)),
      most_samples(
          static_cast<std::size_t>(std::min(kMostSamples, most_time_s(c.limits) * sample_rate_hz + 1e-6))) {
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
    noise.push_back(information_of_noise(drive));
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

namespace {

/// Squares of deviation over wanted deviation, expected over the drives; infinite where unknown. [wish]
Eigen::VectorXd squares(const Task& task, const std::vector<RecordInformation>& told, double amplitude) {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(task.names.size()));
  for (std::size_t s = 0; s < told.size(); ++s) {
    const auto& gradients = task.wishes[s];
    sum += (gradients * told[s].covariance(amplitude)).cwiseProduct(gradients).rowwise().sum();
  }
  sum /= static_cast<double>(told.size());
  return sum.unaryExpr([](double v) { return std::isfinite(v) ? std::max(0.0, v) : HUGE_VAL; });
}

std::vector<RecordInformation> informations(const Task& task, std::span<const double> excitation) {
  std::vector<RecordInformation> told;
  for (std::size_t s = 0; s < task.drives.size(); ++s)
    told.push_back(information_of(task.drives[s], excitation, task.noise[s]));
  return told;
}

}  // namespace

void evaluate(const Task& task, Experiment& x) {
  x.duration_s = static_cast<double>(x.excitation.size()) / task.sample_rate_hz;
  const auto told = informations(task, x.excitation);
  const Eigen::VectorXd square = squares(task, told, 1.0);
  x.figures = figures_of(with_covariance(task.drives.front(), told.front().covariance()));
  x.wished = figures_of(task.config.drive, task.names);
  for (std::size_t i = 0; i < task.names.size(); ++i)
    x.wished[i].standard_deviation = std::sqrt(square(static_cast<Eigen::Index>(i))) * task.wanted[i];
  x.ratio = std::sqrt(square.maxCoeff());
  x.needed_s.reset();
  if (std::isfinite(x.ratio)) x.needed_s = x.duration_s * x.ratio * x.ratio;
}

void evaluate_amplitude(const Task& task, Experiment& x) {
  auto told = informations(task, x.excitation);
  const auto ratio = [&](double amplitude) { return std::sqrt(squares(task, told, amplitude).maxCoeff()); };
  constexpr double kMost = 1e6;
  x.needed_amplitude.reset();
  if (double low = 0.0, high = kMost; ratio(kMost) <= 1.0) {
    for (low = 1.0 / kMost; high / low > 1.001;)
      (ratio(std::sqrt(low * high)) > 1.0 ? low : high) = std::sqrt(low * high);
    x.needed_amplitude = high;
  }
  for (auto& t : told) t.noise.setZero();
  const double alone = ratio(1.0);  // half of the information: half of the variance is missing
  x.noise_dominates = alone > std::sqrt(2.0) * x.ratio;
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

namespace {

Experiment lay_out_prbs(const Task& task, std::size_t samples, std::size_t divider) {
  Experiment x;
  x.type = ExcitationType::prbs;
  x.clock_divider = divider;
  x.register_length = 7;  // long enough not to repeat
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
  return x;
}

}  // namespace

Experiment lay_out_prbs(const Task& task, std::size_t samples) {
  constexpr std::size_t kEnough = 20000;  // to tell which bit length serves the wishes best
  Experiment best;
  for (std::size_t divider = 1;
       0.44 * task.sample_rate_hz / static_cast<double>(divider) > 0.7 * task.high_hz; divider *= 2) {
    Experiment x = lay_out_prbs(task, std::min(samples, kEnough), divider);
    if (best.excitation.empty() || x.ratio < best.ratio) best = std::move(x);
  }
  // A band up to half the sample rate leaves no choice.
  if (best.excitation.empty()) return lay_out_prbs(task, samples, 1);
  return samples > kEnough ? lay_out_prbs(task, samples, best.clock_divider) : best;
}

}  // namespace resonid::planning::detail
