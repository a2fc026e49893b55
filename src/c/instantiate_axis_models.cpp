// SPDX-License-Identifier: MIT
#include "axis.hpp"

namespace resonid::online {
template class BasicAxis<AxisRoom, AxisArx<double, 1>>;
template class BasicAxis<AxisRoom, AxisArx<>>;
template class BasicAxis<AxisRoom, AxisOutputError<>>;
template class BasicAxis<AxisRoom, AxisClosedLoop<>>;
template class BasicAxis<AxisRoom, AxisInstrumental<double, 1>>;
template class BasicAxis<AxisRoom, AxisInstrumental<>>;
}  // namespace resonid::online
