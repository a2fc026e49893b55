// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <resonid/data/record.hpp>
#include <resonid/io/record_reader.hpp>
#include <string>
#include <vector>

namespace resonid::io {

/// What is known of a signal's unit before it is converted.
struct SignalUnit {
  std::string column;                ///< Its name, for the notes.
  std::string unit;                  ///< Of a row of units or in the name; empty: none.
  std::optional<std::string> given;  ///< As the user tells: of the scaled column.
  double scale = 1.0;                ///< As the user tells.
  std::string si;                    ///< What is assumed where nothing tells.
  std::string quantity = {};         ///< What the user says that it is, if so: then nothing is assumed.
};

/// A factor and what the product is measured in.
struct Conversion {
  double factor = 1.0;  ///< The scale included.
  std::string unit;
  bool assumed = false;  ///< Nothing told the unit.
};

/// From known units to SI, from counts to rad with the counts per turn, from per cent to Nm with the rated
/// torque, from A to Nm with the torque constant; units that are not known stay as they are. What was
/// converted or assumed is added to `notes`.
class UnitConverter {
 public:
  UnitConverter(const ColumnMapping& mapping, data::Motion motion, std::vector<std::string>& notes)
      : mapping_(mapping), motion_(motion), notes_(notes) {}

  [[nodiscard]] Conversion convert(const SignalUnit& signal);

 private:
  [[nodiscard]] Conversion to_torque(const SignalUnit& signal, double factor, const char* what);
  void note_converted(const SignalUnit& signal, const std::string& from, double factor,
                      const std::string& to);

  const ColumnMapping& mapping_;
  data::Motion motion_;
  std::vector<std::string>& notes_;
};

}  // namespace resonid::io
