// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/base/enum_names.hpp>
#include <resonid/data/record.hpp>
#include <resonid/diagnostics/finding.hpp>
#include <resonid/fit/drive_model.hpp>

// Names in result files of enums that have none beside them yet.
namespace resonid {

namespace data {
inline constexpr EnumName<OutputQuantity> kOutputQuantityNames[] = {
    {OutputQuantity::velocity, "velocity"},
    {OutputQuantity::position, "position"},
    {OutputQuantity::acceleration, "acceleration"}};
[[nodiscard]] constexpr std::span<const EnumName<OutputQuantity>> enum_names(OutputQuantity) noexcept {
  return kOutputQuantityNames;
}
}  // namespace data

namespace diagnostics {
inline constexpr EnumName<Severity> kSeverityNames[] = {
    {Severity::info, "info"}, {Severity::warning, "warning"}, {Severity::error, "error"}};
[[nodiscard]] constexpr std::span<const EnumName<Severity>> enum_names(Severity) noexcept {
  return kSeverityNames;
}
}  // namespace diagnostics

namespace fit {
inline constexpr EnumName<Structure> kStructureNames[] = {
    {Structure::rigid, "rigid"}, {Structure::two_mass, "two-mass"}, {Structure::three_mass, "three-mass"}};
[[nodiscard]] constexpr std::span<const EnumName<Structure>> enum_names(Structure) noexcept {
  return kStructureNames;
}
}  // namespace fit

}  // namespace resonid
