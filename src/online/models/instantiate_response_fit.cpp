// SPDX-License-Identifier: MIT
// Compiled in both precisions, so that the header-only stage is built by every preset, above all by the one
// without exceptions and RTTI.
#include <resonid/online/models/detail/response_fit.hpp>
#include <resonid/online/models/recursive_response_fit.hpp>

namespace resonid::online {

template class ResponseFit<double, 3, 21>;
template class ResponseFit<float, 3, 21>;
template class RecursiveResponseFit<double, 3, 21>;
template class RecursiveResponseFit<float, 3, 21>;

}  // namespace resonid::online
