// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cmath>
#include <fit/drive/bending.hpp>
#include <fit/drive/constancy.hpp>
#include <fit/drive/score.hpp>
#include <resonid/base/detail/statistics.hpp>

#include "linalg/decompositions.hpp"

namespace resonid::fit::detail {
namespace {

/// Torques on the masses, [mass][sample]; an empty one: none.
using Torques = std::vector<std::vector<double>>;

/// One torque of the dictionary.
struct Shape {
  Bending bending;
  Torques torques;
  double unit = 1.0;  ///< What its amplitude is told in.
};

/// A torque by the motion, held over the sample that causes it.
template <class Function>
std::vector<double> torque_by(const std::vector<double>& motion, Function&& function) {
  std::vector<double> torque(motion.size());
  for (std::size_t k = 0; k < motion.size(); ++k) torque[k] = function(motion[k], k);
  for (std::size_t k = 0; k + 1 < torque.size(); ++k) torque[k] = 0.5 * (torque[k] + torque[k + 1]);
  return torque;
}

/// Time from -1/2 to 1/2 over the record.
struct Course {
  double samples;
  [[nodiscard]] double at(std::size_t k) const { return static_cast<double>(k) / samples - 0.5; }
};

Shape acting(BendingTorque torque, std::size_t masses, std::size_t mass, std::vector<double> f) {
  Shape s;
  s.bending.torque = torque;
  s.torques.resize(masses);
  s.torques[mass] = std::move(f);
  return s;
}

void add_coupling(const std::vector<double>& twist, std::size_t coupling, std::size_t masses,
                  double stiffness, std::vector<Shape>& shapes) {
  const double size = deviation(twist);
  if (!(size > 0.0)) return;
  const Course time{static_cast<double>(twist.size())};
  const auto add = [&](BendingTorque torque, const std::vector<double>& f, double unit) {
    Shape s = acting(torque, masses, coupling + 1, f);
    s.bending.coupling = static_cast<int>(coupling);
    s.torques[coupling] = f;
    for (double& v : s.torques[coupling]) v = -v;
    s.unit = unit;
    shapes.push_back(std::move(s));
  };
  add(BendingTorque::stiffening,
      torque_by(twist, [&](double q, std::size_t) { return std::pow(q / size, 3); }),
      1.0 / (stiffness * size));
  // Beside a spring, play of b is -K q within b/2 and -K b/2 beyond. Narrow and wide, by the twist's
  // deviation.
  for (const double edge : {0.2, 1.0})
    add(BendingTorque::backlash,
        torque_by(twist, [&](double q, std::size_t) { return std::tanh(q / (edge * size)); }),
        -2.0 / stiffness);
  add(BendingTorque::stiffness_drift,
      torque_by(twist, [&](double q, std::size_t k) { return q / size * time.at(k); }),
      1.0 / (stiffness * size));
}

void add_side(const std::vector<double>& velocity, std::size_t mass, std::size_t masses, double inertia,
              double sample_time_s, std::vector<Shape>& shapes) {
  const double size = rms(velocity);
  const bool load = mass > 0;
  if (!(size > 0.0)) return;
  constexpr double kEdge = 0.1, kSlow = 0.3;  // of the velocity
  const auto against = [&](double v) { return -std::tanh(v / (kEdge * size)); };
  shapes.push_back(acting(load ? BendingTorque::load_dry_friction : BendingTorque::dry_friction, masses, mass,
                          torque_by(velocity, [&](double v, std::size_t) { return against(v); })));
  shapes.push_back(acting(load ? BendingTorque::load_stribeck_friction : BendingTorque::stribeck_friction,
                          masses, mass, torque_by(velocity, [&](double v, std::size_t) {
                            return against(v) * std::exp(-std::abs(v) / (kSlow * size));
                          })));
  const Course time{static_cast<double>(velocity.size())};
  std::vector<double> drift(velocity.size(), 0.0);
  for (std::size_t k = 0; k + 1 < drift.size(); ++k)
    drift[k] = -(velocity[k + 1] - velocity[k]) / sample_time_s * inertia * time.at(k);
  shapes.push_back(acting(load ? BendingTorque::load_inertia_drift : BendingTorque::inertia_drift, masses,
                          mass, std::move(drift)));
}

std::vector<Shape> dictionary(const DriveMotion& motion, const data::ThreeMassParameters& p,
                              double sample_time_s) {
  const std::size_t masses = motion.velocity.size();
  std::vector<Shape> shapes;
  for (std::size_t c = 0; c + 1 < masses; ++c)
    add_coupling(motion.twist[c], c, masses, c == 0 ? p.stiffness : p.stiffness_2, shapes);
  add_side(motion.velocity.front(), 0, masses, p.driven_inertia, sample_time_s, shapes);
  if (masses > 1) add_side(motion.velocity.back(), masses - 1, masses, p.load_inertia, sample_time_s, shapes);
  // Under a torque of nearly one size, as of two levels, its square is the feedback's part of it, no gain.
  constexpr double kSizes = 0.3;  // a sine's sizes scatter by 0.44 of its rms, those of noise by 0.6
  const double size = deviation(motion.torque), centre = mean(motion.torque);
  std::vector<double> sizes, f;
  for (const double t : motion.torque) {
    sizes.push_back(std::abs(t - centre));
    f.push_back((t - centre) / size * sizes.back());
  }
  if (size > 0.0 && deviation(sizes) > kSizes * size)
    shapes.push_back(acting(BendingTorque::torque_gain, masses, 0, std::move(f)));
  return shapes;
}

/// Columns orthonormal, those that depend on others left out.
Eigen::MatrixXd orthonormal(Eigen::MatrixXd columns) {
  Eigen::Index kept = 0;
  constexpr double kDependent = 1e-9;
  for (Eigen::Index i = 0; i < columns.cols(); ++i) {
    Eigen::VectorXd v = columns.col(i);
    const double before = v.norm();
    if (!(before > 0.0) || !std::isfinite(before)) continue;
    v /= before;
    for (int pass = 0; pass < 2; ++pass)
      v -= columns.leftCols(kept) * (columns.leftCols(kept).transpose() * v);
    const double after = v.norm();
    if (!(after > kDependent)) continue;
    columns.col(kept++) = v / after;
  }
  return columns.leftCols(kept);
}

/// Whitens what has a value in every sample, and leaves out what samples touch that are not used.
class Whitening {
 public:
  Whitening(const DriveSignals& raw, const NoiseModel& noise)
      : noise_(noise), touched_(touched(raw.unused, noise)) {}
  [[nodiscard]] Eigen::VectorXd operator()(std::span<const double> column) const {
    const auto white = whiten(column, noise_);
    Eigen::VectorXd used(static_cast<Eigen::Index>(white.size()));
    Eigen::Index count = 0;
    const std::size_t before = touched_.empty() ? 0 : touched_.size() - white.size();
    for (std::size_t k = 0; k < white.size(); ++k)
      if (touched_.empty() || !touched_[before + k]) used(count++) = white[k];
    return used.head(count);
  }

 private:
  const NoiseModel& noise_;
  std::vector<bool> touched_;
};

/// Variance of sum d_k r_k, r neither even in size nor quite white (Newey and West 1987).
double robust_variance(const Eigen::VectorXd& d, const Eigen::VectorXd& r) {
  const Eigen::VectorXd s = d.cwiseProduct(r);
  constexpr Eigen::Index kLags = 12;
  double sum = s.squaredNorm();
  for (Eigen::Index lag = 1; lag < std::min(kLags, s.size()); ++lag) {
    const double weight = 1.0 - static_cast<double>(lag) / static_cast<double>(kLags);
    sum += 2.0 * weight * s.head(s.size() - lag).dot(s.tail(s.size() - lag));
  }
  return sum;
}

/// Whitened slopes and residual at the estimate.
struct Slopes {
  Eigen::MatrixXd own;     ///< Of the output by what is estimated: parameters first, then the record's own.
  Eigen::MatrixXd linear;  ///< Orthonormal: the same, and of what a linear drive may have beside.
  Eigen::VectorXd residual;
};

std::optional<Slopes> slopes_of(const SimulationSetup& setup, const DriveSignals& raw,
                                std::span<const double> x, std::span<const int> estimated,
                                std::span<const int> own, const Whitening& whitening) {
  SimulationSetup wider = setup;
  wider.lag = Lag::first_order;
  wider.grounded = true;
  std::vector<int> columns(estimated.begin(), estimated.end());
  for (const Parameter p : kFurtherTried)
    if (std::find(estimated.begin(), estimated.end(), p) == estimated.end() &&
        may_have_parameter(setup.structure, p))
      columns.push_back(p);
  const auto parameters = static_cast<Eigen::Index>(estimated.size());
  const auto states = static_cast<Eigen::Index>(own.size());
  columns.insert(columns.end(), own.begin(), own.end());
  if (columns.size() > DriveSimulation::kMostColumns) return std::nullopt;
  const Eigen::MatrixXd rows = DriveSimulation(wider, raw).rows(x, columns);
  if (!rows.allFinite()) return std::nullopt;
  Eigen::MatrixXd white;
  for (Eigen::Index i = 0; i < rows.cols(); ++i) {
    const Eigen::VectorXd column =
        whitening(std::span(rows.col(i).data(), static_cast<std::size_t>(rows.rows())));
    if (i == 0) white.resize(column.size(), rows.cols());
    white.col(i) = column;
  }
  if (white.rows() <= white.cols()) return std::nullopt;
  Slopes s;
  s.own.resize(white.rows(), parameters + states);
  s.own << -white.leftCols(parameters), -white.middleCols(white.cols() - 1 - states, states);
  s.residual = white.rightCols(1);
  s.linear = orthonormal(white.leftCols(white.cols() - 1));
  return s;
}

/// A torque's whitened output, whole and without what is linear, beside those that were found before.
struct Column {
  Bending bending;
  Eigen::VectorXd whole, apart;
  double unit, size;
};

/// Beyond noise: one in a thousand that any of so many torques is found where there is none.
constexpr double kBeyondNoise = 4.0;
constexpr double kLikely = 3.0;  ///< The same for one that may be the cause of what was found.

std::vector<Column> columns_of(const SimulationSetup& setup, const DriveSignals& raw,
                               std::span<const double> x, const Whitening& whitening, const Slopes& slopes) {
  const DriveSimulation drive(setup, raw);
  const auto p = setup.coordinates.parameters(x.data(), setup.structure == Structure::three_mass);
  std::vector<Column> found;
  for (auto& shape : dictionary(drive.motion(x), p, setup.coordinates.sample_time_s)) {
    const auto output = drive.moved_by(std::move(shape.torques), x);
    Column c{shape.bending, whitening(output), {}, shape.unit, 0.0};
    if (c.whole.size() != slopes.residual.size() || !c.whole.allFinite()) continue;
    c.apart = c.whole - slopes.linear * (slopes.linear.transpose() * c.whole);
    c.apart -= slopes.linear * (slopes.linear.transpose() * c.apart);
    c.size = c.whole.squaredNorm();
    found.push_back(std::move(c));
  }
  return found;
}

/// Amplitude, significance and share of one torque, of the residual that is left.
bool test(Column& c, const Eigen::VectorXd& residual, double degrees) {
  constexpr double kLinear = 1e-6;  // of a torque that a linear drive has too
  const double size = c.apart.squaredNorm();
  if (!(size > kLinear * c.size)) return false;
  const double along = c.apart.dot(residual);
  auto& b = c.bending;
  b.amplitude = along / size;
  const Eigen::VectorXd left = residual - b.amplitude * c.apart;
  const double variance = std::max(left.squaredNorm() / degrees * size, robust_variance(c.apart, left));
  b.deviations = variance > 0.0 ? along / std::sqrt(variance) : 0.0;
  b.share = along * along / (size * residual.squaredNorm());
  return true;
}

std::vector<Constancy> constancy_without(const Slopes& slopes, Eigen::VectorXd left,
                                         std::span<const int> names) {
  const Eigen::MatrixXd basis = orthonormal(slopes.own);
  left -= basis * (basis.transpose() * left);
  Eigen::MatrixXd rows(slopes.own.rows(), slopes.own.cols() + 1);
  rows << -slopes.own, left;
  const auto stretches = static_cast<Eigen::Index>(stretches_of(static_cast<std::size_t>(rows.rows())));
  if (stretches == 0) return {};
  std::vector<StretchFactor> parts;
  const Eigen::Index length = (rows.rows() + stretches - 1) / stretches;
  for (Eigen::Index from = 0; from < rows.rows(); from += length) {
    const Eigen::Index count = std::min(length, rows.rows() - from);
    parts.push_back({rows.middleRows(from, count), static_cast<std::size_t>(count)});
  }
  auto found = constancy_of(parts, names);
  for (const auto& c : constancy_over_frequency(rows, names)) found.push_back(c);
  return found;
}

}  // namespace

BendingTest bending_of(const SimulationSetup& setup, const DriveSignals& raw, std::span<const double> x,
                       std::span<const int> estimated, std::span<const int> own, const NoiseModel& noise) {
  if (raw.output.size() > kLongRecord) return {};
  const Whitening whitening(raw, noise);
  DriveSignals all = raw;
  all.unused.clear();  // the noise model needs neighbours
  const auto slopes = slopes_of(setup, all, x, estimated, own, whitening);
  if (!slopes) return {};
  Eigen::VectorXd residual = slopes->residual, left = slopes->residual;
  residual -= slopes->linear * (slopes->linear.transpose() * residual);
  const double degrees = static_cast<double>(residual.size() - slopes->linear.cols());
  if (!(residual.squaredNorm() > 0.0)) return {};
  const Eigen::VectorXd scale = slopes->own.colwise().norm().cwiseMax(1e-300).cwiseInverse();
  const Eigen::MatrixXd scaled = slopes->own * scale.asDiagonal();
  const Eigen::MatrixXd inverse = linalg::pseudo_inverse(scaled.transpose() * scaled).matrix;
  auto columns = columns_of(setup, all, x, whitening, *slopes);
  BendingTest result;
  while (!columns.empty()) {
    std::erase_if(columns, [&](Column& c) { return !test(c, residual, degrees); });
    const auto beyond = [&](double deviations) {
      return [deviations](const Column& c) { return std::abs(c.bending.deviations) > deviations; };
    };
    if (std::none_of(columns.begin(), columns.end(), beyond(kBeyondNoise))) break;
    // That something is there is known now. What explains most of the residual is its likeliest cause, also
    // where an uneven residual makes another's deviation smaller.
    const auto best = std::max_element(columns.begin(), columns.end(), [&](const Column& a, const Column& b) {
      const auto is_likely = beyond(kLikely);
      return std::pair(is_likely(a), a.bending.share) < std::pair(is_likely(b), b.bending.share);
    });
    const Column chosen = std::move(*best);
    columns.erase(best);
    Bending b = chosen.bending;
    residual -= b.amplitude * chosen.apart;
    left -= b.amplitude * chosen.whole;
    const Eigen::VectorXd moved = inverse * (scaled.transpose() * chosen.whole) * -b.amplitude;
    for (std::size_t i = 0; i < estimated.size(); ++i)
      b.shift(estimated[i]) = scale(static_cast<Eigen::Index>(i)) * moved(static_cast<Eigen::Index>(i));
    b.amplitude *= chosen.unit;
    result.found.push_back(b);
    for (auto& c : columns) {
      const double common = c.apart.dot(chosen.apart) / chosen.apart.squaredNorm();
      c.apart -= common * chosen.apart;
      c.whole -= common * chosen.whole;
    }
  }
  result.left = residual.squaredNorm() / degrees;
  if (!result.found.empty()) result.constancy = constancy_without(*slopes, std::move(left), estimated);
  return result;
}

}  // namespace resonid::fit::detail
