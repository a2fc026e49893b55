// SPDX-License-Identifier: MIT
// Compiles the controller in both precisions, so that every preset builds it, above all the one without
// exceptions and RTTI.
#include <resonid/online/control.hpp>

namespace resonid::online {

template class DriveControl<double>;
template class DriveControl<float>;

}  // namespace resonid::online
