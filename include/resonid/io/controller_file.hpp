// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <resonid/base/expected.hpp>
#include <resonid/data/transfer_function.hpp>
#include <string>
#include <vector>

namespace resonid::io {

/// What a controller file holds. The transfer function is all that comes between measured velocity and
/// torque, from velocity error to torque: of a position cascade C (1 + kv q), q the backward-Euler sum
/// (docs/methods/tune.md 8.1).
struct ControllerFile : data::TransferFunction {
  std::string structure;  ///< "pi", "pid" ... of the file's writer; empty: not told.
  /// T of u = (T r - R y)/S, R and S being numerator and denominator; empty: T is R.
  std::vector<double> reference_numerator;
  std::optional<double> position_gain;  ///< kv of a cascade, velocity per position error, 1/s.
};

/// A controller as options write it: `pi:KP,TI` (backward Euler, KP in torque per velocity, TI in s), or the
/// name of a JSON file, or what such a file holds: `{"numerator": [...], "denominator": [...]}` in powers of
/// z^-1 at the record's sample time, and, as they apply, `"sample_time_s"`, `"structure"`,
/// `"reference_numerator": [...]` and `"position_gain"`. Refused: keys of another type, another sample time,
/// a position gain that numerator and denominator do not contain.
[[nodiscard]] expected<ControllerFile, Error> read_controller(const std::string& text, double sample_time_s);

}  // namespace resonid::io
