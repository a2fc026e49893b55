// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace resonid::io {

/// What the cells of a column hold.
enum class CellKind { number, clock, text };

/// One cell taken for itself.
struct Cell {
  enum class Kind { number, clock, missing, text };
  Kind kind = Kind::text;
  double value = 0.0;  ///< NaN when missing; seconds of a clock.
};

/// Whether a cell says that there is no value: empty, NaN, `#NV`, `#N/A`, `null`, `-` and their like.
[[nodiscard]] bool says_missing(std::string_view text) noexcept;

/// Time of day in seconds: `14:03:59.125`, `14:03:59,125`, `14:03:59:125`, `2:03:59.125 PM`, with or without
/// a date before it (`2026-11-27T`, `27.11.2026 `, `11/27/2026 `) and a zone behind it (`Z`, `+01:00`). Or
/// time that runs, where hours and minutes go on counting: `30:03:59.125`, in minutes and seconds `3:59.125`,
/// `125:00`.
[[nodiscard]] std::optional<double> parse_clock(std::string_view text);

/// The whole text as one finite number with that decimal mark, or nothing.
[[nodiscard]] std::optional<double> parse_decimal(std::string_view text, char decimal);

/// Of what parse_clock() reads: whether it is minutes and seconds.
[[nodiscard]] bool is_without_hours(std::string_view text) noexcept;

[[nodiscard]] Cell read_cell(std::string_view text, char decimal);

}  // namespace resonid::io
