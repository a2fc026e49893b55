// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <complex>
#include <resonid/base/constants.hpp>
#include <resonid/data/record.hpp>
#include <utility>

namespace resonid::data {

/// What a second output measures of the load.
[[nodiscard]] constexpr OutputQuantity quantity_of(SecondOutput kind) noexcept {
  return kind == SecondOutput::load_encoder         ? OutputQuantity::position
         : kind == SecondOutput::load_accelerometer ? OutputQuantity::acceleration
                                                    : OutputQuantity::velocity;
}

/// Factor that turns the phasor of a second output into that of the load's velocity, by the trapezoidal rule:
/// j (2/Ts) tan(w Ts/2) for a position, its inverse for an acceleration. Unlike the driven side's, the load's
/// acceleration does not jump with the torque, so that its sample stands for both intervals beside it.
[[nodiscard]] inline std::complex<double> load_velocity_factor(SecondOutput kind, double frequency_hz,
                                                               double sample_time_s) {
  const std::complex<double> rate(0.0, 2.0 / sample_time_s * std::tan(kPi * frequency_hz * sample_time_s));
  return kind == SecondOutput::load_encoder         ? rate
         : kind == SecondOutput::load_accelerometer ? 1.0 / rate
                                                    : std::complex<double>(1.0);
}

/// The record with the second output in the output's place; it must be there.
[[nodiscard]] inline Record with_second_output(Record record) {
  record.output = std::move(record.second_output);
  record.output_quantity = quantity_of(record.second_output_kind);
  record.second_output = {};
  record.second_output_kind = SecondOutput::none;
  return record;
}

}  // namespace resonid::data
