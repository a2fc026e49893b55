// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <resonid/base/expected.hpp>
#include <string>
#include <vector>

#include "monitor/sources/decoder.hpp"
#include "monitor/sources/source.hpp"

namespace resonid::monitor {

struct CommandSettings {
  std::vector<std::string> command;  ///< Program, found by PATH, and its arguments; no shell.
  Format format = {};                ///< With sample_wraps the index goes on where the axis stands.
  /// After which a command that has ended is run again; doubled up to 30 s each time, and so long again once
  /// it has run for more than 10 s.
  double again_s = 1.0;
};

/// Reads what a command writes to its standard output, `halsampler -t` of LinuxCNC for example; runs it again
/// when it ends. Its last line on standard error is told by status(). With the source the command's whole
/// process group is ended.
///
/// Errors: no command; again_s not > 0.
[[nodiscard]] expected<std::unique_ptr<Source>, Error> make_command_source(CommandSettings settings,
                                                                           Axes& axes);

/// The index of which a sender tells the last 32 bits, where `due` is expected: less than 2^31 ahead of it,
/// or behind. A small number far behind the turn is that of a sender that has begun anew, so behind too.
[[nodiscard]] std::uint64_t unwrapped(std::uint64_t number, std::uint64_t due) noexcept;

}  // namespace resonid::monitor
