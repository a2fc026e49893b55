// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <deque>
#include <numbers>
#include <resonid/base/detail/statistics.hpp>
#include <resonid/fit/detail/inverse_dynamics.hpp>
#include <vector>

#include "linalg/decompositions.hpp"

namespace resonid::fit {
namespace {

using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using Terms = Eigen::Matrix<double, kInverseDynamicsTerms, 1>;
using Square = Eigen::Matrix<double, kInverseDynamicsTerms, kInverseDynamicsTerms>;

constexpr double kAgree = 3.0;        // standard deviations
constexpr double kFiner = 1.6;        // ratio of neighbouring cut-offs
constexpr double kKnown = 0.05;       // std/value of an inertia that a cut-off determines
constexpr double kTail = 3.5;         // standard deviations of the Gaussian at which it ends
constexpr double kBefore = 0.5;       // of the low-pass's width, ahead of leaving out what is at rest
constexpr double kStandstill = 0.05;  // of the velocity's rms: there friction is no constant

/// Gaussian of unit sum, `width` samples of standard deviation.
std::vector<double> gaussian(double width) {
  const auto half = static_cast<int>(std::ceil(kTail * width));
  std::vector<double> kernel;
  double sum = 0.0;
  for (int i = -half; i <= half; ++i) {
    kernel.push_back(std::exp(-0.5 * std::pow(i / width, 2)));
    sum += kernel.back();
  }
  for (double& k : kernel) k /= sum;
  return kernel;
}

/// Rows filtered, every `stride`-th. Beyond the ends there are no equations.
Rows filtered(const Rows& rows, const std::vector<double>& kernel, Eigen::Index stride) {
  const auto half = static_cast<Eigen::Index>(kernel.size() / 2), n = rows.rows();
  const Eigen::Map<const Eigen::VectorXd> weights(kernel.data(), static_cast<Eigen::Index>(kernel.size()));
  Rows result((n + stride - 1) / stride, rows.cols());
  for (Eigen::Index i = 0; i < result.rows(); ++i) {
    const Eigen::Index from = std::max<Eigen::Index>(0, i * stride - half);
    const Eigen::Index to = std::min(n, i * stride + half + 1);
    result.row(i).noalias() =
        weights.segment(from - i * stride + half, to - from).transpose() * rows.middleRows(from, to - from);
  }
  return result;
}

/// Least value within `reach` on either side.
Eigen::VectorXd least_within(const Eigen::VectorXd& values, Eigen::Index reach) {
  Eigen::VectorXd least(values.size());
  std::deque<Eigen::Index> rising;  // candidates, their values ascending
  for (Eigen::Index k = 0; k < values.size() + reach; ++k) {
    if (k < values.size()) {
      while (!rising.empty() && values(rising.back()) >= values(k)) rising.pop_back();
      rising.push_back(k);
    }
    if (k < reach) continue;
    while (rising.front() < k - 2 * reach) rising.pop_front();
    least(k - reach) = values(rising.front());
  }
  return least;
}

/// Sum over lags of the cross products of rows, Bartlett's weights.
Eigen::MatrixXd long_run_covariance(const Rows& scores, Eigen::Index lags) {
  Eigen::MatrixXd sum = scores.transpose() * scores;
  for (Eigen::Index lag = 1; lag <= std::min(lags, scores.rows() - 1); ++lag) {
    const Eigen::MatrixXd at =
        scores.bottomRows(scores.rows() - lag).transpose() * scores.topRows(scores.rows() - lag);
    sum += (1.0 - static_cast<double>(lag) / static_cast<double>(lags + 1)) * (at + at.transpose());
  }
  return sum;
}

/// Lags for residuals of first order (Andrews 1991), `least` at least and a quarter of the rows at most.
Eigen::Index lags_of(const Eigen::VectorXd& residual, double least) {
  const auto n = static_cast<double>(residual.size());
  const double square = std::max(residual.squaredNorm(), 1e-300);
  const double r = std::clamp(
      residual.tail(residual.size() - 1).dot(residual.head(residual.size() - 1)) / square, 0.0, 0.97);
  const double a = 4.0 * r * r / std::pow((1.0 - r) * (1.0 + r), 2);
  return static_cast<Eigen::Index>(std::min(0.25 * n, std::max(least, 1.1447 * std::cbrt(a * n))));
}

/// What one cut-off says.
struct Solution {
  double width = 0.0;  ///< Of the low-pass, in samples.
  Terms value = Terms::Zero();
  Square covariance = Square::Zero();
  double explained = 0.0, kept = 0.0, moving = 0.0;
  double gain = 0.0;  ///< Of the residual by the Stribeck term, per term's deviation; its t value.

  [[nodiscard]] double std(int term) const { return std::sqrt(covariance(term, term)); }
};

class Fitter {
 public:
  Fitter(const data::Record& record, const InverseDynamicsConfig& config)
      : config_(config), step_s_(record.sample_time_s()) {
    constexpr std::size_t kMost = 300'000;
    const std::size_t n = std::min(record.samples(), kMost);
    const auto count = static_cast<Eigen::Index>(n);
    input_ = Eigen::Map<const Eigen::VectorXd>(record.input.samples.data(), count);
    velocity_ = Eigen::Map<const Eigen::VectorXd>(record.output.samples.data(), count);
    delay_ = config.known_delay_s / step_s_;
    if (record.output_quantity == data::OutputQuantity::position) {
      // The mean velocity between two positions: half a sample late, as seen from the later one.
      velocity_.tail(count - 1) = ((velocity_.tail(count - 1) - velocity_.head(count - 1)) / step_s_).eval();
      velocity_(0) = velocity_(1);
      delay_ += 0.5;
    }
    find_motion();
  }

  [[nodiscard]] bool moves() const { return !std::isnan(threshold_); }

  [[nodiscard]] std::optional<InverseDynamics> run() {
    if (config_.coulomb_friction && reverses()) active_.push_back(kCoulombTerm);
    if (config_.viscous_friction) active_.push_back(kViscousTerm);
    std::sort(active_.begin(), active_.end());
    std::optional<Solution> chosen;
    for (const double independent : {150.0, 50.0, 15.0})
      if (!chosen) chosen = by_cut_off(independent);
    if (!chosen) return std::nullopt;
    try_compliance(*chosen);
    if (has(kCoulombTerm)) try_stribeck(*chosen);
    widen(*chosen);
    return result(*chosen);
  }

 private:
  [[nodiscard]] bool has(int term) const {
    return std::find(active_.begin(), active_.end(), term) != active_.end();
  }

  /// Where it moves: the least of the smoothed velocity within the smoothing's reach, so that no sample at
  /// rest has a part in it.
  void find_motion() {
    const Eigen::Index n = velocity_.size() - 1;
    const Eigen::VectorXd mean = 0.5 * (velocity_.head(n) + velocity_.tail(n));
    const double size = std::sqrt(mean.squaredNorm() / static_cast<double>(n));
    const double noise = noise_of_velocity();
    constexpr double kBeyondNoise = 6.0;
    double width = 2.0;
    std::vector<double> kernel;
    const auto level = [&] {
      kernel = gaussian(width);
      return kBeyondNoise * noise * std::sqrt(sum_of_squares(kernel));
    };
    while (level() > kStandstill * size && kTail * width < 0.005 * static_cast<double>(n)) width *= kFiner;
    slowest_ = std::max(level(), 1e-3 * size);
    threshold_ = std::max(slowest_, kStandstill * size);
    if (!(size > 0.0) || threshold_ > 0.5 * size) threshold_ = std::numeric_limits<double>::quiet_NaN();
    smooth_ = filtered(mean, kernel, 1).col(0);
    reach_ = static_cast<Eigen::Index>(kernel.size() / 2) + 1;
  }

  /// Third differences hold noise and hardly any motion; those that are exactly 0 are of a resting encoder.
  [[nodiscard]] double noise_of_velocity() const {
    const Eigen::Index n = velocity_.size() - 3;
    const Eigen::VectorXd d =
        velocity_.tail(n) - 3.0 * velocity_.segment(2, n) + 3.0 * velocity_.segment(1, n) - velocity_.head(n);
    std::vector<double> sizes;
    for (const double x : d)
      if (x != 0.0) sizes.push_back(std::abs(x));
    constexpr double kMedianOfNormal = 0.6745;
    return sizes.size() < 50 ? 0.0 : median_in_place(sizes) / kMedianOfNormal / std::sqrt(20.0);
  }

  /// 0 at rest, 1 in motion, of the least speed.
  [[nodiscard]] static double weight(double speed, double threshold) {
    const double x = std::clamp((speed - threshold) / threshold, 0.0, 1.0);
    return x * x * (3.0 - 2.0 * x);
  }

  [[nodiscard]] bool reverses() const {
    double forth = 0.0, back = 0.0;
    for (Eigen::Index k = 0; k < smooth_.size(); ++k)
      (smooth_(k) > 0.0 ? forth : back) += weight(std::abs(smooth_(k)), threshold_);
    constexpr double kPart = 0.02;
    return std::min(forth, back) > kPart * (forth + back);
  }

  /// Mean torque that acted between samples k and k + 1 of a velocity that is `delay` samples late.
  [[nodiscard]] double torque(Eigen::Index k, double delay) const {
    const double whole = std::floor(delay), part = delay - whole;
    const auto at = [&](Eigen::Index shift) {
      return input_(std::clamp<Eigen::Index>(k - shift, 0, input_.size() - 1));
    };
    const auto shift = static_cast<Eigen::Index>(whole);
    return (1.0 - part) * at(shift) + part * at(shift + 1);
  }

  /// Second derivative of the acceleration.
  [[nodiscard]] double bend(Eigen::Index k) const {
    if (k < 1 || k + 2 >= velocity_.size()) return 0.0;
    return (velocity_(k + 2) - 3.0 * velocity_(k + 1) + 3.0 * velocity_(k) - velocity_(k - 1)) /
           (step_s_ * step_s_ * step_s_);
  }

  /// [between samples][active terms, torque]
  [[nodiscard]] Rows equations(double delay) const {
    const Eigen::Index n = smooth_.size(), terms = static_cast<Eigen::Index>(active_.size());
    Rows rows(n, terms + 1);
    for (Eigen::Index k = 0; k < n; ++k) {
      const double way = smooth_(k) > 0.0 ? 1.0 : -1.0;
      Terms all;
      all(kInertiaTerm) = (velocity_(k + 1) - velocity_(k)) / step_s_;
      all(kViscousTerm) = 0.5 * (velocity_(k + 1) + velocity_(k));
      all(kCoulombTerm) = way;
      all(kOffsetTerm) = -1.0;
      all(kDelayTerm) = -(torque(k, delay + 0.5) - torque(k, delay - 0.5)) / step_s_;
      all(kComplianceTerm) = bend(k);
      all(kStribeckTerm) = stribeck_ > 0.0 ? way * std::exp(-std::pow(smooth_(k) / stribeck_, 2)) : 0.0;
      for (Eigen::Index i = 0; i < terms; ++i) rows(k, i) = all(active_[static_cast<std::size_t>(i)]);
      rows(k, terms) = torque(k, delay);
    }
    return rows;
  }

  [[nodiscard]] std::optional<Solution> solve(double width, double delay, double threshold) const {
    // Half of the low-pass before rest is left out: it takes the high frequencies that the edges of motion
    // would bring down.
    const double before = kBefore * width, after = std::sqrt(1.0 - kBefore * kBefore) * width;
    const auto coarse = std::max<Eigen::Index>(1, static_cast<Eigen::Index>(before / 2.0));
    const auto kernel = gaussian(before);
    Rows rows = filtered(equations(delay), kernel, coarse);
    const Eigen::VectorXd speed =
        least_within(smooth_.cwiseAbs(), reach_ + static_cast<Eigen::Index>(kernel.size() / 2));
    for (Eigen::Index k = 0; k < rows.rows(); ++k) rows.row(k) *= weight(speed(k * coarse), threshold);
    const auto further = std::max<Eigen::Index>(1, static_cast<Eigen::Index>(width / 1.5) / coarse);
    const auto stride = coarse * further;
    const Rows low = filtered(rows, gaussian(after / static_cast<double>(coarse)), further);
    const Eigen::Index terms = low.cols() - 1, n = low.rows();
    if (n < 10 * (terms + 1)) return std::nullopt;
    const Eigen::VectorXd scale = low.leftCols(terms).colwise().norm().transpose();
    if (!(scale.minCoeff() > 0.0)) return std::nullopt;
    const Rows x = low.leftCols(terms) * scale.cwiseInverse().asDiagonal();
    const Eigen::VectorXd y = low.col(terms);
    const Eigen::MatrixXd normal = x.transpose() * x;
    const linalg::RealLdlt solver(normal);
    constexpr double kSingular = 1e-10;
    if (!solver.succeeded() || !(solver.rcond() > kSingular)) return std::nullopt;
    const Eigen::MatrixXd inverse = linalg::inverse(normal);
    Eigen::VectorXd value = inverse * (x.transpose() * y);
    if (!value.allFinite() || !(value(0) != 0.0)) return std::nullopt;
    const Eigen::VectorXd residual = y - x * value;
    const double least_lags = 8.0 * width / static_cast<double>(stride);
    const auto lags = lags_of(residual, least_lags);
    const Eigen::MatrixXd spread = long_run_covariance(residual.asDiagonal() * x, lags);
    const double share = static_cast<double>(lags) / static_cast<double>(n);
    const double few = (1.96 + 2.97 * share + 0.416 * share * share) / 1.96;
    Eigen::MatrixXd covariance =
        few * few * static_cast<double>(n) / static_cast<double>(n - terms) * inverse * spread * inverse;
    allow_for_noisy_acceleration(inverse, residual, value, covariance);
    Solution s;
    s.width = width;
    for (Eigen::Index i = 0; i < terms; ++i) {
      const int a = active_[static_cast<std::size_t>(i)];
      s.value(a) = value(i) / scale(i);
      for (Eigen::Index j = 0; j < terms; ++j)
        s.covariance(a, active_[static_cast<std::size_t>(j)]) = covariance(i, j) / (scale(i) * scale(j));
    }
    const double varying = (y.array() - y.mean()).square().sum();
    s.explained = 1.0 - residual.squaredNorm() / varying;
    s.kept = varying * static_cast<double>(stride) / moving_power(speed, threshold);
    double used = 0.0;
    for (Eigen::Index k = 0; k < rows.rows(); ++k) used += weight(speed(k * coarse), threshold);
    s.moving = used / static_cast<double>(rows.rows());
    return s;
  }

  /// Of the input about its mean.
  [[nodiscard]] double moving_power(const Eigen::VectorXd& speed, double threshold) const {
    double sum = 0.0, square = 0.0, count = 0.0;
    for (Eigen::Index k = 0; k < speed.size(); ++k) {
      const double u = weight(speed(k), threshold) * input_(k);
      sum += u;
      square += u * u;
      count += 1.0;
    }
    return std::max(square - sum * sum / count, 1e-300);
  }

  /// The residual may be of the torque or of the measured acceleration. If all of it is the latter's, the
  /// inertia is small by their share; half of that is taken out, and the range is kept as a deviation.
  static void allow_for_noisy_acceleration(const Eigen::MatrixXd& inverse, const Eigen::VectorXd& residual,
                                           Eigen::VectorXd& value, Eigen::MatrixXd& covariance) {
    const Eigen::VectorXd along = inverse.col(0) / inverse(0, 0);  // how all move with the inertia
    const double half = 0.5 * residual.squaredNorm() * inverse(0, 0) / value(0);
    value += half * along;
    covariance += half * half / 3.0 * along * along.transpose();
  }

  /// The same with the delay led to where its own term vanishes.
  [[nodiscard]] std::optional<Solution> settled(double width) {
    constexpr int kTurns = 4;
    constexpr double kShort = 0.02, kStep = 1.0, kLeast = -1.0, kMost = 10.0;  // samples
    std::optional<Solution> s;
    for (int turn = 0; turn < kTurns; ++turn) {
      s = solve(width, delay_ + further_, threshold_);
      if (!s) return std::nullopt;
      // A cut-off that does not tell the delay leaves it where it was.
      if (!(s->std(kDelayTerm) < kStep * step_s_)) break;
      const double left = s->value(kDelayTerm) / step_s_;
      if (std::abs(left) < kShort) break;
      if (turn + 1 == kTurns) break;
      further_ = std::clamp(further_ + std::clamp(left, -kStep, kStep), kLeast - delay_, kMost);
    }
    s->value(kDelayTerm) += further_ * step_s_;
    return s;
  }

  [[nodiscard]] bool agree(const Solution& a, const Solution& b) const {
    return std::all_of(active_.begin(), active_.end(), [&](int t) {
      return t == kDelayTerm || std::abs(a.value(t) - b.value(t)) < kAgree * std::max(a.std(t), b.std(t));
    });
  }

  /// Uncertainty in parts of the torque.
  [[nodiscard]] double price(const Solution& s) const {
    const double torque = std::sqrt(input_.squaredNorm() / static_cast<double>(input_.size()));
    return std::pow(s.std(kInertiaTerm) / s.value(kInertiaTerm), 2) +
           (has(kCoulombTerm) ? std::pow(s.std(kCoulombTerm) / torque, 2) : 0.0);
  }

  /// `independent`: samples in motion per width that a scatter needs to be known.
  [[nodiscard]] std::optional<Solution> by_cut_off(double independent) {
    const auto n = static_cast<double>(smooth_.size());
    constexpr double kFewest = 1.0, kMostRows = 60'000.0;
    const double finest = std::max(kFewest, 1.5 * n / kMostRows);
    std::vector<Solution> good;
    double width = n / 100.0;
    for (; width > finest; width /= kFiner) {
      const auto s = settled(width);
      if (!s || s->moving * n < independent * width || !(s->value(kInertiaTerm) > 0.0) ||
          !(s->std(kInertiaTerm) < kKnown * s->value(kInertiaTerm)))
        continue;
      rigid_ = std::all_of(good.begin(), good.end(), [&](const Solution& g) { return agree(g, *s); });
      if (!rigid_) {
        rejected_ = *s;
        break;
      }
      good.push_back(*s);
      share_ = std::max(share_, s->explained * s->kept);
    }
    constexpr int kMore = 5;
    for (int i = 0; i < kMore && width > finest; ++i, width /= kFiner)
      if (const auto s = solve(width, delay_ + further_, threshold_))
        share_ = std::max(share_, s->explained * s->kept);
    if (good.empty()) return std::nullopt;
    const auto best = *std::min_element(good.begin(), good.end(),
                                        [&](const auto& a, const auto& b) { return price(a) < price(b); });
    return settled(best.width);
  }

  [[nodiscard]] static bool found(const Solution& s, int term) {
    constexpr double kFound = 4.0;
    return std::abs(s.value(term)) > kFound * s.std(term);
  }

  /// An elastic coupling below its resonance.
  void try_compliance(Solution& chosen) {
    active_.push_back(kComplianceTerm);
    const auto s = settled(chosen.width);
    // Noise of the acceleration looks like one too, but not the same at every cut-off.
    const auto lower = solve(kFiner * chosen.width, delay_ + further_, threshold_);
    if (s && lower && s->value(kComplianceTerm) < 0.0 && found(*s, kComplianceTerm) &&
        found(*lower, kComplianceTerm) && agree(*s, *lower))
      chosen = *s;
    else
      active_.pop_back();
  }

  /// Friction that is larger near standstill, where that is found beyond doubt.
  void try_stribeck(Solution& chosen) {
    double fastest = smooth_.cwiseAbs().maxCoeff();
    std::optional<Solution> best;
    double best_velocity = 0.0;
    active_.push_back(kStribeckTerm);
    for (double velocity = threshold_; velocity < 0.3 * fastest; velocity *= 1.5) {
      stribeck_ = velocity;
      auto s = settled(chosen.width);
      if (!s || (best && s->explained <= best->explained)) continue;
      best = s;
      best_velocity = velocity;
    }
    if (best && found(*best, kStribeckTerm) && best->value(kStribeckTerm) > 0.0 &&
        best->explained > chosen.explained) {
      stribeck_ = best_velocity;
      chosen = *best;
      return;
    }
    stribeck_ = 0.0;
    active_.pop_back();
  }

  /// By what the neighbouring cut-offs and a higher threshold of velocity say otherwise, beyond chance.
  void widen(Solution& chosen) {
    std::vector<Solution> others;
    for (const double width : {chosen.width * kFiner * kFiner, chosen.width * kFiner, chosen.width / kFiner})
      if (width >= 1.0)
        if (const auto s = solve(width, delay_ + further_, threshold_)) others.push_back(*s);
    constexpr double kFaster = 3.0;
    const auto all = active_;
    std::erase(active_, kStribeckTerm);  // too small there
    if (const auto s = solve(chosen.width, delay_ + further_, kFaster * threshold_)) others.push_back(*s);
    active_ = all;
    if (!has(kComplianceTerm)) {
      active_.push_back(kComplianceTerm);
      if (const auto s = solve(chosen.width, delay_ + further_, threshold_)) others.push_back(*s);
      active_ = all;
    }
    constexpr double kPart = 1.0;  // a difference shows a part of the error
    Terms more = Terms::Zero();
    for (const auto& other : others)
      for (const int t : active_) {
        if (t == kDelayTerm || t == kStribeckTerm || t == kComplianceTerm) continue;
        const double chance = 2.0 * std::max(other.covariance(t, t), chosen.covariance(t, t));
        more(t) = std::max(more(t), kPart * (std::pow(other.value(t) - chosen.value(t), 2) - chance));
      }
    if (rejected_) {
      // What ends the cut-offs, an elastic coupling or a lag, grows with their square.
      const double share = 1.0 / (std::pow(chosen.width / rejected_->width, 2) - 1.0);
      for (const int t : active_)
        if (t == kInertiaTerm || t == kViscousTerm || t == kCoulombTerm || t == kOffsetTerm)
          more(t) += std::pow(share * (rejected_->value(t) - chosen.value(t)), 2);
    }
    chosen.covariance.diagonal() += more;
  }

  [[nodiscard]] InverseDynamics result(const Solution& s) const {
    InverseDynamics found;
    const auto estimate = [&](int t) { return data::Estimate{s.value(t), s.std(t)}; };
    found.inertia = estimate(kInertiaTerm);
    found.viscous_friction = estimate(kViscousTerm);
    if (has(kCoulombTerm)) found.coulomb_friction = estimate(kCoulombTerm);
    found.offset = estimate(kOffsetTerm);
    found.further_delay_s = estimate(kDelayTerm);
    found.stribeck_velocity = stribeck_;
    if (has(kComplianceTerm)) found.compliance = estimate(kComplianceTerm);
    found.covariance = s.covariance;
    found.bandwidth_hz = std::sqrt(std::numbers::ln2) / (2.0 * std::numbers::pi * s.width * step_s_);
    found.explained = s.explained;
    found.share = share_;
    found.rigid = rigid_ && !has(kComplianceTerm);
    found.moving = s.moving;
    if (has(kCoulombTerm)) found.friction_torque = friction_of(s);
    return found;
  }

  /// Along the smoothed velocity, which comes later than the torque. Slower than noise for long: it rests.
  [[nodiscard]] std::vector<double> friction_of(const Solution& s) const {
    const Eigen::Index n = smooth_.size();
    constexpr Eigen::Index kRest = 8;                                // samples
    std::vector<Eigen::Index> slow(static_cast<std::size_t>(n), 0);  // samples of the rest it is part of
    for (Eigen::Index from = 0; from < n;) {
      Eigen::Index to = from;
      while (to < n && std::abs(smooth_(to)) < slowest_) ++to;
      for (Eigen::Index k = from; k < to; ++k) slow[static_cast<std::size_t>(k)] = to - from;
      from = to + 1;
    }
    const auto late = static_cast<Eigen::Index>(std::lround(std::max(0.0, delay_ + further_)));
    std::vector<double> torque(static_cast<std::size_t>(input_.size()));
    for (Eigen::Index k = 0; k < input_.size(); ++k) {
      const Eigen::Index at = std::min(k + late, n - 1);
      const double v = smooth_(at);
      const double more =
          stribeck_ > 0.0 ? s.value(kStribeckTerm) * std::exp(-std::pow(v / stribeck_, 2)) : 0.0;
      torque[static_cast<std::size_t>(k)] =
          slow[static_cast<std::size_t>(at)] >= kRest
              ? input_(k) + s.value(kOffsetTerm)
              : std::clamp(slowest_ > 0.0 ? v / slowest_ : 0.0, -1.0, 1.0) * (s.value(kCoulombTerm) + more);
    }
    return torque;
  }

  const InverseDynamicsConfig& config_;
  double step_s_;
  Eigen::VectorXd input_, velocity_;
  Eigen::VectorXd smooth_;              // [between samples]
  Eigen::Index reach_ = 0;              // of its smoothing
  double delay_ = 0.0, further_ = 0.0;  // samples
  double slowest_ = 0.0, threshold_ = 0.0, stribeck_ = 0.0;
  std::vector<int> active_ = {kInertiaTerm, kOffsetTerm, kDelayTerm};
  double share_ = 0.0;
  bool rigid_ = true;
  std::optional<Solution> rejected_;  ///< The first cut-off that disagrees.
};

}  // namespace

expected<InverseDynamics, Error> fit_inverse_dynamics(const data::Record& record,
                                                      const InverseDynamicsConfig& config) {
  constexpr std::size_t kFewest = 100;
  if (record.samples() < kFewest)
    return refuse("record", "needs at least 100 samples", static_cast<double>(record.samples()));
  if (record.input.samples.size() != record.samples())
    return refuse("record", "needs an input of the output's length");
  if (record.output_quantity == data::OutputQuantity::acceleration)
    return refuse("record", "needs a velocity or a position");
  if (!(config.known_delay_s >= 0.0) || config.known_delay_s > 0.25 * record.duration_s())
    return refuse("known_delay_s", "must be >= 0 and a small part of the recording", config.known_delay_s);
  Fitter fitter(record, config);
  if (!fitter.moves()) return refuse("record", "needs a motion beyond the noise");
  auto found = fitter.run();
  if (!found) return refuse("record", "needs a motion that tells the inertia");
  return *found;
}

}  // namespace resonid::fit
