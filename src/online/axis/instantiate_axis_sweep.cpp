// SPDX-License-Identifier: MIT
// Compiled once for the axis with all estimators.
#include <resonid/online/detail/axis_sweep.hpp>

namespace resonid::online::detail {

template class AxisSweepLine<double, 512>;

}  // namespace resonid::online::detail
