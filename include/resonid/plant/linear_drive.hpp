// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/LU>
#include <complex>
#include <resonid/base/constants.hpp>
#include <resonid/base/linear_system.hpp>
#include <resonid/data/transfer_function.hpp>
#include <resonid/plant/drive.hpp>

namespace resonid::plant {

/// Linear machine by exact zero-order hold (METHOD 2.5), without error at any sample time.
///
///   x(k+1) = Φ(Ts) x(k) + Γ(Ts) u(k),   returned: c Φ((1-e) Ts) x(k) + c Γ((1-e) Ts) u(k)
template <int Order>
class LinearDrive final : public Drive {
 public:
  using System = LinearSystem<double, Order>;

  /// From torque to the velocity of the driven side; `early_fraction` e in [0, 1).
  LinearDrive(const System& continuous, double sample_time_s, double early_fraction)
      : continuous_(continuous), sampled_(zero_order_hold(continuous, sample_time_s)) {
    const System early = zero_order_hold(continuous, (1.0 - early_fraction) * sample_time_s);
    output_state_ = early.c * early.a;
    output_torque_ = (early.c * early.b)(0);
  }

  double settle(double velocity) override {
    // A x + b u = 0 and c x = velocity, solved together.
    Eigen::Matrix<double, Order + 1, Order + 1> equations;
    equations << continuous_.a, continuous_.b, continuous_.c, 0.0;
    Eigen::Matrix<double, Order + 1, 1> right = Eigen::Matrix<double, Order + 1, 1>::Zero();
    right(Order) = velocity;
    const Eigen::Matrix<double, Order + 1, 1> solution = equations.fullPivLu().solve(right);
    state_ = solution.template head<Order>();
    return solution(Order);
  }

  double advance(double torque) noexcept override {
    const double velocity = output_state_ * state_ + output_torque_ * torque;
    state_ = (sampled_.a * state_ + sampled_.b * torque).eval();
    return velocity;
  }

  [[nodiscard]] const System& sampled() const noexcept { return sampled_; }

 private:
  System continuous_, sampled_;
  typename System::Row output_state_;
  double output_torque_ = 0.0;
  typename System::Column state_ = System::Column::Zero();
};

using TwoMassDrive = LinearDrive<3>;
using RigidDrive = LinearDrive<1>;

/// Rigid machine: J dW/dt = T - b W.
[[nodiscard]] inline LinearSystem<double, 1> rigid_system(double inertia, double viscous_friction) {
  LinearSystem<double, 1> s;
  s.a(0) = -viscous_friction / inertia;
  s.b(0) = 1.0 / inertia;
  s.c(0) = 1.0;
  return s;
}

/// Response of a discrete system, c (zI - A)^-1 b + d. Solved as it stands, it keeps its digits near 0 Hz,
/// where the polynomials of the transfer function cancel.
template <int Order>
[[nodiscard]] std::complex<double> response(const LinearSystem<double, Order>& discrete, double sample_time_s,
                                            double frequency_hz) {
  using Complex = std::complex<double>;
  const Complex z = std::polar(1.0, kTwoPi * frequency_hz * sample_time_s);
  Eigen::Matrix<Complex, Order, Order> m = -discrete.a.template cast<Complex>();
  m.diagonal().array() += z;
  const Eigen::Matrix<Complex, Order, 1> x = m.partialPivLu().solve(discrete.b.template cast<Complex>());
  return (discrete.c.template cast<Complex>() * x)(0) + discrete.d;
}

/// Transfer function of a discrete system. Denominator: characteristic polynomial by Faddeev and LeVerrier;
/// numerator: from the impulse response h(0) = d, h(i) = c A^(i-1) b, as b_i = sum_j a_j h(i-j).
template <int Order>
[[nodiscard]] data::TransferFunction transfer_function(const LinearSystem<double, Order>& discrete,
                                                       double sample_time_s) {
  using Matrix = typename LinearSystem<double, Order>::Matrix;
  constexpr auto kCount = static_cast<std::size_t>(Order) + 1;
  std::vector<double> a(kCount), h(kCount), b(kCount, 0.0);
  a[0] = 1.0;
  h[0] = discrete.d;
  Matrix m = Matrix::Zero();
  auto x = discrete.b;
  for (std::size_t i = 1; i < kCount; ++i) {
    m = (discrete.a * m).eval();
    m.diagonal().array() += a[i - 1];
    a[i] = -(discrete.a * m).trace() / static_cast<double>(i);
    h[i] = discrete.c * x;
    x = (discrete.a * x).eval();
  }
  for (std::size_t i = 0; i < kCount; ++i)
    for (std::size_t j = 0; j <= i; ++j) b[i] += a[j] * h[i - j];
  return {b, a, sample_time_s};
}

}  // namespace resonid::plant
