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

/// Its output through f(k) = p f(k-1) + (1-p) v(k): one more state holds f(k-1).
SampledDrive filtered(const SampledDrive& drive, double pole) {
  SampledDrive result = with_output(drive, drive.velocity, 0.0);
  Eigen::RowVectorXd& row = result.velocity;
  const Eigen::Index state = drive.moving_states();
  row(state) = pole;
  row.head(state) = (1.0 - pole) * drive.velocity.head(state);
  result.a.row(state) = row;
  return result;
}

/// Its output held over n samples, in the mean over them: 0 ... n-1 samples late. One more state for each.
SampledDrive with_hold(const SampledDrive& drive, std::size_t samples) {
  const double share = 1.0 / static_cast<double>(samples);
  SampledDrive result = drive;
  Eigen::RowVectorXd last = drive.velocity;
  Eigen::RowVectorXd mean = share * drive.velocity;
  for (std::size_t i = 1; i < samples; ++i) {
    const Eigen::Index state = result.moving_states();
    result = with_output(result, last, 0.0);
    last = Eigen::RowVectorXd::Unit(result.a.rows(), state);
    Eigen::RowVectorXd wider = share * last;
    wider.head(state) = mean.head(state);
    mean = wider;
  }
  result.velocity = mean;
  return result;
}

/// The machine with the measured velocity as its output.
SampledDrive as_measured(SampledDrive drive, const VelocityPath& path) {
  if (path.source == VelocitySource::encoder) drive = by_difference(drive);
  if (path.filter_pole > 0.0) drive = filtered(drive, path.filter_pole);
  if (path.hold > 1) drive = with_hold(drive, path.hold);
  return drive;
}

/// 6000 frequencies in even ratio up to half the rate at which the loop gets new values.
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

Truth truth_of(const ExperimentConfig& config, const Drive& drive, const Controller& controller,
               std::span<const double> response_hz) {
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
  truth.coupling = bent_coupling(config.drive);
  truth.torque_lag_s = config.actuator.lag_s;
  const double rate = config.run.sample_rate_hz;
  const VelocityPath path = velocity_path(config.measurement, rate, controller.position_gain());
  truth.controller = controller.feedback(path.filter_pole);
  truth.output_filter_s = config.measurement.filter_s;
  truth.hold_samples = path.hold;
  truth.delay_s = config.measurement.delay_s;
  truth.friction = config.friction.driven;
  truth.load_friction = config.friction.load;
  truth.seed = config.run.seed;
  SampledDrive sampled = drive.sampled(drive.stiffness_factor());
  if (const auto law = controller.velocity_feedback())
    truth.loop =
        loop_response(sampled, split_delay(truth.delay_s, rate), path, *law,
                      loop_lines(path.position_gain > 0.0 ? rate : rate / static_cast<double>(path.hold)));
  sampled = as_measured(std::move(sampled), path);
  truth.plant = transfer_function(sampled);
  truth.response.frequency_hz = response_hz.empty()
                                    ? default_lines(config)
                                    : std::vector<double>(response_hz.begin(), response_hz.end());
  for (const double f : truth.response.frequency_hz) truth.response.value.push_back(response(sampled, f));
  truth.sampled = std::move(sampled);
  return truth;
}

}  // namespace resonid::plant
