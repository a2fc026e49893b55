// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Cholesky>
#include <drive_bound.hpp>
#include <resonid/fit/output_error.hpp>
#include <resonid/io/shipped_experiments.hpp>
#include <resonid/plant/detail/white_noise.hpp>
#include <resonid/response/welch.hpp>

namespace resonid::test {

/// Relative rms of the response, 2 ... 33 Hz, mean over the seeds, and the mean squared distance of (J1, J2,
/// K, D) from the truth in their covariance, as logarithms: 4 if the error bars hold.
struct TightLoopErrors {
  double joint = 0.0, direct = 0.0, distance = 0.0;
};

/// Publication VI's PRBS in noise of 1 rad/s under three times the gain, with `input_noise` (Nm, rms) on the
/// recorded torque, which the drive does not feel: the joint fit against direct spectra.
inline TightLoopErrors joint_in_tight_loop(double input_noise, std::uint64_t first, int seeds) {
  auto c = io::shipped_experiment("vi_prbs_a");
  c.measurement.noise_rms = 1.0;
  c.controller.gain *= 3.0;
  std::vector<double> grid;
  for (double f = 2.0; f <= 33.0; f += 1.0) grid.push_back(f);
  TightLoopErrors mean;
  for (int i = 0; i < seeds; ++i) {
    c.run.seed = first + static_cast<std::uint64_t>(i);
    auto s = simulated(c, grid);
    plant::WhiteNoise noise(1000 + c.run.seed, input_noise);
    for (double& u : s.record.input.samples) u += noise.step();
    const auto rms = [&](auto&& value) {
      double sum = 0.0;
      for (std::size_t k = 0; k < grid.size(); ++k)
        sum += std::norm(value(k) / s.truth.response.value[k] - 1.0) / static_cast<double>(grid.size());
      return std::sqrt(sum) / seeds;
    };
    response::WelchConfig segments;
    segments.segment_samples = 1024;
    response::ResponseOptions spectra;
    spectra.approach = Approach::direct;
    spectra.delay_s = c.measurement.delay_s;
    const auto welch = response::welch(s.record, segments, spectra);
    mean.direct += rms([&](std::size_t k) { return welch->at(grid[k]); });
    fit::OutputErrorConfig config;
    config.initial.parameters = {0.038, 0.027, 160.0, 0.4, 0.0};
    config.known_delay_s = c.measurement.delay_s;
    config.predictor = fit::Predictor::joint;
    const auto fit = fit::fit_output_error(s.record, config);
    if (!fit || !fit->converged) {
      ADD_FAILURE() << "no fit for seed " << c.run.seed;
      continue;
    }
    const auto values = fit->model.values(grid);
    mean.joint += rms([&](std::size_t k) { return values[k]; });
    const auto truth = drive_parameters(c);
    Eigen::Vector4d apart;
    Eigen::Matrix4d covariance;
    for (int p = 0; p < 4; ++p) {
      const double value = fit->model.value(static_cast<fit::Parameter>(p));
      apart(p) = std::log(value / truth(p));
      for (int q = 0; q < 4; ++q)
        covariance(p, q) =
            fit->model.covariance(p, q) / (value * fit->model.value(static_cast<fit::Parameter>(q)));
    }
    mean.distance += apart.dot(covariance.ldlt().solve(apart)) / seeds;
  }
  return mean;
}

}  // namespace resonid::test
