// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/diagnostics/detail/finding_catalogue.hpp>
#include <span>

namespace resonid::diagnostics::detail {

/// The catalogue by chapters of docs/findings.md.
[[nodiscard]] std::span<const FindingKind> data_kinds() noexcept;
[[nodiscard]] std::span<const FindingKind> loop_kinds() noexcept;
[[nodiscard]] std::span<const FindingKind> model_kinds() noexcept;
[[nodiscard]] std::span<const FindingKind> join_kinds() noexcept;
[[nodiscard]] std::span<const FindingKind> validate_kinds() noexcept;
[[nodiscard]] std::span<const FindingKind> compare_kinds() noexcept;
[[nodiscard]] std::span<const FindingKind> track_kinds() noexcept;
[[nodiscard]] std::span<const FindingKind> tune_kinds() noexcept;

}  // namespace resonid::diagnostics::detail
