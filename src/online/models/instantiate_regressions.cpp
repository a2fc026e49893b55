// SPDX-License-Identifier: MIT
// Compiled in both precisions, so that the header-only stage is built by every preset, above all by the one
// without exceptions and RTTI.
#include <resonid/online/models/arx.hpp>
#include <resonid/online/models/output_error.hpp>

namespace resonid::online {

template class Arx<double, 1>;
template class Arx<double, 3>;
template class Arx<float, 3>;
template class Arx<double, 5>;
template class OutputError<double, 1>;
template class OutputError<double, 3>;
template class OutputError<float, 3>;
template class OutputError<double, 5>;

}  // namespace resonid::online
