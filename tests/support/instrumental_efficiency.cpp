// SPDX-License-Identifier: MIT
#include "instrumental_efficiency.hpp"

#include <Eigen/Cholesky>
#include <array>
#include <drive_loops.hpp>
#include <limits>

namespace resonid::test {

double resonance_bound_hz(const LoopRun& run, double noise, bool fixed_integrator) {
  using Vector = Eigen::Matrix<double, 6, 1>;
  const auto& u = run.simulation.record.input.samples;
  const auto& m = run.machine;
  std::array<double, 3> y{};
  std::array<Vector, 3> psi{Vector::Zero(), Vector::Zero(), Vector::Zero()};
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(6, 6);
  for (std::size_t k = 0; k < u.size(); ++k) {
    Vector slope;
    double newest = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t age = i + 1 + run.delay_samples;
      const double input = k >= age ? u[k - age] : 0.0;
      slope(static_cast<int>(i)) = input;
      slope(static_cast<int>(i) + 3) = -y[i];
      newest += m.b[i] * input - m.a[i] * y[i];
    }
    for (std::size_t i = 0; i < 3; ++i) slope -= m.a[i] * psi[i];
    information += slope * slope.transpose() / (noise * noise);
    y = {newest, y[0], y[1]};
    psi = {slope, psi[0], psi[1]};
  }
  const auto g = online::SampledModes<3>(m, run.sample_rate_hz()).resonance_gradient();
  Eigen::MatrixXd free = Eigen::MatrixXd::Identity(6, fixed_integrator ? 5 : 6);
  if (fixed_integrator) free(4, 3) = free(5, 4) = -1.0;  // b and c of A = (1 - z^-1) C
  const Eigen::VectorXd along = free.transpose() * Eigen::Map<const Vector>(g.data());
  return std::sqrt(along.dot((free.transpose() * information * free).ldlt().solve(along)));
}

Efficiency efficiency(double sample_rate_hz, std::uint64_t seeds, bool fixed_integrator) {
  constexpr double kNoise = 0.1;
  Efficiency e;
  double squares = 0.0, bounds = 0.0;
  const auto stiffer = run_loop([&] {
    auto c = constant_belt(sample_rate_hz, 0.0, 1, 1.0, 1.03);
    c.run.duration_s = 0.1;
    return c;
  }());
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    const auto run = run_loop(constant_belt(sample_rate_hz, kNoise, seed));
    auto config = instrumental(run);
    config.start = stiffer.machine;
    config.memory_samples = std::numeric_limits<double>::infinity();
    config.terms.fixed_integrator = fixed_integrator;
    auto iv = online::InstrumentalVariables<double, 3>::create(config).value();
    const auto& r = run.simulation.record;
    for (std::size_t k = 0; k < run.samples(); ++k)
      iv.step(r.excitation.samples[k], r.input.samples[k], r.output.samples[k]);
    const auto model = iv.model();
    const auto covariance = iv.covariance();
    const auto modes = online::SampledModes<3>(model, sample_rate_hz).resonances(covariance);
    const double error = resonance_hz(model, sample_rate_hz) - run.resonance_hz[0];
    const double bound = resonance_bound_hz(run, kNoise, fixed_integrator);
    squares += error * error;
    bounds += bound * bound;
    e.bound_percent = 100.0 * bound / run.resonance_hz[0];
    e.resonance_nees += error * error / (modes[0].std_hz * modes[0].std_hz);
    const int free = fixed_integrator ? 5 : 6;
    Eigen::VectorXd off(6);
    for (int i = 0; i < 3; ++i) {
      const auto j = static_cast<std::size_t>(i);
      off(i) = model.b[j] - run.machine.b[j];
      off(i + 3) = model.a[j] - run.machine.a[j];
    }
    const Eigen::MatrixXd claimed = covariance.topLeftCorner(free, free);
    e.parameter_nees += off.head(free).dot(claimed.ldlt().solve(off.head(free))) / free;
  }
  const auto count = static_cast<double>(seeds);
  e.ratio = std::sqrt(squares / bounds);
  e.resonance_nees /= count;
  e.parameter_nees /= count;
  return e;
}

}  // namespace resonid::test
