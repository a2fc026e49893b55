// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace resonid::online {

/// Discrete model of a drive, from torque to velocity, without direct feed-through (docs/notation.md):
///
///   y(k) = -a_1 y(k-1) - ... - a_n y(k-n) + b_1 u(k-d-1) + ... + b_n u(k-d-n)
///
/// d: whole samples of known delay, which belong to the estimator and not to the model. A two-mass drive has
/// n = 3, a rigid one 1, a three-mass one 5.
template <class Real, std::size_t Order>
struct DiscreteModel {
  static constexpr std::size_t kOrder = Order;
  std::array<Real, Order> b{};  ///< b_1 ... b_n, in powers of z^-1.
  std::array<Real, Order> a{};  ///< a_1 ... a_n; a_0 = 1.
};

/// Covariance of [b_1 ... b_n, a_1 ... a_n], in this order everywhere in the stage. A fixed integrator leaves
/// it singular: the a_i then always sum to -1.
template <class Real, std::size_t Order>
using ModelCovariance = Eigen::Matrix<Real, static_cast<int>(2 * Order), static_cast<int>(2 * Order)>;

/// What every estimator of a discrete model offers; who knows one knows all. `create` (each with its own
/// configuration) is the only call that can fail; a sample that is not finite counts as missing.
template <class E>
concept DiscreteEstimator = std::is_trivially_copyable_v<E> &&
    requires(E estimator, const E& constant, typename E::Scalar x) {
  { E::kOrder } -> std::convertible_to<std::size_t>;
  /// One sample of excitation ru, input u and output y; estimators that do not use ru ignore it.
  { estimator.step(x, x, x) }
  noexcept;
  { estimator.reset() }
  noexcept;
  { constant.model() }
  noexcept->std::convertible_to<DiscreteModel<typename E::Scalar, E::kOrder>>;
  /// Covariance of the error that noise makes, residual variance included; infinite until it is known.
  { constant.covariance() }
  noexcept->std::convertible_to<ModelCovariance<typename E::Scalar, E::kOrder>>;
  /// How far the estimate lags behind slow changes of the machine: it describes the machine of so many
  /// samples ago.
  { constant.lag_samples() }
  noexcept->std::convertible_to<double>;
  /// Newest output minus what was predicted for it.
  { constant.residual() }
  noexcept->std::convertible_to<typename E::Scalar>;
  /// Whether the start no longer matters, and there was excitation enough.
  { constant.ready() }
  noexcept->std::same_as<bool>;
  { constant.samples() }
  noexcept->std::convertible_to<std::uint64_t>;
  { constant.skipped_samples() }
  noexcept->std::convertible_to<std::uint64_t>;
};

}  // namespace resonid::online
