// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <resonid/base/expected.hpp>
#include <resonid/data/transfer_function.hpp>
#include <string>
#include <vector>

namespace resonid::io {

/// What a controller file's law is made of: u = F (kp (b r - y) + ki sum + kd derivative of -y), F the
/// product of biquads.
struct ControllerParts {
  double kp = 0.0, ki = 0.0;  ///< Torque per velocity; per velocity and second.
  struct Biquad {
    double frequency_hz = 0.0, numerator_damping = 0.0, denominator_damping = 0.0;
  };
  std::vector<Biquad> biquads;
  std::optional<double> derivative_gain, derivative_time_s;  ///< A PID's, and its filter.
  double set_point_weight = 1.0;
};

/// What a controller file holds. The transfer function is all that comes between measured velocity and
/// torque, from velocity error to torque: of a position cascade C (1 + kv q), q the backward-Euler sum
/// (docs/methods/tune.md 8.1).
struct ControllerFile : data::TransferFunction {
  std::string structure;  ///< "pi", "pid" ... of the file's writer; empty: not told.
  /// T of u = (T r - R y)/S, R and S being numerator and denominator; empty: T is R.
  std::vector<double> reference_numerator;
  std::optional<double> position_gain;   ///< kv of a cascade, velocity per position error, 1/s.
  std::optional<ControllerParts> parts;  ///< Where the file tells them; they are not compared with the law.
};

/// A controller as options write it: `pi:KP,TI` (backward Euler, KP in torque per velocity, TI in s), or the
/// name of a JSON file, or what such a file holds: `{"numerator": [...], "denominator": [...]}` in powers of
/// z^-1 at the record's sample time, and, as they apply, `"sample_time_s"`, `"structure"`,
/// `"reference_numerator": [...]` and `"position_gain"`, and what it is made of: `"gains": {"kp", "ki",
/// "biquads": [...]}`, `"derivative_gain"`, `"derivative_time_s"` and `"set_point_weight"`. Refused: keys of
/// another type, another sample time, a position gain that numerator and denominator do not contain.
[[nodiscard]] expected<ControllerFile, Error> read_controller(const std::string& text, double sample_time_s);

}  // namespace resonid::io
