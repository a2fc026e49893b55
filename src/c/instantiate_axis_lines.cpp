// SPDX-License-Identifier: MIT
#include "axis.hpp"

namespace resonid::online {
template class BasicAxis<AxisRoom, AxisLines<>>;
template class BasicAxis<AxisRoom, AxisSlidingDft<>>;
template class BasicAxis<AxisRoom, AxisSweep<>>;
template class BasicAxis<AxisRoom, AxisPhysical<>>;
}  // namespace resonid::online
