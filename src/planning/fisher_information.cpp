// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <resonid/base/constants.hpp>
#include <resonid/base/detail/polynomial.hpp>
#include <resonid/diagnostics/margins.hpp>
#include <resonid/planning/detail/fisher_information.hpp>

#include "linalg/decompositions.hpp"

namespace resonid::planning {
namespace {

using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kRelativeStep = 1e-4;  // of central differences: 1e-8 of error

/// Loop of model and controller on a grid as dense as margins need.
diagnostics::LoopMargins margins_of(const NominalDrive& drive) {
  constexpr int kPoints = 1200;
  const double rate = 1.0 / drive.model.sample_time_s;
  const double low = 1e-4 * rate, high = 0.499 * rate;
  data::FrequencyResponse loop;
  for (int i = 0; i < kPoints; ++i)
    loop.frequency_hz.push_back(low * std::pow(high / low, static_cast<double>(i) / (kPoints - 1)));
  loop.value = drive.model.values(loop.frequency_hz, true);
  for (std::size_t i = 0; i < loop.lines(); ++i) {
    const double f = loop.frequency_hz[i];
    loop.value[i] *= drive.controller->response(f) * std::polar(1.0, -kTwoPi * f * drive.model.known_delay_s);
  }
  return diagnostics::loop_margins(loop);
}

int parameter_of(std::string_view name) {
  for (int i = 0; i < fit::kParameterCount; ++i)
    if (fit::kParameterNames[static_cast<std::size_t>(i)] == name) return i;
  return -1;
}

/// Name of the number-th mode of its kind, as identification::figures() has it without its unit.
std::string mode_name(bool anti, int number) {
  return std::string(anti ? "anti" : "") + "resonance" + (number > 1 ? "_" + std::to_string(number) : "");
}

std::optional<double> mode_value(const fit::DriveModel& model, std::string_view name) {
  int seen[2] = {0, 0};
  for (const auto& mode : modes_of(model)) {
    const std::string own = mode_name(mode.anti, ++seen[mode.anti ? 1 : 0]);
    if (name == own) return mode.frequency_hz.value;
    if (name == own + "_damping") return mode.damping_ratio.value;
  }
  return {};
}

double value_of(const NominalDrive& drive, std::string_view name) {
  if (const int i = parameter_of(name); i >= 0) return drive.model.value(static_cast<fit::Parameter>(i));
  if (const auto mode = mode_value(drive.model, name)) return *mode;
  const auto margins = margins_of(drive);
  if (name == "crossover") return margins.crossover_hz().value_or(std::nan(""));
  if (name == "phase_margin") return margins.phase_margin_deg().value_or(std::nan(""));
  return margins.modulus_margin;
}

std::string unit_of(std::string_view name, bool linear) {
  const auto has = [&](std::string_view word) { return name.find(word) != std::string_view::npos; };
  if (has("resonance")) return has("damping") ? "" : "Hz";
  if (has("inertia")) return linear ? "kg" : "kgm2";
  if (has("stiffness")) return linear ? "N/m" : "Nm/rad";
  if (has("damping") || has("friction")) return linear ? "Ns/m" : "Nms/rad";
  if (name == "delay") return "s";
  if (name == "crossover") return "Hz";
  return name == "phase_margin" ? "deg" : "";
}

NominalDrive moved(const NominalDrive& drive, int parameter, double by) {
  NominalDrive other = drive;
  other.model = drive.model.moved(parameter, by);
  return other;
}

/// Derivatives of the measured response, unweighted. [parameter, line]
MatrixXcd response_gradients(const fit::DriveModel& model, std::span<const double> frequency_hz) {
  const auto parameters = estimated_of(model);
  MatrixXcd gradients(static_cast<Eigen::Index>(parameters.size()),
                      static_cast<Eigen::Index>(frequency_hz.size()));
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const double step = kRelativeStep * scale(model, parameters[i]);
    const auto plus = model.moved(parameters[i], step).values(frequency_hz, true);
    const auto minus = model.moved(parameters[i], -step).values(frequency_hz, true);
    for (std::size_t k = 0; k < frequency_hz.size(); ++k)
      gradients(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k)) =
          (plus[k] - minus[k]) / (2.0 * kRelativeStep);
  }
  return gradients;
}

/// Variance per sample at a frequency: innovation over |A|^2.
double noise_density(const fit::NoiseModel& noise, double cycles) {
  const auto a = polynomial(noise.polynomial, std::polar(1.0, -kTwoPi * cycles));
  return noise.innovation_variance / std::norm(a);
}

/// Of the drive itself, outside of the loop.
std::vector<double> measured_velocity(const fit::DriveModel& model, std::span<const double> torque,
                                      std::span<const double> start = {}) {
  return simulate({model, std::nullopt, {}}, torque, start).measured;
}

/// Columns d y/d parameter, then those of initial state and constant torque, whitened.
MatrixXd sensitivity_columns(const NominalDrive& drive, const std::vector<double>& torque) {
  const auto& model = drive.model;
  std::vector<std::vector<double>> columns;
  for (const int i : estimated_of(model)) {
    const double step = kRelativeStep * scale(model, i);
    auto plus = measured_velocity(model.moved(i, step), torque);
    const auto minus = measured_velocity(model.moved(i, -step), torque);
    for (std::size_t k = 0; k < plus.size(); ++k) plus[k] = (plus[k] - minus[k]) / (2.0 * kRelativeStep);
    columns.push_back(std::move(plus));
  }
  const std::vector<double> none(torque.size(), 0.0), constant(torque.size(), 1.0);
  for (std::size_t i = 0; i < states_of(model); ++i) {
    std::vector<double> start(states_of(model), 0.0);
    start[i] = 1.0;
    columns.push_back(measured_velocity(model, none, start));
  }
  columns.push_back(measured_velocity(model, constant));
  for (auto& column : columns) column = fit::whiten(column, drive.noise);
  MatrixXd x(static_cast<Eigen::Index>(columns.front().size()), static_cast<Eigen::Index>(columns.size()));
  for (std::size_t i = 0; i < columns.size(); ++i)
    x.col(static_cast<Eigen::Index>(i)) = Eigen::Map<const VectorXd>(columns[i].data(), x.rows());
  return x;
}

}  // namespace

std::vector<int> estimated_of(const fit::DriveModel& model) {
  std::vector<int> list;
  for (int i = 0; i < fit::kParameterCount; ++i)
    if (model.estimated[static_cast<std::size_t>(i)]) list.push_back(i);
  return list;
}

double scale(const fit::DriveModel& model, int parameter) {
  if (parameter == fit::kDelay) return model.sample_time_s;
  if (parameter == fit::kViscousFriction || parameter == fit::kLoadViscousFriction) {
    const auto modes = modes_of(model);
    const double pace =
        modes.empty() ? 0.01 / model.sample_time_s : kTwoPi * modes.front().frequency_hz.value;
    return model.parameters.driven_inertia * pace;
  }
  return model.value(static_cast<fit::Parameter>(parameter));
}

std::vector<std::string> figure_names(const NominalDrive& drive) {
  std::vector<std::string> names;
  for (const int i : estimated_of(drive.model))
    names.emplace_back(fit::kParameterNames[static_cast<std::size_t>(i)]);
  const auto pairs = static_cast<int>(modes_of(drive.model).size() / 2);
  for (int number = 1; number <= pairs; ++number)
    for (const char* ending : {"", "_damping"})
      for (const bool anti : {false, true}) names.push_back(mode_name(anti, number) + ending);
  if (drive.controller) {
    const auto margins = margins_of(drive);
    if (margins.crossover_hz()) names.insert(names.end(), {"crossover", "phase_margin"});
    names.emplace_back("modulus_margin");
  }
  return names;
}

std::vector<Figure> figures_of(const NominalDrive& drive, const std::vector<std::string>& names,
                               bool linear_motion) {
  std::vector<Figure> figures;
  const auto wanted = names.empty() ? figure_names(drive) : names;
  const MatrixXd gradients = figure_gradients(drive, wanted);
  const auto parameters = estimated_of(drive.model);
  for (std::size_t f = 0; f < wanted.size(); ++f) {
    double variance = 0.0;
    for (std::size_t i = 0; i < parameters.size(); ++i)
      for (std::size_t j = 0; j < parameters.size(); ++j)
        variance += gradients(static_cast<Eigen::Index>(f), static_cast<Eigen::Index>(i)) *
                    gradients(static_cast<Eigen::Index>(f), static_cast<Eigen::Index>(j)) *
                    drive.model.covariance(parameters[i], parameters[j]) / scale(drive.model, parameters[i]) /
                    scale(drive.model, parameters[j]);
    const double deviation = std::isfinite(variance) ? std::sqrt(std::max(0.0, variance))
                                                     : std::numeric_limits<double>::infinity();
    figures.push_back({wanted[f], unit_of(wanted[f], linear_motion), value_of(drive, wanted[f]), deviation});
  }
  return figures;
}

MatrixXd figure_gradients(const NominalDrive& drive, const std::vector<std::string>& names) {
  const auto parameters = estimated_of(drive.model);
  MatrixXd gradients(static_cast<Eigen::Index>(names.size()), static_cast<Eigen::Index>(parameters.size()));
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const double step = kRelativeStep * scale(drive.model, parameters[i]);
    const NominalDrive plus = moved(drive, parameters[i], step), minus = moved(drive, parameters[i], -step);
    for (std::size_t f = 0; f < names.size(); ++f)
      gradients(static_cast<Eigen::Index>(f), static_cast<Eigen::Index>(i)) =
          (value_of(plus, names[f]) - value_of(minus, names[f])) / (2.0 * kRelativeStep);
  }
  return gradients;
}

MatrixXcd line_sensitivities(const NominalDrive& drive, std::span<const double> frequency_hz) {
  MatrixXcd lines = response_gradients(drive.model, frequency_hz);
  const auto loop = loop_response(drive, frequency_hz);
  for (std::size_t k = 0; k < frequency_hz.size(); ++k)
    lines.col(static_cast<Eigen::Index>(k)) *=
        loop.torque[k] / std::sqrt(noise_density(drive.noise, frequency_hz[k] * drive.model.sample_time_s));
  return lines;
}

MatrixXd fisher_information_of_noise(const NominalDrive& drive) {
  const auto n = static_cast<Eigen::Index>(estimated_of(drive.model).size());
  MatrixXd fisher = MatrixXd::Zero(n, n);
  if (!drive.controller) return fisher;
  constexpr int kPoints = 4000;
  std::vector<double> f;
  for (int i = 0; i < kPoints; ++i) f.push_back(0.5 * (i + 0.5) / kPoints / drive.model.sample_time_s);
  const auto loop = loop_response(drive, f);
  const MatrixXcd gradients = response_gradients(drive.model, f);
  for (int i = 0; i < kPoints; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const double gain = std::norm(drive.controller->response(f[k]) * loop.torque[k]);
    fisher += gain / kPoints * (gradients.col(i).conjugate() * gradients.col(i).transpose()).real();
  }
  return fisher;
}

double torque_of_noise(const NominalDrive& drive) {
  if (!drive.controller) return 0.0;
  constexpr int kPoints = 4000;
  std::vector<double> f;
  for (int i = 0; i < kPoints; ++i) f.push_back(0.5 * (i + 0.5) / kPoints / drive.model.sample_time_s);
  const auto loop = loop_response(drive, f);
  double variance = 0.0;
  for (std::size_t k = 0; k < f.size(); ++k)
    variance += std::norm(drive.controller->response(f[k]) * loop.torque[k]) *
                noise_density(drive.noise, f[k] * drive.model.sample_time_s) / kPoints;
  return std::sqrt(variance);
}

FisherInformation fisher_information(const NominalDrive& drive, std::span<const double> excitation,
                                     const MatrixXd& noise) {
  const MatrixXd x = sensitivity_columns(drive, simulate(drive, excitation).torque);
  return {x.transpose() * x / drive.noise.innovation_variance, static_cast<double>(x.rows()) * noise};
}

MatrixXd FisherInformation::covariance(double amplitude) const {
  const Eigen::Index n = noise.rows(), all = excitation.rows();
  MatrixXd fisher = excitation;
  fisher.topRows(n) *= amplitude;
  fisher.leftCols(n) *= amplitude;
  fisher.topLeftCorner(n, n) += noise;
  // Columns of very different size: scaled to a unit diagonal before the inversion.
  const VectorXd size = fisher.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const MatrixXd scaled = size.asDiagonal() * fisher * size.asDiagonal();
  const linalg::RealLdlt factors(scaled);
  // What the record does not tell has no error bar at all; a 0 would promise a perfect one.
  const bool told =
      fisher.diagonal().head(n).minCoeff() > 0.0 && factors.succeeded() && factors.d().minCoeff() > 1e-15;
  if (!told) return MatrixXd::Constant(n, n, std::numeric_limits<double>::infinity());
  const MatrixXd inverse =
      size.asDiagonal() * factors.solve(MatrixXd::Identity(all, all)) * size.asDiagonal();
  return inverse.topLeftCorner(n, n);
}

NominalDrive predicted(const NominalDrive& drive, std::span<const double> excitation) {
  return with_covariance(
      drive, fisher_information(drive, excitation, fisher_information_of_noise(drive)).covariance());
}

NominalDrive with_covariance(const NominalDrive& drive, const MatrixXd& covariance) {
  const auto parameters = estimated_of(drive.model);
  NominalDrive result = drive;
  result.model.covariance.setZero();
  for (std::size_t i = 0; i < parameters.size(); ++i)
    for (std::size_t j = 0; j < parameters.size(); ++j) {
      const int a = parameters[i], b = parameters[j];
      result.model.covariance(a, b) = covariance(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) *
                                      scale(drive.model, a) * scale(drive.model, b);
    }
  return result;
}

}  // namespace resonid::planning
