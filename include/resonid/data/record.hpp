// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <resonid/base/enum_names.hpp>
#include <string>
#include <vector>

namespace resonid::data {

/// What the measured output of a drive is. A response is always reported for velocity.
enum class OutputQuantity { velocity, position, acceleration };
inline constexpr EnumName<OutputQuantity> kOutputQuantityNames[] = {
    {OutputQuantity::velocity, "velocity"},
    {OutputQuantity::position, "position"},
    {OutputQuantity::acceleration, "acceleration"}};
[[nodiscard]] constexpr std::span<const EnumName<OutputQuantity>> enum_names(OutputQuantity) noexcept {
  return kOutputQuantityNames;
}

/// Whether the machine turns or slides: decides the units kgm2, Nm/rad ... or kg, N/m ...
enum class Motion { rotary, linear };
inline constexpr EnumName<Motion> kMotionNames[] = {{Motion::rotary, "rotary"}, {Motion::linear, "linear"}};
[[nodiscard]] constexpr std::span<const EnumName<Motion>> enum_names(Motion) noexcept { return kMotionNames; }

/// What a record may hold beside the output: motion measured at the load.
enum class SecondOutput { none, load_encoder, load_accelerometer };
inline constexpr EnumName<SecondOutput> kSecondOutputNames[] = {
    {SecondOutput::none, "none"},
    {SecondOutput::load_encoder, "load-encoder"},
    {SecondOutput::load_accelerometer, "load-accelerometer"}};
[[nodiscard]] constexpr std::span<const EnumName<SecondOutput>> enum_names(SecondOutput) noexcept {
  return kSecondOutputNames;
}

/// One signal of a record. No samples means that the signal is not there.
struct Channel {
  std::string name;             ///< Name in the file ("iq_meas_A").
  std::string unit;             ///< Unit after scaling ("Nm", "rad/s", "V").
  std::vector<double> samples;  ///< [sample], finite.
  bool unit_assumed = false;    ///< Nothing told the unit: the reader took it for SI.

  [[nodiscard]] bool present() const noexcept { return !samples.empty(); }
};

/// How evenly the samples lie in time, measured from the time column.
struct Sampling {
  bool measured = false;            ///< False when only a rate was given.
  double jitter_rms_s = 0.0;        ///< Deviation of the time stamps from the uniform grid, rms.
  double jitter_max_s = 0.0;        ///< The same, largest.
  std::size_t gaps = 0;             ///< Intervals longer than 1.5 sample times.
  double largest_gap_s = 0.0;       ///< Longest interval between neighbouring samples, if there is a gap.
  double first_gap_at_s = 0.0;      ///< Time stamp before the first gap.
  std::string time_name;            ///< Name of the time column; empty when only a rate was given.
  std::vector<std::size_t> filled;  ///< Samples that were missing and are interpolated, ascending.
};

/// Uniformly sampled signals of one experiment on a drive; what a measured and a simulated drive have in
/// common. All channels that are present have equally many samples. Sign convention and symbols:
/// docs/notation.md.
struct Record {
  std::string source;           ///< File name or description.
  double sample_rate_hz = 0.0;  ///< > 0.
  double start_time_s = 0.0;    ///< Time of sample 0.
  Channel input;                ///< u: torque (force) that the plant receives.
  Channel output;               ///< y: measured velocity, position or acceleration, feedback delay included.
  Channel excitation;           ///< ru: what is added to the controller's output; optional.
  Channel reference;            ///< r: reference of the loop; optional.
  Channel position;             ///< Position of the machine for plants that vary over it; optional.
  Channel second_output;        ///< Position or acceleration of the load, delay included; optional.
  SecondOutput second_output_kind = SecondOutput::none;
  OutputQuantity output_quantity = OutputQuantity::velocity;
  Motion motion = Motion::rotary;
  Sampling sampling;
  std::vector<std::string> reading;  ///< What the reader assumed and converted, a sentence each.

  [[nodiscard]] std::size_t samples() const noexcept { return output.samples.size(); }
  [[nodiscard]] double sample_time_s() const noexcept { return 1.0 / sample_rate_hz; }
  [[nodiscard]] double duration_s() const noexcept { return static_cast<double>(samples()) / sample_rate_hz; }
};

/// What excites the drive: ru where it is recorded, else the input.
[[nodiscard]] const std::vector<double>& exciting(const Record& record);

/// `count` samples from `first` on, of every channel that is present; first + count <= samples().
[[nodiscard]] Record part_of(const Record& record, std::size_t first, std::size_t count);

}  // namespace resonid::data
