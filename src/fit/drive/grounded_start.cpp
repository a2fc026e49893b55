// SPDX-License-Identifier: MIT
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

/// Compares magnitudes; `left` is what the factors leave of them.
void judge(const Lines& lines, const std::vector<double>& left, Modes modes, Modes& best) {
  double sum = 0.0, mean = 0.0, square = 0.0;
  for (std::size_t i = 0; i < left.size(); ++i) {
    sum += lines.weight[i];
    mean += lines.weight[i] * left[i];
    square += lines.weight[i] * left[i] * left[i];
  }
  mean /= sum;
  modes.spread = square / sum - mean * mean;
  if (!(modes.spread < best.spread)) return;
  // Far below its resonance on the spring the velocity is w/K, and K the inertia times that squared.
  const double omega = kTwoPi * modes.first_hz;
  modes.inertia = std::exp(-mean) / (omega * omega);
  best = modes;
}

Modes best_modes(const Lines& lines, bool coupling) {
  Modes best;
  const std::size_t n = lines.frequency_hz.size();
  std::vector<double> slope(n), left(n);
  for (std::size_t k = 0; k < n; ++k)
    slope[k] = lines.log_magnitude[k] - std::log(kTwoPi * lines.frequency_hz[k]);
  for (const double ratio : kRatios) {
    const Factors factors(lines, ratio);
    for (std::size_t first = 0; first < factors.size(); ++first) {
      std::vector<double> without = slope;
      for (std::size_t k = 0; k < n; ++k) without[k] += factors[first][k];
      if (!coupling) {
        judge(lines, without, {factors.hz(first), 0.0, 0.0, ratio}, best);
        continue;
      }
      for (std::size_t zero = std::max<std::size_t>(first + 1, kBelow); zero + 1 < factors.size(); ++zero)
        for (std::size_t pole = zero + 1; pole < factors.size(); ++pole) {
          for (std::size_t k = 0; k < n; ++k) left[k] = without[k] - factors[zero][k] + factors[pole][k];
          judge(lines, left, {factors.hz(first), factors.hz(zero), factors.hz(pole), ratio}, best);
        }
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
    std::vector<double> left;
    for (std::size_t k = 0; k < lines.frequency_hz.size(); ++k) {
      const double f = lines.frequency_hz[k];
      double rest =
          lines.log_magnitude[k] - std::log(kTwoPi * f) + log_factor(f, modes.first_hz, modes.damping_ratio);
      if (modes.resonance_hz > 0.0)
        rest += log_factor(f, modes.resonance_hz, modes.damping_ratio) -
                log_factor(f, modes.antiresonance_hz, modes.damping_ratio);
      left.push_back(rest);
    }
    judge(lines, left, modes, best);
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
