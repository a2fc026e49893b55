// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <resonid/identification/tune.hpp>
#include <span>
#include <string>
#include <vector>

#include "design/machine.hpp"

namespace resonid::identification {

/// Designs under other options, as `tune` would do them: of simple_structure(). Without them an advice is
/// what the identified machines allow, with some room.
struct Trials {
  /// Whether there is one that is stable and crosses where the machines were measured.
  std::function<bool(const TuneOptions&)> succeeds;
  /// What it reaches, as it is compared with `least_bandwidth_hz`; 0 where there is none.
  std::function<double(const TuneOptions&)> bandwidth_hz;
  /// How many more are made before what is told stays an estimate: a cascade takes a minute.
  std::shared_ptr<int> left = std::make_shared<int>(0);

  [[nodiscard]] bool take_one() const { return (*left)-- > 0; }
};

/// The one of which looser bounds are told: a P or a cascade that was asked for, else a PI.
[[nodiscard]] ControllerStructure simple_structure(ControllerStructure structure);

/// Bounds that no controller meets: which of them cannot be met beside the others, and what could.
[[nodiscard]] Error out_of_reach(const TuneOptions& options, const std::vector<design::Machine>& machines,
                                 std::span<const Result> results, const Trials& trials,
                                 const std::string& what);

/// A bandwidth that is not reached under the bounds, and looser ones under which a PI reaches it.
[[nodiscard]] Error bandwidth_out_of_reach(const TuneOptions& options,
                                           const std::vector<design::Machine>& machines, double reached_hz,
                                           const Trials& trials);

/// A limit of the noise's torque below what every loop takes that crosses where the machines were measured,
/// and how much that is. Nothing where no loop does, whatever its noise.
[[nodiscard]] std::optional<Error> noise_out_of_reach(const TuneOptions& options,
                                                      const std::vector<design::Machine>& machines,
                                                      std::span<const Result> results);

/// A bound, tighter than the usual one, that leaves only loops which cross below what was measured: which one
/// it is, and what of it a PI needs that crosses inside. Nothing where loops do so under the usual bounds
/// too.
[[nodiscard]] std::optional<Error> crossing_out_of_reach(const TuneOptions& options,
                                                         const std::vector<design::Machine>& machines,
                                                         std::span<const Result> results,
                                                         const Trials& trials);

}  // namespace resonid::identification
