// SPDX-License-Identifier: MIT
#include "design/shaper.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numeric>
#include <resonid/base/constants.hpp>
#include <utility>

namespace resonid::design {
namespace {

struct Impulse {
  double time_s, amplitude;
};

/// Ascending, impulses at one time together, normalised.
Shaper shaper_of(std::vector<Impulse> impulses) {
  std::sort(impulses.begin(), impulses.end(),
            [](const auto& a, const auto& b) { return a.time_s < b.time_s; });
  const double near = impulses.empty() ? 0.0 : 1e-12 * impulses.back().time_s;
  Shaper shaper;
  for (const Impulse& impulse : impulses) {
    if (impulse.amplitude == 0.0) continue;
    if (!shaper.times_s.empty() && impulse.time_s - shaper.times_s.back() <= near) {
      shaper.amplitudes.back() += impulse.amplitude;
    } else {
      shaper.times_s.push_back(impulse.time_s);
      shaper.amplitudes.push_back(impulse.amplitude);
    }
  }
  const double sum = std::accumulate(shaper.amplitudes.begin(), shaper.amplitudes.end(), 0.0);
  for (double& amplitude : shaper.amplitudes) amplitude /= sum;
  return shaper;
}

/// Times in damped periods, and amplitudes before they are normalised (docs/methods/tune.md 11.1). `k`: decay
/// of half a period.
std::vector<Impulse> impulses_of(ShaperKind kind, double k, double v) {
  switch (kind) {
    case ShaperKind::zv:
      return {{0.0, 1.0}, {0.5, k}};
    case ShaperKind::mzv: {
      const double later = std::pow(k, 0.75), first = 1.0 - std::sqrt(0.5);
      return {{0.0, first}, {0.375, (std::sqrt(2.0) - 1.0) * later}, {0.75, first * later * later}};
    }
    case ShaperKind::zvd:
      return {{0.0, 1.0}, {0.5, 2.0 * k}, {1.0, k * k}};
    case ShaperKind::ei:
      return {{0.0, 0.25 * (1.0 + v)}, {0.5, 0.5 * (1.0 - v) * k}, {1.0, 0.25 * (1.0 + v) * k * k}};
    default: {
      const double x = std::cbrt(v * v * (std::sqrt(1.0 - v * v) + 1.0));
      const double outer = (3.0 * x * x + 2.0 * x + 3.0 * v * v) / (16.0 * x);
      return {{0.0, outer}, {0.5, (0.5 - outer) * k}, {1.0, (0.5 - outer) * k * k}, {1.5, outer * k * k * k}};
    }
  }
}

}  // namespace

expected<Shaper> shaper_for(ShaperKind kind, const ShapedMode& mode, double limit) {
  if (!(mode.frequency_hz > 0.0)) return refuse("frequency_hz", "must be > 0", mode.frequency_hz);
  const double zeta = mode.damping_ratio;
  if (!(zeta >= 0.0 && zeta < 1.0)) return refuse("damping_ratio", "must be >= 0 and below 1", zeta);
  if (!(limit > 0.0 && limit < 1.0)) return refuse("limit", "must be > 0 and below 1", limit);
  const double root = std::sqrt(1.0 - zeta * zeta), period_s = 1.0 / (mode.frequency_hz * root);
  auto impulses = impulses_of(kind, std::exp(-zeta * kPi / root), limit);
  for (Impulse& impulse : impulses) impulse.time_s *= period_s;
  return shaper_of(std::move(impulses));
}

Shaper convolved(const Shaper& a, const Shaper& b) {
  std::vector<Impulse> impulses;
  for (std::size_t i = 0; i < a.times_s.size(); ++i)
    for (std::size_t j = 0; j < b.times_s.size(); ++j)
      impulses.push_back({a.times_s[i] + b.times_s[j], a.amplitudes[i] * b.amplitudes[j]});
  return shaper_of(std::move(impulses));
}

Shaper sampled(const Shaper& shaper, double sample_time_s) {
  constexpr double kOnSample = 1e-9;  // of a sample
  std::vector<Impulse> impulses;
  for (std::size_t i = 0; i < shaper.times_s.size(); ++i) {
    const double at = shaper.times_s[i] / sample_time_s, before = std::floor(at + kOnSample);
    const double later = std::max(0.0, at - before) < kOnSample ? 0.0 : at - before;
    impulses.push_back({before * sample_time_s, (1.0 - later) * shaper.amplitudes[i]});
    impulses.push_back({(before + 1.0) * sample_time_s, later * shaper.amplitudes[i]});
  }
  return shaper_of(std::move(impulses));
}

double residual_vibration(const Shaper& shaper, const ShapedMode& mode) {
  const double omega = kTwoPi * mode.frequency_hz, zeta = mode.damping_ratio;
  const std::complex<double> pole(zeta * omega, omega * std::sqrt(std::max(0.0, 1.0 - zeta * zeta)));
  std::complex<double> sum = 0.0;
  for (std::size_t i = 0; i < shaper.times_s.size(); ++i)
    sum += shaper.amplitudes[i] * std::exp(pole * (shaper.times_s[i] - shaper.duration_s()));
  return std::abs(sum);
}

Band insensitive_band(const Shaper& shaper, const ShapedMode& mode, double limit) {
  // The humps of an extra insensitive shaper touch the limit, and surpass it by a trifle where there is
  // damping.
  const double most = 1.01 * limit;
  constexpr double kStep = 5e-4, kLargest = 4.0;  // times the mode's frequency
  const auto exceeds = [&](double factor) {
    return residual_vibration(shaper, {factor * mode.frequency_hz, mode.damping_ratio}) > most;
  };
  const auto edge = [&](double direction) {
    double inside = 1.0, outside = 1.0;
    while (!exceeds(outside) && outside > kStep && outside < kLargest) {
      inside = outside;
      outside += direction * kStep;
    }
    constexpr int kHalvings = 30;
    for (int i = 0; i < kHalvings; ++i) {
      const double middle = 0.5 * (inside + outside);
      (exceeds(middle) ? outside : inside) = middle;
    }
    return inside * mode.frequency_hz;
  };
  return {edge(-1.0), edge(1.0)};
}

}  // namespace resonid::design
