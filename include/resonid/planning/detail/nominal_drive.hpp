// SPDX-License-Identifier: MIT
#pragma once

#include <complex>
#include <optional>
#include <resonid/base/expected.hpp>
#include <resonid/data/transfer_function.hpp>
#include <resonid/fit/detail/noise_model.hpp>
#include <resonid/fit/drive_model.hpp>
#include <span>
#include <vector>

namespace resonid::planning {

/// What is known of a drive before the experiment: enough to say what the experiment will show.
struct NominalDrive {
  /// Parameters with sample time and known delay; `estimated` says which ones the experiment is to find.
  fit::DriveModel model;
  std::optional<data::TransferFunction> controller;  ///< From velocity error to torque; none: open loop.
  fit::NoiseModel noise;  ///< Noise of the measured velocity; white: order 0 with the noise's variance.
};

[[nodiscard]] expected<void, Error> check(const NominalDrive& drive);

/// Responses of the loop at some lines, from the excitation to what it moves (docs/notation.md).
struct LoopResponse {
  std::vector<std::complex<double>> torque;    ///< S = 1/(1 + C Gd): to the torque that the machine gets.
  std::vector<std::complex<double>> velocity;  ///< G S: to the machine's velocity, no delay.
  std::vector<std::complex<double>> position;  ///< G S/(jw).
};
[[nodiscard]] LoopResponse loop_response(const NominalDrive& drive, std::span<const double> frequency_hz);

/// The drive's response to an excitation, without noise and load: deviations from the operating point.
struct Motion {
  std::vector<double> torque;    ///< [sample] u
  std::vector<double> velocity;  ///< [sample] of the driven side, no delay
  std::vector<double> position;  ///< [sample]
  std::vector<double> measured;  ///< [sample] velocity, delay included: 0 until the delay is over
};
/// x(0) = `start`, the states of data::continuous_system (rigid: the velocity alone); none: from rest.
[[nodiscard]] Motion simulate(const NominalDrive& drive, std::span<const double> excitation,
                              std::span<const double> start = {});

/// Undamped resonances and anti-resonances without error bars, ascending; none when rigid.
[[nodiscard]] std::vector<data::Mode> modes_of(const fit::DriveModel& model);

/// Their number in simulate().
[[nodiscard]] std::size_t states_of(const fit::DriveModel& model) noexcept;

/// What the drive may turn out to be: itself first, then its parameters each multiplied or divided by
/// 1 + spread, in eight combinations that have every pair of parameters in all four (rigid: in two); nothing
/// else when `spread` is 0. Models whose closed loop would be unstable are left out.
[[nodiscard]] std::vector<NominalDrive> possible_drives(const NominalDrive& drive, double spread);

/// False when the loop of model and controller is unstable.
[[nodiscard]] bool stable(const NominalDrive& drive);

}  // namespace resonid::planning
