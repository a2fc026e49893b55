// SPDX-License-Identifier: MIT
#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <limits>
#include <resonid/online/excitation/excitation.hpp>
#include <resonid/plant/closed_loop.hpp>
#include <resonid/plant/detail/measurement.hpp>

namespace resonid::plant {
namespace {

constexpr int kSamples = 16384;  // more than one journey of the cart there and back

/// Nanoseconds per sample of `step`, the least of many runs: what other processes take from the machine adds
/// to some runs, never takes away.
class Stopwatch {
 public:
  template <class Step>
  void time(Step&& step) {
    const auto start = std::chrono::steady_clock::now();
    for (int k = 0; k < kSamples; ++k) step();
    const std::chrono::duration<double, std::nano> taken = std::chrono::steady_clock::now() - start;
    least_ns_ = std::min(least_ns_, taken.count() / kSamples);
  }
  [[nodiscard]] double least_ns() const noexcept { return least_ns_; }

 private:
  double least_ns_ = std::numeric_limits<double>::infinity();
};

/// The bare state update x = A x + B u of a two-mass machine: velocities and twist.
class BareUpdate {
 public:
  explicit BareUpdate(const Drive& drive) {
    const SampledDrive sampled = drive.sampled(1.0);
    a_ = sampled.a.topLeftCorner<3, 3>();
    b_ = sampled.b.head<3>();
  }
  void step(double torque) noexcept { x_ = a_ * x_ + b_ * torque; }
  [[nodiscard]] const Eigen::Vector3d& state() const noexcept { return x_; }

 private:
  Eigen::Matrix3d a_;
  Eigen::Vector3d b_;
  Eigen::Vector3d x_ = Eigen::Vector3d::Zero();
};

struct Experiment {
  ClosedLoop loop;
  online::Excitation excitation;
  MeasurementNoise noise;
  BareUpdate bare;
};

ControllerConfig published_pi() {
  ControllerConfig c;
  c.kind = ControllerKind::pi;
  c.gain = 1.03598193204;
  c.integral_time_s = 0.147023908851;
  return c;
}

/// System 2 of Publication VI with its delay and noise.
Experiment linear(online::ExcitationConfig excitation) {
  constexpr double kRate = 500.0;
  const MachineConfig machine{
      {Structure::two_mass, data::Motion::rotary, 0.032, 0.032, 5.75e4, 120.0, 0.05}, {}, {}, 0.0};
  MeasurementConfig measurement;
  measurement.noise_rms = 0.1;
  auto drive = make_drive(machine, kRate, 0.0).value();
  BareUpdate bare(*drive);
  return {ClosedLoop(std::move(drive),
                     {Controller::create(published_pi(), kRate).value(), MotionProfile::create({}).value(),
                      split_delay(0.004, kRate), VelocitySource::sensor, 0.0, 0.0, 1.0, 1.0 / kRate}),
          online::Excitation::create(excitation, kRate).value(), MeasurementNoise(measurement, kRate, 1),
          bare};
}

Experiment linear_chirp() {
  online::ExcitationConfig e;
  e.kind = online::Kind::chirp;
  e.from_hz = 35.0;
  e.to_hz = 1.5;
  e.duration_s = 17.0;
  e.repeat = true;
  return linear(e);
}

Experiment linear_prbs() {
  online::ExcitationConfig e;
  e.kind = online::Kind::prbs;
  e.register_length = 17;
  return linear(e);
}

/// Tooth belt with friction, encoder, noise and limits, its excitation above breakaway.
Experiment tooth_belt(MotionConfig motion, DryFriction driven) {
  constexpr double kRate = 2000.0;
  MachineConfig machine;
  machine.drive.structure = Structure::tooth_belt;
  machine.drive.driven_inertia = 0.0028;
  machine.drive.cart_mass_kg = 6.7;
  machine.drive.radius_m = 0.0199;
  machine.drive.specific_stiffness_n = 3.764e5;
  machine.drive.quality = 10.0;
  machine.drive.upper_length_m = 1.7;
  machine.drive.lower_length_m = 2.14;
  machine.drive.stroke_from_m = 0.3;
  machine.drive.stroke_to_m = 1.68;
  machine.friction.driven = driven;
  machine.friction.load = {0.1, 0.15, 0.5};
  ControllerConfig controller;
  controller.kind = ControllerKind::cascade;
  controller.gain = 0.12;
  controller.integral_time_s = 0.2;
  controller.position_gain = 5.0;
  controller.velocity_feedforward = 1.0;
  controller.torque_limit = 10.0;
  online::ExcitationConfig e;
  e.kind = online::Kind::prbs;
  e.register_length = 10;
  MeasurementConfig measurement;
  measurement.noise_rms = 0.02;
  auto drive = make_drive(machine, kRate, 0.0).value();
  BareUpdate bare(*drive);
  return {ClosedLoop(std::move(drive),
                     {Controller::create(controller, kRate).value(), MotionProfile::create(motion).value(),
                      split_delay(0.0005, kRate), VelocitySource::encoder, kTwoPi / 8192.0, 0.0, 1.0 / 0.0199,
                      1.0 / kRate}),
          online::Excitation::create(e, kRate).value(), MeasurementNoise(measurement, kRate, 1), bare};
}

/// The cart goes to and fro over its stroke: friction turns twice in a journey.
Experiment tooth_belt_moving() {
  MotionConfig motion;
  motion.kind = MotionKind::trapezoidal;
  motion.velocity = 0.38;
  motion.acceleration = 2.0;
  motion.from = 0.38;
  motion.to = 1.6;
  motion.returns = true;
  return tooth_belt(motion, {0.3, 0.4, 0.5});
}
/// The cart stands: the excitation makes both sides stop, turn and break away all the time.
Experiment tooth_belt_reversing() {
  MotionConfig motion;
  motion.from = 1.0;
  return tooth_belt(motion, {0.3, 0.4, 0.5});
}
/// The cart stands, and friction holds the driven side.
Experiment tooth_belt_stuck() {
  MotionConfig motion;
  motion.from = 1.0;
  return tooth_belt(motion, {3.0, 4.0, 0.5});
}

/// Time per sample of the whole experiment, and as counters: of the bare update of the same run, and how many
/// times as much the experiment takes. Both take turns, so that a slow moment of the machine meets both.
void whole_over_bare(benchmark::State& state, Experiment experiment) {
  Stopwatch whole;
  Stopwatch bare;
  for (auto _ : state) {
    whole.time([&] {
      benchmark::DoNotOptimize(experiment.loop.step(experiment.excitation.step(), experiment.noise.step()));
    });
    bare.time([&] {
      experiment.bare.step(0.5);
      benchmark::DoNotOptimize(experiment.bare.state());
    });
  }
  state.counters["whole_ns"] = whole.least_ns();
  state.counters["bare_ns"] = bare.least_ns();
  state.counters["ratio"] = whole.least_ns() / bare.least_ns();
}
BENCHMARK_CAPTURE(whole_over_bare, linear_chirp, linear_chirp());
BENCHMARK_CAPTURE(whole_over_bare, linear_prbs, linear_prbs());
BENCHMARK_CAPTURE(whole_over_bare, tooth_belt_moving, tooth_belt_moving());
BENCHMARK_CAPTURE(whole_over_bare, tooth_belt_reversing, tooth_belt_reversing());
BENCHMARK_CAPTURE(whole_over_bare, tooth_belt_stuck, tooth_belt_stuck());

}  // namespace
}  // namespace resonid::plant
