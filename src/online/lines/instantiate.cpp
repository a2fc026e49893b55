// SPDX-License-Identifier: MIT
// Compiles every tracker in both precisions, so that the header-only stage is built by every preset, above
// all by the one without exceptions and RTTI.
#include <resonid/online/lines/chirp_tracker.hpp>
#include <resonid/online/lines/detail/full_kalman_bank.hpp>
#include <resonid/online/lines/detail/line_bank_block.hpp>
#include <resonid/online/lines/encoder.hpp>
#include <resonid/online/lines/kalman_bank.hpp>
#include <resonid/online/lines/line_bank.hpp>
#include <resonid/online/lines/response_tracker.hpp>
#include <resonid/online/lines/sliding_dft.hpp>

namespace resonid::online {

template class KalmanBank<double, 8>;
template class KalmanBank<float, 8>;
template class LineBank<double, 21>;
template class LineBank<float, 21>;
template class LineBankBlock<double, 21>;
template class LineBankBlock<float, 21>;
template class ChirpTracker<double>;
template class ChirpTracker<float>;
template class ChirpTracker<double, 3>;
template class ChirpTracker<float, 3>;
template class SlidingDft<double, 8, 512>;
template class SlidingDft<float, 8, 512>;
template class FullKalmanBank<double, 8>;
template class FullKalmanBank<float, 8>;
template class EncoderVelocity<double>;
template class EncoderVelocity<float>;
template class ResponseTracker<KalmanBank<double, 8>>;
template class ResponseTracker<KalmanBank<float, 8>>;
template class ResponseTracker<FullKalmanBank<double, 8>>;
template class ResponseTracker<FullKalmanBank<float, 8>>;
template class ResponseTracker<ChirpTracker<double>>;
template class ResponseTracker<ChirpTracker<float>>;
template class ResponseTracker<SlidingDft<double, 8, 512>>;
template class ResponseTracker<SlidingDft<float, 8, 512>>;

static_assert(std::is_trivially_copyable_v<ResponseTracker<KalmanBank<double, 8>>>);
static_assert(std::is_trivially_copyable_v<ResponseTracker<ChirpTracker<float>>>);
static_assert(std::is_trivially_copyable_v<ResponseTracker<SlidingDft<float, 8, 512>>>);

}  // namespace resonid::online
