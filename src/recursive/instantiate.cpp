// SPDX-License-Identifier: MIT
// Compiles every estimator in both precisions, so that the header-only stage is built by every preset, above
// all by the one without exceptions and RTTI.
#include <resonid/recursive/discrete_model.hpp>

namespace resonid::recursive {

template struct DiscreteModel<double, 3>;
template struct DiscreteModel<float, 3>;

}  // namespace resonid::recursive
