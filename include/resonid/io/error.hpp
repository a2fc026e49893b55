// SPDX-License-Identifier: MIT
#pragma once

#include <string>

namespace resonid::io {

/// Why a file could not be read or written. The message names the file and, where they apply, the line
/// (counted from 1) and the column, what was found and what is required; it is meant for the user as it
/// stands.
struct Error {
  std::string message;
};

}  // namespace resonid::io
