// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <optional>
#include <resonid/base/enum_names.hpp>
#include <resonid/base/expected.hpp>
#include <resonid/data/record.hpp>
#include <resonid/io/detail/table.hpp>
#include <span>
#include <string>

namespace resonid::io {

/// What the numbers of a time column are.
enum class TimeUnit { seconds, milliseconds, microseconds, nanoseconds, hundred_nanoseconds, samples };
inline constexpr EnumName<TimeUnit> kTimeUnitNames[] = {
    {TimeUnit::seconds, "s"},      {TimeUnit::milliseconds, "ms"},           {TimeUnit::microseconds, "us"},
    {TimeUnit::nanoseconds, "ns"}, {TimeUnit::hundred_nanoseconds, "100ns"}, {TimeUnit::samples, "samples"}};
[[nodiscard]] constexpr std::span<const EnumName<TimeUnit>> enum_names(TimeUnit) noexcept {
  return kTimeUnitNames;
}

/// What is done about samples that are missing.
enum class MissingSamples { interpolate, refuse };
inline constexpr EnumName<MissingSamples> kMissingSamplesNames[] = {
    {MissingSamples::interpolate, "interpolate"}, {MissingSamples::refuse, "refuse"}};
[[nodiscard]] constexpr std::span<const EnumName<MissingSamples>> enum_names(MissingSamples) noexcept {
  return kMissingSamplesNames;
}

/// Which column is which signal, and in what unit. What is not named is looked for under its usual names
/// (docs/methods/record_files.md). Input, output, excitation, reference and second output may be sums of
/// columns, `34.18*theta - 3.307*strain`.
///
/// Units that are known, from a name, a row of units or these fields, are converted to SI, and
/// Record::reading says so. A scale other than 1 and -1 takes the place of that: it must give SI.
struct ColumnMapping {
  TextLayout layout = {};                  ///< How a text file is written, as far as it is not to be sniffed.
  std::optional<std::string> time = {};    ///< "none" ignores a column with a usual name.
  std::optional<TimeUnit> time_unit = {};  ///< Absent: as the column's name tells, else seconds.
  std::optional<std::string> input = {};   ///< u
  std::optional<std::string> output = {};  ///< y
  std::optional<std::string> excitation = {};  ///< ru, absent when not named and not found.
  std::optional<std::string> reference = {};   ///< r, absent when not named and not found.
  std::optional<std::string> position =
      {};  ///< Position of the machine, absent when not named and not found.
  std::optional<std::string> second_output =
      {};                             ///< Motion of the load, of second_output_kind; both or none.
  double sample_rate_hz = 0.0;        ///< 0: from the time column.
  double input_scale = 1.0;           ///< Scale of the input and the excitation; not 0.
  double output_scale = 1.0;          ///< Scale of the output and the reference; not 0.
  double second_output_scale = 1.0;   ///< Scale of the second output; not 0.
  std::optional<double> from_s = {};  ///< First instant taken, in the time of the record.
  std::optional<double> to_s = {};    ///< First instant no longer taken.
  std::optional<data::OutputQuantity> output_quantity =
      {};  ///< Absent: as name and unit tell, else velocity.
  data::SecondOutput second_output_kind = data::SecondOutput::none;
  /// Take backward differences of a position (and its reference), so that the record holds a velocity. The
  /// mean over the past sample: it comes half a sample late. The first sample is left out.
  bool differentiate = false;
  std::optional<data::Motion> motion =
      {};  ///< Absent: linear where a unit is of force or length, else rotary.
  std::optional<std::string> input_unit = {};   ///< Unit of the scaled column, where its name does not tell.
  std::optional<std::string> output_unit = {};  ///< The same; with `differentiate` that of the velocity.
  std::optional<std::string> second_output_unit = {};  ///< As input_unit.
  std::optional<double> counts_per_rev = {};   ///< Resolution of an encoder whose counts are recorded, > 0.
  std::optional<double> rated_torque = {};     ///< What 100 % of an input in per cent are, Nm or N, > 0.
  std::optional<double> torque_constant = {};  ///< Torque (force) per A of an input in A; not 0.
  MissingSamples missing = MissingSamples::interpolate;
};

/// Makes a record of a table: finds the signals, converts and scales them, measures the sample rate, jitter
/// and gaps from the time column, cuts, and puts isolated missing samples back on their grid: up to 1 % of
/// all and three in a row, by cubic interpolation.
///
/// Errors: a column that is not there, a sum that holds anything but columns and factors, several candidates
/// for a signal, columns of different lengths, time that does not rise, a unit that does not fit what the
/// signal is said to be, more than 5 % of the samples missing, an empty cut, fewer than 16 samples. Longer
/// gaps and jitter are no errors: they are reported in Record::sampling, and the samples beside a gap stand
/// next to each other.
[[nodiscard]] expected<data::Record, Error> to_record(const Table& table, const ColumnMapping& mapping);

/// read_table() and to_record().
[[nodiscard]] expected<data::Record, Error> read_record(const std::filesystem::path& path,
                                                        const ColumnMapping& mapping);

}  // namespace resonid::io
