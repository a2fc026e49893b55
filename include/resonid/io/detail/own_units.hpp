// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/data/record.hpp>
#include <resonid/io/record_reader.hpp>
#include <span>
#include <string>

namespace resonid::io {

/// What the numbers of a signal were measured in before the reader converted and scaled them.
struct OwnUnit {
  std::string unit;     ///< "A", "rpm", "counts/s"; empty: nothing tells.
  double factor = 1.0;  ///< What one of it is in the unit of the record; negative for a mirrored sensor.
};

/// A signal that was read, as a result tells of it.
struct ReadSignal {
  std::string column;                  ///< Its name in the file.
  std::string unit;                    ///< What it was converted to, "Nm".
  std::span<const std::string> notes;  ///< Record::reading, which tells what a row of units told.
  data::Motion motion = data::Motion::rotary;
};

/// The drive's unit of torque, current or voltage.
[[nodiscard]] OwnUnit own_input_unit(const ReadSignal& signal, const ColumnMapping& mapping);
/// The drive's unit of velocity: of a position in deg it is deg/s. `quantity`: that of the record, after
/// differentiation.
[[nodiscard]] OwnUnit own_velocity_unit(const ReadSignal& signal, const ColumnMapping& mapping,
                                        data::OutputQuantity quantity);

}  // namespace resonid::io
