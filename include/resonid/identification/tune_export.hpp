// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <resonid/base/enum_names.hpp>
#include <resonid/base/expected.hpp>
#include <resonid/identification/tune.hpp>
#include <span>
#include <string>

namespace resonid::identification {

/// The languages of controllers.
enum class ExportFormat {
  json,             ///< Numerator and denominator, as `--controller` takes them.
  c,                ///< C99, double.
  c_float,          ///< C99, float.
  structured_text,  ///< IEC 61131-3.
  hal,              ///< LinuxCNC.
  klipper,          ///< The input shaper of a printer's axis.
  first_step        ///< As json, of the gains to begin with: first_step().
};
inline constexpr EnumName<ExportFormat> kExportFormatNames[] = {{ExportFormat::json, "json"},
                                                                {ExportFormat::c, "c"},
                                                                {ExportFormat::c_float, "c-float"},
                                                                {ExportFormat::structured_text, "st"},
                                                                {ExportFormat::hal, "hal"},
                                                                {ExportFormat::klipper, "klipper"},
                                                                {ExportFormat::first_step, "first-step"}};
[[nodiscard]] constexpr std::span<const EnumName<ExportFormat>> enum_names(ExportFormat) noexcept {
  return kExportFormatNames;
}

struct ExportNames {
  /// Name of struct, block or component; empty: "velocity_controller", of a cascade "position_controller".
  std::string name = {};
  std::string axis = "x";               ///< The printer's.
  std::string thread = "servo-thread";  ///< LinuxCNC's.
};

/// Before anything is designed: what a target cannot express of what these options ask for.
[[nodiscard]] expected<void, Error> check_exportable(const TuneOptions& options, ExportFormat format);

/// Refuses to take away what is unstable on the identified machine.
[[nodiscard]] expected<void, Error> check_exportable(const Tuning& tuning);

/// The proposed controller as text for another controller, with the torque limit of the options
/// (docs/methods/tune.md 16). Refused, and never approximated: what the target cannot express. A design that
/// is not trusted begins with a warning. Refused too: json and first_step, which are controller files;
/// resonid::controller_json() writes the former.
[[nodiscard]] expected<std::string> exported(const Tuning& tuning, ExportFormat format,
                                             const ExportNames& names = {});

/// Units of proportional, integral and derivative gain: "Nm/(rad/s)", "Nm/rad", "Nm/(rad/s2)"; "A/rpm",
/// "A/(rpm s)", "A s/rpm".
struct GainUnits {
  std::string kp, ki, kd;
};
/// Empty where one of the units is.
[[nodiscard]] GainUnits gain_units(const std::string& input, const std::string& velocity);

/// Gains as the drive takes them: with the scales of the recording undone.
struct OwnGains {
  double factor = 1.0;  ///< What every gain, and every term of a numerator, is multiplied by.
  GainUnits units;      ///< Empty where nothing tells them.
};
/// Nothing where the recording is in the units of the result itself.
[[nodiscard]] std::optional<OwnGains> own_gains(const Tuning& tuning);

/// The first step of a proposed controller on a machine: half of every gain, a quarter of an integral one.
inline constexpr double kFirstGain = 0.5, kFirstIntegralGain = 0.25;

/// That controller, without figures: to be run, and judged by `--evaluate`, before the full gains are taken.
/// Refused: a schedule, and a controller without gains.
[[nodiscard]] expected<TunedController, Error> first_step(const Tuning& tuning);

}  // namespace resonid::identification
