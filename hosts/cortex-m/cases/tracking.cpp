// SPDX-License-Identifier: MIT
#include <complex>
#include <new>
#include <resonid/online/lines/chirp_tracker.hpp>
#include <resonid/online/lines/kalman_bank.hpp>
#include <resonid/online/lines/line_bank.hpp>
#include <resonid/online/lines/response_tracker.hpp>
#include <resonid/online/lines/sliding_dft.hpp>

#include "../define_case.hpp"
#include "../record.hpp"
#include "cases.hpp"

using namespace resonid::online;

namespace {

/// Every n-th line of the multisine's 21, the first `Lines` of them.
template <std::size_t Lines>
constexpr std::array<double, Lines> multisine_lines() {
  std::array<double, Lines> hz{};
  for (std::size_t i = 0; i < Lines; ++i) hz[i] = drive::kLineSpacingHz * 10.0 * static_cast<double>(i + 1);
  return hz;
}

void line(Output& out, std::complex<float> value) {
  out.floats("line", std::array{value.real(), value.imag()});
}

/// Response at every line and sample.
template <std::size_t Lines>
struct LineBankCase {
  using Estimator = LineBank<float, Lines>;
  static inline Storage<Estimator> bank;
  static inline std::array<float, Lines> re, im;

  static bool create() {
    const auto lines = multisine_lines<Lines>();
    LineBankConfig config;
    config.bank = {.sample_rate_hz = drive::kSampleRateHz, .frequency_hz = lines};
    return bank.hold(Estimator::create(config));
  }
  static void step(const Sample& s) {
    bank->step(s.u, s.y);
    bank->responses(re, im);
  }
  static void report(Output& out) {
    for (std::size_t i = 0; i < Lines; ++i) out.floats("response", std::array{re[i], im[i]});
    for (std::size_t i = 0; i < Lines; ++i) line(out, bank->phasor(1, i));
  }
};

/// One channel, phasors only.
struct KalmanBankCase {
  using Estimator = KalmanBank<float, 8>;
  static inline Storage<Estimator> bank;

  static bool create() {
    const auto lines = multisine_lines<8>();
    return bank.hold(Estimator::create({.sample_rate_hz = drive::kSampleRateHz, .frequency_hz = lines}));
  }
  static void step(const Sample& s) { bank->step(s.y); }
  static void report(Output& out) {
    for (std::size_t i = 0; i < 8; ++i) line(out, bank->phasor(i));
  }
};

/// Three banks of eight lines; one response with its standard deviation is asked for per sample.
struct ResponseTrackerCase {
  using Estimator = ResponseTracker<KalmanBank<float, 8>>;
  static inline Storage<Estimator> tracker;
  static inline std::array<std::complex<float>, 8> response;
  static inline std::array<float, 8> deviation;
  static inline std::size_t next;

  static bool create() {
    const auto lines = multisine_lines<8>();
    const auto bank =
        KalmanBank<float, 8>::create({.sample_rate_hz = drive::kSampleRateHz, .frequency_hz = lines});
    next = 0;
    return bank && tracker.hold(Estimator::create(*bank, {}));
  }
  static void step(const Sample& s) {
    tracker->step(s.ru, s.u, s.y);
    response[next] = tracker->response(next, resonid::Approach::direct);
    deviation[next] = tracker->standard_deviation(next);
    next = (next + 1) % 8;
  }
  static void report(Output& out) {
    for (std::size_t i = 0; i < 8; ++i) line(out, response[i]);
  }
};

/// The phasors of ru, u and y at every sample.
struct ChirpTrackerCase {
  using Estimator = ChirpTracker<float, 3>;
  static inline Storage<Estimator> tracker;
  static inline std::array<std::complex<float>, 3> phasor;

  static bool create() {
    return tracker.hold(Estimator::create({.sample_rate_hz = drive::kSampleRateHz,
                                           .from_hz = drive::kChirpFromHz,
                                           .to_hz = drive::kChirpToHz,
                                           .duration_s = drive::kChirpDurationS}));
  }
  static void step(const Sample& s) {
    tracker->step({s.ru, s.u, s.y});
    for (std::size_t i = 0; i < 3; ++i) phasor[i] = tracker->phasor(0, i);
  }
  static void report(Output& out) {
    for (const auto& p : phasor) line(out, p);
  }
};

struct SlidingDftCase {
  using Estimator = SlidingDft<float, 21, 512>;
  static inline Storage<Estimator> dft;

  static bool create() {
    const auto hz = multisine_lines<21>();
    return dft.hold(Estimator::create(
        {.sample_rate_hz = drive::kSampleRateHz, .window_samples = 512, .frequency_hz = hz}));
  }
  static void step(const Sample& s) { dft->step(s.y); }
  static void report(Output& out) {
    for (std::size_t i = 0; i < 21; ++i) line(out, dft->amplitude(i));
  }
};

}  // namespace

const Case line_bank_8 = case_of<LineBankCase<8>>("line_bank_8", Injection::multisine);
const Case line_bank_21 = case_of<LineBankCase<21>>("line_bank_21", Injection::multisine);
const Case kalman_bank_8 = case_of<KalmanBankCase>("kalman_bank_8", Injection::multisine);
const Case chirp_tracker_3 = case_of<ChirpTrackerCase>("chirp_tracker_3", Injection::chirp);
const Case sliding_dft_21 = case_of<SlidingDftCase>("sliding_dft_21", Injection::multisine);
const Case response_tracker_8 = case_of<ResponseTrackerCase>("response_tracker_8", Injection::multisine);
