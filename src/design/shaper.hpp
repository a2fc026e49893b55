// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <resonid/base/enum_names.hpp>
#include <resonid/base/expected.hpp>
#include <span>
#include <vector>

// Input shapers: a few impulses with which a reference is convolved, so that it leaves a mode at rest
// (docs/methods/tune.md 11; Singer and Seering 1990, Singhose et al. 1994).
namespace resonid::design {

/// What is to be left at rest: a mode of the closed loop as the load sees it, not the plant's resonance.
struct ShapedMode {
  double frequency_hz = 0.0;
  double damping_ratio = 0.0;
};

enum class ShaperKind {
  zv,           ///< Zero vibration; half a period.
  mzv,          ///< Three impulses within three quarters of a period.
  zvd,          ///< Zero vibration and derivative; a period.
  ei,           ///< Extra insensitive: the limit at the mode itself, zero to both sides; a period.
  two_hump_ei,  ///< The same with two humps; one and a half periods.
};
inline constexpr std::array kShaperKinds = {ShaperKind::zv, ShaperKind::mzv, ShaperKind::zvd, ShaperKind::ei,
                                            ShaperKind::two_hump_ei};
inline constexpr EnumName<ShaperKind> kShaperNames[] = {{ShaperKind::zv, "zv"},
                                                        {ShaperKind::mzv, "mzv"},
                                                        {ShaperKind::zvd, "zvd"},
                                                        {ShaperKind::ei, "ei"},
                                                        {ShaperKind::two_hump_ei, "2hump_ei"}};
[[nodiscard]] constexpr std::span<const EnumName<ShaperKind>> enum_names(ShaperKind) noexcept {
  return kShaperNames;
}

/// Impulses, ascending in time from 0 on; their amplitudes add up to 1.
struct Shaper {
  std::vector<double> amplitudes, times_s;

  [[nodiscard]] double duration_s() const { return times_s.empty() ? 0.0 : times_s.back(); }
};

/// `limit`: residual vibration that the extra insensitive ones leave.
[[nodiscard]] expected<Shaper> shaper_for(ShaperKind kind, const ShapedMode& mode, double limit = 0.05);

/// One shaper after the other: for two modes.
[[nodiscard]] Shaper convolved(const Shaper& a, const Shaper& b);

/// On a grid of samples, each impulse split linearly between its neighbours: rounded to samples it would
/// leave several per cent (docs/methods/tune.md 11.4).
[[nodiscard]] Shaper sampled(const Shaper& shaper, double sample_time_s);

/// Vibration after the last impulse, relative to that of a single impulse at that time
/// (docs/methods/tune.md 11.2).
[[nodiscard]] double residual_vibration(const Shaper& shaper, const ShapedMode& mode);

/// Frequencies around the mode at which the residual vibration stays below a limit, without a gap.
struct Band {
  double from_hz = 0.0, to_hz = 0.0;
};
[[nodiscard]] Band insensitive_band(const Shaper& shaper, const ShapedMode& mode, double limit = 0.05);

}  // namespace resonid::design
