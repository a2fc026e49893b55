// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <resonid/plant/closed_loop.hpp>
#include <resonid/plant/experiment.hpp>
#include <resonid/plant/linear_drive.hpp>
#include <resonid/plant/white_noise.hpp>

namespace resonid::plant {
namespace {

constexpr double kMaxSamples = 1e8;
constexpr double kMaxDelaySamples = 1e6;
constexpr double kDiverged = 1e12;

std::vector<double> default_lines(const excitation::ExcitationConfig& config, const excitation::Band& band,
                                  double sample_rate_hz) {
  using excitation::Kind;
  if (config.kind == Kind::multisine || config.kind == Kind::stepped_sine) {
    const auto lines = config.lines_hz.hz();
    std::vector<double> f(lines.begin(), lines.end());
    std::sort(f.begin(), f.end());
    return f;
  }
  constexpr std::size_t kCount = 200;
  const bool silent = config.kind == Kind::none;
  const double low = silent ? 1e-3 * sample_rate_hz : band.low_hz;
  const double high = silent ? 0.45 * sample_rate_hz : band.high_hz;
  std::vector<double> f(kCount);
  for (std::size_t i = 0; i < kCount; ++i)
    f[i] = low * std::pow(high / low, static_cast<double>(i) / static_cast<double>(kCount - 1));
  return f;
}

template <int Order>
void describe_plant(const LinearSystem<double, Order>& continuous, double step, Truth& truth) {
  const auto sampled = zero_order_hold(continuous, step);
  truth.plant = transfer_function(sampled, step);
  for (const double f : truth.response.frequency_hz)
    truth.response.value.push_back(response(sampled, step, f));
}

Truth truth_of(const ExperimentConfig& config, const std::optional<data::TransferFunction>& controller,
               std::vector<double> response_hz) {
  Truth truth;
  truth.structure = config.drive.structure;
  truth.motion = config.drive.motion;
  truth.viscous_friction = config.drive.viscous_friction;
  truth.controller = controller;
  truth.delay_s = config.measurement.delay_s;
  truth.seed = config.run.seed;
  truth.response.frequency_hz = std::move(response_hz);
  const double step = 1.0 / config.run.sample_rate_hz;
  if (config.drive.structure == Structure::rigid) {
    truth.rigid_inertia = config.drive.driven_inertia;
    describe_plant(rigid_system(truth.rigid_inertia, truth.viscous_friction), step, truth);
  } else {
    truth.two_mass = at_driven_shaft(config.drive);
    describe_plant(data::continuous_system(*truth.two_mass), step, truth);
  }
  return truth;
}

data::Record empty_record(const ExperimentConfig& config, std::size_t samples, bool closed) {
  const bool rotary = config.drive.motion == data::Motion::rotary;
  data::Record record;
  record.source = "simulation";
  record.sample_rate_hz = config.run.sample_rate_hz;
  record.motion = config.drive.motion;
  record.excitation = {"ru", rotary ? "Nm" : "N", std::vector<double>(samples)};
  record.input = {"u", rotary ? "Nm" : "N", std::vector<double>(samples)};
  record.output = {"y", rotary ? "rad/s" : "m/s", std::vector<double>(samples)};
  if (closed)
    record.reference = {"r", rotary ? "rad/s" : "m/s", std::vector<double>(samples, config.run.reference)};
  return record;
}

/// The closed loop runs linear laws on r - y.
expected<void, ConfigError> check_runs(const ControllerConfig& c) noexcept {
  if (c.kind == ControllerKind::cascade || c.kind == ControllerKind::rst)
    return refuse("kind", "must be none, p, pi, pid or transfer-function in a simulated experiment");
  if (c.torque_limit > 0.0)
    return refuse("torque_limit", "must be 0 in a simulated experiment", c.torque_limit);
  if (c.velocity_limit > 0.0)
    return refuse("velocity_limit", "must be 0 in a simulated experiment", c.velocity_limit);
  return {};
}

expected<void, ConfigError> check_all(const ExperimentConfig& config) {
  if (const auto ok = check(config.drive); !ok) return ok;
  if (const auto ok = check(config.controller); !ok) return ok;
  if (const auto ok = check_runs(config.controller); !ok) return ok;
  if (const auto ok = check(config.measurement); !ok) return ok;
  if (const auto ok = check(config.run); !ok) return ok;
  const double delay = config.measurement.delay_s * config.run.sample_rate_hz;
  if (delay > kMaxDelaySamples)
    return refuse("delay_s", "must be at most 1e6 samples", config.measurement.delay_s);
  return {};
}

expected<std::size_t, ConfigError> length_of(const RunConfig& run, const excitation::Excitation& excitation) {
  const double samples = run.duration_s > 0.0 ? run.duration_s * run.sample_rate_hz
                                              : static_cast<double>(excitation.natural_length_samples());
  if (samples == 0.0) return refuse("duration_s", "must be given: the excitation has no length of its own");
  if (!(samples >= 1.5)) return refuse("duration_s", "must be at least two samples", run.duration_s);
  if (!(samples <= kMaxSamples)) return refuse("duration_s", "must be at most 1e8 samples", run.duration_s);
  return static_cast<std::size_t>(std::llround(samples));
}

}  // namespace

expected<void, ConfigError> check(const MeasurementConfig& c) noexcept {
  if (!(c.delay_s >= 0.0)) return refuse("delay_s", "must be >= 0", c.delay_s);
  if (!(c.noise_rms >= 0.0)) return refuse("noise_rms", "must be >= 0", c.noise_rms);
  return {};
}

expected<void, ConfigError> check(const RunConfig& c) noexcept {
  if (!(c.sample_rate_hz > 0.0)) return refuse("sample_rate_hz", "must be > 0", c.sample_rate_hz);
  if (!(c.duration_s >= 0.0)) return refuse("duration_s", "must be >= 0", c.duration_s);
  if (!std::isfinite(c.reference)) return refuse("reference", "must be finite", c.reference);
  return {};
}

expected<Simulation, ConfigError> simulate_closed_loop(const ExperimentConfig& config,
                                                       std::span<const double> response_hz) {
  if (const auto ok = check_all(config); !ok) return unexpected(ok.error());
  const double rate = config.run.sample_rate_hz;
  auto excitation = excitation::Excitation::create(config.excitation, rate);
  if (!excitation) return unexpected(excitation.error());
  const auto samples = length_of(config.run, *excitation);
  if (!samples) return unexpected(samples.error());
  for (const double f : response_hz)
    if (!(f > 0.0 && f <= 0.5 * rate))
      return refuse("response_hz", "must be > 0 and at most half the sample rate", f);

  const SampleDelay delay = split_delay(config.measurement.delay_s, rate);
  const auto law = Controller::create(config.controller, rate);
  if (!law) return unexpected(law.error());
  const auto controller = law->feedback();
  auto drive = make_drive(config.drive, rate, delay.fraction);
  if (!drive) return unexpected(drive.error());
  auto loop = ClosedLoop::create(std::move(*drive), controller, delay, config.run.reference);
  if (!loop) return unexpected(loop.error());

  WhiteNoise noise(config.run.seed, config.measurement.noise_rms);
  Simulation simulation;
  auto& record = simulation.record = empty_record(config, *samples, controller.has_value());
  for (std::size_t k = 0; k < *samples; ++k) {
    const double ru = excitation->step();
    const auto [u, y] = loop->step(ru, noise.step());
    if (!(std::abs(u) < kDiverged && std::abs(y) < kDiverged))
      return refuse("controller", "must hold the drive stable: the simulated loop diverges");
    record.excitation.samples[k] = ru;
    record.input.samples[k] = u;
    record.output.samples[k] = y;
  }
  simulation.truth =
      truth_of(config, controller,
               response_hz.empty() ? default_lines(config.excitation, excitation->band(), rate)
                                   : std::vector<double>(response_hz.begin(), response_hz.end()));
  return simulation;
}

}  // namespace resonid::plant
