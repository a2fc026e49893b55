// SPDX-License-Identifier: MIT
// Compiled in both precisions, so that the header-only stage is built by every preset, above all by the one
// without exceptions and RTTI.
#include <resonid/online/models/detail/model_response.hpp>
#include <resonid/online/models/discrete_model.hpp>
#include <resonid/online/models/modes.hpp>
#include <resonid/online/models/rls.hpp>

namespace resonid::online {

template struct DiscreteModel<double, 3>;
template struct DiscreteModel<float, 3>;
template class RecursiveLeastSquares<double, 6>;
template class RecursiveLeastSquares<float, 6>;
template class SampledModes<1>;
template class SampledModes<2>;
template class SampledModes<3>;
template class SampledModes<4>;
template class SampledModes<5>;

}  // namespace resonid::online
