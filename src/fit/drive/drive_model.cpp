// SPDX-License-Identifier: MIT
#include <algorithm>
#include <fit/drive/measured_response.hpp>
#include <resonid/fit/drive_model.hpp>
#include <vector>

#include "linalg/decompositions.hpp"

namespace resonid::fit {

std::string_view name_of(Structure structure) noexcept {
  switch (structure) {
    case Structure::rigid:
      return "rigid";
    case Structure::two_mass:
      return "two-mass";
    default:
      return "three-mass";
  }
}

int order_of(Structure structure) noexcept {
  return structure == Structure::rigid ? 1 : structure == Structure::two_mass ? 3 : 5;
}

bool has_parameter(Structure structure, int parameter) noexcept {
  switch (parameter) {
    case kDrivenInertia:
      return true;
    case kLoadInertia:
    case kStiffness:
    case kDamping:
      return structure != Structure::rigid;
    case kMiddleInertia:
    case kStiffness2:
    case kDamping2:
      return structure == Structure::three_mass;
    default:
      return false;
  }
}

bool may_have_parameter(Structure structure, int parameter) noexcept {
  switch (parameter) {
    case kViscousFriction:
    case kDelay:
    case kTorqueLag:
    case kOutputFilter:
    case kMotorGroundStiffness:
      return true;
    case kLoadViscousFriction:
    case kLoadGroundStiffness:
      return structure != Structure::rigid;
    default:
      return false;
  }
}

ParameterMask estimated_parameters(Structure structure, bool viscous_friction, bool delay,
                                   std::span<const Parameter> further) {
  ParameterMask mask{};
  for (int i = 0; i < kParameterCount; ++i) mask[static_cast<std::size_t>(i)] = has_parameter(structure, i);
  mask[kViscousFriction] = viscous_friction;
  mask[kDelay] = delay;
  for (const Parameter p : further) mask[static_cast<std::size_t>(p)] = may_have_parameter(structure, p);
  return mask;
}

namespace {

double& reference(DriveModel& model, int parameter) {
  switch (parameter) {
    case kDrivenInertia:
      return model.parameters.driven_inertia;
    case kLoadInertia:
      return model.parameters.load_inertia;
    case kStiffness:
      return model.parameters.stiffness;
    case kDamping:
      return model.parameters.damping;
    case kViscousFriction:
      return model.parameters.viscous_friction;
    case kMiddleInertia:
      return model.parameters.middle_inertia;
    case kStiffness2:
      return model.parameters.stiffness_2;
    case kDamping2:
      return model.parameters.damping_2;
    case kLoadViscousFriction:
      return model.parameters.load_viscous_friction;
    case kTorqueLag:
      return model.torque_lag_s;
    case kOutputFilter:
      return model.output_filter_s;
    case kMotorGroundStiffness:
      return model.parameters.motor_ground_stiffness;
    case kLoadGroundStiffness:
      return model.parameters.load_ground_stiffness;
    default:
      return model.delay_s;
  }
}

using Complex = std::complex<double>;

/// Eigenvalues, ascending in magnitude, of pairs the one with positive imaginary part first.
std::vector<Complex> eigenvalues(const Eigen::MatrixXd& a) {
  std::vector<Complex> roots;
  if (a.rows() == 0 || !a.allFinite()) return roots;
  const Eigen::VectorXcd values = linalg::eigenvalues(a);
  roots.assign(values.begin(), values.end());
  std::sort(roots.begin(), roots.end(), [](const Complex& x, const Complex& y) {
    const double difference = std::abs(x) - std::abs(y);
    if (std::abs(difference) > 1e-9 * std::abs(x)) return difference < 0.0;
    return x.imag() > y.imag();
  });
  return roots;
}

/// Poles of the continuous drive, or its zeros: the poles with the driven side clamped. The velocity of a
/// drive that is tied to the ground has a further zero at 0; torque lag and output filter are poles of their
/// own.
std::vector<Complex> continuous_roots(const DriveModel& model, bool zeros) {
  auto roots = detail::with_masses(model.structure, [&](auto masses) {
    constexpr int kOrder = detail::Sizes<masses>::kOrder;
    const Eigen::MatrixXd whole = detail::continuous_drive<masses>(model.parameters).a;
    if (!zeros) return eigenvalues(model.grounded() ? whole : whole.topLeftCorner(kOrder, kOrder));
    return eigenvalues(whole.block(1, 1, kOrder - 1, kOrder - 1));
  });
  if (zeros && model.grounded()) roots.insert(roots.begin(), Complex(0.0, 0.0));
  for (const double lag_s : {model.torque_lag_s, model.output_filter_s})
    if (!zeros && lag_s > 0.0) roots.emplace_back(-1.0 / lag_s, 0.0);
  return roots;
}

/// Takes the root nearest to `to` out of `roots`.
Complex take_nearest(std::vector<Complex>& roots, const Complex& to) {
  const auto nearest = std::min_element(roots.begin(), roots.end(), [&](const Complex& x, const Complex& y) {
    return std::abs(x - to) < std::abs(y - to);
  });
  const Complex root = *nearest;
  roots.erase(nearest);
  return root;
}

std::vector<UncertainRoot> uncertain_roots(const DriveModel& model, bool zeros) {
  const auto values = continuous_roots(model, zeros);
  const auto count = static_cast<Eigen::Index>(values.size());
  Eigen::MatrixXd gradient = Eigen::MatrixXd::Zero(2 * count, kParameterCount);
  for (int i = 0; i < kParameterCount; ++i) {
    const double step = model.difference_step(i);
    if (!model.estimated[static_cast<std::size_t>(i)] || step <= 0.0) continue;
    auto plus = continuous_roots(model.moved(i, step), zeros);
    auto minus = continuous_roots(model.moved(i, -step), zeros);
    if (plus.size() != values.size() || minus.size() != values.size()) continue;
    for (Eigen::Index k = 0; k < count; ++k) {
      const auto& root = values[static_cast<std::size_t>(k)];
      const Complex slope = (take_nearest(plus, root) - take_nearest(minus, root)) / (2.0 * step);
      gradient(2 * k, i) = slope.real();
      gradient(2 * k + 1, i) = slope.imag();
    }
  }
  std::vector<UncertainRoot> roots;
  for (Eigen::Index k = 0; k < count; ++k) {
    const Eigen::MatrixXd rows = gradient.middleRows(2 * k, 2);
    roots.push_back({values[static_cast<std::size_t>(k)], rows * model.covariance * rows.transpose()});
  }
  return roots;
}

/// Undamped modes, ascending: anti-resonance and resonance in turn.
struct PlainMode {
  bool anti = false;
  data::UndampedMode mode;
};

/// Of a chain that springs tie to the ground, the same with the driven side `clamped`; those that would
/// topple are left out.
std::vector<data::UndampedMode> grounded_modes(const DriveModel& model, bool clamped) {
  const auto& p = model.parameters;
  const Eigen::Index n = (order_of(model.structure) + 1) / 2;
  Eigen::MatrixXd stiffness = Eigen::MatrixXd::Zero(n, n), damping = stiffness;
  Eigen::VectorXd scale(n);
  scale(0) = p.driven_inertia;
  const auto couple = [&](Eigen::Index at, double k, double d) {
    Eigen::Matrix2d link;
    link << 1.0, -1.0, -1.0, 1.0;
    stiffness.block<2, 2>(at, at) += k * link;
    damping.block<2, 2>(at, at) += d * link;
  };
  if (n > 1) {
    couple(0, p.stiffness, p.damping);
    scale(n - 1) = p.load_inertia;
    stiffness(n - 1, n - 1) += p.load_ground_stiffness;
  }
  if (n > 2) {
    couple(1, p.stiffness_2, p.damping_2);
    scale(1) = p.middle_inertia;
  }
  stiffness(0, 0) += p.motor_ground_stiffness;
  scale = scale.cwiseSqrt().cwiseInverse().eval();
  const Eigen::Index first = clamped ? 1 : 0, size = n - first;
  std::vector<data::UndampedMode> modes;
  if (size == 0) return modes;
  const Eigen::MatrixXd k =
      (scale.asDiagonal() * stiffness * scale.asDiagonal()).bottomRightCorner(size, size);
  const Eigen::MatrixXd d = (scale.asDiagonal() * damping * scale.asDiagonal()).bottomRightCorner(size, size);
  if (!k.allFinite()) return modes;
  const auto axes = linalg::symmetric_eigenpairs(k);
  for (Eigen::Index i = 0; i < size; ++i) {
    if (!(axes.values(i) > 0.0)) continue;
    const double omega = std::sqrt(axes.values(i));
    const Eigen::VectorXd shape = axes.vectors.col(i);
    modes.push_back({omega / kTwoPi, 0.5 * shape.dot(d * shape) / omega});
  }
  return modes;
}

std::vector<PlainMode> plain_modes(const DriveModel& model) {
  const auto& p = model.parameters;
  if (model.grounded()) {
    std::vector<PlainMode> all;
    for (const bool anti : {true, false})
      for (const auto& mode : grounded_modes(model, anti)) all.push_back({anti, mode});
    std::stable_sort(all.begin(), all.end(), [](const PlainMode& a, const PlainMode& b) {
      return a.mode.frequency_hz < b.mode.frequency_hz;
    });
    return all;
  }
  if (model.structure == Structure::rigid) return {};
  if (model.structure == Structure::two_mass)
    return {{true, {data::antiresonance_hz(p), data::antiresonance_damping_ratio(p)}},
            {false, {data::resonance_hz(p), data::resonance_damping_ratio(p)}}};
  const auto clamped = data::undamped_modes(p, true);
  const auto free = data::undamped_modes(p, false);
  return {{true, clamped[0]}, {false, free[0]}, {true, clamped[1]}, {false, free[1]}};
}

}  // namespace

double DriveModel::value(Parameter parameter) const {
  DriveModel copy = *this;
  return reference(copy, parameter);
}

void DriveModel::set(Parameter parameter, double value) { reference(*this, parameter) = value; }

std::vector<Parameter> DriveModel::further() const {
  std::vector<Parameter> more;
  for (int i = kLoadViscousFriction; i <= kLoadGroundStiffness; ++i)
    if (estimated[static_cast<std::size_t>(i)]) more.push_back(static_cast<Parameter>(i));
  return more;
}

data::Estimate DriveModel::estimate(Parameter parameter) const {
  return {value(parameter),
          std::sqrt(covariance(parameter, parameter) < 0.0 ? 0.0 : covariance(parameter, parameter))};
}

DriveModel DriveModel::moved(int parameter, double by) const {
  DriveModel copy = *this;
  reference(copy, parameter) += by;
  return copy;
}

double DriveModel::difference_step(int parameter) const {
  const double sd = std::sqrt(covariance(parameter, parameter));
  const double size = std::abs(value(static_cast<Parameter>(parameter)));
  return sd > 0.0 ? std::min(0.1 * sd, 1e-4 * size + 1e-3 * sd) : 1e-6 * size;
}

std::complex<double> DriveModel::response(double frequency_hz) const {
  return values(std::span(&frequency_hz, 1)).front();
}

std::vector<std::complex<double>> DriveModel::values(std::span<const double> frequencies_hz,
                                                     bool as_measured) const {
  return detail::with_masses(structure, [&](auto masses) {
    const detail::MeasuredResponse<masses> measured(
        parameters, as_measured ? delay_s / sample_time_s : 0.0, torque_lag_s / sample_time_s,
        detail::filter_pole(output_filter_s, sample_time_s),
        {sample_time_s, as_measured ? known_delay_s / sample_time_s : 0.0,
         torque_lag_s > 0.0 ? detail::Lag::first_order : detail::Lag::none, grounded(), velocity});
    return measured.values(frequencies_hz);
  });
}

data::FrequencyResponse DriveModel::response(std::span<const double> frequencies_hz) const {
  data::FrequencyResponse result;
  result.frequency_hz.assign(frequencies_hz.begin(), frequencies_hz.end());
  const auto evaluate = [&](const DriveModel& model) { return model.values(frequencies_hz); };
  result.value = evaluate(*this);
  // E|dG|^2 = g^H P g with the complex gradient g over the parameters.
  std::array<std::vector<std::complex<double>>, kParameterCount> gradient;
  for (int i = 0; i < kParameterCount; ++i) {
    const double step = 1e-5 * std::max(std::abs(value(static_cast<Parameter>(i))),
                                        std::sqrt(std::max(0.0, covariance(i, i))));
    if (i == kDelay || !estimated[static_cast<std::size_t>(i)] || step <= 0.0) continue;
    auto plus = evaluate(moved(i, step));
    const auto minus = evaluate(moved(i, -step));
    for (std::size_t k = 0; k < plus.size(); ++k) plus[k] = (plus[k] - minus[k]) / (2.0 * step);
    gradient[static_cast<std::size_t>(i)] = std::move(plus);
  }
  for (std::size_t k = 0; k < frequencies_hz.size(); ++k) {
    double variance = 0.0;
    for (int i = 0; i < kParameterCount; ++i)
      for (int j = 0; j < kParameterCount; ++j) {
        const auto& gi = gradient[static_cast<std::size_t>(i)];
        const auto& gj = gradient[static_cast<std::size_t>(j)];
        if (!gi.empty() && !gj.empty()) variance += covariance(i, j) * (std::conj(gi[k]) * gj[k]).real();
      }
    result.std.push_back(std::sqrt(std::max(0.0, variance)));
  }
  return result;
}

data::TransferFunction DriveModel::transfer_function() const {
  const bool lags = torque_lag_s > 0.0;
  const int mechanical = order_of(structure) + (grounded() ? 1 : 0);
  const int order = mechanical + (lags ? 1 : 0);
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(order, order);
  Eigen::VectorXd b = Eigen::VectorXd::Zero(order);
  Eigen::RowVectorXd c = Eigen::RowVectorXd::Zero(order);
  double d = 0.0;
  detail::with_masses(structure, [&](auto masses) {
    const auto s = detail::sampled_drive<masses>(
        parameters, data::OutputQuantity::velocity, 0.0, sample_time_s,
        lags ? detail::Lag::first_order : detail::Lag::none, torque_lag_s / sample_time_s, velocity);
    a.topLeftCorner(mechanical, mechanical) = s.system.a.topLeftCorner(mechanical, mechanical);
    b.head(mechanical) = (s.system.b - s.lag_b).head(mechanical);
    c.head(mechanical) = s.system.c.head(mechanical);
    d = s.system.d - s.lag_d;
    if (!lags) return;
    a.topRightCorner(mechanical, 1) = s.lag_b.head(mechanical);
    a(mechanical, mechanical) = s.decay;
    b(mechanical) = 1.0 - s.decay;
    c(mechanical) = s.lag_d;
  });
  const bool differences = velocity == Velocity::differences;
  data::TransferFunction g{{0.0}, {1.0}, sample_time_s};
  // Faddeev-LeVerrier: adj(zI - A) and det(zI - A) in one recursion.
  Eigen::MatrixXd m = Eigen::MatrixXd::Identity(order, order);
  for (int k = 1; k <= order; ++k) {
    // y(k+1) = c x(k) + d u(k); the velocity itself is x_0(k).
    if (differences && k == 1) g.numerator.push_back(d);
    g.numerator.push_back(differences ? c.dot(m * b) : (m * b)(0));
    const Eigen::MatrixXd am = a * m;
    const double coefficient = -am.trace() / k;
    g.denominator.push_back(coefficient);
    if (differences) g.numerator.back() += d * coefficient;
    m = am;
    m.diagonal().array() += coefficient;
  }
  if (const double pole = detail::filter_pole(output_filter_s, sample_time_s); pole > 0.0) {
    for (double& coefficient : g.numerator) coefficient *= 1.0 - pole;
    g.denominator.push_back(0.0);
    for (std::size_t i = g.denominator.size() - 1; i > 0; --i)
      g.denominator[i] -= pole * g.denominator[i - 1];
  }
  return g;
}

std::vector<data::Mode> DriveModel::modes() const {
  const auto values = plain_modes(*this);
  // A moved model may lose a mode that hardly is one.
  const auto of = [](const DriveModel& m, std::size_t i) {
    const auto all = plain_modes(m);
    return i < all.size() ? all[i].mode : data::UndampedMode{};
  };
  std::vector<data::Mode> result;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const auto frequency = [&](const DriveModel& m) { return of(m, i).frequency_hz; };
    const auto damping = [&](const DriveModel& m) { return of(m, i).damping_ratio; };
    result.push_back({values[i].anti,
                      {values[i].mode.frequency_hz, standard_deviation_of(frequency)},
                      {values[i].mode.damping_ratio, standard_deviation_of(damping)}});
  }
  return result;
}

data::Estimate DriveModel::resonance() const {
  const auto all = modes();
  const auto anti = std::find_if(all.begin(), all.end(), [](const data::Mode& m) { return m.anti; });
  const auto above = std::find_if(anti, all.end(), [](const data::Mode& m) { return !m.anti; });
  return above == all.end() ? data::Estimate{} : above->frequency_hz;
}

data::Estimate DriveModel::antiresonance() const {
  const auto all = modes();
  const auto anti = std::find_if(all.begin(), all.end(), [](const data::Mode& m) { return m.anti; });
  return anti == all.end() ? data::Estimate{} : anti->frequency_hz;
}

std::vector<UncertainRoot> DriveModel::poles() const { return uncertain_roots(*this, false); }

std::vector<UncertainRoot> DriveModel::zeros() const { return uncertain_roots(*this, true); }

namespace detail {

std::array<double, kParameterCount> Coordinates::from(const DriveModel& model) const {
  std::array<double, kParameterCount> x{};
  const auto unit = jacobian(model);
  for (int i = 0; i < kParameterCount; ++i) {
    const double value = model.value(static_cast<Parameter>(i));
    const auto at = static_cast<std::size_t>(i);
    x[at] = is_logarithm(i) ? std::log(std::max(value, 1e-300)) : value / unit[at];
  }
  x[kOutputFilter] = filter_pole(model.output_filter_s, sample_time_s);
  return x;
}

void Coordinates::store(const double* x, DriveModel& model) const {
  model.parameters = parameters(x, model.structure == Structure::three_mass);
  if (model.structure == Structure::rigid)
    model.parameters.load_inertia = model.parameters.stiffness = model.parameters.damping = 0.0;
  model.delay_s = x[kDelay] * sample_time_s;
  model.torque_lag_s = x[kTorqueLag] * sample_time_s;
  const double pole = std::min(x[kOutputFilter], 1.0 - 1e-9);
  model.output_filter_s = pole > 0.0 ? -sample_time_s / std::log(pole) : 0.0;
}

std::array<double, kParameterCount> Coordinates::jacobian(const DriveModel& model) const {
  std::array<double, kParameterCount> unit{};
  for (int i = 0; i < kParameterCount; ++i)
    if (is_logarithm(i)) unit[static_cast<std::size_t>(i)] = model.value(static_cast<Parameter>(i));
  unit[kViscousFriction] = unit[kLoadViscousFriction] = viscous_unit;
  unit[kMotorGroundStiffness] = unit[kLoadGroundStiffness] = ground_unit;
  unit[kDelay] = unit[kTorqueLag] = sample_time_s;
  // T = -Ts/ln p; without a filter as at a hundredth, where p vanishes faster than T.
  const double pole = std::max(0.01, filter_pole(model.output_filter_s, sample_time_s));
  unit[kOutputFilter] = sample_time_s / (pole * std::pow(std::log(pole), 2));
  return unit;
}

}  // namespace detail
}  // namespace resonid::fit
