// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/online/models/rls.hpp>

#include "error.hpp"

namespace resonid::c {

/// What configurations of least squares and of models say about forgetting, in the same fields.
template <class Config>
expected<online::RecursiveLeastSquaresConfig, Error> adaptation(const Config& c) noexcept {
  const auto forgetting = enumerator("forgetting", c.forgetting, online::Forgetting::directional);
  if (!forgetting) return unexpected<Error>(forgetting.error());
  online::RecursiveLeastSquaresConfig r;
  r.start_variance = c.start_variance;
  r.forgetting = *forgetting;
  r.factor = c.factor;
  r.smallest_factor = c.smallest_factor;
  r.noise_variance = c.noise_variance;
  r.largest_variance = c.largest_variance;
  r.smallest_variance = c.smallest_variance;
  return r;
}

}  // namespace resonid::c
