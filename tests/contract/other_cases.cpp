// SPDX-License-Identifier: MIT
#include <array>
#include <complex>
#include <resonid/base/detail/discrete_filter.hpp>
#include <resonid/online/models/detail/model_response.hpp>
#include <resonid/online/models/physical_tracker.hpp>
#include <resonid/online/models/recursive_response_fit.hpp>
#include <resonid/online/models/rls.hpp>
#include <resonid/online/supervision/change_detection.hpp>
#include <string_view>
#include <tooth_belt.hpp>

#include "subject.hpp"

namespace resonid::test {
namespace {

using namespace resonid::online;

template <class Real>
struct DiscreteFilterTraits {
  using Scalar = Real;
  using Listed = DiscreteFilter<Real, 4>;
  static constexpr bool kTyped = true;
  static constexpr std::string_view kName = "DiscreteFilter", kAsListed = "order up to 4",
                                    kCost = "constant: order";
  static constexpr unsigned kArguments = kU;
  static constexpr double kRecovered = 1e-5;
  static Listed make() {
    static constexpr std::array<double, 2> kNumerator{0.2, 0.1};
    static constexpr std::array<double, 3> kDenominator{1.0, -1.6, 0.8};
    return Listed::create(kNumerator, kDenominator).value();
  }
  static std::tuple<Real> arguments(const Listed&, const Sample& s) noexcept {
    return {static_cast<Real>(s[1])};
  }
  static void observe(const Listed& e, Answers& answers) noexcept {
    answers.figure(static_cast<double>(e.output(Real(0))));
  }
};

/// The controller, more or less: no matter what it comes to, it is the same each time.
template <class Real, Forgetting How>
struct RlsTraits {
  using Scalar = Real;
  using Listed = RecursiveLeastSquares<Real, 6>;
  using Estimator = RecursiveLeastSquares<Real, 3>;
  static constexpr bool kTyped = true;
  static constexpr std::string_view kName = How == Forgetting::none       ? "RecursiveLeastSquares, none"
                                            : How == Forgetting::constant ? "RecursiveLeastSquares, constant"
                                            : How == Forgetting::variable
                                                ? "RecursiveLeastSquares, variable"
                                                : "RecursiveLeastSquares, directional",
                                    kAsListed = "6 parameters",
                                    kCost = "parameters squared; every 16th sample looks at the limits";
  static constexpr unsigned kArguments = kRu | kU | kY;
  static constexpr double kRecovered = How == Forgetting::none ? 0.05 : 1e-3;
  static constexpr bool kForgets = How == Forgetting::constant || How == Forgetting::variable;
  static Estimator make() {
    return Estimator::create(
               {.start_variance = 10.0, .forgetting = How, .factor = 0.99, .noise_variance = 0.01})
        .value();
  }
  static std::tuple<std::array<Real, 3>, Real> arguments(const Estimator&, const Sample& s) noexcept {
    return {{Real(1), static_cast<Real>(s[0]), static_cast<Real>(s[2])}, static_cast<Real>(s[1])};
  }
  static void observe(const Estimator& e, Answers& answers) noexcept {
    for (const Real x : e.parameters()) answers.figure(static_cast<double>(x));
    answers.add_all(e.covariance());
    answers.add(static_cast<double>(e.residual_variance()));
    answers.add(static_cast<double>(e.memory_samples()));
    answers.add(static_cast<double>(e.mean_age_samples()));
    answers.add(e.excited() ? 1.0 : 0.0);
  }
};

constexpr std::array<double, 5> kLines{12.0, 20.0, 31.0, 45.0, 60.0};

template <class Real>
struct ResponseFitTraits {
  using Scalar = Real;
  using Listed = RecursiveResponseFit<Real, 3, 21>;
  using Estimator = RecursiveResponseFit<Real, 3, 5>;
  static constexpr bool kTyped = true;
  static constexpr std::string_view kName = "RecursiveResponseFit", kAsListed = "order 3, 21 lines",
                                    kCost = "parameters squared";
  static constexpr unsigned kArguments = kRu | kU;
  static constexpr double kRecovered = 1e-3;
  static Estimator make() {
    return Estimator::create({.sample_rate_hz = kRateHz, .frequency_hz = kLines}).value();
  }
  /// The response of the machine, off by some of the record.
  static std::tuple<std::complex<Real>> arguments(const Estimator& e, const Sample& s) noexcept {
    static const auto kResponse = [] {
      std::array<std::complex<double>, kLines.size()> g;
      for (std::size_t i = 0; i < g.size(); ++i)
        g[i] = response(tooth_belt(0.8, 1.0 / kRateHz), kLines[i], kRateHz);
      return g;
    }();
    const auto g = kResponse[e.next_line()];
    return {std::complex<Real>(static_cast<Real>(g.real() + 1e-3 * s[0]),
                               static_cast<Real>(g.imag() + 1e-3 * s[1]))};
  }
  static void observe(const Estimator& e, Answers& answers) noexcept {
    const auto model = e.model();
    for (const Real x : model.b) answers.figure(static_cast<double>(x));
    for (const Real x : model.a) answers.figure(static_cast<double>(x));
    answers.add_all(e.covariance());
    answers.add(e.lag_samples());
    answers.add(e.ready() ? 1.0 : 0.0);
  }
};

template <class Real, bool Drifts>
struct PhysicalTrackerTraits {
  using Scalar = Real;
  using Listed = PhysicalTracker<Real, Drifts ? 0 : 16384>;
  using Estimator = PhysicalTracker<Real, Drifts ? 0 : 1000>;
  static constexpr bool kTyped = true;
  static constexpr std::string_view kName = Drifts ? "PhysicalTracker, drifting" : "PhysicalTracker",
                                    kAsListed = Drifts ? "without replay" : "replay of 16384 samples",
                                    kCost =
                                        Drifts
                                            ? "states squared; every `refresh_samples`, while the estimate "
                                              "moves, one discretisation"
                                            : "the same times 1 + `replay_speed` until the memory is full";
  static constexpr unsigned kArguments = kU | kY;
  static constexpr double kRecovered = Drifts ? 0.02 : 0.01;
  static constexpr bool kForgets = false;
  static constexpr double kSpike = 1e9;
  static Estimator make() {
    constexpr double kCart = 6.7, kRadius = 0.0199, kSpecific = 376406.25;
    constexpr double kFar = kSpecific / 0.9, kBelow = kSpecific / 2.14;
    PhysicalTrackerConfig c;
    c.sample_rate_hz = kRateHz;
    c.delay_s = 1.0 / kRateHz;
    c.driven_inertia = {0.0028, 0.1};
    c.load_inertia = {kCart * kRadius * kRadius, 0.1};
    c.stiffness = {(kSpecific / 0.75 + kFar * kBelow / (kFar + kBelow)) * kRadius * kRadius, 0.3};
    c.damping = {0.06, 0.5};
    c.stiffness_drift_per_s = Drifts ? 0.05 : 0.0;
    return Estimator::create(c).value();
  }
  static std::tuple<Real, Real, Real> arguments(const Estimator&, const Sample& s) noexcept {
    return {static_cast<Real>(s[0]), static_cast<Real>(s[1]), static_cast<Real>(s[2])};
  }
  static void observe(const Estimator& e, Answers& answers) noexcept {
    for (std::size_t i = 0; i < 4; ++i) answers.figure(e.value(static_cast<PhysicalParameter>(i)));
    answers.add(e.value(PhysicalParameter::torque_offset));
    answers.add_all(e.log_covariance());
    answers.add(e.resonance_hz());
    answers.add(e.resonance_std_hz());
    answers.add(e.noise_rms());
    answers.add(e.lag_samples());
    answers.add(static_cast<double>(e.residual()));
    answers.add(e.ready() ? 1.0 : 0.0);
    answers.add(e.plausible() ? 1.0 : 0.0);
  }
};

template <class Real>
struct ChangeDetectorTraits {
  using Scalar = Real;
  using Listed = online::ChangeDetector<Real>;
  static constexpr bool kTyped = true;
  static constexpr std::string_view kName = "ChangeDetector", kAsListed = "window of 256 blocks",
                                    kCost = "constant; the last sample of a block: `window_blocks`";
  static constexpr unsigned kArguments = kU | kY;
  static constexpr double kRecovered = 0.05;
  static constexpr bool kForgets = false;
  static Listed make() {
    return Listed::create({.sample_rate_hz = kRateHz,
                           .block_s = 0.02,
                           .baseline_s = 2.0,
                           .false_alarm_interval_s = 1e5,
                           .window_blocks = 32})
        .value();
  }
  static std::tuple<Real, Real> arguments(const Listed&, const Sample& s) noexcept {
    return {static_cast<Real>(s[2]), static_cast<Real>(0.1 + s[1] * s[1])};
  }
  static void observe(const Listed& e, Answers& answers) noexcept {
    answers.figure(e.block_std());
    answers.add(e.baseline());
    answers.add(e.level());
    answers.add(e.threshold());
    answers.add(e.change().size);
    answers.add(e.alarm() ? 1.0 : 0.0);
    answers.add(e.reliable() ? 1.0 : 0.0);
  }
};

template <class Real>
void add(std::vector<Case>& all) {
  all.push_back(case_of<DiscreteFilterTraits<Real>>());
  all.push_back(case_of<RlsTraits<Real, Forgetting::none>>());
  all.push_back(case_of<RlsTraits<Real, Forgetting::constant>>());
  all.push_back(case_of<RlsTraits<Real, Forgetting::variable>>());
  all.push_back(case_of<RlsTraits<Real, Forgetting::directional>>());
  all.push_back(case_of<ResponseFitTraits<Real>>());
  all.push_back(case_of<PhysicalTrackerTraits<Real, false>>());
  all.push_back(case_of<PhysicalTrackerTraits<Real, true>>());
  all.push_back(case_of<ChangeDetectorTraits<Real>>());
}

}  // namespace

void add_other_cases(std::vector<Case>& all) {
  add<double>(all);
  add<float>(all);
}

}  // namespace resonid::test
