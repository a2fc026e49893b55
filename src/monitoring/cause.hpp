// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <monitoring/row.hpp>
#include <resonid/base/enum_names.hpp>
#include <resonid/online/axis_result.hpp>
#include <span>
#include <string_view>

namespace resonid::monitoring {

/// What makes figures change.
enum class Cause : std::uint8_t {
  unknown,           ///< Nothing of what follows does so.
  coupling_looser,   ///< Stiffness fell, inertias same.
  coupling_stiffer,  ///< Stiffness rose, inertias same.
  load_heavier,      ///< Load inertia rose, stiffness and motor inertia same.
  load_lighter,
  motor_inertia,   ///< That of the driven side alone.
  input_scale,     ///< Everything per torque by one factor, frequencies same.
  friction_rose,   ///< Damping or dry friction.
  friction_fell,   ///< Likewise.
  load_torque,     ///< Alone.
  delay_or_gains,  ///< Margins, the machine same.
  not_described,   ///< The response differs from the baseline, all figures same.
};
inline constexpr std::size_t kCauses = 12;
inline constexpr EnumName<Cause> kCauseNames[] = {{Cause::unknown, "unknown"},
                                                  {Cause::coupling_looser, "coupling-looser"},
                                                  {Cause::coupling_stiffer, "coupling-stiffer"},
                                                  {Cause::load_heavier, "load-heavier"},
                                                  {Cause::load_lighter, "load-lighter"},
                                                  {Cause::motor_inertia, "motor-inertia"},
                                                  {Cause::input_scale, "input-scale"},
                                                  {Cause::friction_rose, "friction-rose"},
                                                  {Cause::friction_fell, "friction-fell"},
                                                  {Cause::load_torque, "load-torque"},
                                                  {Cause::delay_or_gains, "delay-or-gains"},
                                                  {Cause::not_described, "not-described"}};
[[nodiscard]] constexpr std::span<const EnumName<Cause>> enum_names(Cause) noexcept { return kCauseNames; }

/// In words, with what speaks for it: "belt or coupling looser (inertias unchanged)".
[[nodiscard]] std::string_view cause_words(Cause cause) noexcept;

/// A figure in the baseline and now. Not a number where it is not known.
struct FigureShift {
  online::Figure before, after;
};

/// Causes, the most likely first.
struct LikelyCause {
  struct Ranked {
    Cause cause = Cause::unknown;
    double weight = 0.0;  ///< All sum to 1.
  };
  std::array<Ranked, kCauses> ranked{};
  /// Probability of what the first one leaves unexplained, were it true (chi-square).
  double fit = 0.0;

  static constexpr double kSure = 0.95;
  [[nodiscard]] const Ranked& first() const noexcept { return ranked.front(); }
  [[nodiscard]] bool sure() const noexcept {
    return first().cause != Cause::unknown && first().weight >= kSure;
  }
};

/// The likely cause from the direction in which all figures moved.
///
/// Each cause is a direction d in the logarithms of the figures (differences where a logarithm makes no
/// sense) with an unknown size t >= 0 of a half-normal prior; what it says nothing about is free with a prior
/// of its own. Shifts y with the covariance S, taken as diagonal, then have the marginal likelihood
///
///   p(y) = 2 N(y; 0, S + F + tau^2 d d') Phi(m/v),   t | y ~ N(m, v^2) before its sign is known
///
/// summed over three scales of tau and F, as much or little may have happened; weights are these times equal
/// priors of the causes, of `input_scale` and of anything at all lower ones. A cause that leaves more
/// unexplained than one of a hundred would (chi-square of y - d t) is out; so `unknown` is what remains where
/// no direction fits, and where the shifts are within their noise. Limits: two causes at once are unknown or,
/// where one of them hides in the noise, the other; the standard deviations must be honest (1.5 times too
/// small ones end in `unknown` more often); stiffness, inertias and frequencies depend on each other, which
/// is allowed for by their number only.
[[nodiscard]] LikelyCause likely_cause(const std::array<FigureShift, kWatched>& shifts) noexcept;

}  // namespace resonid::monitoring
