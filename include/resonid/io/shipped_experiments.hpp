// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/plant/experiment.hpp>
#include <span>
#include <string_view>

namespace resonid::io {

/// An experiment file of the folder experiments/, built into the library.
struct ShippedExperiment {
  std::string_view name;  ///< File name without ".toml".
  std::string_view text;
};

/// In the order of their names.
[[nodiscard]] std::span<const ShippedExperiment> shipped_experiments() noexcept;

/// The configuration of a shipped experiment. Asserts that there is one of that name and that it is valid,
/// which the tests check for all of them.
[[nodiscard]] plant::ExperimentConfig shipped_experiment(std::string_view name);

}  // namespace resonid::io
