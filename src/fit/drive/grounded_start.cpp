// SPDX-License-Identifier: MIT
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <fit/drive/grounded_start.hpp>
#include <limits>
#include <resonid/base/constants.hpp>
#include <vector>

namespace resonid::fit::detail {
namespace {

constexpr int kSteps = 60;                                          // of the grid over the band
constexpr int kBelow = 20, kAbove = 10;                             // and beyond its ends
constexpr std::array<double, 4> kRatios = {0.01, 0.05, 0.15, 0.5};  // damping of all modes alike
constexpr std::size_t kFew = 160, kMany = 1000;  // lines of the scan, and of what refines it

/// Lines that are known, thinned evenly on the logarithmic axis: a resonance on the ground is often low,
/// where the lines of a periodic excitation are few.
struct Lines {
  std::vector<double> frequency_hz, log_magnitude, weight;
};

Lines spread(const data::FrequencyResponse& g, std::size_t most) {
  constexpr double kUsable = 0.5;
  Lines lines;
  if (g.lines() == 0) return lines;
  const double ratio =
      std::pow(g.frequency_hz.back() / g.frequency_hz.front(), 1.0 / static_cast<double>(most));
  for (std::size_t i = 0; i < g.lines(); ++i) {
    const double magnitude = std::abs(g.value[i]), f = g.frequency_hz[i];
    const double relative = g.std.empty() ? 0.0 : g.std[i] / magnitude;
    if (!(magnitude > 0.0) || !(f > 0.0) || !(relative < kUsable)) continue;
    if (!lines.frequency_hz.empty() && f < lines.frequency_hz.back() * ratio) continue;
    lines.frequency_hz.push_back(f);
    lines.log_magnitude.push_back(std::log(magnitude));
    lines.weight.push_back(1.0 / (0.01 + relative * relative));
  }
  return lines;
}

/// ln |1 + 2 j z f/f0 - (f/f0)^2|
double log_factor(double frequency_hz, double mode_hz, double damping_ratio) {
  const double x = frequency_hz / mode_hz;
  return 0.5 * std::log(std::pow(1.0 - x * x, 2) + std::pow(2.0 * damping_ratio * x, 2));
}

/// The same over the lines, for every place of the grid.
class Factors {
 public:
  Factors(const Lines& lines, double damping_ratio) {
    const double low = lines.frequency_hz.front(), high = std::max(lines.frequency_hz.back(), 1.5 * low);
    for (int i = -kBelow; i <= kSteps + kAbove; ++i) {
      places_.push_back(low * std::pow(high / low, static_cast<double>(i) / kSteps));
      std::vector<double> of_place;
      for (const double f : lines.frequency_hz)
        of_place.push_back(log_factor(f, places_.back(), damping_ratio));
      values_.push_back(std::move(of_place));
    }
  }
  [[nodiscard]] std::size_t size() const { return places_.size(); }
  [[nodiscard]] double hz(std::size_t i) const { return places_[i]; }
  [[nodiscard]] const std::vector<double>& operator[](std::size_t i) const { return values_[i]; }

 private:
  std::vector<double> places_;
  std::vector<std::vector<double>> values_;
};

/// A drive on a spring by its modes: s/J prod (s^2 + zero^2)/prod (s^2 + pole^2), J the driven inertia.
struct Modes {
  double first_hz = 0.0, antiresonance_hz = 0.0, resonance_hz = 0.0;  // the last two of a coupling
  double damping_ratio = 0.0;
  double inertia = 0.0;  // of the whole
  double spread = std::numeric_limits<double>::infinity();
};

/// Takes the modes over where they leave less; the weighted moments are those of what their factors leave.
void judge(double sum, double mean, double square, Modes modes, Modes& best) {
  mean /= sum;
  modes.spread = square / sum - mean * mean;
  if (!(modes.spread < best.spread)) return;
  // Far below its resonance on the spring the velocity is w/K, and K the inertia times that squared.
  const double omega = kTwoPi * modes.first_hz;
  modes.inertia = std::exp(-mean) / (omega * omega);
  best = modes;
}

/// By the moments of all pairs of factors, so that a triple of places costs no sum over the lines.
Modes best_modes(const Lines& lines, bool coupling) {
  Modes best;
  const auto n = static_cast<Eigen::Index>(lines.frequency_hz.size());
  const Eigen::Map<const Eigen::ArrayXd> weight(lines.weight.data(), n);
  const double sum = weight.sum();
  for (const double ratio : kRatios) {
    const Factors factors(lines, ratio);
    const auto places = static_cast<Eigen::Index>(factors.size());
    Eigen::MatrixXd columns(n, places + 1);  // the last: the slope, without any factor
    for (Eigen::Index i = 0; i < places; ++i)
      columns.col(i) = Eigen::Map<const Eigen::VectorXd>(factors[static_cast<std::size_t>(i)].data(), n);
    for (Eigen::Index k = 0; k < n; ++k) {
      const auto line = static_cast<std::size_t>(k);
      columns(k, places) = lines.log_magnitude[line] - std::log(kTwoPi * lines.frequency_hz[line]);
    }
    columns = weight.sqrt().matrix().asDiagonal() * columns;
    const Eigen::MatrixXd square = columns.transpose() * columns;
    const Eigen::VectorXd mean = columns.transpose() * weight.sqrt().matrix();
    const auto hz = [&](Eigen::Index i) { return factors.hz(static_cast<std::size_t>(i)); };
    for (Eigen::Index first = 0; first < places; ++first) {
      const Eigen::VectorXd with = square.col(places) + square.col(first);  // of slope + first by any other
      const double own = with(places) + with(first), own_mean = mean(places) + mean(first);
      if (!coupling) {
        judge(sum, own_mean, own, {hz(first), 0.0, 0.0, ratio}, best);
        continue;
      }
      for (Eigen::Index zero = std::max<Eigen::Index>(first + 1, kBelow); zero + 1 < places; ++zero)
        for (Eigen::Index pole = zero + 1; pole < places; ++pole)
          judge(sum, own_mean - mean(zero) + mean(pole),
                own + square(zero, zero) + square(pole, pole) +
                    2.0 * (with(pole) - with(zero) - square(zero, pole)),
                {hz(first), hz(zero), hz(pole), ratio}, best);
    }
  }
  return best;
}

/// Moves modes and damping by ever smaller steps: a sharp resonance beside the grid's nearest place is
/// another minimum of the fit.
Modes refined(const Lines& lines, const Modes& start) {
  Modes best = start;
  best.spread = std::numeric_limits<double>::infinity();
  const auto consider = [&](const Modes& modes) {
    double sum = 0.0, mean = 0.0, square = 0.0;
    for (std::size_t k = 0; k < lines.frequency_hz.size(); ++k) {
      const double f = lines.frequency_hz[k];
      double rest =
          lines.log_magnitude[k] - std::log(kTwoPi * f) + log_factor(f, modes.first_hz, modes.damping_ratio);
      if (modes.resonance_hz > 0.0)
        rest += log_factor(f, modes.resonance_hz, modes.damping_ratio) -
                log_factor(f, modes.antiresonance_hz, modes.damping_ratio);
      sum += lines.weight[k];
      mean += lines.weight[k] * rest;
      square += lines.weight[k] * rest * rest;
    }
    judge(sum, mean, square, modes, best);
  };
  consider(start);
  constexpr std::array kMoved = {&Modes::first_hz, &Modes::antiresonance_hz, &Modes::resonance_hz,
                                 &Modes::damping_ratio};
  constexpr double kLargest = 1.06, kSmallest = 1.001;
  for (double step = kLargest; step > kSmallest; step = std::sqrt(step))
    for (int turn = 0; turn < 2; ++turn)
      for (const auto member : kMoved)
        for (const double factor : {step, 1.0 / step}) {
          Modes moved = best;
          moved.*member *= member == &Modes::damping_ratio ? factor * factor : factor;
          const bool ordered = !(moved.resonance_hz > 0.0) || (moved.first_hz < moved.antiresonance_hz &&
                                                               moved.antiresonance_hz < moved.resonance_hz);
          if (ordered) consider(moved);
        }
  return best;
}

}  // namespace

std::optional<DriveModel> grounded_start(const data::FrequencyResponse& response, Structure structure,
                                         Parameter ground, double sample_time_s) {
  const bool coupling = structure == Structure::two_mass;
  if (!coupling && structure != Structure::rigid) return std::nullopt;
  const Lines lines = spread(response, kFew);
  constexpr std::size_t kFewest = 4;
  if (lines.frequency_hz.size() < kFewest) return std::nullopt;
  const Modes modes = refined(spread(response, kMany), best_modes(lines, coupling));
  if (!(modes.inertia > 0.0) || !std::isfinite(modes.inertia)) return std::nullopt;
  DriveModel model;
  model.structure = structure;
  model.sample_time_s = sample_time_s;
  auto& p = model.parameters;
  const double first = std::pow(kTwoPi * modes.first_hz, 2);
  if (!coupling) {
    p.driven_inertia = modes.inertia;
    p.motor_ground_stiffness = modes.inertia * first;
    return model;
  }
  // The squares of the poles have a sum and a product that either spring can give with this zero.
  const double zero = std::pow(kTwoPi * modes.antiresonance_hz, 2);
  const double pole = std::pow(kTwoPi * modes.resonance_hz, 2);
  p.driven_inertia = modes.inertia * zero / pole;
  if (ground == kMotorGroundStiffness) {
    p.motor_ground_stiffness = modes.inertia * first;
    p.stiffness = p.driven_inertia * (pole - zero) * (zero - first) / zero;
    p.load_inertia = p.stiffness / zero;
  } else {
    p.stiffness = p.driven_inertia * (first + pole - zero);
    const double of_load = p.driven_inertia * first * pole / p.stiffness;  // its spring over its inertia
    p.load_inertia = p.stiffness / (zero - of_load);
    p.load_ground_stiffness = of_load * p.load_inertia;
  }
  p.damping = 2.0 * modes.damping_ratio / (kTwoPi * modes.resonance_hz) * p.stiffness;
  return model;
}

}  // namespace resonid::fit::detail
