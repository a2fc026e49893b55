// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <new>
#include <resonid/base/detail/intact.hpp>
#include <resonid/base/expected.hpp>
#include <resonid/online/axis_config.hpp>
#include <resonid/online/axis_result.hpp>
#include <resonid/online/detail/axis_reading.hpp>
#include <resonid/online/models/arx.hpp>
#include <resonid/online/models/closed_loop_output_error.hpp>
#include <resonid/online/models/instrumental_variables.hpp>
#include <resonid/online/models/modes.hpp>
#include <resonid/online/models/output_error.hpp>
#include <string_view>

namespace resonid::online::detail {

/// The start that is told, as all estimators of discrete models of one order take it.
template <std::size_t Order>
struct AxisStart {
  std::array<double, Order> b{}, a{};
  bool integrator = false;  ///< It has one at z = 1.
  double memory_samples = 0.0;
  std::size_t delay_samples = 0;

  static expected<AxisStart, Error> create(const AxisConfig& c) noexcept {
    constexpr double kIntegrator = 1e-9, kLeastMemory = 50.0, kPeriodsRemembered = 24.0;
    if (c.start_b.size() != Order)
      return refuse("start_b", "needs an initial model of order 1 or 3",
                    static_cast<double>(c.start_b.size()));
    AxisStart s;
    std::copy(c.start_b.begin(), c.start_b.end(), s.b.begin());
    std::copy(c.start_a.begin(), c.start_a.end(), s.a.begin());
    double sum = 1.0;
    for (const double a : s.a) sum += a;
    s.integrator = std::abs(sum) < kIntegrator;
    const double own = c.output == AxisOutput::position ? 0.5 : 0.0;  // of the difference
    s.delay_samples =
        static_cast<std::size_t>(std::max(0.0, std::round(c.known_delay_s * c.sample_rate_hz + own)));
    const auto modes = SampledModes<Order>(DiscreteModel<double, Order>{s.b, s.a}, 1.0).resonances();
    s.memory_samples = c.memory_s > 0.0 ? c.memory_s * c.sample_rate_hz
                       : modes.empty()  ? kLeastMemory
                                        : std::max(kLeastMemory, kPeriodsRemembered / modes[0].frequency_hz);
    return s;
  }
  [[nodiscard]] ModelEstimatorConfig common(const AxisConfig& c) const noexcept {
    ModelEstimatorConfig m;
    m.sample_rate_hz = c.sample_rate_hz;
    m.delay_samples = delay_samples;
    m.start_b = b;
    m.start_a = a;
    m.fixed_integrator = integrator;
    m.high_pass_hz = c.high_pass_hz;
    m.adaptation = c.adaptation;
    m.adaptation.factor = 1.0 - 1.0 / memory_samples;
    return m;
  }
};

/// Which methods an estimator of a discrete model serves, and how it is made.
template <class Estimator>
struct AxisModelTraits;

template <class Real, std::size_t Order>
struct AxisModelTraits<Arx<Real, Order>> {
  static bool serves(AxisMethod m) noexcept { return m == AxisMethod::arx; }
  static expected<Arx<Real, Order>, Error> create(const AxisConfig& c, const AxisStart<Order>& s) noexcept {
    return Arx<Real, Order>::create(
        {.common = s.common(c), .load_torque = c.load_torque, .coulomb = c.coulomb_friction});
  }
};

template <class Real, std::size_t Order>
struct AxisModelTraits<OutputError<Real, Order>> {
  static bool serves(AxisMethod m) noexcept {
    return m == AxisMethod::output_error || m == AxisMethod::prediction_error;
  }
  static expected<OutputError<Real, Order>, Error> create(const AxisConfig& c,
                                                          const AxisStart<Order>& s) noexcept {
    OutputErrorConfig e;
    e.common = s.common(c);
    if (c.method == AxisMethod::prediction_error) e.gradient = OutputErrorGradient::filtered;
    e.load_torque = c.load_torque;
    e.controller_numerator = c.controller_numerator;
    e.controller_denominator = c.controller_denominator;
    return OutputError<Real, Order>::create(e);
  }
};

template <class Real, std::size_t Order>
struct AxisModelTraits<ClosedLoopOutputError<Real, Order>> {
  static bool serves(AxisMethod m) noexcept {
    return m == AxisMethod::closed_loop || m == AxisMethod::filtered_closed_loop ||
           m == AxisMethod::damped_closed_loop;
  }
  static expected<ClosedLoopOutputError<Real, Order>, Error> create(const AxisConfig& c,
                                                                    const AxisStart<Order>& s) noexcept {
    ClosedLoopOutputErrorConfig e;
    e.common = s.common(c);
    e.controller_numerator = c.controller_numerator;
    e.controller_denominator = c.controller_denominator;
    e.input = PredictorInput::measured;
    if (c.method == AxisMethod::filtered_closed_loop) e.gradient = ClosedLoopGradient::fixed_filter;
    if (c.method == AxisMethod::damped_closed_loop) e.gradient = ClosedLoopGradient::damped_filter;
    return ClosedLoopOutputError<Real, Order>::create(e);
  }
};

template <class Real, std::size_t Order>
struct AxisModelTraits<InstrumentalVariables<Real, Order>> {
  static bool serves(AxisMethod m) noexcept { return m == AxisMethod::instrumental_variables; }
  static expected<InstrumentalVariables<Real, Order>, Error> create(const AxisConfig& c,
                                                                    const AxisStart<Order>& s) noexcept {
    InstrumentalVariablesConfig<Order> e;
    e.start.b = s.b;
    e.start.a = s.a;
    e.controller_numerator = c.controller_numerator;
    e.controller_denominator = c.controller_denominator;
    e.delay_samples = s.delay_samples;
    e.terms.fixed_integrator = s.integrator;
    e.terms.offsets = c.load_torque;
    e.terms.coulomb = c.coulomb_friction;
    if (c.memory_s > 0.0) e.memory_samples = s.memory_samples;
    e.extrapolate = c.extrapolate;
    e.start_deviation = c.start_deviation;
    return InstrumentalVariables<Real, Order>::create(e);
  }
};

/// Any estimator of a discrete model of order 1 or 3 (DiscreteEstimator) as an axis runs it.
template <DiscreteEstimator Estimator>
class AxisModel {
 public:
  using Scalar = typename Estimator::Scalar;
  static constexpr std::size_t kOrder = Estimator::kOrder;
  static_assert(kOrder == 1 || kOrder == 3);
  static constexpr bool kTakesVelocity = true;

  static bool serves(const AxisConfig& c) noexcept {
    return AxisModelTraits<Estimator>::serves(c.method) && (c.start_b.size() == 1) == (kOrder == 1);
  }
  static expected<void, Error> create_in(void* where, const AxisConfig& c) noexcept {
    const auto start = AxisStart<kOrder>::create(c);
    if (!start) return unexpected<Error>(start.error());
    const auto estimator = AxisModelTraits<Estimator>::create(c, *start);
    if (!estimator) return unexpected<Error>(estimator.error());
    ::new (where) AxisModel(*estimator, c);
    return {};
  }

  void step(Scalar ru, Scalar u, Scalar y) noexcept {
    estimator_.step(ru, u, y);
    ++since_lag_;
    ++since_stability_;
  }
  void miss(std::uint64_t count) noexcept { estimator_.miss(count); }
  void reset() noexcept {
    estimator_.reset();
    lag_ = 0.0;
    since_lag_ = kLagSamples;
    since_stability_ = kStabilitySamples;
  }
  [[nodiscard]] Scalar residual() const noexcept {
    return estimator_.ready() ? estimator_.residual() : std::numeric_limits<Scalar>::quiet_NaN();
  }
  [[nodiscard]] std::uint64_t skipped_samples() const noexcept { return estimator_.skipped_samples(); }

  void read(AxisReading& r, const AxisCriteria& criteria) noexcept {
    const auto model = estimator_.model();
    const auto covariance = estimator_.covariance();
    r.ready = estimator_.ready();
    if constexpr (requires { estimator_.excited(); }) r.excited = estimator_.excited();
    r.has_model = true;
    auto padded = AxisReading::Covariance::Zero().eval();
    for (std::size_t i = 0; i < kOrder; ++i) {
      r.model.b[i] = static_cast<double>(model.b[i]);
      r.model.a[i] = static_cast<double>(model.a[i]);
      for (std::size_t j = 0; j < kOrder; ++j) {
        const auto at = [&](std::size_t row, std::size_t column) {
          return static_cast<double>(covariance(static_cast<int>(row), static_cast<int>(column)));
        };
        const auto put = [&](std::size_t row, std::size_t column, double x) {
          padded(static_cast<int>(row), static_cast<int>(column)) = x;
        };
        put(i, j, at(i, j));
        put(i, 3 + j, at(i, kOrder + j));
        put(3 + i, j, at(kOrder + i, j));
        put(3 + i, 3 + j, at(kOrder + i, kOrder + j));
      }
    }
    r.set_covariance(padded);
    for (std::size_t i = 0; i < kOrder; ++i) {
      r.parameter[i] = {r.model.b[i], deviation(padded, i)};
      r.parameter[kOrder + i] = {r.model.a[i], deviation(padded, 3 + i)};
    }
    if constexpr (requires { estimator_.coulomb_torque(); })
      if (has_coulomb_) r.parameter[2 * kOrder].value = static_cast<double>(estimator_.coulomb_torque());
    find_modes(r, kOrder, sample_rate_hz_);
    r.finds_resonance = kOrder > 1;
    r.uncertainty =
        kOrder > 1 ? r.resonance_hz.std / r.resonance_hz.value : r.parameter[0].std / std::abs(r.model.b[0]);
    r.most_uncertainty = kOrder > 1 ? criteria.resonance_std : criteria.gain_std;
    if (since_lag_ >= kLagSamples) {
      lag_ = estimator_.lag_samples();
      since_lag_ = 0;
    }
    r.lag_samples = lag_;
  }
  void watch(AxisStability& s) noexcept {
    if constexpr (requires { estimator_.guard().restarts(); }) s.restarts = estimator_.guard().restarts();
    if constexpr (requires { estimator_.stability(); }) {
      if (since_stability_ < kStabilitySamples) return;
      since_stability_ = 0;
      const auto stability = estimator_.stability();
      ++s.watched;
      if (!std::isfinite(stability.least_eigenvalue)) return;
      s.least_eigenvalue = std::min(s.least_eigenvalue, stability.least_eigenvalue);
      if (!stability.stable) ++s.unstable;
    }
  }
  [[nodiscard]] std::string_view parameter_name(std::size_t i) const noexcept {
    constexpr std::string_view kNames[] = {"b1", "b2", "b3", "a1", "a2", "a3"};
    if (i == 2 * kOrder && has_coulomb_) return "coulomb_friction";
    if (i >= 2 * kOrder) return {};
    return kNames[i < kOrder ? i : 3 + i - kOrder];
  }
  /// False where a right model leaves no white residual.
  [[nodiscard]] bool white_residual() const noexcept {
    return !AxisModelTraits<Estimator>::serves(AxisMethod::arx);
  }
  /// For a state of unknown origin (base/detail/intact.hpp).
  [[nodiscard]] bool intact() const noexcept { return estimator_.intact() && resonid::intact(has_coulomb_); }
  [[nodiscard]] const Estimator& estimator() const noexcept { return estimator_; }

 private:
  static constexpr std::uint64_t kLagSamples = 50;  // a lag costs more than many steps, and changes slowly
  static constexpr std::uint64_t kStabilitySamples = 250;  // likewise

  AxisModel(const Estimator& estimator, const AxisConfig& c) noexcept
      : estimator_(estimator),
        sample_rate_hz_(c.sample_rate_hz),
        has_coulomb_(c.coulomb_friction && requires { estimator.coulomb_torque(); }) {}
  static double deviation(const AxisReading::Covariance& covariance, std::size_t i) noexcept {
    const double variance = covariance(static_cast<int>(i), static_cast<int>(i));
    return std::isfinite(variance) && variance >= 0.0 ? std::sqrt(variance) : AxisRow::kUnknown;
  }

  Estimator estimator_;
  double sample_rate_hz_;
  bool has_coulomb_;  // estimated
  double lag_ = 0.0;
  std::uint64_t since_lag_ = kLagSamples, since_stability_ = kStabilitySamples;
};

}  // namespace resonid::online::detail
