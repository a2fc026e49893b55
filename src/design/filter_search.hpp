// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <resonid/design/detail/bounds.hpp>
#include <vector>

#include "design/controller.hpp"
#include "design/largest_gain.hpp"

// PI with free biquads for the least integrated error of the load (docs/methods/tune.md 6): largest ki is the
// wrong aim there, since a broad dip below the crossover raises ki and the error alike.
namespace resonid::design {

struct FilterSearch {
  int biquads = 1;      ///< 1 ... 4
  int population = 20;  ///< Of the differential evolution.
  int generations = 18;
  std::uint64_t seed = 1;
};

struct FilteredDesign {
  FilteredPi controller;
  double iae = 0.0;  ///< Of the load after a load step, the mean over the machines, rad.
};

/// The best controller found within the bounds; at least one of them must limit |CS|, or a lead near the
/// Nyquist frequency is the answer. Nothing where no gain meets the bounds. `starts`: filters to begin from
/// as well.
[[nodiscard]] std::optional<FilteredDesign> search_filters(Machines& machines, const Bounds& bounds,
                                                           const FilterSearch& how,
                                                           const std::vector<Biquad>& starts = {});

/// From filters that suited other machines, with a small population around them.
[[nodiscard]] std::optional<FilteredDesign> search_filters_again(Machines& machines, const Bounds& bounds,
                                                                 const std::vector<Biquad>& from);

/// Integrated absolute error of the load's velocity after a torque step of 1 Nm against it, rad; infinite
/// where the loop is unstable.
[[nodiscard]] double load_step_iae(const Machine& machine, const FilteredPi& controller);

/// The same to a few thousandths, by strides of samples where that is enough, and without a look at the
/// poles: of an unstable loop it grows beyond measure. What a search asks again and again.
[[nodiscard]] double rough_load_step_iae(const Machine& machine, const FilteredPi& controller);
/// `fast_gain`: of the controller at high frequencies, which tells how fast the loop may be.
[[nodiscard]] double rough_load_step_iae(const Machine& machine, const ControllerStates& controller,
                                         double fast_gain);

}  // namespace resonid::design
