// SPDX-License-Identifier: MIT
#pragma once

#include <string>

namespace resonid::cli {

/// An experiment file, from disk or built in.
struct ExperimentSource {
  std::string name;  ///< In messages.
  std::string text;
};

/// The file of that name; where there is none, the shipped experiment of that name. Neither is an InputError.
[[nodiscard]] ExperimentSource experiment_source(const std::string& experiment);

}  // namespace resonid::cli
