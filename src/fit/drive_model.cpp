// SPDX-License-Identifier: MIT
#include <algorithm>
#include <fit/sampled_drive.hpp>
#include <resonid/fit/drive_model.hpp>
#include <vector>

namespace resonid::fit {

ParameterMask estimated_parameters(Structure structure, bool viscous_friction, bool delay) {
  const bool two = structure == Structure::two_mass;
  return {true, two, two, two, viscous_friction, delay};
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
    default:
      return model.delay_s;
  }
}

LinearSystem<double, detail::kStates> held(const DriveModel& model) {
  return detail::hold(detail::continuous_drive(model.structure, model.parameters), model.sample_time_s);
}

}  // namespace

double DriveModel::value(Parameter parameter) const {
  DriveModel copy = *this;
  return reference(copy, parameter);
}

Estimate DriveModel::estimate(Parameter parameter) const {
  return {value(parameter),
          std::sqrt(covariance(parameter, parameter) < 0.0 ? 0.0 : covariance(parameter, parameter))};
}

DriveModel DriveModel::moved(int parameter, double by) const {
  DriveModel copy = *this;
  reference(copy, parameter) += by;
  return copy;
}

std::complex<double> DriveModel::response(double frequency_hz) const {
  const auto g = detail::velocity_response(structure, held(*this), frequency_hz, sample_time_s);
  return {g.re, g.im};
}

std::vector<std::complex<double>> DriveModel::values(std::span<const double> frequencies_hz,
                                                     bool as_measured) const {
  const detail::MeasuredResponse<double> measured(
      structure, parameters, as_measured ? delay_s / sample_time_s : 0.0,
      as_measured ? known_delay_s / sample_time_s : 0.0, sample_time_s);
  std::vector<std::complex<double>> result;
  result.reserve(frequencies_hz.size());
  for (const double f : frequencies_hz) {
    const auto g = measured(f);
    result.emplace_back(g.re, g.im);
  }
  return result;
}

data::FrequencyResponse DriveModel::response(std::span<const double> frequencies_hz) const {
  data::FrequencyResponse result;
  result.frequency_hz.assign(frequencies_hz.begin(), frequencies_hz.end());
  const auto evaluate = [&](const DriveModel& model) { return model.values(frequencies_hz); };
  result.value = evaluate(*this);
  // E|dG|^2 = g^H P g with the complex gradient g over the parameters.
  std::array<std::vector<std::complex<double>>, kParameterCount> gradient;
  for (int i = 0; i < kDelay; ++i) {
    const double step = 1e-5 * std::max(std::abs(value(static_cast<Parameter>(i))),
                                        std::sqrt(std::max(0.0, covariance(i, i))));
    if (!estimated[static_cast<std::size_t>(i)] || step <= 0.0) continue;
    auto plus = evaluate(moved(i, step));
    const auto minus = evaluate(moved(i, -step));
    for (std::size_t k = 0; k < plus.size(); ++k) plus[k] = (plus[k] - minus[k]) / (2.0 * step);
    gradient[static_cast<std::size_t>(i)] = std::move(plus);
  }
  for (std::size_t k = 0; k < frequencies_hz.size(); ++k) {
    double variance = 0.0;
    for (int i = 0; i < kDelay; ++i)
      for (int j = 0; j < kDelay; ++j) {
        const auto& gi = gradient[static_cast<std::size_t>(i)];
        const auto& gj = gradient[static_cast<std::size_t>(j)];
        if (!gi.empty() && !gj.empty()) variance += covariance(i, j) * (std::conj(gi[k]) * gj[k]).real();
      }
    result.standard_deviation.push_back(std::sqrt(std::max(0.0, variance)));
  }
  return result;
}

data::TransferFunction DriveModel::transfer_function() const {
  const auto s = held(*this);
  const int order = structure == Structure::two_mass ? 3 : 1;
  const Eigen::MatrixXd a = s.a.topLeftCorner(order, order);
  const Eigen::VectorXd b = s.b.head(order);
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

Estimate DriveModel::resonance() const {
  const auto f = [](const DriveModel& m) { return data::resonance_hz(m.parameters); };
  return {f(*this), standard_deviation_of(f)};
}

Estimate DriveModel::antiresonance() const {
  const auto f = [](const DriveModel& m) { return data::antiresonance_hz(m.parameters); };
  return {f(*this), standard_deviation_of(f)};
}

namespace detail {

std::array<double, kParameterCount> Coordinates::from(const DriveModel& model) const {
  const auto logarithm = [](double x) { return std::log(std::max(x, 1e-300)); };
  const auto& p = model.parameters;
  return {logarithm(p.driven_inertia), logarithm(p.load_inertia),         logarithm(p.stiffness),
          logarithm(p.damping),        p.viscous_friction / viscous_unit, model.delay_s / sample_time_s};
}

void Coordinates::store(const double* x, DriveModel& model) const {
  model.parameters = parameters(x);
  if (model.structure == Structure::rigid)
    model.parameters.load_inertia = model.parameters.stiffness = model.parameters.damping = 0.0;
  model.delay_s = x[kDelay] * sample_time_s;
}

std::array<double, kParameterCount> Coordinates::jacobian(const DriveModel& model) const {
  const auto& p = model.parameters;
  return {p.driven_inertia, p.load_inertia, p.stiffness, p.damping, viscous_unit, sample_time_s};
}

}  // namespace detail
}  // namespace resonid::fit
