// SPDX-License-Identifier: MIT
#include <Eigen/Core>
#include <array>
#include <cmath>
#include <resonid/base/constants.hpp>
#include <resonid/online/detail/axis_lines.hpp>
#include <resonid/online/detail/axis_physical.hpp>
#include <resonid/online/detail/axis_reading.hpp>
#include <resonid/online/models/detail/zoh_two_mass.hpp>
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
  const auto zoh =
      ZohTwoMass<double>::over({p[0], p[1], p[2], p[3], p[4]},
                               kTwoPi * std::sqrt(p[2] * (1.0 / p[0] + 1.0 / p[1])), 1.0 / sample_rate_hz, 0);
  Eigen::Matrix3d a, m = Eigen::Matrix3d::Identity();
  Eigen::Vector3d b;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) a(i, j) = zoh.ab[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)];
    b(i) = zoh.ab[static_cast<std::size_t>(i)][3];
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
                                                    const Eigen::Matrix<double, 5, 5>& covariance,
                                                    double sample_rate_hz) noexcept {
  constexpr double kStep = 1e-4;
  Eigen::Matrix<double, 6, 5> gradient = Eigen::Matrix<double, 6, 5>::Zero();
  for (int i = 0; i < 5; ++i) {
    if (!(covariance(i, i) > 0.0)) continue;  // known
    const auto at = static_cast<std::size_t>(i);
    auto up = p, down = p;
    double step = kStep;
    if (i < 4) {
      up[at] *= std::exp(kStep);
      down[at] *= std::exp(-kStep);
    } else {  // friction may be 0: a step against what the inertia takes at the resonance
      step *= std::sqrt(p[2] * p[0]);
      up[at] += step;
      down[at] -= step;
    }
    const auto above = sampled_two_mass(up, sample_rate_hz), below = sampled_two_mass(down, sample_rate_hz);
    for (int k = 0; k < 3; ++k) {
      const auto of = static_cast<std::size_t>(k);
      gradient(k, i) = (above.b[of] - below.b[of]) / (2.0 * step);
      gradient(3 + k, i) = (above.a[of] - below.a[of]) / (2.0 * step);
    }
  }
  return gradient * covariance * gradient.transpose();
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

}  // namespace resonid::online::detail
