// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <resonid/base/detail/discrete_filter.hpp>
#include <resonid/base/detail/polynomial.hpp>
#include <resonid/base/expected.hpp>
#include <resonid/online/models/discrete_model.hpp>
#include <span>

namespace resonid::online {

/// A signal's last samples, newest first: at(0) is x(k).
template <class Real>
class SignalHistory {
 public:
  static constexpr std::size_t kLength = 32;

  void push(Real x) noexcept { value_[++newest_ % kLength] = x; }
  [[nodiscard]] Real at(std::size_t age) const noexcept { return value_[(newest_ - age) % kLength]; }
  [[nodiscard]] bool below(Real limit) const noexcept {
    return std::all_of(value_.begin(), value_.end(), [limit](Real x) { return std::abs(x) < limit; });
  }

 private:
  std::array<Real, kLength> value_{};
  std::size_t newest_ = 0;
};

/// Noise-free closed loop of a model, the known controller and the known delay, driven by the excitation
/// alone:
///
///   yh(k) = B/A uh(k-d)        uh(k) = ru(k) - C yh(k)
///
/// Its signals are what the measured ones would be without noise, load and reference. The model may be
/// replaced at any time; the loop keeps its past. Source: Gilson and Van den Hof 2005.
template <class Real, std::size_t Order>
class AuxiliaryLoop {
 public:
  using Model = DiscreteModel<Real, Order>;
  static constexpr std::size_t kMaxController = 6;  ///< Largest order of the controller.
  static constexpr std::size_t kMaxDelay = SignalHistory<Real>::kLength - Order - 1;

  static expected<AuxiliaryLoop, Error> create(std::span<const double> controller_numerator,
                                               std::span<const double> controller_denominator,
                                               std::size_t delay_samples) {
    if (delay_samples > kMaxDelay)
      return refuse("delay_samples", "must leave room in the signals' history",
                    static_cast<double>(delay_samples));
    if (controller_numerator.size() > kMaxController + 1)
      return refuse("controller_numerator", "is of too high an order",
                    static_cast<double>(controller_numerator.size()));
    if (controller_denominator.size() > kMaxController + 1)
      return refuse("controller_denominator", "is of too high an order",
                    static_cast<double>(controller_denominator.size()));
    const auto filter = Controller::create(controller_numerator, controller_denominator);
    if (!filter && filter.error().field == "numerator")
      return refuse("controller_numerator", filter.error().requirement, filter.error().value);
    if (!filter) return refuse("controller_denominator", filter.error().requirement, filter.error().value);
    AuxiliaryLoop loop;
    loop.controller_ = *filter;
    loop.delay_ = delay_samples;
    for (std::size_t i = 0; i < controller_numerator.size(); ++i)
      loop.numerator_[i] = static_cast<Real>(controller_numerator[i] / controller_denominator[0]);
    for (std::size_t i = 0; i < controller_denominator.size(); ++i)
      loop.denominator_[i] = static_cast<Real>(controller_denominator[i] / controller_denominator[0]);
    loop.controller_order_ = std::max(controller_numerator.size(), controller_denominator.size()) - 1;
    return loop;
  }

  void set_model(const Model& model) noexcept { model_ = model; }
  [[nodiscard]] const Model& model() const noexcept { return model_; }
  [[nodiscard]] std::size_t delay_samples() const noexcept { return delay_; }

  void step(Real excitation) noexcept {
    Real y(0);
    for (std::size_t i = 0; i < Order; ++i)
      y += model_.b[i] * input_.at(i + delay_) - model_.a[i] * output_.at(i);
    output_.push(y);
    input_.push(excitation - controller_.step(y));
  }
  void reset() noexcept {
    controller_.reset();
    input_ = output_ = {};
  }

  /// Rests at last where the excitation is off, instead of fading into slow denormal numbers.
  void flush() noexcept {
    if (input_.below(Real(1e-30)) && output_.below(Real(1e-30))) reset();
  }

  /// uh and yh; at(0) is of the newest step().
  [[nodiscard]] const SignalHistory<Real>& input() const noexcept { return input_; }
  [[nodiscard]] const SignalHistory<Real>& output() const noexcept { return output_; }

  /// Whether this loop would be stable with `model`: A D + z^-d B N has all roots within the unit circle.
  [[nodiscard]] bool stable(const Model& model) const noexcept {
    Polynomial p{};
    for (std::size_t j = 0; j <= controller_order_; ++j) {
      p[j] += denominator_[j];
      for (std::size_t i = 0; i < Order; ++i) {
        p[i + j + 1] += denominator_[j] * model.a[i];
        p[i + j + 1 + delay_] += numerator_[j] * model.b[i];
      }
    }
    return roots_inside(p, Order + delay_ + controller_order_);
  }

  /// For a state of unknown origin (base/detail/intact.hpp).
  [[nodiscard]] bool intact() const noexcept {
    return controller_.intact() && controller_order_ <= kMaxController && delay_ <= kMaxDelay;
  }

 private:
  using Controller = DiscreteFilter<Real, kMaxController>;
  using Polynomial = std::array<Real, SignalHistory<Real>::kLength + kMaxController>;

  AuxiliaryLoop() = default;

  Controller controller_;
  std::array<Real, kMaxController + 1> numerator_{}, denominator_{};
  std::size_t controller_order_ = 0, delay_ = 0;
  Model model_{};
  SignalHistory<Real> input_, output_;
};

}  // namespace resonid::online
