// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "plant/experiment_parts.hpp"

namespace resonid::plant {
namespace {

constexpr double kMaxSamples = 1e8;
constexpr double kDiverged = 1e12;
constexpr std::uint64_t kSecondNoise = 0xd1b54a32d192ed03U;  // another sequence than that of the velocity
constexpr std::size_t kInstants = 1000;                      // of what changes over time

/// One encoder count at the driven side.
double encoder_count(const ExperimentConfig& c) {
  if (c.measurement.encoder_counts == 0.0) return 0.0;
  const bool linear = c.drive.motion == data::Motion::linear && c.drive.structure != Structure::tooth_belt;
  return (linear ? 1.0 : kTwoPi) / c.measurement.encoder_counts;
}

data::Record empty_record(const ExperimentConfig& config, std::size_t samples, const Controller& controller) {
  const bool rotary = config.drive.motion == data::Motion::rotary;
  const bool belt = config.drive.structure == Structure::tooth_belt;
  data::Record record;
  record.source = "simulation";
  record.sample_rate_hz = config.run.sample_rate_hz;
  record.motion = config.drive.motion;
  record.excitation = {"ru", rotary ? "Nm" : "N", std::vector<double>(samples)};
  record.input = {"u", rotary ? "Nm" : "N", std::vector<double>(samples)};
  record.output = {"y", rotary ? "rad/s" : "m/s", std::vector<double>(samples)};
  if (controller.closed()) record.reference = {"r", rotary ? "rad/s" : "m/s", std::vector<double>(samples)};
  if (belt || controller.uses_position())
    record.position = {"position", belt || !rotary ? "m" : "rad", std::vector<double>(samples)};
  record.second_output_kind = config.measurement.second_output;
  if (record.second_output_kind == data::SecondOutput::load_encoder)
    record.second_output = {"load_position", rotary ? "rad" : "m", std::vector<double>(samples)};
  if (record.second_output_kind == data::SecondOutput::load_accelerometer)
    record.second_output = {"load_acceleration", rotary ? "rad/s2" : "m/s2", std::vector<double>(samples)};
  return record;
}

expected<ClosedLoop> checked_loop(const ExperimentConfig& config, double duration_s) {
  const double rate = config.run.sample_rate_hz;
  const SampleDelay delay = split_delay(config.measurement.delay_s, rate);
  auto drive = make_drive(machine_of(config), rate, delay.fraction, duration_s);
  if (!drive) return unexpected(located("drive", drive.error()));
  auto controller = Controller::create(config.controller, rate);
  if (!controller) return unexpected(located("controller", controller.error()));
  const auto motion = MotionProfile::create(config.motion);
  if (!motion) return unexpected(located("motion", motion.error()));
  const bool belt = config.drive.structure == Structure::tooth_belt;
  const VelocityPath path = velocity_path(config.measurement, rate, 0.0);
  return ClosedLoop(std::move(*drive), {std::move(*controller), *motion, delay, config.measurement.velocity,
                                        encoder_count(config), config.actuator.torque_resolution,
                                        belt ? 1.0 / config.drive.radius_m : 1.0, 1.0 / rate,
                                        path.filter_pole, path.hold, config.measurement.second_output});
}

/// Follows what changes, at most kInstants times.
class Observer {
 public:
  Observer(const ExperimentConfig& config, std::size_t samples, const Machine& machine)
      : machine_(machine),
        belt_(config.drive.structure == Structure::tooth_belt),
        rate_hz_(config.run.sample_rate_hz),
        every_(machine.varies() ? std::max<std::size_t>(1, (samples + kInstants - 1) / kInstants) : 0) {}

  void sample(std::size_t k, const Drive& drive) {
    if (every_ == 0 || k % every_ != 0) return;
    const double time_s = static_cast<double>(k) / rate_hz_;
    const double factor = machine_.factor(time_s, drive.place());
    seen_.time_s.push_back(time_s);
    seen_.resonance_hz.push_back(resonances(machine_.system(factor)).front().frequency_hz);
    if (belt_) seen_.position_m.push_back(drive.place());
  }
  [[nodiscard]] std::optional<OverTime> seen() && {
    return every_ == 0 ? std::nullopt : std::optional<OverTime>(std::move(seen_));
  }

 private:
  const Machine& machine_;
  bool belt_;
  double rate_hz_;
  std::size_t every_;
  OverTime seen_;
};

SimulationError diverged(bool closed) {
  if (closed) return {{"controller", "must hold the drive stable: the simulated loop diverges"}, true};
  return {{"excitation", "must keep torque and velocity below 1e12"}};
}

Error out_of_stroke(const ExperimentConfig& config, double time_s, double place) {
  return {
      place < config.drive.stroke_from_m ? "drive.stroke_from_m" : "drive.stroke_to_m",
      fmt::format("must hold the cart: it leaves its stroke, {:g} ... {:g} m, after {:.4g} s, at {:.4g} m",
                  config.drive.stroke_from_m, config.drive.stroke_to_m, time_s, place)};
}

}  // namespace

expected<void, Error> check(const RunConfig& c) noexcept {
  if (!(c.sample_rate_hz > 0.0)) return refuse("sample_rate_hz", "must be > 0", c.sample_rate_hz);
  if (!(c.duration_s >= 0.0)) return refuse("duration_s", "must be >= 0", c.duration_s);
  return {};
}

expected<std::size_t> length_of(const ExperimentConfig& config) {
  const RunConfig& run = config.run;
  const auto excitation = online::Excitation::create(config.excitation, run.sample_rate_hz);
  const double samples = run.duration_s > 0.0 ? run.duration_s * run.sample_rate_hz
                                              : static_cast<double>(excitation->natural_length_samples());
  const auto refused = [&](const char* requirement, double value) {
    return unexpected(located("run", {"duration_s", requirement, value}));
  };
  if (samples == 0.0) return refused("must be given: the excitation has no length of its own", std::nan(""));
  if (!(samples >= 1.5)) return refused("must be at least two samples", run.duration_s);
  if (!(samples <= kMaxSamples)) return refused("must be at most 1e8 samples", run.duration_s);
  return static_cast<std::size_t>(std::llround(samples));
}

expected<ClosedLoop> make_loop(const ExperimentConfig& config) {
  if (const auto ok = check(config); !ok) return unexpected(ok.error());
  return checked_loop(config, static_cast<double>(*length_of(config)) / config.run.sample_rate_hz);
}

expected<Simulation> simulate_closed_loop(const ExperimentConfig& config,
                                          std::span<const double> response_hz) {
  auto simulation = simulate_or_tell(config, response_hz);
  if (!simulation) return unexpected<Error>(simulation.error());
  return *std::move(simulation);
}

expected<Simulation, SimulationError> simulate_or_tell(const ExperimentConfig& config,
                                                       std::span<const double> response_hz) {
  if (const auto ok = checked(config); !ok) return unexpected(ok.error());
  const auto told = [](const Error& error) { return unexpected(SimulationError{error}); };
  const double rate = config.run.sample_rate_hz;
  for (const double f : response_hz)
    if (!(f > 0.0 && f <= 0.5 * rate))
      return told(located("run", {"response_hz", "must be > 0 and at most half the sample rate", f}));
  const std::size_t samples = *length_of(config);
  auto loop = checked_loop(config, static_cast<double>(samples) / rate);
  if (!loop) return told(loop.error());

  auto excitation = *online::Excitation::create(config.excitation, rate);
  const Controller controller = *Controller::create(config.controller, rate);
  const Machine machine(machine_of(config), static_cast<double>(samples) / rate);
  MeasurementNoise noise(config.measurement, rate, config.run.seed);
  WhiteNoise second_noise(config.run.seed ^ kSecondNoise, config.measurement.second_noise);
  Observer observer(config, samples, machine);
  Simulation simulation;
  simulation.truth = truth_of(config, loop->drive(), controller, response_hz);
  auto& record = simulation.record = empty_record(config, samples, controller);
  const bool belt = config.drive.structure == Structure::tooth_belt;
  for (std::size_t k = 0; k < samples; ++k) {
    observer.sample(k, loop->drive());
    const double ru = excitation.step();
    const ClosedLoop::Sample s = loop->step(ru, noise.step());
    if (!(std::abs(s.input) < kDiverged && std::abs(s.output) < kDiverged))
      return unexpected(diverged(controller.closed()));
    if (belt && !(s.place >= config.drive.stroke_from_m - 1e-3 && s.place <= config.drive.stroke_to_m + 1e-3))
      return told(out_of_stroke(config, static_cast<double>(k) / rate, s.place));
    record.excitation.samples[k] = ru;
    record.input.samples[k] = s.input;
    record.output.samples[k] = s.output;
    if (record.reference.present()) record.reference.samples[k] = s.reference;
    if (record.position.present()) record.position.samples[k] = s.place;
    if (record.second_output.present()) record.second_output.samples[k] = s.second + second_noise.step();
  }
  simulation.truth.over_time = std::move(observer).seen();
  return simulation;
}

}  // namespace resonid::plant
