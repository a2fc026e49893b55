// SPDX-License-Identifier: MIT
// The axis with all estimators, compiled once.
#include <resonid/online/axis.hpp>

namespace resonid::online {

template class BasicAxis<AxisRoom, AxisLines<>, AxisSlidingDft<>, AxisSweep<>, AxisPhysical<>,
                         AxisArx<double, 1>, AxisArx<>, AxisOutputError<>, AxisClosedLoop<>,
                         AxisInstrumental<double, 1>, AxisInstrumental<>>;
static_assert(std::is_trivially_copyable_v<Axis>);

}  // namespace resonid::online
