// SPDX-License-Identifier: MIT
#pragma once

#include <complex>
#include <cstdint>
#include <functional>
#include <optional>
#include <resonid/base/expected.hpp>
#include <vector>

#include "design/closed_loop.hpp"
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

/// A mode of a closed loop, and the size of what the load shows of it half a period after a step of the
/// reference by 1.
struct ShownMode {
  ShapedMode mode;
  double size = 0.0;
};
/// From the largest size on. `further`: what the loop's velocity goes through besides, by z; of a position
/// loop the position of the load and the way of its reference.
[[nodiscard]] std::vector<ShownMode> shown_modes(
    const ClosedLoop& loop,
    const std::function<std::complex<double>(std::complex<double> z)>& further = nullptr);

/// Modes of many draws by frequency: with two in a draw the lower and the higher one, and one that is alone
/// to the nearer of both. Nothing where fewer than `least` of the draws have two.
struct TwoModes {
  std::vector<ModesOfDraw> low, high;
};
[[nodiscard]] std::optional<TwoModes> two_modes(const std::vector<ModesOfDraw>& draws, double least = 0.05);
/// One mode that moves: its draws below and above a frequency.
[[nodiscard]] TwoModes split_at(const std::vector<ModesOfDraw>& draws, double frequency_hz);

/// The closed-loop mode of which the load shows most half a period after a step of the reference
/// (docs/methods/tune.md 11.3). Nothing where the loop does not oscillate.
[[nodiscard]] std::optional<ShapedMode> shaped_mode_of(const fit::DriveModel& machine,
                                                       const FilteredPi& controller);

/// The same in draws of the posterior; draws that do not oscillate have no mode.
[[nodiscard]] std::vector<ModesOfDraw> shaped_modes(const Posterior& posterior, const FilteredPi& controller,
                                                    std::size_t draws, std::uint64_t seed);

}  // namespace resonid::design
