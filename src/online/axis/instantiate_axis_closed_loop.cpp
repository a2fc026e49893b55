// SPDX-License-Identifier: MIT
// Compiled once for the axis with all estimators.
#include <resonid/online/detail/axis_models.hpp>

namespace resonid::online::detail {

template class AxisModel<ClosedLoopOutputError<double, 3>>;

}  // namespace resonid::online::detail
