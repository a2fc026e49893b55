// SPDX-License-Identifier: MIT
// Compiled once for the axis with all estimators.
#include <resonid/online/detail/axis_models.hpp>

namespace resonid::online::detail {

template class AxisModel<InstrumentalVariables<double, 1>>;
template class AxisModel<InstrumentalVariables<double, 3>>;

}  // namespace resonid::online::detail
