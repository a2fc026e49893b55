// SPDX-License-Identifier: MIT
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <identification/online_tracker.hpp>
#include <resonid/online/models/detail/model_response.hpp>
#include <resonid/online/models/discrete_model.hpp>
#include <resonid/online/models/modes.hpp>

namespace resonid::identification::detail {

/// Figures of a discrete model as rows report them.
template <std::size_t Order>
struct DiscreteFigures {
  OnlineValue resonance, antiresonance;
  bool physical = false;
};

/// First resonance and anti-resonance; a machine has its poles inside the unit circle (an integrator may lie
/// a little outside), a torque that accelerates it, and oscillates with a positive damping.
template <class Real, std::size_t Order>
DiscreteFigures<Order> figures_of(const online::DiscreteModel<Real, Order>& model,
                                  const online::ModelCovariance<Real, Order>& covariance,
                                  double sample_rate_hz) {
  constexpr double kIntegrator = 1.002;
  const online::SampledModes<Order> modes(model, sample_rate_hz);
  const auto first = [](const auto& list) {
    if (list.empty()) return OnlineValue{};
    return OnlineValue{list[0].frequency_hz,
                       std::isfinite(list[0].std_hz) && list[0].std_hz > 0.0 ? list[0].std_hz : kUnknown};
  };
  const auto resonances = modes.resonances(covariance);
  DiscreteFigures<Order> f{first(resonances), first(modes.antiresonances(covariance)), false};
  double gain = 0.0;
  for (const Real b : model.b) gain += static_cast<double>(b);
  bool stable = true;
  for (const auto& pole : modes.poles())
    stable = stable && std::abs(pole) < (pole.imag() == 0.0 ? kIntegrator : 1.0);
  f.physical = stable && gain > 0.0 && (Order < 3 || !resonances.empty());
  return f;
}

/// Any estimator of a discrete model (online::DiscreteEstimator) as an OnlineTracker.
template <online::DiscreteEstimator Estimator>
class DiscreteTracker : public OnlineTracker {
 public:
  static constexpr std::size_t kOrder = Estimator::kOrder;
  using Real = typename Estimator::Scalar;

  DiscreteTracker(const Estimator& estimator, double sample_rate_hz)
      : estimator_(estimator), sample_rate_hz_(sample_rate_hz) {}

  void step(double ru, double u, double y) noexcept override {
    estimator_.step(static_cast<Real>(ru), static_cast<Real>(u), static_cast<Real>(y));
    fresh_ = false;
    if (++samples_ % kLagSamples == 0) lag_due_ = true;
  }
  [[nodiscard]] std::vector<OnlineColumn> columns() const override {
    std::vector<OnlineColumn> columns;
    for (const char* name : {"b", "a"})
      for (std::size_t i = 1; i <= kOrder; ++i)
        columns.push_back({fmt::format("{}{}", name, i), "", true, false});
    return columns;
  }
  void read(std::span<OnlineValue> values) override {
    const auto model = estimator_.model();
    const auto covariance = estimator_.covariance();
    for (std::size_t i = 0; i < kOrder; ++i) {
      values[i] = {static_cast<double>(model.b[i]), deviation(covariance, i)};
      values[kOrder + i] = {static_cast<double>(model.a[i]), deviation(covariance, kOrder + i)};
    }
  }
  [[nodiscard]] bool ready() const override { return estimator_.ready(); }
  [[nodiscard]] double lag_samples() const override {
    if (lag_due_) lag_ = estimator_.lag_samples();
    lag_due_ = false;
    return lag_;
  }
  [[nodiscard]] double residual() const override { return static_cast<double>(estimator_.residual()); }
  [[nodiscard]] OnlineValue resonance() override {
    refresh();
    return figures_.resonance;
  }
  [[nodiscard]] OnlineValue antiresonance() override {
    refresh();
    return figures_.antiresonance;
  }
  [[nodiscard]] bool finds_resonance() const override { return kOrder >= 2; }
  /// Of a machine without a resonance: that of its gain.
  [[nodiscard]] double uncertainty() override {
    if (finds_resonance()) return OnlineTracker::uncertainty();
    return deviation(estimator_.covariance(), 0) / std::abs(static_cast<double>(estimator_.model().b[0]));
  }
  [[nodiscard]] double most_uncertainty() const override {
    constexpr double kMostUncertainGain = 0.1;
    return finds_resonance() ? OnlineTracker::most_uncertainty() : kMostUncertainGain;
  }
  [[nodiscard]] bool physical() override {
    refresh();
    return figures_.physical;
  }
  [[nodiscard]] bool excited() const override {
    if constexpr (requires { estimator_.excited(); }) return estimator_.excited();
    return true;
  }
  void response(std::span<const double> frequency_hz, std::span<std::complex<double>> values) override {
    const auto model = estimator_.model();
    for (std::size_t i = 0; i < values.size(); ++i)
      values[i] = online::response(model, frequency_hz[i], sample_rate_hz_);
  }

 protected:
  [[nodiscard]] const Estimator& estimator() const { return estimator_; }

 private:
  void refresh() {
    if (fresh_) return;
    figures_ = figures_of(online::DiscreteModel<Real, kOrder>(estimator_.model()),
                          online::ModelCovariance<Real, kOrder>(estimator_.covariance()), sample_rate_hz_);
    fresh_ = true;
  }
  static double deviation(const online::ModelCovariance<Real, kOrder>& covariance, std::size_t i) {
    const double variance = static_cast<double>(covariance(static_cast<int>(i), static_cast<int>(i)));
    return std::isfinite(variance) && variance >= 0.0 ? std::sqrt(variance) : kUnknown;
  }

  Estimator estimator_;
  double sample_rate_hz_;
  DiscreteFigures<kOrder> figures_;
  bool fresh_ = false;
  static constexpr std::uint64_t kLagSamples = 50;  // a lag costs more than many steps, and changes slowly
  std::uint64_t samples_ = 0;
  mutable double lag_ = 0.0;
  mutable bool lag_due_ = true;
};

}  // namespace resonid::identification::detail
