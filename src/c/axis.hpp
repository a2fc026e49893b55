// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/online/axis.hpp>

namespace resonid::c {

/// An axis with one estimator: a handle is as large as its kind needs.
template <class Estimator>
using Axis = online::BasicAxis<online::AxisRoom, Estimator>;

}  // namespace resonid::c

namespace resonid::online {
extern template class BasicAxis<AxisRoom, AxisLines<>>;
extern template class BasicAxis<AxisRoom, AxisSlidingDft<>>;
extern template class BasicAxis<AxisRoom, AxisSweep<>>;
extern template class BasicAxis<AxisRoom, AxisPhysical<>>;
extern template class BasicAxis<AxisRoom, AxisArx<double, 1>>;
extern template class BasicAxis<AxisRoom, AxisArx<>>;
extern template class BasicAxis<AxisRoom, AxisOutputError<>>;
extern template class BasicAxis<AxisRoom, AxisClosedLoop<>>;
extern template class BasicAxis<AxisRoom, AxisInstrumental<double, 1>>;
extern template class BasicAxis<AxisRoom, AxisInstrumental<>>;
}  // namespace resonid::online
