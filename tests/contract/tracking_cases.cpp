// SPDX-License-Identifier: MIT
#include <array>
#include <resonid/online/lines/chirp_tracker.hpp>
#include <resonid/online/lines/detail/full_kalman_bank.hpp>
#include <resonid/online/lines/kalman_bank.hpp>
#include <resonid/online/lines/line_bank.hpp>
#include <resonid/online/lines/response_tracker.hpp>
#include <resonid/online/lines/sliding_dft.hpp>
#include <string_view>

#include "subject.hpp"

namespace resonid::test {
namespace {

using namespace resonid::online;

constexpr std::array<double, 2> kLines{12.0, 31.0};

/// A tracker of one signal, here y.
template <class Real>
struct OfOneSignal {
  using Scalar = Real;
  static constexpr bool kTyped = true;
  static constexpr unsigned kArguments = kY;
  static constexpr double kRecovered = 1e-4;
  template <class E>
  static std::tuple<Real> arguments(const E&, const Sample& s) noexcept {
    return {static_cast<Real>(s[2])};
  }
  template <class E>
  static void observe(const E& e, Answers& answers) noexcept {
    for (std::size_t i = 0; i < e.lines(); ++i) answers.figure(std::complex<double>(e.amplitude(i)));
    for (std::size_t i = 0; i < e.lines(); ++i) {
      const std::complex<double> p(e.phasor(i));
      answers.add(p.real());
      answers.add(p.imag());
      answers.add(e.noise_gain(i));
      answers.add(e.lag_samples(i));
      answers.add(e.settled(i) ? 1.0 : 0.0);
    }
    if constexpr (requires { e.innovation(); }) answers.add(static_cast<double>(e.innovation()));
    if constexpr (requires { e.offset(); }) answers.add(static_cast<double>(e.offset()));
    if constexpr (requires { e.covariance(0); }) answers.add_all(e.covariance(0));
  }
};

template <class Real>
struct KalmanBankTraits : OfOneSignal<Real> {
  using Listed = KalmanBank<Real, 21>;
  static constexpr std::string_view kName = "KalmanBank", kAsListed = "21 lines", kCost = "constant: lines";
  static KalmanBank<Real, 4> make() {
    return KalmanBank<Real, 4>::create({.sample_rate_hz = kRateHz, .frequency_hz = kLines, .lambda = 50.0})
        .value();
  }
};
template <class Real>
struct FullKalmanBankTraits : OfOneSignal<Real> {
  using Listed = FullKalmanBank<Real, 21>;
  static constexpr std::string_view kName = "FullKalmanBank", kAsListed = "21 lines",
                                    kCost = "lines squared; less at a missing sample";
  static FullKalmanBank<Real, 4> make() {
    static constexpr std::array<double, 1> kDrift{0.5};
    return FullKalmanBank<Real, 4>::create(
               {.sample_rate_hz = kRateHz, .frequency_hz = kLines, .drift = kDrift, .start_deviation = 10.0})
        .value();
  }
};
template <class Real>
struct SlidingDftTraits : OfOneSignal<Real> {
  using Listed = SlidingDft<Real, 21, 1000>;
  static constexpr std::string_view
      kName = "SlidingDft",
      kAsListed = "21 lines, window of 1000",
      kCost = "lines; more at every 32nd sample (float: 64th) and at the last of a window";
  static SlidingDft<Real, 4, 250> make() {
    return SlidingDft<Real, 4, 250>::create({.sample_rate_hz = kRateHz,
                                             .window_samples = 250,
                                             .frequency_hz = kLines,
                                             .window = DftWindow::hann})
        .value();
  }
};
template <class Real>
struct ChirpTrackerTraits : OfOneSignal<Real> {
  using Listed = ChirpTracker<Real>;
  static constexpr std::string_view
      kName = "ChirpTracker",
      kAsListed = "", kCost = "constant; every 32nd sample, and all of a logarithmic sweep, a cosine";
  static ChirpTracker<Real> make() {
    return ChirpTracker<Real>::create({.sample_rate_hz = kRateHz,
                                       .from_hz = 12.0,
                                       .to_hz = 35.0,
                                       .duration_s = 20.0,
                                       .offset = true,
                                       .gain = GainRule::placed_poles})
        .value();
  }
};

template <class Real>
struct LineBankTraits {
  using Scalar = Real;
  using Listed = LineBank<Real, 21>;
  static constexpr bool kTyped = true;
  static constexpr std::string_view kName = "LineBank", kAsListed = "21 lines, u and y",
                                    kCost = "constant: lines";
  static constexpr unsigned kArguments = kU | kY;
  static constexpr double kRecovered = 1e-4;
  static LineBank<Real, 8> make() {
    return LineBank<Real, 8>::create(
               {.bank = {.sample_rate_hz = kRateHz, .frequency_hz = kLines, .lambda = 50.0},
                .known_delay_s = 0.004})
        .value();
  }
  static std::tuple<Real, Real> arguments(const LineBank<Real, 8>&, const Sample& s) noexcept {
    return {static_cast<Real>(s[1]), static_cast<Real>(s[2])};
  }
  static void observe(const LineBank<Real, 8>& e, Answers& answers) noexcept {
    for (std::size_t i = 0; i < e.lines(); ++i) answers.figure(std::complex<double>(e.response(i)));
    for (std::size_t i = 0; i < e.lines(); ++i) {
      answers.add(static_cast<double>(e.phasor(0, i).real()));
      answers.add(static_cast<double>(e.phasor(1, i).imag()));
    }
    answers.add(static_cast<double>(e.innovation(0)));
    answers.add(static_cast<double>(e.offset(1)));
    answers.add(e.ready() ? 1.0 : 0.0);
  }
};

/// Three trackers like that of `Of`, and their ratio.
template <class Of>
struct ResponseTrackerTraits {
  using Scalar = typename Of::Scalar;
  using Tracker = ResponseTracker<decltype(Of::make())>;
  using Listed = ResponseTracker<typename Of::Listed>;
  static constexpr bool kTyped = true;
  static inline const std::string kName = "ResponseTracker of " + std::string(Of::kName);
  static constexpr std::string_view kAsListed = Of::kAsListed, kCost = Of::kCost;
  static constexpr unsigned kArguments = kRu | kU | kY;
  static constexpr double kRecovered = 1e-4;
  static Tracker make() {
    static constexpr std::array<double, 2> kController{0.12, 0.0}, kOne{1.0, 0.0};
    return Tracker::create(Of::make(), {.known_delay_s = 0.004,
                                        .controller_numerator = kController,
                                        .controller_denominator = kOne,
                                        .noise_memory_samples = 500.0})
        .value();
  }
  static std::tuple<Scalar, Scalar, Scalar> arguments(const Tracker&, const Sample& s) noexcept {
    return {static_cast<Scalar>(s[0]), static_cast<Scalar>(s[1]), static_cast<Scalar>(s[2])};
  }
  static void observe(const Tracker& e, Answers& answers) noexcept {
    for (std::size_t i = 0; i < e.lines(); ++i)
      for (const Approach a : {Approach::direct, Approach::indirect, Approach::joint})
        answers.figure(std::complex<double>(e.response(i, a)));
    for (std::size_t i = 0; i < e.lines(); ++i) {
      answers.add(static_cast<double>(e.standard_deviation(i)));
      answers.add(static_cast<double>(e.coherence(i)));
      answers.add(e.lag_samples(i));
    }
  }
};

template <class Real>
void add(std::vector<Case>& all) {
  all.push_back(case_of<LineBankTraits<Real>>());
  all.push_back(case_of<KalmanBankTraits<Real>>());
  all.push_back(case_of<FullKalmanBankTraits<Real>>());
  all.push_back(case_of<SlidingDftTraits<Real>>());
  all.push_back(case_of<ChirpTrackerTraits<Real>>());
  all.push_back(case_of<ResponseTrackerTraits<KalmanBankTraits<Real>>>());
  all.push_back(case_of<ResponseTrackerTraits<FullKalmanBankTraits<Real>>>());
  all.push_back(case_of<ResponseTrackerTraits<SlidingDftTraits<Real>>>());
  all.push_back(case_of<ResponseTrackerTraits<ChirpTrackerTraits<Real>>>());
}

}  // namespace

void add_tracking_cases(std::vector<Case>& all) {
  add<double>(all);
  add<float>(all);
}

}  // namespace resonid::test
