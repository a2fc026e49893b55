// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <array>
#include <fit/drive/drive_signals.hpp>
#include <fit/drive/friction_law.hpp>
#include <fit/drive/sampled_drive.hpp>
#include <optional>
#include <resonid/data/transfer_function.hpp>
#include <span>
#include <vector>

// A record's output simulated by a drive, alone or in its loop, with exact derivatives.
namespace resonid::fit::detail {

/// A record's own coordinates follow the physical ones: states and place at its start, constant torque, by
/// how much the torque lags behind its command, and the controller's states; among them, from kCoulomb on,
/// the shared ones of dry friction: on the driven side, on the load; and of FrictionLaw on the driven side.
inline constexpr int kInitialState = kParameterCount;
inline constexpr int kPlace = kInitialState + Sizes<3>::kOrder;
inline constexpr int kOffset = kPlace + 1;
inline constexpr int kCoulomb = kPlace + 2;
inline constexpr int kLoadCoulomb = kCoulomb + 1;
inline constexpr int kExcess = kCoulomb + 2;
inline constexpr int kStribeckVelocity = kCoulomb + 3;
inline constexpr int kFrictionCoordinates = 4;
inline constexpr int kBehind = kCoulomb + kFrictionCoordinates;
inline constexpr int kControllerState = kBehind + 1;

/// How a simulated drive moves, [sample] from the first that the delay leaves.
struct DriveMotion {
  std::vector<std::vector<double>> velocity;  ///< [mass]
  std::vector<std::vector<double>> twist;     ///< [coupling]
  std::vector<double> torque;                 ///< On the driven side.
};

struct SimulationSetup {
  Structure structure = Structure::two_mass;
  data::OutputQuantity quantity = data::OutputQuantity::velocity;
  Coordinates coordinates;
  double known_delay_samples = 0.0;
  std::optional<data::TransferFunction> controller;  ///< Closes the loop: u = input + C (reference - y).
  Lag lag = Lag::none;                               ///< Of the torque loop.
  Velocity velocity = Velocity::sampled;
  bool grounded = false;  ///< Springs to the ground: the velocity depends on the place.
  int mass = 0;           ///< Whose motion the output is; dry friction needs that of the driven side, 0.

  [[nodiscard]] int controller_order() const;
};

/// One record under one set of signals. `x` are the coordinates above.
class DriveSimulation {
 public:
  DriveSimulation(const SimulationSetup& setup, const DriveSignals& signals)
      : setup_(setup), signals_(signals) {}

  /// Output minus simulated output, for every sample that the delay leaves. In closed loop the controller is
  /// given the recorded output as long as the simulated one is not there yet.
  [[nodiscard]] std::vector<double> residual(std::span<const double> x) const;
  [[nodiscard]] double sum_of_squares(std::span<const double> x) const;

  /// Triangular factor of [J r] for the active coordinates: the same least-squares problem in few rows,
  /// whatever the record's length. J is the derivative of the residual.
  static constexpr std::size_t kMostColumns = 36;  ///< Active coordinates at most.
  [[nodiscard]] Eigen::MatrixXd factor(std::span<const double> x, std::span<const int> active) const;
  /// [stretch] The same of so many stretches of equal length, one after the other, and their samples.
  [[nodiscard]] std::vector<std::pair<Eigen::MatrixXd, std::size_t>> factors(std::span<const double> x,
                                                                             std::span<const int> active,
                                                                             std::size_t stretches) const;

  [[nodiscard]] DriveMotion motion(std::span<const double> x) const;
  /// What further torques [mass][sample] alone do to the output, in the loop, for every sample that has a
  /// residual.
  [[nodiscard]] std::vector<double> moved_by(std::vector<std::vector<double>> pushes,
                                             std::span<const double> x) const;

  /// [J r] itself, [sample]: as many rows as the record leaves.
  [[nodiscard]] Eigen::MatrixXd rows(std::span<const double> x, std::span<const int> active) const;

  /// Dry friction of the drive itself under x: in each part of a sample either side slides, up to a
  /// standstill or past it, or rests. Returns direction and stuck, with their parts, and what acts on the
  /// load; the rest is empty.
  [[nodiscard]] DriveSignals friction(std::span<const double> x) const;
  /// The residual under that friction, whatever course the signals have.
  [[nodiscard]] std::vector<double> moving_residual(std::span<const double> x) const;

 private:
  /// Empty where the reduction is not exact enough.
  template <class Reduction>
  [[nodiscard]] std::vector<std::pair<Eigen::MatrixXd, std::size_t>> factors_by(std::span<const double> x,
                                                                                std::span<const int> active,
                                                                                std::size_t stretches) const;
  /// Its residual, and the course where `course` has room for all of it; an empty one is left alone.
  std::vector<double> simulate_friction(std::span<const double> x, DriveSignals& course) const;
  template <int Masses, class Row, class Sink>
  void run(const double* x, std::span<const int> active, Sink&& sink, DriveSignals* friction,
           DriveMotion* motion = nullptr) const;
  template <int Masses, class Row, class Sink>
  void run_wide(const double* x, std::span<const int> active, Sink&& sink) const;
  /// `sink` is given the residual and its slopes, a Slopes of at least as many columns as are active.
  template <int Masses, class Sink>
  void run_with_slopes(const double* x, std::span<const int> active, Sink&& sink) const;

  const SimulationSetup& setup_;
  const DriveSignals& signals_;
};

}  // namespace resonid::fit::detail
