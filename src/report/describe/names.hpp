// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/base/enum_names.hpp>
#include <resonid/data/record.hpp>
#include <resonid/diagnostics/finding.hpp>
#include <resonid/fit/drive_model.hpp>
#include <resonid/identification/validate.hpp>
#include <resonid/planning/plan.hpp>

// Names in result files.
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

namespace identification {
inline constexpr EnumName<Verdict> kVerdictNames[] = {
    {Verdict::accepted, "accepted"}, {Verdict::doubtful, "doubtful"}, {Verdict::rejected, "rejected"}};
[[nodiscard]] constexpr std::span<const EnumName<Verdict>> enum_names(Verdict) noexcept {
  return kVerdictNames;
}
}  // namespace identification

namespace planning {
inline constexpr EnumName<Criterion> kCriterionNames[] = {
    {Criterion::accuracy, "accuracy"}, {Criterion::d, "d"}, {Criterion::a, "a"}, {Criterion::e, "e"}};
[[nodiscard]] constexpr std::span<const EnumName<Criterion>> enum_names(Criterion) noexcept {
  return kCriterionNames;
}
inline constexpr EnumName<ExcitationType> kExcitationTypeNames[] = {{ExcitationType::multisine, "multisine"},
                                                                    {ExcitationType::chirp, "chirp"},
                                                                    {ExcitationType::prbs, "prbs"}};
[[nodiscard]] constexpr std::span<const EnumName<ExcitationType>> enum_names(ExcitationType) noexcept {
  return kExcitationTypeNames;
}
}  // namespace planning

}  // namespace resonid
