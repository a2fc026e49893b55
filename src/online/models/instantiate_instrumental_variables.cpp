// SPDX-License-Identifier: MIT
// Compiled in both precisions, so that the header-only stage is built by every preset, above all by the one
// without exceptions and RTTI.
#include <resonid/online/models/instrumental_variables.hpp>

namespace resonid::online {

template class InstrumentalVariables<double, 1>;
template class InstrumentalVariables<double, 3>;
template class InstrumentalVariables<float, 3>;
template class InstrumentalVariables<double, 5>;

}  // namespace resonid::online
