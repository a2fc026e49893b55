// SPDX-License-Identifier: MIT
#include "analytic.hpp"

#include <Eigen/LU>
#include <cmath>
#include <utility>

#include "eigenpairs.hpp"

namespace resonid::plant::test {
namespace {

Complex series(Complex x, int first) {  // sum x^n/(n + first)!
  Complex sum = 0;
  Complex term = 1;
  for (int i = 2; i <= first; ++i) term /= Real(i);
  for (int n = 0; n < 30; ++n) {
    sum += term;
    term *= x / Real(n + 1 + first);
  }
  return sum;
}
Complex turn(Real cycles) { return std::polar(Real(1), 2 * std::acos(Real(-1)) * cycles); }

/// (exp(p t) - 1)/p and its integral (phi - t)/p, by their series where those cancel.
Complex phi(Complex p, Real t) {
  return std::abs(p * t) < Real(0.5) ? series(p * t, 1) * t : (std::exp(p * t) - Real(1)) / p;
}
Complex psi(Complex p, Real t) {
  return std::abs(p * t) < Real(0.5) ? series(p * t, 2) * t * t : (phi(p, t) - t) / p;
}

}  // namespace

Analytic::Analytic(const DriveConfig& c, double torque_lag_s, double position_m) {
  const Real r2 = c.radius_m > 0.0 ? Real(c.radius_m) * c.radius_m : Real(1);
  Real viscous_load = c.load_viscous_friction;
  switch (c.structure) {
    case Structure::rigid:
      inertia_ = {c.driven_inertia};
      break;
    case Structure::chain:
      for (const double j : c.inertias) inertia_.push_back(j);
      for (std::size_t i = 0; i < c.stiffnesses.size(); ++i)
        springs_.push_back({i, i + 1, r2 * c.stiffnesses[i], r2 * c.dampings[i]});
      break;
    case Structure::two_mass: {
      // The load at its own shaft, seen through rollers of different radius: w_ares = r2 sqrt(K/J2).
      const Real ratio = c.load_radius_m > 0.0 ? Real(c.radius_m) / c.load_radius_m : Real(1);
      inertia_ = {c.driven_inertia, c.load_inertia * ratio * ratio};
      springs_ = {{0, 1, r2 * c.stiffness, r2 * c.damping}};
      break;
    }
    case Structure::three_mass:
      inertia_ = {c.driven_inertia, c.middle_inertia, c.load_inertia};
      springs_ = {{0, 1, r2 * c.stiffness, r2 * c.damping},
                  {1, 2, r2 * c.stiffness_2, r2 * c.damping_2},
                  {0, 2, r2 * c.bypass_stiffness, r2 * c.bypass_damping}};
      break;
    case Structure::tooth_belt: {
      const Real x = position_m;
      const Real c0 = c.specific_stiffness_n;
      const Real k1 = c0 / x;
      const Real k2 = c0 / (c.upper_length_m - x);
      const Real k3 = c0 / c.lower_length_m;
      stiffness_ = k1 + k2 * k3 / (k2 + k3);
      // Qk = 10 of the resonance sqrt(K (r^2/Js + 1/mL)): Nevaranta 2016, Table 2.2.
      damping_ = stiffness_ /
                 (std::sqrt(stiffness_ * (r2 / c.driven_inertia + 1 / Real(c.cart_mass_kg))) * c.quality);
      inertia_ = {c.driven_inertia, r2 * c.cart_mass_kg};
      springs_ = {{0, 1, r2 * stiffness_, r2 * damping_}};
      break;
    }
  }
  if (inertia_.size() == 1) viscous_load = 0;
  motor_ground_ = c.motor_ground_stiffness;
  load_ground_ = inertia_.size() > 1 ? c.load_ground_stiffness : 0.0;
  decompose(c.viscous_friction, viscous_load, torque_lag_s);
}

Complex Analytic::sampled(Real frequency_hz, Real step_s, int whole, Real early) const {
  const Complex z = turn(frequency_hz * step_s);
  const Real until = (1 - early) * step_s;
  Complex sum = 0;
  for (std::size_t i = 0; i < poles_.size(); ++i) {
    const Complex p = poles_[i];
    const Complex state = phi(p, step_s) / (z - std::exp(p * step_s));
    sum += residues_[i] * (std::exp(p * until) * state + phi(p, until));
  }
  return sum * std::pow(z, -(whole + 1));
}

Complex Analytic::sampled_difference(Real frequency_hz, Real step_s, int whole, Real early) const {
  const Complex z = turn(frequency_hz * step_s);
  const Real until = (1 - early) * step_s;
  Complex sum = 0;
  for (std::size_t i = 0; i < poles_.size(); ++i) {
    const Complex p = poles_[i];
    const Complex state = phi(p, step_s) / (z - std::exp(p * step_s));
    const Complex all = phi(p, step_s) * state + psi(p, step_s);  // way over a sample
    const Complex first = phi(p, until) * state + psi(p, until);
    sum += residues_[i] * (first + (all - first) / z);
  }
  return sum / step_s * std::pow(z, -(whole + 1));
}

void Analytic::decompose(Real viscous, Real viscous_load, Real lag_s) {
  const auto n = static_cast<Eigen::Index>(inertia_.size());
  const bool grounded = motor_ground_ + load_ground_ > 0;
  const Eigen::Index states = 2 * n - 1 + (grounded ? 1 : 0) + (lag_s > 0 ? 1 : 0);
  Eigen::Matrix<Real, -1, -1> a = Eigen::Matrix<Real, -1, -1>::Zero(states, states);
  const Real scale = n > 1      ? std::sqrt(springs_[0].stiffness / inertia_[1])
                     : grounded ? std::sqrt(motor_ground_ / inertia_[0])
                                : Real(1);
  for (const Spring& s : springs_) {
    const auto from = static_cast<Eigen::Index>(s.from);
    const auto to = static_cast<Eigen::Index>(s.to);
    for (const auto& [mass, sign] : {std::pair{from, Real(1)}, std::pair{to, Real(-1)}}) {
      const Real j = inertia_[static_cast<std::size_t>(mass)];
      a(mass, to) += sign * s.damping / j;
      a(mass, from) -= sign * s.damping / j;
      for (Eigen::Index t = from; t < to; ++t) a(mass, n + t) += sign * s.stiffness / (j * scale);
    }
  }
  for (Eigen::Index t = 0; t + 1 < n; ++t) {
    a(n + t, t + 1) = scale;
    a(n + t, t) = -scale;
  }
  if (grounded) {
    const Eigen::Index angle = 2 * n - 1;
    a(angle, 0) = scale;
    a(0, angle) -= motor_ground_ / (inertia_.front() * scale);
    a(n - 1, angle) -= load_ground_ / (inertia_.back() * scale);
    for (Eigen::Index t = 0; t + 1 < n; ++t) a(n - 1, n + t) -= load_ground_ / (inertia_.back() * scale);
  }
  a(0, 0) -= viscous / inertia_.front();
  a(n - 1, n - 1) -= viscous_load / inertia_.back();
  Eigen::Matrix<Complex, -1, 1> b = Eigen::Matrix<Complex, -1, 1>::Zero(states);
  if (lag_s > 0) {
    a(0, states - 1) = 1 / inertia_.front();
    a(states - 1, states - 1) = -1 / lag_s;
    b(states - 1) = 1 / lag_s;
  } else {
    b(0) = 1 / inertia_.front();
  }
  const Eigenpairs pairs = eigenpairs(a);
  const Eigen::Matrix<Complex, -1, 1> gain = pairs.vectors.partialPivLu().solve(b);
  for (Eigen::Index i = 0; i < states; ++i) {
    poles_.push_back(pairs.values(i));
    residues_.push_back(pairs.vectors(0, i) * gain(i));
  }
}

}  // namespace resonid::plant::test
