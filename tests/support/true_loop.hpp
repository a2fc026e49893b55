// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>
#include <resonid/base/constants.hpp>
#include <resonid/data/transfer_function.hpp>
#include <resonid/data/two_mass.hpp>

// What a controller does on a machine that is known exactly, from the differential equations: nothing of the
// stages `fit` and `design` is used.
namespace resonid::test {

struct TrueLoop {
  bool stable = false;
  double spectral_radius = 0.0;
  double sensitivity = 0.0;    ///< Largest |S|.
  double load_transfer = 0.0;  ///< Largest |T_load|.
};

/// Two masses under sampled control. The torque is kept from sample to sample, the motor's velocity measured
/// `delay_s` > 0 later, which need not be whole samples: of the sample l = ceil(delay/Ts) before, and the
/// part theta = l Ts - delay after it,
///
///   y(k) = c (e^{A theta} x(k-l) + int_0^theta e^{A s} b ds u(k-l))
class TrueTwoMass {
 public:
  TrueTwoMass(const data::TwoMassParameters& p, double delay_s, double sample_time_s)
      : sample_time_s_(sample_time_s) {
    Eigen::Matrix4d rates = Eigen::Matrix4d::Zero();  // velocities of motor and load, twist; torque
    rates.row(0) << -(p.damping + p.viscous_friction) / p.driven_inertia, p.damping / p.driven_inertia,
        -p.stiffness / p.driven_inertia, 1.0 / p.driven_inertia;
    rates.row(1) << p.damping / p.load_inertia, -p.damping / p.load_inertia, p.stiffness / p.load_inertia,
        0.0;
    rates.row(2) << 1.0, -1.0, 0.0, 0.0;
    const Eigen::Matrix4d whole = exponential(rates * sample_time_s);
    a_ = whole.topLeftCorner<3, 3>();
    b_ = whole.topRightCorner<3, 1>();
    late_ = static_cast<int>(std::ceil(delay_s / sample_time_s - 1e-9));
    const Eigen::Matrix4d part = exponential(rates * (late_ * sample_time_s - delay_s));
    measured_ = part.row(0).head<3>();
    through_ = part(0, 3);
  }

  /// L from error to delayed velocity.
  [[nodiscard]] std::complex<double> loop(const data::TransferFunction& controller,
                                          double frequency_hz) const {
    const auto z = at(frequency_hz);
    const std::complex<double> motor = (measured_ * states(z)).value() + through_;
    return controller.response(frequency_hz) * motor * std::pow(z, -late_);
  }
  [[nodiscard]] double sensitivity(const data::TransferFunction& controller, double frequency_hz) const {
    return 1.0 / std::abs(1.0 + loop(controller, frequency_hz));
  }
  /// From the reference to the load's velocity.
  [[nodiscard]] double load_transfer(const data::TransferFunction& controller, double frequency_hz) const {
    return std::abs(controller.response(frequency_hz) * states(at(frequency_hz))(1)) *
           sensitivity(controller, frequency_hz);
  }

  [[nodiscard]] TrueLoop under(const data::TransferFunction& controller) const {
    TrueLoop found;
    found.spectral_radius = spectral_radius(controller);
    found.stable = found.spectral_radius < 1.0;
    found.sensitivity = largest([&](double f) { return sensitivity(controller, f); });
    found.load_transfer = largest([&](double f) { return load_transfer(controller, f); });
    return found;
  }

 private:
  static Eigen::Matrix4d exponential(const Eigen::Matrix4d& m) {
    constexpr int kSquarings = 12, kTerms = 12;
    const Eigen::Matrix4d small = m / std::ldexp(1.0, kSquarings);
    Eigen::Matrix4d sum = Eigen::Matrix4d::Zero(), term = small;  // e^m - 1, which keeps its digits
    for (int k = 2; k <= kTerms; ++k) {
      sum += term;
      term = (term * small / k).eval();
    }
    for (int k = 0; k < kSquarings; ++k) sum = (2.0 * sum + sum * sum).eval();
    return sum + Eigen::Matrix4d::Identity();
  }

  [[nodiscard]] std::complex<double> at(double frequency_hz) const {
    return std::polar(1.0, kTwoPi * frequency_hz * sample_time_s_);
  }
  [[nodiscard]] Eigen::Vector3cd states(std::complex<double> z) const {
    const Eigen::Matrix3cd system = z * Eigen::Matrix3cd::Identity() - a_.cast<std::complex<double>>();
    return system.inverse() * b_.cast<std::complex<double>>();
  }

  /// Over a dense grid, then by golden sections around its largest.
  template <class Size>
  [[nodiscard]] double largest(Size size) const {
    constexpr int kPoints = 4000;
    const double end_hz = 0.5 / sample_time_s_, ratio = std::pow(1e-5, -1.0 / kPoints);
    double best = 0.0, best_hz = end_hz;
    for (double f = 1e-5 * end_hz; f <= end_hz; f *= ratio)
      if (const double here = size(f); here > best) {
        best = here;
        best_hz = f;
      }
    double low = best_hz / ratio, high = std::min(end_hz, best_hz * ratio);
    constexpr double kGolden = 0.6180339887498949;
    for (int i = 0; i < 50; ++i) {
      const double left = high - kGolden * (high - low), right = low + kGolden * (high - low);
      (size(left) > size(right) ? high : low) = size(left) > size(right) ? right : left;
    }
    return std::max(best, size(0.5 * (low + high)));
  }

  /// Of masses, the line of delayed measurements and the controller in transposed direct form II.
  [[nodiscard]] double spectral_radius(const data::TransferFunction& controller) const {
    auto numerator = controller.numerator, denominator = controller.denominator;
    const std::size_t size = std::max(numerator.size(), denominator.size());
    numerator.resize(size);
    denominator.resize(size);
    const int order = static_cast<int>(size) - 1, line = 3, memory = line + late_;
    Eigen::MatrixXd m = Eigen::MatrixXd::Zero(memory + order, memory + order);
    Eigen::RowVectorXd torque = Eigen::RowVectorXd::Zero(m.cols()), velocity = torque;
    velocity(memory - 1) = 1.0;
    torque = -numerator[0] * velocity;
    if (order > 0) torque(memory) += 1.0;
    m.block<3, 3>(0, 0) = a_;
    m.topRows<3>() += b_ * torque;
    m.row(line).head<3>() = measured_;
    m.row(line) += through_ * torque;
    for (int i = 1; i < late_; ++i) m(line + i, line + i - 1) = 1.0;
    for (int i = 0; i < order; ++i) {
      const auto k = static_cast<std::size_t>(i) + 1;
      m.row(memory + i) = -numerator[k] * velocity - denominator[k] * torque;
      if (i + 1 < order) m(memory + i, memory + i + 1) += 1.0;
    }
    return Eigen::EigenSolver<Eigen::MatrixXd>(m, false).eigenvalues().cwiseAbs().maxCoeff();
  }

  double sample_time_s_;
  Eigen::Matrix3d a_;
  Eigen::Vector3d b_;
  Eigen::RowVector3d measured_;
  double through_ = 0.0;
  int late_ = 0;
};

}  // namespace resonid::test
