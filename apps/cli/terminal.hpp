// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace resonid::cli {

enum class When { automatic, always, never };

/// How the program talks: what -q, -v, --brief and --color ask for, the same for every verb.
struct OutputSettings {
  bool quiet = false;    ///< Errors only.
  bool verbose = false;  ///< Stages with elapsed times, wherever standard error goes.
  bool brief = false;    ///< The verdict and the key figures instead of the summary.
  When colour = When::automatic;
  bool ascii = false;  ///< No character beyond ASCII of the program's own.
};
[[nodiscard]] OutputSettings& output_settings() noexcept;

/// Columns that help is wrapped to: COLUMNS, else the terminal's, else 80; at most 100, at least 40.
[[nodiscard]] std::size_t text_width();

/// Whether this stream of the process (STDOUT_FILENO ...) is a terminal that moves its cursor.
[[nodiscard]] bool is_screen(int stream);
/// Whether the program writes "±" and "m²" to people: where the locale (LC_ALL, else LC_CTYPE, else LANG) is
/// a UTF-8 one, unless --ascii is given.
[[nodiscard]] bool is_unicode();

/// Whether colours are written to it: as --color says; auto: a screen, unless NO_COLOR is set and not empty.
[[nodiscard]] bool is_coloured(int stream);

enum class Paint { bold, good, doubtful, bad };
/// The text in a colour, or as it is where the stream has none.
[[nodiscard]] std::string painted(std::string_view text, Paint paint, int stream);
/// A summary whose verdict ("Trusted.", "Rejected.") is coloured.
[[nodiscard]] std::string with_painted_verdict(std::string_view summary, int stream);

/// Lines of at most `width` columns; the first begins with `first`, the others with `indent`. Words that are
/// longer stand out.
[[nodiscard]] std::string wrapped(std::string_view text, std::size_t width, std::string_view first,
                                  std::string_view indent, std::string_view line_end = "");
/// The same lines without what they begin with.
[[nodiscard]] std::vector<std::string> wrapped_lines(std::string_view text, std::size_t width);
/// Columns that UTF-8 text takes.
[[nodiscard]] std::size_t columns_of(std::string_view text);

}  // namespace resonid::cli
