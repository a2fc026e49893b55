// SPDX-License-Identifier: MIT
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <resonid/base/constants.hpp>
#include <resonid/online/detail/axis_physical.hpp>
#include <resonid/online/detail/axis_reading.hpp>
#include <resonid/online/detail/axis_sweep.hpp>
#include <resonid/online/models/detail/held_two_mass.hpp>
#include <resonid/online/models/modes.hpp>

namespace resonid::online::detail {
namespace {

/// J1, J2 and K of a model of order 3 with an integrator.
void find_masses(AxisReading& r, double sample_rate_hz) noexcept {
  const auto& m = r.model;
  const double slope = 3.0 + 2.0 * m.a[0] + m.a[1];  // of A at z = 1
  const double inertia = slope / sample_rate_hz / (m.b[0] + m.b[1] + m.b[2]);
  const double ratio = r.resonance_hz.value / r.antiresonance_hz.value;
  const double omega = kTwoPi * r.antiresonance_hz.value;
  if (!(ratio > 1.0) || !(inertia > 0.0)) return;
  r.driven_inertia = inertia / (ratio * ratio);
  r.load_inertia = inertia - r.driven_inertia;
  r.stiffness = r.load_inertia * omega * omega;
}

}  // namespace

void find_modes(AxisReading& r, std::size_t order, double sample_rate_hz) noexcept {
  constexpr double kIntegrator = 1.002;
  constexpr double kMostDamping = 0.9;  // of what is called a resonance
  double gain = 0.0;
  for (const double b : r.model.b) gain += b;
  if (order == 1) {
    r.physical = std::abs(r.model.a[0]) < kIntegrator && gain > 0.0;
    return;
  }
  const SampledModes<3> modes(r.model, sample_rate_hz);
  const auto take = [](const auto& found, Figure& hz, double& damping) {
    if (found.empty() || !(std::abs(found[0].damping_ratio) < kMostDamping)) return;
    const double std = found[0].std_hz;
    hz = {found[0].frequency_hz, std::isfinite(std) && std > 0.0 ? std : AxisRow::kUnknown};
    damping = found[0].damping_ratio;
  };
  const auto covariance = r.covariance();
  take(modes.resonances(covariance), r.resonance_hz, r.resonance_damping);
  take(modes.antiresonances(covariance), r.antiresonance_hz, r.antiresonance_damping);
  bool stable = true;
  for (const auto& pole : modes.poles())
    stable = stable && std::abs(pole) < (pole.imag() == 0.0 ? kIntegrator : 1.0);
  r.physical = stable && gain > 0.0 && std::isfinite(r.resonance_hz.value);
  find_masses(r, sample_rate_hz);
}

/// Faddeev and LeVerrier: adj(zI - A) and det(zI - A) in one recursion.
AxisReading::Model sampled_two_mass(const std::array<double, 5>& p, double sample_rate_hz) noexcept {
  const auto held = HeldTwoMass<double>::over({p[0], p[1], p[2], p[3], p[4]},
                                              kTwoPi * std::sqrt(p[2] * (1.0 / p[0] + 1.0 / p[1])),
                                              1.0 / sample_rate_hz, 0);
  Eigen::Matrix3d a, m = Eigen::Matrix3d::Identity();
  Eigen::Vector3d b;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) a(i, j) = held.ab[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)];
    b(i) = held.ab[static_cast<std::size_t>(i)][3];
  }
  AxisReading::Model model;
  for (std::size_t k = 0; k < 3; ++k) {
    model.b[k] = m.row(0).dot(b);
    const Eigen::Matrix3d am = a * m;
    model.a[k] = -am.trace() / static_cast<double>(k + 1);
    m = am;
    m.diagonal().array() += model.a[k];
  }
  return model;
}

AxisReading::Covariance sampled_two_mass_covariance(const std::array<double, 5>& p,
                                                    const Eigen::Matrix4d& log_covariance,
                                                    double sample_rate_hz) noexcept {
  constexpr double kStep = 1e-4;
  Eigen::Matrix<double, 6, 4> by_log;
  for (int i = 0; i < 4; ++i) {
    auto up = p, down = p;
    up[static_cast<std::size_t>(i)] *= std::exp(kStep);
    down[static_cast<std::size_t>(i)] *= std::exp(-kStep);
    const auto above = sampled_two_mass(up, sample_rate_hz), below = sampled_two_mass(down, sample_rate_hz);
    for (int k = 0; k < 3; ++k) {
      const auto at = static_cast<std::size_t>(k);
      by_log(k, i) = (above.b[at] - below.b[at]) / (2.0 * kStep);
      by_log(3 + k, i) = (above.a[at] - below.a[at]) / (2.0 * kStep);
    }
  }
  return by_log * log_covariance * by_log.transpose();
}

std::complex<double> axis_velocity_factor(AxisOutput output, double frequency_hz,
                                          double sample_rate_hz) noexcept {
  const double angle = kTwoPi * frequency_hz / sample_rate_hz;
  switch (output) {
    case AxisOutput::position:
      return {0.0, 2.0 * sample_rate_hz * std::tan(0.5 * angle)};
    case AxisOutput::acceleration:
      return 1.0 / sample_rate_hz / (1.0 - std::polar(1.0, -angle));
    case AxisOutput::velocity:
      break;
  }
  return 1.0;
}

namespace {

/// Height of the peak at i above the higher of the two valleys that part it from higher ground, or the band's
/// ends.
template <class Level>
double prominence(const Level& level, std::size_t points, std::size_t i) noexcept {
  double before = level(i), after = level(i);
  for (std::size_t k = i; k-- > 0 && level(k) <= level(i);) before = std::min(before, level(k));
  for (std::size_t k = i + 1; k < points && level(k) <= level(i); ++k) after = std::min(after, level(k));
  return level(i) - std::max(before, after);
}

/// Of the parabola through three points.
double vertex(double x0, double y0, double x1, double y1, double x2, double y2) noexcept {
  const double a = (y2 - y1) / (x2 - x1), b = (y1 - y0) / (x1 - x0);
  const double curvature = (a - b) / (x2 - x0);
  if (curvature == 0.0) return x1;
  return std::clamp(0.5 * (x0 + x1) - 0.5 * b / curvature, x0, x2);
}

}  // namespace

AxisExtrema axis_extrema(std::span<const double> hz, std::span<const double> level_db,
                         std::span<const double> relative_std) noexcept {
  constexpr double kLeastDb = 3.0, kDeviations = 3.0, kDbPerNeper = 8.69;
  AxisExtrema found;
  for (const double sign : {-1.0, 1.0}) {
    double& first = sign < 0.0 ? found.minimum_hz : found.maximum_hz;
    const auto level = [&](std::size_t i) { return sign * level_db[i]; };
    for (std::size_t i = 1; i + 1 < hz.size() && std::isnan(first); ++i) {
      if (level(i) < level(i - 1) || level(i) <= level(i + 1)) continue;
      const double error = std::isfinite(relative_std[i]) ? relative_std[i] : 0.0;
      if (prominence(level, hz.size(), i) < std::max(kLeastDb, kDeviations * kDbPerNeper * error)) continue;
      first = std::exp(vertex(std::log(hz[i - 1]), level(i - 1), std::log(hz[i]), level(i),
                              std::log(hz[i + 1]), level(i + 1)));
    }
  }
  return found;
}

}  // namespace resonid::online::detail
