// SPDX-License-Identifier: MIT
#pragma once

namespace resonid::cli {

/// From now on Ctrl-C (SIGINT) and SIGTERM say so on standard error, remove what is half written and end the
/// program with 130 or 143. To be called before any thread begins; a signal that was ignored stays ignored.
void end_on_signals();

/// Says on standard error that this signal has ended the program; the exit code of that.
[[nodiscard]] int ended_by(int signal);

}  // namespace resonid::cli
