// SPDX-License-Identifier: MIT
// Compiled in both precisions, so that the header-only stage is built by every preset, above all by the one
// without exceptions and RTTI.
#include <resonid/online/models/closed_loop_output_error.hpp>

namespace resonid::online {

template class ClosedLoopOutputError<double, 1>;
template class ClosedLoopOutputError<double, 3>;
template class ClosedLoopOutputError<float, 3>;
template class ClosedLoopOutputError<double, 5>;

}  // namespace resonid::online
