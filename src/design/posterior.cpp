// SPDX-License-Identifier: MIT
#include "design/posterior.hpp"

#include <algorithm>
#include <cmath>

#include "linalg/decompositions.hpp"

namespace resonid::design {
namespace {

/// Positive by nature: inertias, stiffnesses, dampings.
bool is_logarithm(fit::Parameter p) { return p < fit::kViscousFriction || p > fit::kLoadGroundStiffness; }
bool is_never_negative(fit::Parameter p) {
  return p == fit::kTorqueLag || p == fit::kOutputFilter || p == fit::kViscousFriction ||
         p == fit::kLoadViscousFriction;
}

}  // namespace

Posterior::Posterior(fit::DriveModel nominal, double delay_std_s, double known_to_hz)
    : nominal_(std::move(nominal)), known_to_hz_(known_to_hz) {
  std::vector<double> scale;
  for (int i = 0; i < fit::kParameterCount; ++i) {
    const auto p = static_cast<fit::Parameter>(i);
    if (!nominal_.estimated[static_cast<std::size_t>(i)] || p == fit::kDelay) continue;
    parameters_.push_back(p);
    scale.push_back(is_logarithm(p) ? 1.0 / nominal_.value(p) : 1.0);
  }
  parameters_.push_back(fit::kDelay);
  scale.push_back(1.0);
  const auto count = static_cast<Eigen::Index>(parameters_.size());
  Eigen::MatrixXd covariance(count, count);
  for (Eigen::Index i = 0; i < count; ++i)
    for (Eigen::Index j = 0; j < count; ++j)
      covariance(i, j) = nominal_.covariance(parameters_[static_cast<std::size_t>(i)],
                                             parameters_[static_cast<std::size_t>(j)]) *
                         scale[static_cast<std::size_t>(i)] * scale[static_cast<std::size_t>(j)];
  const bool estimated = nominal_.estimated[fit::kDelay] && covariance(count - 1, count - 1) > 0.0;
  delay_is_told_ = !estimated;
  if (!estimated) {
    covariance.row(count - 1).setZero();
    covariance.col(count - 1).setZero();
    covariance(count - 1, count - 1) = delay_std_s * delay_std_s;
  }
  spread_by(covariance);
}

Posterior::Posterior(fit::DriveModel nominal, std::vector<fit::Parameter> parameters,
                     const Eigen::MatrixXd& covariance)
    : nominal_(std::move(nominal)), parameters_(std::move(parameters)) {
  spread_by(covariance);
}

void Posterior::spread_by(const Eigen::MatrixXd& covariance) {
  // By correlations, since a delay in seconds has another size than a logarithm.
  const Eigen::VectorXd std = covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  const Eigen::VectorXd scale = std.unaryExpr([](double s) { return s > 0.0 ? 1.0 / s : 0.0; });
  const auto axes = linalg::symmetric_eigenpairs(scale.asDiagonal() * covariance * scale.asDiagonal());
  constexpr double kNone = 1e-9;
  std::vector<Eigen::Index> used;
  for (Eigen::Index i = 0; i < axes.values.size(); ++i)
    if (axes.values(i) > kNone) used.push_back(i);
  spread_.resize(covariance.rows(), static_cast<Eigen::Index>(used.size()));
  for (Eigen::Index i = 0; i < spread_.cols(); ++i) {
    const Eigen::Index axis = used[static_cast<std::size_t>(i)];
    spread_.col(i) = std.cwiseProduct(axes.vectors.col(axis)) * std::sqrt(axes.values(axis));
  }
}

Posterior Posterior::scaled(double factor, double delay_factor) const {
  Posterior other = *this;
  const auto at = std::find(parameters_.begin(), parameters_.end(), fit::kDelay);
  if (at != parameters_.end()) {
    const Eigen::RowVectorXd delay = spread_.row(at - parameters_.begin());
    const double size = delay.norm();
    if (size > 0.0 && delay_factor < factor) {
      // S (I - (1 - sqrt(d)) v v^T) with v along the delay's row: what is left of the others where the delay
      // is known better, inside of what was.
      const Eigen::RowVectorXd v = delay / size;
      other.spread_ -= (1.0 - std::sqrt(delay_factor / factor)) * (spread_ * v.transpose()) * v;
    } else if (delay_factor > factor) {
      other.spread_.row(at - parameters_.begin()) *= std::sqrt(delay_factor);
      for (Eigen::Index i = 0; i < spread_.rows(); ++i)
        if (i != at - parameters_.begin()) other.spread_.row(i) *= std::sqrt(factor);
      return other;
    }
  }
  other.spread_ *= std::sqrt(factor);
  return other;
}

Posterior Posterior::blended(const Posterior& other, double share) const {
  std::vector<fit::Parameter> all = parameters_;
  for (const fit::Parameter p : other.parameters_)
    if (std::find(all.begin(), all.end(), p) == all.end()) all.push_back(p);
  const auto count = static_cast<Eigen::Index>(all.size());
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(count, count);
  const auto add = [&](const Posterior& part, double weight) {
    Eigen::MatrixXd spread = Eigen::MatrixXd::Zero(count, part.spread_.cols());
    for (std::size_t i = 0; i < part.parameters_.size(); ++i)
      spread.row(std::find(all.begin(), all.end(), part.parameters_[i]) - all.begin()) =
          part.spread_.row(static_cast<Eigen::Index>(i));
    covariance += weight * spread * spread.transpose();
  };
  add(*this, 1.0 - share);
  add(other, share);
  Posterior blended(nominal_, std::move(all), covariance);
  blended.known_to_hz_ = std::min(known_to_hz_, other.known_to_hz_);
  blended.delay_is_told_ = delay_is_told_ || other.delay_is_told_;
  return blended;
}

Posterior Posterior::between(const Posterior& other, double share) const {
  const Posterior straight = blended(other, share);
  std::vector<fit::Parameter> all = straight.parameters_;
  std::vector<double> bends(all.size(), 0.0);
  // Parabolas whose slopes at the ends are 1 -+ kSkew of the mean one; at twice that the next would turn.
  constexpr double kSkew = 0.5;
  for (int i = 0; i < fit::kParameterCount; ++i) {
    const auto p = static_cast<fit::Parameter>(i);
    const double from = nominal_.value(p), to = other.nominal_.value(p);
    const double change = !is_logarithm(p) ? to - from : from > 0.0 && to > 0.0 ? std::log(to / from) : 0.0;
    if (change == 0.0) continue;
    const auto found = std::find(all.begin(), all.end(), p);
    if (found == all.end()) bends.push_back(0.0);
    const auto at = found - all.begin();
    if (found == all.end()) all.push_back(p);
    bends[static_cast<std::size_t>(at)] = kSkew * change * share * (1.0 - share);
  }
  const auto count = static_cast<Eigen::Index>(all.size()), known = straight.spread_.rows();
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(count, count);
  covariance.topLeftCorner(known, known) = straight.spread_ * straight.spread_.transpose();
  covariance.diagonal() += Eigen::Map<const Eigen::VectorXd>(bends.data(), count).cwiseAbs2();
  Posterior between(nominal_, std::move(all), covariance);
  between.known_to_hz_ = straight.known_to_hz_;
  between.delay_is_told_ = straight.delay_is_told_;
  return between;
}

fit::DriveModel Posterior::at(const Eigen::VectorXd& u) const {
  const Eigen::VectorXd moved = spread_ * u;
  fit::DriveModel model = nominal_;
  for (std::size_t i = 0; i < parameters_.size(); ++i) {
    const fit::Parameter p = parameters_[i];
    const double by = moved(static_cast<Eigen::Index>(i)), from = nominal_.value(p);
    double value = is_logarithm(p) ? from * std::exp(by) : from + by;
    if (is_never_negative(p)) value = std::max(0.0, value);
    if (p == fit::kDelay) value = std::max(-nominal_.known_delay_s, value);
    model.set(p, value);
  }
  return model;
}

}  // namespace resonid::design
