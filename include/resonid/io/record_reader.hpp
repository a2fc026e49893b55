// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <optional>
#include <resonid/base/expected.hpp>
#include <resonid/data/record.hpp>
#include <resonid/io/detail/table.hpp>
#include <string>

namespace resonid::io {

/// Which column is which signal, and in what unit. What is not named is looked for under its usual names
/// (docs/methods/record_files.md). Input, output, excitation, reference and second output may be sums of
/// columns, `34.18*theta - 3.307*strain`.
struct ColumnMapping {
  std::optional<std::string> time;        ///< In seconds; "none" ignores a column with a usual name.
  std::optional<std::string> input;       ///< u
  std::optional<std::string> output;      ///< y
  std::optional<std::string> excitation;  ///< ru, absent when not named and not found.
  std::optional<std::string> reference;   ///< r, absent when not named and not found.
  std::optional<std::string> position;    ///< Position of the machine, absent when not named and not found.
  std::optional<std::string> second_output;  ///< Motion of the load, of second_output_kind; both or none.
  double sample_rate_hz = 0.0;               ///< 0: from the time column.
  double input_scale = 1.0;                  ///< Scale of the input and the excitation; not 0.
  double output_scale = 1.0;                 ///< Scale of the output and the reference; not 0.
  double second_output_scale = 1.0;          ///< Scale of the second output; not 0.
  std::optional<double> from_s;              ///< First instant taken, in the time of the record.
  std::optional<double> to_s;                ///< First instant no longer taken.
  data::OutputQuantity output_quantity = data::OutputQuantity::velocity;
  data::SecondOutput second_output_kind = data::SecondOutput::none;
  /// Take backward differences of a position (and its reference), so that the record holds a velocity. The
  /// mean over the past sample: it comes half a sample late. The first sample is left out.
  bool differentiate = false;
  data::Motion motion = data::Motion::rotary;
  std::optional<std::string> input_unit;   ///< After scaling; otherwise from the column's name and the scale.
  std::optional<std::string> output_unit;  ///< The same; with `differentiate` that of the velocity.
  std::optional<std::string> second_output_unit;  ///< As input_unit.
};

/// Makes a record of a table: finds the signals, scales them, tells their units, measures the sample rate,
/// jitter and gaps from the time column, and cuts.
///
/// Errors: a column that is not there, a sum that holds anything but columns and factors, several candidates
/// for a signal, columns of different lengths, time that does not rise, more than 5 % of the samples missing,
/// an empty cut, fewer than 16 samples. Gaps and jitter are no errors: they are reported in Record::sampling,
/// and the samples beside a gap stand next to each other.
[[nodiscard]] expected<data::Record, Error> to_record(const Table& table, const ColumnMapping& mapping);

/// read_table() and to_record().
[[nodiscard]] expected<data::Record, Error> read_record(const std::filesystem::path& path,
                                                        const ColumnMapping& mapping);

}  // namespace resonid::io
