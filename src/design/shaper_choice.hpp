// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <resonid/base/expected.hpp>
#include <vector>

#include "design/controller.hpp"
#include "design/posterior.hpp"
#include "design/shaper.hpp"

namespace resonid::design {

/// The modes that a shaper is to leave at rest in one draw of the posterior: at all positions and loads of
/// the machine, and several at each where there are.
using ModesOfDraw = std::vector<ShapedMode>;

/// Quantile over the draws of the residual vibration of the worst mode of each; linear between order
/// statistics.
[[nodiscard]] double vibration_quantile(const Shaper& shaper, const std::vector<ModesOfDraw>& draws,
                                        double quantile = 0.95);

/// The mode in the middle of those of the draws: geometric mean of the 2.5 % and 97.5 % quantiles of the
/// frequency, and median damping. Where a position moves the mode, a shaper is made for it. Nothing where
/// there is no mode.
[[nodiscard]] std::optional<ShapedMode> middle_mode(const std::vector<ModesOfDraw>& draws);

struct ShaperOptions {
  double limit = 0.05;                  ///< Residual vibration that is allowed.
  double quantile = 0.95;               ///< Share of the draws in which it is not exceeded.
  std::optional<double> sample_time_s;  ///< Judged as sampled.
};

struct ShaperCandidate {
  std::vector<ShaperKind> kinds;  ///< [designed mode]
  Shaper shaper;
  double quantile = 0.0;  ///< Residual vibration that is not exceeded.
};

struct ShaperChoice {
  std::vector<ShaperCandidate> candidates;  ///< Ascending in duration.
  std::optional<std::size_t> chosen;        ///< Nothing where none stays below the limit.
};

/// The shortest shaper whose quantile stays below the limit, the one with less vibration where two are as
/// short (docs/methods/tune.md 11.2). `designed`: the mode that the shapers are made for, or two, with every
/// pair of kinds.
[[nodiscard]] expected<ShaperChoice> choose_shaper(const std::vector<ShapedMode>& designed,
                                                   const std::vector<ModesOfDraw>& draws,
                                                   const ShaperOptions& options = {});

/// The closed-loop mode of which the load shows most half a period after a step of the reference
/// (docs/methods/tune.md 11.3). Nothing where the loop does not oscillate.
[[nodiscard]] std::optional<ShapedMode> shaped_mode_of(const fit::DriveModel& machine,
                                                       const FilteredPi& controller);

/// The same in draws of the posterior; draws that do not oscillate have no mode.
[[nodiscard]] std::vector<ModesOfDraw> shaped_modes(const Posterior& posterior, const FilteredPi& controller,
                                                    std::size_t draws, std::uint64_t seed);

}  // namespace resonid::design
