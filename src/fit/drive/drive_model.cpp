// SPDX-License-Identifier: MIT
#include <algorithm>
#include <fit/drive/sampled_drive.hpp>
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

ParameterMask estimated_parameters(Structure structure, bool viscous_friction, bool delay) {
  ParameterMask mask{};
  for (int i = 0; i < kParameterCount; ++i) mask[static_cast<std::size_t>(i)] = has_parameter(structure, i);
  mask[kViscousFriction] = viscous_friction;
  mask[kDelay] = delay;
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

/// Poles of the continuous drive, or its zeros: the poles with the driven side clamped.
std::vector<Complex> continuous_roots(const DriveModel& model, bool zeros) {
  return detail::with_masses(model.structure, [&](auto masses) {
    constexpr int kOrder = detail::Sizes<masses>::kOrder;
    const Eigen::MatrixXd a =
        detail::continuous_drive<masses>(model.parameters).a.topLeftCorner(kOrder, kOrder);
    return eigenvalues(zeros ? a.bottomRightCorner(kOrder - 1, kOrder - 1) : a);
  });
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

/// Undamped modes of a drive that is not rigid: anti-resonance and resonance in turn.
struct PlainMode {
  bool anti = false;
  data::UndampedMode mode;
};
std::vector<PlainMode> plain_modes(const DriveModel& model) {
  const auto& p = model.parameters;
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
  std::vector<std::complex<double>> result;
  result.reserve(frequencies_hz.size());
  detail::with_masses(structure, [&](auto masses) {
    const detail::MeasuredResponse<masses, double> measured(
        parameters, as_measured ? delay_s / sample_time_s : 0.0,
        as_measured ? known_delay_s / sample_time_s : 0.0, sample_time_s);
    for (const double f : frequencies_hz) {
      const auto g = measured(f);
      result.emplace_back(g.re, g.im);
    }
  });
  return result;
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
  const int order = order_of(structure);
  Eigen::MatrixXd a;
  Eigen::VectorXd b;
  detail::with_masses(structure, [&](auto masses) {
    const auto s = detail::hold(detail::continuous_drive<masses>(parameters), sample_time_s);
    a = s.a.topLeftCorner(order, order);
    b = s.b.head(order);
  });
  data::TransferFunction g{{0.0}, {1.0}, sample_time_s};
  // Faddeev-LeVerrier: adj(zI - A) and det(zI - A) in one recursion.
  Eigen::MatrixXd m = Eigen::MatrixXd::Identity(order, order);
  for (int k = 1; k <= order; ++k) {
    g.numerator.push_back((m * b)(0));
    const Eigen::MatrixXd am = a * m;
    const double coefficient = -am.trace() / k;
    g.denominator.push_back(coefficient);
    m = am;
    m.diagonal().array() += coefficient;
  }
  return g;
}

std::vector<data::Mode> DriveModel::modes() const {
  const auto values = plain_modes(*this);
  std::vector<data::Mode> result;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const auto frequency = [i](const DriveModel& m) { return plain_modes(m)[i].mode.frequency_hz; };
    const auto damping = [i](const DriveModel& m) { return plain_modes(m)[i].mode.damping_ratio; };
    result.push_back({values[i].anti,
                      {values[i].mode.frequency_hz, standard_deviation_of(frequency)},
                      {values[i].mode.damping_ratio, standard_deviation_of(damping)}});
  }
  return result;
}

data::Estimate DriveModel::resonance() const { return modes().at(1).frequency_hz; }

data::Estimate DriveModel::antiresonance() const { return modes().at(0).frequency_hz; }

std::vector<UncertainRoot> DriveModel::poles() const { return uncertain_roots(*this, false); }

std::vector<UncertainRoot> DriveModel::zeros() const { return uncertain_roots(*this, true); }

namespace detail {

std::array<double, kParameterCount> Coordinates::from(const DriveModel& model) const {
  const auto logarithm = [](double x) { return std::log(std::max(x, 1e-300)); };
  const auto& p = model.parameters;
  return {logarithm(p.driven_inertia), logarithm(p.load_inertia),         logarithm(p.stiffness),
          logarithm(p.damping),        p.viscous_friction / viscous_unit, model.delay_s / sample_time_s,
          logarithm(p.middle_inertia), logarithm(p.stiffness_2),          logarithm(p.damping_2)};
}

void Coordinates::store(const double* x, DriveModel& model) const {
  model.parameters = parameters(x, model.structure == Structure::three_mass);
  if (model.structure == Structure::rigid)
    model.parameters.load_inertia = model.parameters.stiffness = model.parameters.damping = 0.0;
  model.delay_s = x[kDelay] * sample_time_s;
}

std::array<double, kParameterCount> Coordinates::jacobian(const DriveModel& model) const {
  const auto& p = model.parameters;
  return {p.driven_inertia, p.load_inertia,   p.stiffness,   p.damping,  viscous_unit,
          sample_time_s,    p.middle_inertia, p.stiffness_2, p.damping_2};
}

}  // namespace detail
}  // namespace resonid::fit
