// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/online/models/rls.hpp>

#include "error.hpp"

namespace resonid::c {

/// What settings of least squares and of models say about forgetting, in the same fields.
template <class Settings>
expected<online::RecursiveLeastSquaresConfig> adaptation(const Settings& s) noexcept {
  const auto forgetting = enumerator("forgetting", s.forgetting, online::Forgetting::directional);
  if (!forgetting) return unexpected<Error>(forgetting.error());
  online::RecursiveLeastSquaresConfig r;
  r.start_variance = s.start_variance;
  r.forgetting = *forgetting;
  r.factor = s.factor;
  r.smallest_factor = s.smallest_factor;
  r.noise_variance = s.noise_variance;
  r.largest_variance = s.largest_variance;
  r.smallest_variance = s.smallest_variance;
  return r;
}

}  // namespace resonid::c
