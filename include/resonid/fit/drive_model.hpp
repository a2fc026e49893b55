// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <array>
#include <complex>
#include <resonid/base/enum_names.hpp>
#include <resonid/data/frequency_response.hpp>
#include <resonid/data/mode.hpp>
#include <resonid/data/three_mass.hpp>
#include <resonid/data/transfer_function.hpp>
#include <resonid/fit/detail/uncertain_root.hpp>
#include <span>
#include <string_view>
#include <vector>

namespace resonid::fit {

/// What a drive is taken for.
enum class Structure {
  rigid,       ///< One inertia with viscous friction.
  two_mass,    ///< Two inertias, spring and damper, viscous friction on the driven side.
  three_mass,  ///< Three inertias in a row; "load" is the last, "middle" the one between.
};
inline constexpr EnumName<Structure> kStructureNames[] = {
    {Structure::rigid, "rigid"}, {Structure::two_mass, "two-mass"}, {Structure::three_mass, "three-mass"}};
[[nodiscard]] constexpr std::span<const EnumName<Structure>> enum_names(Structure) noexcept {
  return kStructureNames;
}

/// Physical parameters in the order of every parameter vector and covariance of this stage.
enum Parameter : int {
  kDrivenInertia,
  kLoadInertia,
  kStiffness,
  kDamping,
  kViscousFriction,
  kDelay,
  kLoadViscousFriction,
  kTorqueLag,
  kOutputFilter,
  kMotorGroundStiffness,
  kLoadGroundStiffness,
  kMiddleInertia,
  kStiffness2,
  kDamping2,
  kParameterCount
};
inline constexpr std::array<std::string_view, kParameterCount> kParameterNames = {"driven_inertia",
                                                                                  "load_inertia",
                                                                                  "stiffness",
                                                                                  "damping",
                                                                                  "viscous_friction",
                                                                                  "delay",
                                                                                  "load_viscous_friction",
                                                                                  "torque_lag",
                                                                                  "output_filter",
                                                                                  "motor_ground_stiffness",
                                                                                  "load_ground_stiffness",
                                                                                  "middle_inertia",
                                                                                  "stiffness_2",
                                                                                  "damping_2"};

using ParameterMask = std::array<bool, kParameterCount>;
using ParameterVector = Eigen::Matrix<double, kParameterCount, 1>;
using ParameterCovariance = Eigen::Matrix<double, kParameterCount, kParameterCount>;

/// "rigid", "two-mass", "three-mass"
[[nodiscard]] std::string_view name_of(Structure structure) noexcept;
/// Order of the sampled model: 1, 3, 5.
[[nodiscard]] int order_of(Structure structure) noexcept;
/// Whether a drive of this structure has the inertia, stiffness or damping at all; always > 0 in a model.
[[nodiscard]] bool has_parameter(Structure structure, int parameter) noexcept;

/// Whether a drive of this structure may have the parameter beside those that it must have: friction and
/// delay always, what needs a load only where there is one.
[[nodiscard]] bool may_have_parameter(Structure structure, int parameter) noexcept;

/// Which parameters a structure estimates: its own, and `further` ones that it may have.
[[nodiscard]] ParameterMask estimated_parameters(Structure structure, bool viscous_friction, bool delay,
                                                 std::span<const Parameter> further = {});

/// A parameter that the fit leaves out, and what estimating it would gain (score test).
struct Lacking {
  Parameter parameter = kTorqueLag;
  double gain =
      0.0;  ///< In twice the log-likelihood: chi-square of one degree of freedom where nothing lacks.
};

/// How a velocity is measured.
enum class Velocity {
  sampled,      ///< At the sample itself.
  differences,  ///< Differences of a position, an encoder's for one: the mean over the past sample.
};
inline constexpr EnumName<Velocity> kVelocityNames[] = {{Velocity::sampled, "sampled"},
                                                        {Velocity::differences, "differences"}};
[[nodiscard]] constexpr std::span<const EnumName<Velocity>> enum_names(Velocity) noexcept {
  return kVelocityNames;
}

/// Identified drive: physical parameters with covariance, sampled by zero-order hold.
struct DriveModel {
  Structure structure = Structure::two_mass;
  data::ThreeMassParameters parameters;   ///< Rigid: driven_inertia (the whole one), viscous_friction only.
  Velocity velocity = Velocity::sampled;  ///< Part of response(), as the torque lag is.
  double torque_lag_s = 0.0;              ///< Time constant of a torque loop of first order, >= 0.
  /// Time constant T of a filter of the measured velocity, f(k) = p f(k-1) + (1-p) v(k), p = exp(-Ts/T).
  double output_filter_s = 0.0;
  double delay_s = 0.0;        ///< Fitted delay, on top of the known one; not part of response().
  double known_delay_s = 0.0;  ///< In the measured output and taken out of its response.
  double sample_time_s = 0.0;
  ParameterMask estimated{};
  /// Covariance of the parameters themselves, not logarithms.
  ParameterCovariance covariance = ParameterCovariance::Zero();

  [[nodiscard]] double value(Parameter parameter) const;
  void set(Parameter parameter, double value);
  /// What is estimated beside the structure's own, friction on the driven side and delay:
  /// OutputErrorConfig::further.
  [[nodiscard]] std::vector<Parameter> further() const;
  [[nodiscard]] data::Estimate estimate(Parameter parameter) const;

  /// Whether a spring ties a side to the ground, so that velocity depends on the place.
  [[nodiscard]] bool grounded() const noexcept {
    return parameters.motor_ground_stiffness != 0.0 || parameters.load_ground_stiffness != 0.0;
  }

  /// Zero-order-hold response from commanded torque to velocity, without any delay.
  [[nodiscard]] std::complex<double> response(double frequency_hz) const;

  /// The same at many frequencies; `as_measured` with the fitted delay and with what a fraction of a sample
  /// in known and fitted delay does through the hold: what a response with the known delay taken out shows.
  [[nodiscard]] std::vector<std::complex<double>> values(std::span<const double> frequencies_hz,
                                                         bool as_measured = false) const;

  /// Response with the total standard deviation that the covariance gives to each value.
  [[nodiscard]] data::FrequencyResponse response(std::span<const double> frequencies_hz) const;

  /// The same as a discrete transfer function, without delay: of order 1, 3 or 5, one more with a torque lag
  /// and one with springs to the ground.
  [[nodiscard]] data::TransferFunction transfer_function() const;

  /// Undamped resonances and anti-resonances, ascending; none when rigid without a spring to the ground.
  [[nodiscard]] std::vector<data::Mode> modes() const;

  /// The lowest anti-resonance in Hz, and the resonance above it; not for rigid drives.
  [[nodiscard]] data::Estimate resonance() const;
  [[nodiscard]] data::Estimate antiresonance() const;

  /// Poles and zeros from torque to velocity in the s-plane (1/s), viscous friction and dampings included.
  [[nodiscard]] std::vector<UncertainRoot> poles() const;
  [[nodiscard]] std::vector<UncertainRoot> zeros() const;

  /// Standard deviation of any scalar function of the model, to first order in the covariance.
  template <class Function>
  [[nodiscard]] double standard_deviation_of(Function&& function) const {
    Eigen::Matrix<double, kParameterCount, 1> gradient;
    for (int i = 0; i < kParameterCount; ++i)
      gradient(i) = estimated[static_cast<std::size_t>(i)] ? derivative(function, i) : 0.0;
    return std::sqrt(std::max(0.0, gradient.dot(covariance * gradient)));
  }

  /// A copy with one parameter moved.
  [[nodiscard]] DriveModel moved(int parameter, double by) const;

  /// How far to move a parameter for a derivative by differences; 0 where there is nothing to move.
  [[nodiscard]] double difference_step(int parameter) const;

 private:
  template <class Function>
  double derivative(Function&& function, int i) const {
    const double step = difference_step(i);
    if (step <= 0.0) return 0.0;
    return (function(moved(i, step)) - function(moved(i, -step))) / (2.0 * step);
  }
};

}  // namespace resonid::fit
