// SPDX-License-Identifier: MIT
// Compiled once for the axis with all estimators.
#include <resonid/online/detail/axis_lines.hpp>

namespace resonid::online::detail {

template class AxisFixedLines<SlidingDft<double, 256, 16384>>;

}  // namespace resonid::online::detail
