// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cassert>
#include <resonid/io/experiment.hpp>
#include <resonid/io/shipped_experiments.hpp>

namespace resonid::io {

plant::ExperimentConfig shipped_experiment(std::string_view name) {
  const auto all = shipped_experiments();
  const auto found =
      std::find_if(all.begin(), all.end(), [&](const ShippedExperiment& e) { return e.name == name; });
  assert(found != all.end());
  auto config = parse_experiment(found->text, found->name);
  assert(config);
  return std::move(*config);
}

}  // namespace resonid::io
