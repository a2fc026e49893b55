// SPDX-License-Identifier: MIT
#include "drive_bound.hpp"

#include <cmath>
#include <linalg/decompositions.hpp>

#include "experiments.hpp"

namespace resonid::test {

Eigen::Vector4d drive_parameters(const plant::ExperimentConfig& c) {
  const double square = c.drive.radius_m * c.drive.radius_m;
  return {c.drive.driven_inertia, c.drive.load_inertia, square * c.drive.stiffness, square * c.drive.damping};
}

Eigen::VectorXd drive_figures(const Eigen::Vector4d& p) {
  constexpr double kTurn = 6.283185307179586;
  Eigen::VectorXd f(kFigures);
  f << p, std::sqrt(p(2) * (1.0 / p(0) + 1.0 / p(1))) / kTurn, std::sqrt(p(2) / p(1)) / kTurn;
  return f;
}

Eigen::MatrixXd output_slopes(const plant::ExperimentConfig& c, const data::Record& record, bool at_rest) {
  const auto n = static_cast<Eigen::Index>(record.samples());
  const auto delay = static_cast<Eigen::Index>(std::lround(c.measurement.delay_s * record.sample_rate_hz));
  const auto sampled = [&](const plant::ExperimentConfig& moved) {
    auto brief = moved;
    brief.run.duration_s = 0.2;
    brief.excitation.kind = online::Kind::none;
    return simulated(brief, std::vector<double>{5.0}).truth.sampled;
  };
  // Columns: response to the input, to a constant, to each state.
  const auto responses = [&](const plant::ExperimentConfig& moved) {
    const auto s = sampled(moved);
    const auto states = s.a.rows();
    Eigen::MatrixXd x = Eigen::MatrixXd::Zero(states, 2 + states);
    x.rightCols(states).setIdentity();
    Eigen::MatrixXd out(n - delay, 2 + states);
    for (Eigen::Index k = 0; k + delay < n; ++k) {
      out.row(k) = s.velocity * x;
      x = (s.a * x).eval();
      x.col(0) += s.b * record.input.samples[static_cast<std::size_t>(k)];
      x.col(1) += s.b;
    }
    return out;
  };
  const Eigen::MatrixXd all = responses(c);
  const Eigen::MatrixXd nuisance = all.rightCols(at_rest ? 0 : all.cols() - 1);
  Eigen::MatrixXd slopes(n - delay, 4 + nuisance.cols());
  slopes.rightCols(nuisance.cols()) = nuisance;
  constexpr double kStep = 1e-4;
  for (int i = 0; i < 4; ++i) {
    auto up = c, down = c;
    double plant::DriveConfig::*const fields[] = {
        &plant::DriveConfig::driven_inertia, &plant::DriveConfig::load_inertia,
        &plant::DriveConfig::stiffness, &plant::DriveConfig::damping};
    up.drive.*fields[i] *= std::exp(kStep);
    down.drive.*fields[i] *= std::exp(-kStep);
    slopes.col(i) = (responses(up).col(0) - responses(down).col(0)) / (2.0 * kStep);
  }
  return slopes;
}

Eigen::MatrixXd figure_gradient(const plant::ExperimentConfig& c) {
  constexpr double kStep = 1e-4;
  const Eigen::Vector4d at = drive_parameters(c);
  Eigen::MatrixXd gradient(kFigures, 4);
  for (int i = 0; i < 4; ++i) {
    Eigen::Vector4d up = at, down = at;
    up(i) *= std::exp(kStep);
    down(i) *= std::exp(-kStep);
    gradient.col(i) =
        (drive_figures(up).array().log() - drive_figures(down).array().log()).matrix() / (2.0 * kStep);
  }
  return gradient;
}

Eigen::MatrixXd bound_of_logarithms(const plant::ExperimentConfig& c, const data::Record& record,
                                    bool at_rest) {
  const Eigen::MatrixXd slopes = output_slopes(c, record, at_rest);
  const Eigen::VectorXd size = slopes.colwise().norm().transpose().cwiseMax(1e-12);
  const Eigen::MatrixXd scaled = slopes * size.cwiseInverse().asDiagonal();
  const Eigen::MatrixXd inverse = size.cwiseInverse().asDiagonal() *
                                  linalg::pseudo_inverse(scaled.transpose() * scaled).matrix *
                                  size.cwiseInverse().asDiagonal();
  const double variance = c.measurement.noise_rms * c.measurement.noise_rms;
  const Eigen::MatrixXd gradient = figure_gradient(c);
  return variance * gradient * inverse.topLeftCorner(4, 4) * gradient.transpose();
}

Eigen::Matrix4d fisher_information_of_logarithms(const plant::ExperimentConfig& c,
                                                 const data::Record& record) {
  const Eigen::MatrixXd slopes = output_slopes(c, record);
  const Eigen::MatrixXd nuisance = slopes.rightCols(slopes.cols() - 4), own = slopes.leftCols(4);
  const Eigen::MatrixXd left = own - nuisance * (linalg::pseudo_inverse(nuisance).matrix * own);
  return left.transpose() * left / (c.measurement.noise_rms * c.measurement.noise_rms);
}

}  // namespace resonid::test
