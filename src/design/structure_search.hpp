// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <optional>
#include <resonid/design/detail/bounds.hpp>
#include <vector>

#include "design/controller.hpp"
#include "design/global_search.hpp"
#include "design/largest_gain.hpp"

// Controllers of any structure by a few numbers each: what RST and state feedback are searched with
// (docs/methods/tune.md 9.2, 10.2).
namespace resonid::design {

/// A controller by a point of the search, or nothing where there is none.
using MakeController = std::function<std::optional<LinearController>(const GlobalSearch::Point&)>;

struct StructureDesign {
  GlobalSearch::Point point;
  double iae = 0.0;       ///< Of the load after a load step, the mean over the machines, rad.
  double exceeded = 0.0;  ///< By what a bound is exceeded at any frequency, relative.
};

/// Least integrated error of the load after a load step, with the bounds as penalties. No proof that it is
/// the least. Nothing where no stable controller was found. Lines at which a bound is nearly reached are
/// added to `machines`. `from`: what suited other machines, from which alone is gone on; empty: none.
[[nodiscard]] std::optional<StructureDesign> search_structure(Machines& machines, const Bounds& bounds,
                                                              const MakeController& make,
                                                              std::vector<GlobalSearch::Range> ranges,
                                                              const GlobalSearch::Effort& effort,
                                                              std::vector<GlobalSearch::Point> starts = {},
                                                              const GlobalSearch::Point& from = {});

}  // namespace resonid::design
