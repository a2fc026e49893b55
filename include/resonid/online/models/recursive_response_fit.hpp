// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <resonid/base/detail/intact.hpp>
#include <resonid/base/expected.hpp>
#include <resonid/online/models/detail/lag.hpp>
#include <resonid/online/models/detail/line_rows.hpp>
#include <resonid/online/models/detail/response_fit.hpp>
#include <resonid/online/models/detail/weighted_rows.hpp>
#include <resonid/online/models/discrete_model.hpp>
#include <span>
#include <type_traits>

namespace resonid::online {

struct RecursiveResponseFitConfig {
  double sample_rate_hz = 0.0;             ///< Sample rate of the model, > 0.
  std::span<const double> frequency_hz{};  ///< Lines in (0, sample_rate_hz/2), as many as parameters / 2.
  bool integrator = true;                  ///< Fix one pole at z = 1 (a free drive).
  bool levy = false;                       ///< Without the weights 1/|A| of the present model.
  /// Time constant of forgetting, in steps; at least the number of lines. 0: four times that.
  double memory_steps = 0.0;
  /// Steps after which the noise of a line is a new one: the tracker's window (with a Hann window: N/1.5) if
  /// step() is called at every sample. 0: no line comes twice with the same noise in it.
  double correlated_steps = 0.0;
};

/// The same model as ResponseFit from one line per step, in turn: recursive least squares whose two rows are
/// the real and the imaginary part of A G - B = 0 at that line (the source's suggestion for future work).
///
///   w = 1/|A(z_l)|^2        R^T R <- lambda R^T R + w (rows)^T rows        lambda = 1 - 1/memory_steps
///
/// A step costs a fixed few rotations whatever the number of lines. What it costs in turn is delay: the model
/// describes the lines as they were memory_steps ago on average, on top of the lines' own lag. A line that is
/// not finite is left out, and nothing is forgotten for it. Source: Nevaranta 2016, section 5.1.
template <class Real, std::size_t Order, std::size_t MaxLines>
class RecursiveResponseFit {
 public:
  using Scalar = Real;
  using Complex = std::complex<Real>;
  static constexpr std::size_t kOrder = Order;

  static expected<RecursiveResponseFit, Error> create(const RecursiveResponseFitConfig& config) {
    const auto lines = ResponseFit<Real, Order, MaxLines>::create({.sample_rate_hz = config.sample_rate_hz,
                                                                   .frequency_hz = config.frequency_hz,
                                                                   .integrator = config.integrator});
    if (!lines) return unexpected<Error>(lines.error());
    const auto count = static_cast<double>(config.frequency_hz.size());
    if (!(config.memory_steps == 0.0 || (config.memory_steps >= count && std::isfinite(config.memory_steps))))
      return refuse("memory_steps", "must be 0 or at least the number of lines", config.memory_steps);
    if (!(config.correlated_steps >= 0.0) || !std::isfinite(config.correlated_steps))
      return refuse("correlated_steps", "must be >= 0", config.correlated_steps);
    RecursiveResponseFit fit(2 * Order - (config.integrator ? 1 : 0));
    fit.count_ = config.frequency_hz.size();
    for (std::size_t l = 0; l < fit.count_; ++l)
      fit.line_[l] = LineRows<Real, Order>(config.frequency_hz[l] / config.sample_rate_hz);
    fit.levy_ = config.levy;
    fit.integrator_ = config.integrator;
    fit.memory_ = config.memory_steps > 0.0 ? config.memory_steps : 4.0 * count;
    fit.forgetting_ = static_cast<Real>(1.0 - 1.0 / fit.memory_);
    // Mean over an exponential memory of noise whose correlation falls linearly within n steps.
    const double n = std::max(config.correlated_steps, count);
    fit.repeated_ = 1.0 + fit.memory_ / n * std::expm1(-n / fit.memory_);
    return fit;
  }

  /// The next line in turn: which one is next_line().
  void step(Complex response) noexcept {
    const std::size_t l = next_;
    next_ = next_ + 1 == count_ ? 0 : next_ + 1;
    ++steps_;
    if (!std::isfinite(std::norm(response))) {
      ++skipped_;
      return;
    }
    const auto rows = line_[l].rows(response);
    Real weight(1);
    if (!levy_) {
      if (ready_)
        weight = Real(1) / line_[l].power(model_);
      else if (integrator_)
        weight = Real(1) / (line_[l].difference() * line_[l].difference());
    }
    sum_.forget(forgetting_);
    sum_.add(rows.real, rows.right.real(), weight);
    sum_.add(rows.imag, rows.right.imag(), weight);
    ++taken_;
    if (!ready_ && taken_ < count_) return;
    if (!sum_.determined()) return;
    const auto solution = sum_.solution();
    for (const Real x : solution)
      if (!std::isfinite(x)) return;
    // The rows of the first turn had the weights of no model: they count as little as what is forgotten.
    if (!ready_ && !levy_) sum_.forget(Real(1) / Real(count_));
    std::copy_n(solution.begin(), Order, model_.beta.begin());
    std::copy_n(solution.begin() + Order, Order, model_.alpha.begin());
    ready_ = true;
  }
  /// `count` lines in turn were lost: as so many steps with a response that is not finite.
  void miss(std::uint64_t count) noexcept {
    next_ = static_cast<std::size_t>((next_ + count % count_) % count_);
    steps_ += count;
    skipped_ += count;
  }
  void reset() noexcept {
    sum_.reset();
    model_ = {};
    ready_ = false;
    next_ = 0;
    taken_ = steps_ = skipped_ = 0;
  }

  [[nodiscard]] DiscreteModel<Real, Order> model() const noexcept { return model_.model(); }
  /// Covariance of [b, a], from the scatter of the lines about the model (noise and misfit); infinite until
  /// there is a model. Meant for the weights 1/|A|; with Levy's it is too small.
  [[nodiscard]] ModelCovariance<Real, Order> covariance() const noexcept {
    if (!ready_) return ModelCovariance<Real, Order>::Constant(std::numeric_limits<Real>::infinity());
    const Real rows = std::max(Real(1), sum_.rows());
    const Real turns = rows / Real(2 * count_);
    const Real fitted = static_cast<Real>(repeated_) * Real(columns_) / Real(2 * count_);
    const Real spare = Real(1) - std::min(fitted, static_cast<Real>(0.9));
    const Real variance = sum_.squares() / rows / spare;
    return model_covariance<Real, Order>(sum_.covariance() * variance * turns * static_cast<Real>(repeated_));
  }
  [[nodiscard]] bool ready() const noexcept { return ready_; }
  /// How far the model lags behind slow changes of the machine, beyond the lag of the lines that it is given;
  /// with step() called at every sample.
  [[nodiscard]] double lag_samples() const noexcept {
    return ready_ ? memory_ - 1.0 + oscillation_memory_samples(model()) : 0.0;
  }
  [[nodiscard]] std::size_t lines() const noexcept { return count_; }
  [[nodiscard]] std::size_t next_line() const noexcept { return next_; }
  [[nodiscard]] std::uint64_t steps() const noexcept { return steps_; }
  [[nodiscard]] std::uint64_t skipped_steps() const noexcept { return skipped_; }

  /// For a state of unknown origin (base/detail/intact.hpp).
  [[nodiscard]] bool intact() const noexcept {
    return intact_flags(levy_, integrator_, ready_) && sum_.intact() && count_ >= 1 && count_ <= MaxLines &&
           next_ < count_ && columns_ <= 2 * Order;
  }

 private:
  explicit RecursiveResponseFit(std::size_t columns) noexcept : sum_(columns), columns_(columns) {}

  std::array<LineRows<Real, Order>, MaxLines> line_{};
  WeightedRows<Real, 2 * Order> sum_;
  DifferenceModel<Real, Order> model_{};
  Real forgetting_{1};
  double memory_ = 0.0,
         repeated_ = 1.0;  // repeated_: variance of the mean over the memory, per turn
  std::size_t count_ = 0, columns_ = 0, next_ = 0;
  bool levy_ = false, integrator_ = true, ready_ = false;
  std::uint64_t taken_ = 0, steps_ = 0, skipped_ = 0;
};

static_assert(std::is_trivially_copyable_v<RecursiveResponseFit<double, 3, 21>>);
static_assert(std::is_trivially_copyable_v<RecursiveResponseFit<float, 3, 21>>);

}  // namespace resonid::online
