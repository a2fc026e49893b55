// SPDX-License-Identifier: MIT
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <identification/track_discrete.hpp>
#include <identification/track_plan.hpp>
#include <resonid/online/models/detail/regression.hpp>

// What the makers of discrete estimators share; one source for each family, since they take long to compile.
namespace resonid::identification::detail {

inline constexpr double kPeriodsRemembered = 24.0;  // of the resonance
inline constexpr double kLeastMemorySamples = 50.0;
inline constexpr double kStartVariance = 0.01;

inline tl::unexpected<Error> refused_estimator(std::string_view method, const Error& error) {
  if (error.field == "start")
    return tl::unexpected(
        Error{"controller", fmt::format("{}: the loop of the start model and this controller is "
                                        "unstable: controller, delay or sign do not belong to "
                                        "this record",
                                        method)});
  const bool controller = error.field.view().find("controller") != std::string_view::npos;
  std::string message = fmt::format("{}: {} {}", method, error.field.view(), error.requirement.view());
  if (std::isfinite(error.value)) message += fmt::format(" (found {:.6g})", error.value);
  return tl::unexpected(Error{controller ? "controller" : "method", std::move(message)});
}

/// What all makers need to know.
template <std::size_t Order>
struct Known {
  std::string_view name;
  std::array<double, Order> b{}, a{};
  std::vector<double> numerator, denominator;  // of the controller
  std::size_t delay_samples = 0;
  double left_of_delay = 0.0;  // in samples
  bool integrator = false;     // the start has one at z = 1
  double memory_samples = 0.0;
  bool memory_given = false;
  double sample_rate_hz = 0.0;

  [[nodiscard]] online::ModelEstimatorConfig common() const {
    online::ModelEstimatorConfig c;
    c.sample_rate_hz = sample_rate_hz;
    c.delay_samples = delay_samples;
    c.start_b = b;
    c.start_a = a;
    c.fixed_integrator = integrator;
    c.adaptation.start_variance = kStartVariance;
    c.adaptation.factor = 1.0 - 1.0 / memory_samples;
    return c;
  }
};

template <std::size_t Order>
Known<Order> known(const data::Record& record, const TrackOptions& options, const TrackPlan& plan) {
  Known<Order> k;
  k.name = name_of(plan.method);
  k.sample_rate_hz = record.sample_rate_hz;
  const auto& drive = plan.start->drive;
  fit::DriveModel resampled = drive;
  resampled.sample_time_s = record.sample_time_s();
  const auto g = resampled.transfer_function();
  double sum = 1.0;
  for (std::size_t i = 0; i < Order; ++i) {
    k.b[i] = i + 1 < g.numerator.size() ? g.numerator[i + 1] : 0.0;
    k.a[i] = i + 1 < g.denominator.size() ? g.denominator[i + 1] : 0.0;
    sum += k.a[i];
  }
  k.integrator = std::abs(sum) < 1e-9;
  if (options.common.controller) {
    k.numerator = options.common.controller->numerator;
    k.denominator = options.common.controller->denominator;
  }
  const double delay = plan.delay_s * record.sample_rate_hz + velocity_of(record)->further_delay_samples;
  k.delay_samples = static_cast<std::size_t>(std::max(0.0, std::round(delay)));
  k.left_of_delay = delay - std::round(delay);
  k.memory_given = options.memory_s > 0.0;
  const double periods =
      Order >= 2 ? kPeriodsRemembered / drive.resonance().value * record.sample_rate_hz : 0.0;
  k.memory_samples =
      k.memory_given ? options.memory_s * record.sample_rate_hz : std::max(kLeastMemorySamples, periods);
  return k;
}

/// An estimator with what its maker has to say about the run. A pseudo-linear recursion is judged at its
/// start and every kWatchSamples: whether a small error of its parameters would grow.
template <online::DiscreteEstimator Estimator>
class Discrete final : public DiscreteTracker<Estimator> {
 public:
  Discrete(const Estimator& estimator, std::string_view name, double sample_rate_hz, bool white,
           std::vector<diagnostics::Finding> findings)
      : DiscreteTracker<Estimator>(estimator, sample_rate_hz),
        name_(name),
        white_(white),
        findings_(std::move(findings)) {
    watch();
  }

  void step(double ru, double u, double y) noexcept override {
    DiscreteTracker<Estimator>::step(ru, u, y);
    if (++samples_ % kWatchSamples == 0) watch();
  }
  [[nodiscard]] bool white_residual() const override { return white_; }
  void inspect(std::vector<diagnostics::Finding>& findings) const override {
    findings.insert(findings.end(), findings_.begin(), findings_.end());
    if (kLeastShare * static_cast<double>(watched_) < static_cast<double>(unstable_))
      findings.push_back(
          {"locally-unstable", diagnostics::Severity::error, least_eigenvalue_, 0.0,
           fmt::format("{} is driven away from the right parameters of this machine: it is damped too "
                       "little for so fast a sampling. Use iv or physical.",
                       name_)});
    if constexpr (requires { this->estimator().guard().restarts(); }) {
      const auto lost = this->estimator().guard().restarts();
      if (lost > 0)
        findings.push_back(
            {"predictor-lost", diagnostics::Severity::error, static_cast<double>(lost), 0.0,
             "The predictor ran away from the measured output and was started again: the estimate "
             "is not to be trusted. Use iv or physical."});
    }
  }

 private:
  static constexpr std::uint64_t kWatchSamples = 250;
  static constexpr double kLeastShare = 0.05;  // of the times, that a noisy estimate may look unstable

  void watch() noexcept {
    if constexpr (requires { this->estimator().stability(); }) {
      const auto stability = this->estimator().stability();
      ++watched_;
      if (!std::isfinite(stability.least_eigenvalue)) return;
      least_eigenvalue_ = std::min(least_eigenvalue_, stability.least_eigenvalue);
      if (!stability.stable) ++unstable_;
    }
  }

  std::string_view name_;
  bool white_;
  std::vector<diagnostics::Finding> findings_;
  std::uint64_t samples_ = 0, watched_ = 0, unstable_ = 0;
  double least_eigenvalue_ = std::numeric_limits<double>::infinity();
};

template <online::DiscreteEstimator Estimator, std::size_t Order>
TrackerMade made(const expected<Estimator, Error>& estimator, const Known<Order>& k, bool white,
                 std::vector<diagnostics::Finding> findings = {}) {
  if (!estimator) return refused_estimator(k.name, estimator.error());
  constexpr double kNoticeable = 0.05;
  if (std::abs(k.left_of_delay) > kNoticeable)
    findings.push_back(
        {"fractional-delay", diagnostics::Severity::info, k.left_of_delay, kNoticeable,
         fmt::format("{} knows whole samples of delay only: {:+.2f} samples of it became part of the "
                     "model's zeros. physical takes any delay.",
                     k.name, k.left_of_delay)});
  return std::make_unique<Discrete<Estimator>>(*estimator, k.name, k.sample_rate_hz, white,
                                               std::move(findings));
}

[[nodiscard]] inline bool is_rigid(const TrackPlan& plan) {
  return plan.start->drive.structure == fit::Structure::rigid;
}

// All of them need plan.start.
[[nodiscard]] TrackerMade make_arx_tracker(const data::Record& record, const TrackOptions& options,
                                           const TrackPlan& plan);
[[nodiscard]] TrackerMade make_output_error_tracker(const data::Record& record, const TrackOptions& options,
                                                    const TrackPlan& plan);
[[nodiscard]] TrackerMade make_closed_loop_tracker(const data::Record& record, const TrackOptions& options,
                                                   const TrackPlan& plan);
[[nodiscard]] TrackerMade make_instrumental_tracker(const data::Record& record, const TrackOptions& options,
                                                    const TrackPlan& plan);

}  // namespace resonid::identification::detail
