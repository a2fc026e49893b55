// SPDX-License-Identifier: MIT
#pragma once

#include <stdexcept>

namespace resonid::cli {

/// Exit codes of every verb (docs/command_line.md).
enum ExitCode : int { kDone = 0, kFailed = 1, kWrongUse = 2, kNotTrusted = 3 };

/// Wrong options: the message names the option, what was found and what is required. Ends with kWrongUse.
struct UsageError : std::runtime_error {
  using std::runtime_error::runtime_error;
};
/// Input that cannot be read or makes no sense: the message names file, line and column. Ends with kWrongUse.
struct InputError : std::runtime_error {
  using std::runtime_error::runtime_error;
};
/// The same where the message has been told already.
struct ToldError : std::runtime_error {
  using std::runtime_error::runtime_error;
};
/// --require-trusted and a result that is not. Ends with kNotTrusted.
struct NotTrustedError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A verb that ends in its own way has been ended by a signal before it was done. Ends with 128 and its
/// number.
struct InterruptedError : std::runtime_error {
  explicit InterruptedError(int number) : std::runtime_error("ended by a signal"), signal(number) {}
  int signal;
};

}  // namespace resonid::cli
