// SPDX-License-Identifier: MIT
#pragma once

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
  klipper           ///< The input shaper of a printer's axis.
};
inline constexpr EnumName<ExportFormat> kExportFormatNames[] = {
    {ExportFormat::json, "json"},          {ExportFormat::c, "c"},     {ExportFormat::c_float, "c-float"},
    {ExportFormat::structured_text, "st"}, {ExportFormat::hal, "hal"}, {ExportFormat::klipper, "klipper"}};
[[nodiscard]] constexpr std::span<const EnumName<ExportFormat>> enum_names(ExportFormat) noexcept {
  return kExportFormatNames;
}

struct ExportNames {
  std::string name = "velocity_controller";  ///< Name of struct, block or component.
  std::string axis = "x";                    ///< The printer's.
  std::string thread = "servo-thread";       ///< LinuxCNC's.
};

/// Before anything is designed: what a target cannot express of what these options ask for.
[[nodiscard]] expected<void, Error> check_exportable(const TuneOptions& options, ExportFormat format);

/// Refuses to take away what is unstable on the identified machine.
[[nodiscard]] expected<void, Error> check_exportable(const Tuning& tuning);

/// The proposed controller as text for another controller, with the torque limit of the options
/// (docs/methods/tune.md 16). Refused, and never approximated: what the target cannot express. A design that
/// is not trusted begins with a warning. Not json, which report::controller_json() writes.
[[nodiscard]] expected<std::string> exported(const Tuning& tuning, ExportFormat format,
                                             const ExportNames& names = {});

}  // namespace resonid::identification
