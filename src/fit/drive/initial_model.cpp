// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <fit/drive/initial_models.hpp>
#include <optional>
#include <resonid/base/constants.hpp>
#include <resonid/base/detail/statistics.hpp>
#include <resonid/fit/detail/sanathanan_koerner.hpp>
#include <resonid/fit/response_fit.hpp>
#include <vector>

namespace resonid::fit {
namespace {

struct Pair {
  double antiresonance_hz = 0.0;
  double resonance_hz = 0.0;
  double damping_time_s = 0.0;  // D/K
};

struct Candidate : Pair {
  double friction_hz = 0.0;  // B/(2 pi (J1 + J2)): corner of the rigid machine
  double spread = std::numeric_limits<double>::infinity();
  double log_gain = 0.0;
};

/// Weighted lines thinned to at most 80 ... 160, so that the scan costs the same for every record.
struct Lines {
  std::vector<double> frequency_hz, log_magnitude, weight;
};

Lines thin(const data::FrequencyResponse& g) {
  Lines lines;
  const std::size_t stride = std::max<std::size_t>(1, g.lines() / 80);
  for (std::size_t i = 0; i < g.lines(); i += stride) {
    const double magnitude = std::abs(g.value[i]);
    if (!(magnitude > 0.0) || !(g.frequency_hz[i] > 0.0)) continue;
    const double relative = g.std.empty() ? 0.0 : g.std[i] / magnitude;
    // Lines stand for the width of the logarithmic axis that they cover.
    lines.frequency_hz.push_back(g.frequency_hz[i]);
    lines.log_magnitude.push_back(std::log(magnitude));
    lines.weight.push_back(1.0 / (0.01 + relative * relative) / g.frequency_hz[i]);
  }
  return lines;
}

/// (1 + s d + (s/wa)^2) and (1 + s d + (s/wr)^2).
struct Factors {
  std::complex<double> top, bottom;
};
Factors factors(const Pair& pair, double f) {
  const double a = f / pair.antiresonance_hz;
  const double r = f / pair.resonance_hz;
  const double damping = kTwoPi * f * pair.damping_time_s;
  return {{1.0 - a * a, damping}, {1.0 - r * r, damping}};
}

/// Compares magnitudes with those of the continuous drive of unit inertia, top/(s bottom + b top).
void judge(const Lines& lines, Candidate& c) {
  double sum = 0.0, mean = 0.0, square = 0.0;
  for (std::size_t i = 0; i < lines.frequency_hz.size(); ++i) {
    const double f = lines.frequency_hz[i];
    const std::complex<double> s(0.0, kTwoPi * f);
    const auto [top, bottom] = factors(c, f);
    const double shape =
        0.5 * std::log(std::norm(top) / std::norm(s * bottom + kTwoPi * c.friction_hz * top));
    const double difference = lines.log_magnitude[i] - shape;
    sum += lines.weight[i];
    mean += lines.weight[i] * difference;
    square += lines.weight[i] * difference * difference;
  }
  c.log_gain = mean / sum;
  c.spread = square / sum - c.log_gain * c.log_gain;
}

/// Geometric grid over the band of the lines.
struct Grid {
  double low_hz, ratio;
  int steps;

  explicit Grid(const Lines& lines) : low_hz(lines.frequency_hz.front()) {
    const double high = std::max(lines.frequency_hz.back(), 1.5 * low_hz);
    ratio = high / low_hz;
    steps = std::clamp(static_cast<int>(25.0 * std::log10(ratio)), 36, 100);
  }
  [[nodiscard]] double at(int i) const { return low_hz * std::pow(ratio, static_cast<double>(i) / steps); }
};

constexpr double kWidest = 10.0;  // resonance over anti-resonance: a load 100 times the motor
constexpr std::array<double, 4> kDampingRatios = {0.005, 0.03, 0.1, 0.3};

double damping_time(double ratio, double resonance_hz) { return 2.0 * ratio / (kTwoPi * resonance_hz); }

Candidate best_two_mass(const Lines& lines, bool with_friction) {
  const Grid grid(lines);
  Candidate best;
  for (int i = 0; i < grid.steps; ++i)
    for (int j = i + 1; j <= grid.steps; ++j)
      for (const double damping : kDampingRatios)
        for (const double friction : {0.0, 0.3, 1.0, 3.0}) {
          if (friction > 0.0 && !with_friction) continue;
          Candidate c;
          c.antiresonance_hz = grid.at(i);
          c.resonance_hz = grid.at(j);
          if (c.resonance_hz > kWidest * c.antiresonance_hz) continue;
          c.damping_time_s = damping_time(damping, c.resonance_hz);
          c.friction_hz = friction * c.antiresonance_hz;
          judge(lines, c);
          if (c.spread < best.spread) best = c;
        }
  return best;
}

/// Best further pair to one that is given, below its anti-resonance or above its resonance (a little beyond
/// the band too): what the given one explains is taken out of the lines first.
Candidate best_further_pair(const Lines& all, const Pair& given) {
  Lines lines = all;
  for (std::size_t i = 0; i < lines.frequency_hz.size(); ++i) {
    const auto [top, bottom] = factors(given, lines.frequency_hz[i]);
    lines.log_magnitude[i] -= 0.5 * std::log(std::norm(top) / std::norm(bottom));
  }
  const Grid grid(lines);
  const int beyond = grid.steps / 6;
  Candidate best;
  for (int i = 0; i < grid.steps + beyond; ++i)
    for (int j = i + 1; j <= grid.steps + beyond; ++j)
      for (const double damping : kDampingRatios) {
        Candidate c;
        c.antiresonance_hz = grid.at(i);
        c.resonance_hz = grid.at(j);
        if (c.resonance_hz > kWidest * c.antiresonance_hz) continue;
        if (!(c.resonance_hz < given.antiresonance_hz || c.antiresonance_hz > given.resonance_hz)) continue;
        c.damping_time_s = damping_time(damping, c.resonance_hz);
        judge(lines, c);
        if (c.spread < best.spread) best = c;
      }
  return best;
}

DriveModel of_pairs(double total_inertia, const Pair& first, const Pair& second, double sample_time_s) {
  const Pair& low = first.resonance_hz < second.resonance_hz ? first : second;
  const Pair& high = first.resonance_hz < second.resonance_hz ? second : first;
  DriveModel model;
  model.structure = Structure::three_mass;
  model.sample_time_s = sample_time_s;
  auto& p = model.parameters;
  p = data::three_mass_of_modes(total_inertia, {low.antiresonance_hz, high.antiresonance_hz},
                                {low.resonance_hz, high.resonance_hz});
  const double damping_time_s = std::sqrt(low.damping_time_s * high.damping_time_s);
  p.damping = damping_time_s * p.stiffness;
  p.damping_2 = damping_time_s * p.stiffness_2;
  return model;
}

DriveModel three_mass_of_magnitudes(const Lines& lines, double sample_time_s) {
  Pair first = best_two_mass(lines, false);
  Candidate second = best_further_pair(lines, first);
  for (int round = 0; round < 2 && second.resonance_hz > 0.0; ++round) {
    const Candidate again = best_further_pair(lines, second);
    if (!(again.resonance_hz > 0.0)) break;
    first = second;
    second = again;
  }
  return of_pairs(std::exp(-second.log_gain), first, second, sample_time_s);
}

/// Weak second pairs, whose zero nearly cancels its pole, hardly show in magnitudes: the first pair with one
/// at several places above it.
std::vector<DriveModel> with_weak_second_pairs(const Lines& lines, double sample_time_s) {
  std::vector<DriveModel> models;
  const Candidate first = best_two_mass(lines, false);
  const double high = lines.frequency_hz.back();
  if (!(high > 1.5 * first.resonance_hz)) return models;
  for (const double place : {0.25, 0.5, 0.75}) {
    Pair second;
    second.antiresonance_hz = first.resonance_hz * std::pow(high / first.resonance_hz, place);
    second.resonance_hz = 1.05 * second.antiresonance_hz;
    second.damping_time_s = damping_time(0.1, second.resonance_hz);
    models.push_back(of_pairs(std::exp(-first.log_gain), first, second, sample_time_s));
  }
  return models;
}

/// From the modes of a rational model of fifth order, if it has two pairs of each in turn.
std::optional<DriveModel> three_mass_of_rational(const data::FrequencyResponse& response,
                                                 double sample_time_s) {
  SanathananKoernerConfig config;
  config.order = 5;
  config.integrator = true;
  config.sample_time_s = sample_time_s;
  const auto fit = fit_sanathanan_koerner(response, config);
  if (!fit) return std::nullopt;
  const auto poles = pole_modes(fit->transfer_function);
  const auto zeros = zero_modes(fit->transfer_function);
  if (poles.size() != 2 || zeros.size() != 2) return std::nullopt;
  if (!(zeros[0].frequency_hz < poles[0].frequency_hz && poles[0].frequency_hz < zeros[1].frequency_hz &&
        zeros[1].frequency_hz < poles[1].frequency_hz))
    return std::nullopt;
  double slope = 0.0, gain = 0.0;  // G ~ Ts/J/(z - 1) near z = 1
  const auto& g = fit->transfer_function;
  for (std::size_t i = 0; i < g.denominator.size(); ++i) slope -= static_cast<double>(i) * g.denominator[i];
  for (const double b : g.numerator) gain += b;
  const double inertia = -sample_time_s * slope / gain;
  if (!(inertia > 0.0)) return std::nullopt;
  const auto pair = [&](std::size_t i) {
    const double ratio = std::clamp(poles[i].damping_ratio, 1e-4, 0.5);
    return Pair{zeros[i].frequency_hz, poles[i].frequency_hz, damping_time(ratio, poles[i].frequency_hz)};
  };
  return of_pairs(inertia, pair(0), pair(1), sample_time_s);
}

}  // namespace

DriveModel initial_model(const data::FrequencyResponse& response, Structure structure, double sample_time_s,
                         bool with_friction) {
  DriveModel model;
  model.structure = structure;
  model.sample_time_s = sample_time_s;
  const Lines lines = thin(response);
  if (lines.frequency_hz.empty()) return model;
  if (structure == Structure::rigid) {
    std::vector<double> inertia;
    for (std::size_t i = 0; i < lines.frequency_hz.size(); ++i)
      inertia.push_back(std::exp(-lines.log_magnitude[i]) / (kTwoPi * lines.frequency_hz[i]));
    model.parameters.driven_inertia = median(std::move(inertia));
    return model;
  }
  if (structure == Structure::three_mass) return three_mass_of_magnitudes(lines, sample_time_s);
  const Candidate best = best_two_mass(lines, with_friction);
  const double total = std::exp(-best.log_gain);
  const double ratio = std::pow(best.resonance_hz / best.antiresonance_hz, 2) - 1.0;  // J2/J1
  auto& p = model.parameters;
  p.driven_inertia = total / (1.0 + ratio);
  p.load_inertia = total - p.driven_inertia;
  p.stiffness = std::pow(kTwoPi * best.antiresonance_hz, 2) * p.load_inertia;
  p.damping = best.damping_time_s * p.stiffness;
  p.viscous_friction = kTwoPi * best.friction_hz * total;
  return model;
}

std::vector<DriveModel> detail::initial_models(const data::FrequencyResponse& response, Structure structure,
                                               double sample_time_s, bool with_friction) {
  std::vector<DriveModel> models = {initial_model(response, structure, sample_time_s, with_friction)};
  if (structure != Structure::three_mass) return models;
  if (const auto rational = three_mass_of_rational(response, sample_time_s)) models.push_back(*rational);
  const Lines lines = thin(response);
  if (!lines.frequency_hz.empty())
    for (const auto& weak : with_weak_second_pairs(lines, sample_time_s)) models.push_back(weak);
  return models;
}

}  // namespace resonid::fit
