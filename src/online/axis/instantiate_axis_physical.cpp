// SPDX-License-Identifier: MIT
// Compiled once for the axis with all estimators.
#include <resonid/online/detail/axis_physical.hpp>

namespace resonid::online::detail {

template class AxisPhysical<double, 16384>;

}  // namespace resonid::online::detail
