// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>

#include "plant/experiment_parts.hpp"
#include "plant/loop_poles.hpp"

namespace resonid::plant {
namespace {

std::vector<double> default_lines(const ExperimentConfig& config) {
  using online::Kind;
  const auto& e = config.excitation;
  if (e.kind == Kind::multisine || e.kind == Kind::stepped_sine) {
    const auto lines = e.lines_hz.hz();
    std::vector<double> f(lines.begin(), lines.end());
    std::sort(f.begin(), f.end());
    return f;
  }
  constexpr std::size_t kCount = 200;
  const double rate = config.run.sample_rate_hz;
  const bool silent = e.kind == Kind::none;
  const auto band = online::Excitation::create(e, rate)->band();
  const double low = silent ? 1e-3 * rate : band.low_hz;
  const double high = silent ? 0.45 * rate : band.high_hz;
  std::vector<double> f(kCount);
  for (std::size_t i = 0; i < kCount; ++i)
    f[i] = low * std::pow(high / low, static_cast<double>(i) / static_cast<double>(kCount - 1));
  return f;
}

/// The machine with one more state as its output: x'(k+1) = row x(k) + command u(k), an output of the sample
/// before.
SampledDrive with_output(const SampledDrive& drive, const Eigen::RowVectorXd& row, double command) {
  const Eigen::Index n = drive.moving_states();
  const Eigen::Index size =
      n + (drive.grounded ? 1 : 2);  // a free machine's angle comes last, acting on nothing
  SampledDrive result = drive;
  result.a = Eigen::MatrixXd::Zero(size, size);
  result.b = Eigen::VectorXd::Zero(size);
  result.a.topLeftCorner(n, n) = drive.a.topLeftCorner(n, n);
  result.b.head(n) = drive.b.head(n);
  result.a.row(n).head(n) = row.head(n);
  result.b(n) = command;
  result.velocity = Eigen::RowVectorXd::Unit(size, n);
  return result;
}

/// The machine with the mean velocity over the past sample as its output.
SampledDrive by_difference(const SampledDrive& drive) {
  const Eigen::Index angle = drive.a.rows() - 1;
  const Eigen::RowVectorXd way = drive.a.row(angle) - Eigen::RowVectorXd::Unit(angle + 1, angle);
  return with_output(drive, way / drive.sample_time_s, drive.b(angle) / drive.sample_time_s);
}

/// 6000 frequencies in even ratio up to half the sample rate.
std::vector<double> loop_lines(double sample_rate_hz) {
  constexpr std::size_t kLines = 6000;
  constexpr double kSpan = 5e4;  // highest to lowest
  std::vector<double> lines(kLines);
  for (std::size_t i = 0; i < kLines; ++i)
    lines[i] = 0.5 * sample_rate_hz *
               std::pow(kSpan, static_cast<double>(i + 1) / static_cast<double>(kLines) - 1.0);
  return lines;
}

}  // namespace

Truth truth_of(const ExperimentConfig& config, const Drive& drive,
               std::optional<data::TransferFunction> feedback, std::span<const double> response_hz) {
  Truth truth;
  truth.structure = config.drive.structure;
  truth.motion = config.drive.motion;
  const double factor = stiffness_factor(config.disturbance, 0.0);
  truth.system = mass_system(config.drive, factor, drive.place());
  if (truth.system.masses() == 2) {
    const Coupling& c = truth.system.couplings.front();
    truth.two_mass = {truth.system.inertia[0], truth.system.inertia[1], c.stiffness, c.damping,
                      truth.system.viscous[0]};
  }
  truth.resonances = resonances(truth.system);
  truth.antiresonances = antiresonances(truth.system);
  truth.torque_lag_s = config.actuator.lag_s;
  truth.controller = std::move(feedback);
  truth.delay_s = config.measurement.delay_s;
  truth.friction = config.friction.driven;
  truth.load_friction = config.friction.load;
  truth.seed = config.run.seed;
  SampledDrive sampled = drive.sampled(drive.stiffness_factor());
  if (truth.controller)
    truth.loop =
        loop_response(sampled, split_delay(truth.delay_s, config.run.sample_rate_hz),
                      config.measurement.velocity, *truth.controller, loop_lines(config.run.sample_rate_hz));
  if (config.measurement.velocity == VelocitySource::encoder) sampled = by_difference(sampled);
  truth.plant = transfer_function(sampled);
  truth.response.frequency_hz = response_hz.empty()
                                    ? default_lines(config)
                                    : std::vector<double>(response_hz.begin(), response_hz.end());
  for (const double f : truth.response.frequency_hz) truth.response.value.push_back(response(sampled, f));
  truth.sampled = std::move(sampled);
  return truth;
}

}  // namespace resonid::plant
