// SPDX-License-Identifier: MIT
#pragma once

#include <monitoring/alarm_settings.hpp>
#include <monitoring/row.hpp>
#include <resonid/data/record.hpp>
#include <resonid/identification/result.hpp>
#include <resonid/identification/track.hpp>
#include <string>
#include <string_view>

namespace resonid::monitoring {

/// What is known of an axis before its first sample.
struct AxisSpec {
  std::string name;
  double sample_rate_hz = 0.0;  ///< > 0
  data::Motion motion = data::Motion::rotary;
  data::OutputQuantity output_quantity = data::OutputQuantity::velocity;
  bool has_excitation = true;  ///< Samples hold the excitation.
  bool has_position = false;   ///< They hold the machine's position.
  /// Units of the samples once they are scaled; empty: SI for `motion` and `output_quantity`.
  std::string input_unit, output_unit;
  double input_scale = 1.0;       ///< Of excitation and input, not 0; negative: their sign is turned round.
  double excitation_scale = 1.0;  ///< A further one of the excitation alone, likewise.
  double output_scale = 1.0;      ///< Of the output, likewise.
  double position_scale = 1.0;

  /// Method, controller, delay, excitation, start, baseline. What is about single recordings must be left
  /// out: `learn_s`, `whole_record`, `every`, `change_of`, `on_row` ...
  identification::TrackOptions track;
  double row_every_s = 0.1;  ///< From row to row, > 0.

  /// How long a figure is watched before its changes can be told, s. A short one finds less.
  double baseline_s = 600.0;
  /// Mean time between false alarms of each detector (threshold.hpp).
  double false_alarm_interval_s = 3.6e6;
  AxisAlarmSettings alarms;
};

/// Units of the scaled samples, never empty.
struct SampleUnits {
  std::string input, output;
};
[[nodiscard]] SampleUnits sample_units(const AxisSpec& spec);

/// In which the axis' figures and the limits of their alarms are, as `identify` and `track` tell them:
/// Nm/rad, or A/rad of an input that is a current.
[[nodiscard]] identification::Units figure_units(const AxisSpec& spec);
/// The one of a figure; empty where neither input nor output decides it: a frequency, a margin.
[[nodiscard]] std::string_view unit_of(Watched figure, const identification::Units& units) noexcept;

}  // namespace resonid::monitoring
