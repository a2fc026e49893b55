// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/base/enum_names.hpp>
#include <span>

namespace resonid::online {

/// How older samples lose weight.
enum class Forgetting {
  none,         ///< Never: for a constant machine.
  constant,     ///< By `factor` per sample.
  variable,     ///< The faster, the larger the newest error is against the usual one (Fortescue et al. 1981).
  directional,  ///< Only what the newest regressor tells about (Kulhavy 1985): silence forgets nothing.
};
inline constexpr EnumName<Forgetting> kForgettingNames[] = {{Forgetting::constant, "constant"},
                                                            {Forgetting::none, "none"},
                                                            {Forgetting::variable, "variable"},
                                                            {Forgetting::directional, "directional"}};
[[nodiscard]] constexpr std::span<const EnumName<Forgetting>> enum_names(Forgetting) noexcept {
  return kForgettingNames;
}

struct RecursiveLeastSquaresConfig {
  std::span<const double> start{};  ///< Parameters before the first sample; empty: 0.
  /// Variance of each parameter's start per unit variance of the residual, times its scale squared; > 0.
  double start_variance = 1.0;
  std::span<const double> scale{};  ///< Typical size of each regressor, > 0; empty: 1.
  std::span<const bool> fixed{};    ///< Parameters that stay at their start; empty: none.
  Forgetting forgetting = Forgetting::constant;
  double factor = 0.99;            ///< Weight that a sample keeps per sample, in (0, 1]; not used by `none`.
  double smallest_factor = 0.8;    ///< Least factor of `variable`, in (0, factor].
  double noise_variance = 0.0;     ///< Usual variance of the error, for `variable`; 0: learned.
  double largest_variance = 1e4;   ///< Upper limit of each parameter's variance over its start's, >= 1.
  double smallest_variance = 0.0;  ///< Lower limit likewise: stays alert without forgetting; 0 ... 1.
};

}  // namespace resonid::online
