// SPDX-License-Identifier: MIT
// Compiled once for the axis with all estimators.
#include <resonid/online/detail/axis_models.hpp>

namespace resonid::online::detail {

template class AxisModel<Arx<double, 1>>;
template class AxisModel<Arx<double, 3>>;
template class AxisModel<OutputError<double, 3>>;

}  // namespace resonid::online::detail
