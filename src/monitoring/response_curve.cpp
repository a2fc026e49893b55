// SPDX-License-Identifier: MIT
#include <Eigen/Core>
#include <array>
#include <cmath>
#include <monitoring/response_curve.hpp>
#include <resonid/base/constants.hpp>
#include <resonid/data/transfer_function.hpp>

namespace resonid::monitoring {
namespace {

using identification::detail::Follower;
using P = online::PhysicalParameter;
constexpr std::array kPlant = {P::driven_inertia, P::load_inertia, P::stiffness, P::damping,
                               P::viscous_friction};

/// Models of the physical tracker's estimate and of its neighbours, one standard deviation's part up and down
/// in each parameter, from which the response's error follows to first order.
class PhysicalErrors {
 public:
  PhysicalErrors(const online::PhysicalTracker<double, 16384>& tracker, double rate_hz) : rate_hz_(rate_hz) {
    const auto all = tracker.log_covariance();
    for (int i = 0; i < 5; ++i)
      for (int j = 0; j < 5; ++j)
        covariance_(i, j) = all(static_cast<int>(kPlant[static_cast<std::size_t>(i)]),
                                static_cast<int>(kPlant[static_cast<std::size_t>(j)]));
    std::array<double, 5> plant{};
    for (std::size_t i = 0; i < 5; ++i) plant[i] = tracker.value(kPlant[i]);
    for (std::size_t i = 0; i < 5; ++i) {
      auto up = plant, down = plant;
      if (kPlant[i] == P::viscous_friction) {  // its own unit, all others by logarithms
        step_[i] = kStep * std::max(plant[3], 1e-12);
        up[i] += step_[i];
        down[i] -= step_[i];
      } else {
        step_[i] = kStep;
        up[i] *= std::exp(kStep);
        down[i] *= std::exp(-kStep);
      }
      up_[i] = online::detail::sampled_two_mass(up, rate_hz);
      down_[i] = online::detail::sampled_two_mass(down, rate_hz);
    }
  }
  [[nodiscard]] double std_at(double hz) const {
    Eigen::Matrix<std::complex<double>, 5, 1> g;
    for (std::size_t i = 0; i < 5; ++i)
      g(static_cast<int>(i)) =
          (online::response(up_[i], hz, rate_hz_) - online::response(down_[i], hz, rate_hz_)) /
          (2.0 * step_[i]);
    const double variance = g.real().dot(covariance_ * g.real()) + g.imag().dot(covariance_ * g.imag());
    return std::sqrt(std::max(0.0, variance));
  }

 private:
  static constexpr double kStep = 1e-4;
  double rate_hz_;
  Eigen::Matrix<double, 5, 5> covariance_;
  std::array<double, 5> step_{};
  std::array<online::detail::AxisReading::Model, 5> up_, down_;
};

}  // namespace

ResponseCurve response_curve(const Follower& follower, std::size_t points) {
  ResponseCurve curve;
  const auto& axis = follower.axis();
  const auto& setup = follower.setup();
  const double rate_hz = setup.config.sample_rate_hz;
  if (axis.lines() > 1) {
    for (std::size_t i = 0; i < axis.lines(); ++i) {
      const auto line = axis.line(i);
      if (!line.settled) continue;
      curve.frequency_hz.push_back(line.frequency_hz);
      curve.plant.push_back(line.response);
      curve.std.push_back(line.std);
    }
  } else if (axis.has_model()) {
    const auto* physical = axis.estimator<online::AxisPhysical<>>();
    std::optional<PhysicalErrors> errors;
    if (physical != nullptr) errors.emplace(physical->tracker(), rate_hz);
    constexpr double kLowest = 0.001, kHighest = 0.49;  // of the sample rate
    for (std::size_t i = 0; i < points; ++i) {
      const double part = static_cast<double>(i) / static_cast<double>(points - 1);
      const double hz = rate_hz * kLowest * std::pow(kHighest / kLowest, part);
      curve.frequency_hz.push_back(hz);
      curve.plant.push_back(axis.response(hz));
      if (errors) curve.std.push_back(errors->std_at(hz));
    }
  }
  if (setup.numerator.empty()) return curve;
  const data::TransferFunction controller{setup.numerator, setup.denominator, 1.0 / rate_hz};
  for (std::size_t i = 0; i < curve.frequency_hz.size(); ++i) {
    const double hz = curve.frequency_hz[i];
    const auto factor = controller.response(hz) * std::polar(1.0, -kTwoPi * hz * setup.config.known_delay_s);
    curve.loop.push_back(factor * curve.plant[i]);
    if (!curve.std.empty()) curve.loop_std.push_back(std::abs(factor) * curve.std[i]);
  }
  return curve;
}

}  // namespace resonid::monitoring
