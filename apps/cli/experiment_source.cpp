// SPDX-License-Identifier: MIT
#include "experiment_source.hpp"

#include <filesystem>
#include <resonid/base/error_text.hpp>
#include <resonid/io/detail/suggestion.hpp>
#include <resonid/io/experiment.hpp>
#include <resonid/io/shipped_experiments.hpp>
#include <vector>

#include "errors.hpp"

namespace resonid::cli {

ExperimentSource experiment_source(const std::string& experiment) {
  std::error_code ignored;
  std::vector<std::string> names;
  for (const auto& shipped : io::shipped_experiments()) {
    if (shipped.name == experiment && !std::filesystem::exists(experiment, ignored))
      return {experiment, std::string(shipped.text)};
    names.emplace_back(shipped.name);
  }
  auto text = io::read_experiment_text(experiment);
  if (text) return {experiment, std::move(*text)};
  const bool name = experiment.find_first_of("/.") == std::string::npos;
  throw InputError(message_of(text.error()) +
                   (name ? ", and no shipped experiment has that name" + io::suggestion(experiment, names) +
                               "; 'resonid simulate --list' shows them"
                         : std::string()));
}

}  // namespace resonid::cli
