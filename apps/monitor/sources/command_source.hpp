// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <resonid/base/expected.hpp>
#include <string>
#include <vector>

#include "monitor/sources/decoder.hpp"
#include "monitor/sources/source.hpp"

namespace resonid::monitor {

struct CommandSettings {
  std::vector<std::string> command;  ///< Program, found by PATH, and its arguments; no shell.
  Format format = TextSettings{};
  double again_s = 1.0;  ///< After which a command that has ended is run again; doubled up to 30 s each time.
};

/// Reads what a command writes to its standard output, `halsampler -t` of LinuxCNC for example; runs it again
/// when it ends. Its last line on standard error is told by status(). With the source the command's whole
/// process group is ended.
///
/// Errors: no command; again_s not > 0.
[[nodiscard]] expected<std::unique_ptr<Source>, Error> make_command_source(CommandSettings settings,
                                                                           Axes& axes);

}  // namespace resonid::monitor
