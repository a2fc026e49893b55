// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <complex>
#include <resonid/base/constants.hpp>
#include <resonid/fit/response_fit.hpp>
#include <vector>

namespace resonid::fit {
namespace {

struct Candidate {
  double antiresonance_hz = 0.0;
  double resonance_hz = 0.0;
  double damping_time_s = 0.0;  // D/K
  double friction_hz = 0.0;     // B/(2 pi (J1 + J2)): corner of the rigid machine
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
    const double relative = g.standard_deviation.empty() ? 0.0 : g.standard_deviation[i] / magnitude;
    // Lines stand for the width of the logarithmic axis that they cover.
    lines.frequency_hz.push_back(g.frequency_hz[i]);
    lines.log_magnitude.push_back(std::log(magnitude));
    lines.weight.push_back(1.0 / (0.01 + relative * relative) / g.frequency_hz[i]);
  }
  return lines;
}

/// Compares magnitudes with those of the continuous drive of unit inertia,
///   G = (1 + s d + (s/wa)^2) / (s (1 + s d + (s/wr)^2) + b (1 + s d + (s/wa)^2))
void judge(const Lines& lines, Candidate& c) {
  double sum = 0.0, mean = 0.0, square = 0.0;
  for (std::size_t i = 0; i < lines.frequency_hz.size(); ++i) {
    const double f = lines.frequency_hz[i];
    const double a = f / c.antiresonance_hz;
    const double r = f / c.resonance_hz;
    const std::complex<double> s(0.0, kTwoPi * f);
    const std::complex<double> top(1.0 - a * a, kTwoPi * f * c.damping_time_s);
    const std::complex<double> bottom(1.0 - r * r, kTwoPi * f * c.damping_time_s);
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
    std::nth_element(inertia.begin(), inertia.begin() + inertia.size() / 2, inertia.end());
    model.parameters.driven_inertia = inertia[inertia.size() / 2];
    return model;
  }
  const double low = lines.frequency_hz.front();
  const double high = std::max(lines.frequency_hz.back(), 1.5 * low);
  const int steps = std::clamp(static_cast<int>(25.0 * std::log10(high / low)), 36, 100);
  Candidate best;
  for (int i = 0; i < steps; ++i)
    for (int j = i + 1; j <= steps; ++j)
      for (const double damping : {0.005, 0.03, 0.1, 0.3})
        for (const double friction : {0.0, 0.3, 1.0, 3.0}) {
          if (friction > 0.0 && !with_friction) continue;
          Candidate c;
          c.antiresonance_hz = low * std::pow(high / low, static_cast<double>(i) / steps);
          c.resonance_hz = low * std::pow(high / low, static_cast<double>(j) / steps);
          constexpr double kWidest = 10.0;  // a load 100 times the motor
          if (c.resonance_hz > kWidest * c.antiresonance_hz) continue;
          c.damping_time_s = 2.0 * damping / (kTwoPi * c.resonance_hz);
          c.friction_hz = friction * c.antiresonance_hz;
          judge(lines, c);
          if (c.spread < best.spread) best = c;
        }
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

}  // namespace resonid::fit
