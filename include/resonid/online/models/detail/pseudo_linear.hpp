// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <resonid/online/models/detail/lag.hpp>
#include <resonid/online/models/discrete_model.hpp>
#include <resonid/online/models/positive_real.hpp>

namespace resonid::online {

/// Share of a residual's variance that is taken for noise at least, whatever a motion explains.
inline constexpr double kLeastNoise = 0.1;

/// Covariance of a model whose parameters a pseudo-linear recursion moves: recursion_covariance() in the
/// parameters of the regression; extra ones, beside b and a, count as if M were I for them. `motion` was seen
/// with H f for the instrument and for the regressor.
template <class Rls, class Past, std::size_t Order>
[[nodiscard]] ModelCovariance<typename Rls::Scalar, Order> pseudo_linear_covariance(
    const Rls& rls, const Past& past, const PseudoLinearRecursion<Order>& recursion,
    const StiffnessMotion<typename Rls::Scalar>& motion = {}) noexcept {
  static_assert(Rls::kParameters <= kMostParameters);
  constexpr int kAll = static_cast<int>(Rls::kParameters), kModel = static_cast<int>(2 * Order);
  using Matrix = Eigen::Matrix<double, kAll, kAll>;
  if (!rls.covariance().allFinite()) return past.covariance(rls.covariance());
  Matrix m = Matrix::Identity();
  const PositiveReal<Order> average(recursion);
  m.template topLeftCorner<kModel, kModel>() = average.matrix();
  Matrix p = rls.information_inverse().template cast<double>();
  const double residual = static_cast<double>(rls.residual_variance());
  if constexpr (kAll == kModel) {
    const auto& means = average.means();
    double explained = 0.0;  // of the residual's variance
    if (means.along_cross > 0.0) {
      const double moved = static_cast<double>(motion.moved()) * means.along_own / means.along_cross;
      explained = moved * moved * means.along_error / means.along_own *
                  static_cast<double>(motion.weight() / rls.memory_samples());
    }
    p = average.of_errors(p, std::max(residual - explained, kLeastNoise * residual), explained);
  } else {
    p *= residual;
  }
  const Matrix x = recursion_covariance(m, p, static_cast<double>(rls.weight_share()));
  return past.covariance(x.template cast<typename Rls::Scalar>().eval());
}

/// Lag of a pseudo-linear recursion: its share of the memory's mean age, as local_stability() finds it. Where
/// the gradient is the bare regressor, the oscillator's own memory is to be added. Where the recursion is not
/// stable, the whole age stands.
template <class Real, std::size_t Order>
[[nodiscard]] double recursion_lag_samples(const LocalStability& s, Real mean_age_samples,
                                           const DiscreteModel<Real, Order>& model, bool filtered) noexcept {
  const double share = s.stable && std::isfinite(s.lag_share) ? s.lag_share : 1.0;
  return share * static_cast<double>(mean_age_samples) + (filtered ? 0.0 : oscillation_memory_samples(model));
}

}  // namespace resonid::online
