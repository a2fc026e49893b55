// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/base/expected.hpp>
#include <resonid/data/transfer_function.hpp>
#include <string>

namespace resonid::io {

/// A controller as options write it: `pi:KP,TI` (backward Euler, KP in torque per velocity, TI in s), or the
/// name of a JSON file `{"numerator": [...], "denominator": [...]}` in powers of z^-1 at the record's sample
/// time, or what such a file holds.
[[nodiscard]] expected<data::TransferFunction, Error> read_controller(const std::string& text,
                                                                      double sample_time_s);

}  // namespace resonid::io
