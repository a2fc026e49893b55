// SPDX-License-Identifier: MIT
// Compiled in both precisions, so that the header-only stage is built by every preset, above all by the one
// without exceptions and RTTI.
#include <resonid/online/models/physical_tracker.hpp>

namespace resonid::online {

template class PhysicalTracker<double>;
template class PhysicalTracker<double, 0>;
template class PhysicalTracker<float, 4096>;
template class PhysicalTracker<float, 0>;
static_assert(std::is_trivially_copyable_v<PhysicalTracker<double>>);
static_assert(std::is_trivially_copyable_v<PhysicalTracker<float, 0>>);

}  // namespace resonid::online
