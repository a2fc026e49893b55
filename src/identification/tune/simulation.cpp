// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <resonid/base/error_text.hpp>
#include <resonid/identification/detail/tune_simulation.hpp>
#include <resonid/plant/detail/simulation_error.hpp>

#include "identification/tune/checks.hpp"
#include "identification/tune/law.hpp"

namespace resonid::identification {
namespace {

using plant::ControllerKind;
using plant::ExperimentConfig;
using plant::MotionKind;

constexpr double kStepAt = 0.05;  // of the run

plant::DriveConfig drive_config(const fit::DriveModel& m) {
  const auto& p = m.parameters;
  plant::DriveConfig drive;
  drive.structure = m.structure == fit::Structure::rigid      ? plant::Structure::rigid
                    : m.structure == fit::Structure::two_mass ? plant::Structure::two_mass
                                                              : plant::Structure::three_mass;
  drive.driven_inertia = p.driven_inertia;
  if (m.structure != fit::Structure::rigid) {
    drive.load_inertia = p.load_inertia;
    drive.stiffness = p.stiffness;
    drive.damping = p.damping;
    drive.load_viscous_friction = std::max(0.0, p.load_viscous_friction);
    drive.load_ground_stiffness = p.load_ground_stiffness;
  }
  if (m.structure == fit::Structure::three_mass) {
    drive.middle_inertia = p.middle_inertia;
    drive.stiffness_2 = p.stiffness_2;
    drive.damping_2 = p.damping_2;
  }
  drive.viscous_friction = std::max(0.0, p.viscous_friction);
  drive.motor_ground_stiffness = p.motor_ground_stiffness;
  return drive;
}

/// The law as the simulated drive runs it.
plant::ControllerConfig controller_config(const TunedController& c, const TuneOptions& options) {
  plant::ControllerConfig config;
  config.torque_limit = options.torque_limit.value_or(0.0);
  if (c.position_gain && c.gains) {
    config.kind = ControllerKind::cascade;
    config.gain = c.gains->kp;
    config.integral_time_s = c.gains->kp / c.gains->ki;
    config.position_gain = *c.position_gain;
    config.velocity_feedforward = 1.0;
    return config;
  }
  config.kind = ControllerKind::rst;
  config.r = c.feedback.denominator;
  config.s = c.feedback.numerator;
  config.t = config.s;
  if (!c.reference_numerator.empty()) config.t = c.reference_numerator;
  return config;
}

/// What the load does; the encoder there is as late as the velocity. A rigid machine is its own load.
std::vector<double> load_velocity(const data::Record& record) {
  if (!record.second_output.present()) return record.output.samples;
  const auto& position = record.second_output.samples;
  std::vector<double> velocity(position.size(), 0.0);
  for (std::size_t k = 1; k < position.size(); ++k)
    velocity[k] = (position[k] - position[k - 1]) * record.sample_rate_hz;
  if (velocity.size() > 1) velocity[0] = velocity[1];
  return velocity;
}

class Simulator {
 public:
  Simulator(Tuning& tuning, ExperimentConfig experiment) : t_(tuning), base_(std::move(experiment)) {
    base_.excitation = {};
    base_.measurement.noise_rms = 0.0;
    base_.measurement.second_output = base_.drive.structure == plant::Structure::rigid
                                          ? data::SecondOutput::none
                                          : data::SecondOutput::load_encoder;
    base_.measurement.second_noise = 0.0;
  }

  expected<void, Error> run() {
    if (std::abs(base_.run.sample_rate_hz * t_.sample_time_s - 1.0) > 0.01)
      return refuse("simulate", fmt::format("the experiment runs at {:g} Hz, the controller at {:g} Hz",
                                            base_.run.sample_rate_hz, 1.0 / t_.sample_time_s));
    if (auto done = runs_of(t_.proposed(), ""); !done) return done;
    if (!t_.running || t_.simulated.empty()) return {};
    return runs_of(*t_.running, " with the running controller");
  }

 private:
  expected<void, Error> runs_of(const TunedController& c, const std::string& with) {
    const bool cascade = c.position_gain.has_value();
    const double settling = settling_s();
    if (!cascade)
      if (auto done = one(c, "reference step" + with, reference_step(settling)); !done) return done;
    if (auto done = one(c, "load step" + with, load_step(settling)); !done) return done;
    const bool moves =
        base_.motion.kind == MotionKind::trapezoidal || base_.motion.kind == MotionKind::s_curve;
    if (!moves) return {};
    ExperimentConfig config = base_;
    config.run.duration_s = std::max(base_.run.duration_s, settling);
    return one(c, "motion of the experiment" + with, config);
  }

  /// Until the slower of both controllers has let go of all but a thousandth, so that their steps stand at
  /// one time; at most kLongest, and beyond kShort no more samples than a page can take.
  [[nodiscard]] double settling_s() {
    constexpr double kLeast = 0.1, kLongest = 60.0, kShort = 5.0, kSamples = 20'000.0;
    double longest = kLeast;
    const auto follow = [&](const TunedController& c) {
      if (!c.stable) return;
      const double decay = -std::log(std::clamp(c.spectral_radius, 0.1, 1.0 - 1e-12));
      longest = std::max(longest, std::log(1e3) / decay * t_.sample_time_s);
    };
    follow(t_.proposed());
    if (t_.running) follow(*t_.running);
    const double most = std::clamp(kSamples * t_.sample_time_s, kShort, kLongest);
    if (longest > most && !told_cut_) {
      t_.findings.push_back(
          {"simulation-cut", diagnostics::Severity::info, longest, most,
           fmt::format("The loop takes {:.3g} s to settle, and its steps are simulated for {:.3g} s: what "
                       "figures sum up until then, as IAE and settling, come out smaller than promised.",
                       longest, most)});
      told_cut_ = true;
    }
    return std::min(longest, most);
  }

  /// As steep as a sample allows.
  [[nodiscard]] ExperimentConfig reference_step(double settling) const {
    ExperimentConfig config = base_;
    const double step = t_.options.reference_step;
    config.disturbance = {};
    config.motion = {};
    config.motion.kind = MotionKind::trapezoidal;
    config.motion.velocity = step;
    config.motion.acceleration = step / t_.sample_time_s;
    config.motion.from = base_.motion.from;
    config.motion.to = base_.motion.from + 20.0 * step * settling;
    config.motion.wait_s = kStepAt * settling;
    config.run.duration_s = 2.0 * settling;
    return config;
  }

  /// While it turns, since at rest dry friction takes small torques.
  [[nodiscard]] ExperimentConfig load_step(double settling) const {
    ExperimentConfig config = base_;
    config.motion = {};
    config.motion.kind = MotionKind::constant;
    config.motion.velocity = t_.options.reference_step;
    config.motion.from = base_.motion.from;
    config.disturbance = {};
    config.disturbance.load_step = {-load_torque()};
    config.disturbance.load_step_at_s = {kStepAt * settling};
    config.run.duration_s = 2.0 * settling;
    return config;
  }

  [[nodiscard]] double load_torque() const {
    constexpr double kPart = 0.2;  // of the torque limit: what it takes remains within it
    return t_.options.torque_limit ? std::min(1.0, kPart * *t_.options.torque_limit) : 1.0;
  }

  expected<void, Error> one(const TunedController& c, const std::string& what, ExperimentConfig config) {
    config.controller = controller_config(c, t_.options);
    const auto simulation = plant::simulate_or_tell(config);
    if (!simulation) {
      const auto& error = simulation.error();
      if (!error.unstable) return tl::unexpected<Error>(error);
      t_.findings.push_back({"fails-in-simulation",
                             diagnostics::Severity::error,
                             {},
                             {},
                             fmt::format("{}: on the simulated drive the loop is unstable ({}).", what,
                                         error.requirement.view())});
      t_.trusted = t_.trusted && &c != &t_.proposed();
      return {};
    }
    const auto& record = simulation->record;
    SimulatedRun run;
    run.what = what;
    run.velocity = load_velocity(record);
    run.torque = record.input.samples;
    run.reference = record.reference.samples;
    for (std::size_t k = 0; k < record.samples(); ++k)
      run.time_s.push_back(static_cast<double>(k) / record.sample_rate_hz);
    put_figures(c, what, record.output.samples, run);
    if (&c == &t_.proposed()) compare(run);
    t_.simulated.push_back(std::move(run));
    return {};
  }

  /// What the linear design promises beside what came: friction, limits and another machine make it differ.
  void compare(const SimulatedRun& run) {
    constexpr double kPart = 0.3, kPoints = 10.0;
    for (const auto& figure : run.figures) {
      // What is summed up until it has settled is not all there after a cut.
      const bool cut = told_cut_ && (figure.name == "load_step_iae" || figure.name == "reference_settling_s");
      if (!figure.promised || cut) continue;
      const double room = figure.name == "reference_overshoot" ? kPoints : kPart * std::abs(*figure.promised);
      if (distance(figure) <= room + 5.0 * t_.sample_time_s) continue;
      t_.findings.push_back(
          {"simulation-differs", diagnostics::Severity::warning, figure.simulated, figure.promised,
           fmt::format(
               "{}: {} {:.3g} {} came, {:.3g} was promised: friction, the torque limit, or a drive that is "
               "not the identified one.",
               run.what, figure.name, figure.simulated, figure.unit, *figure.promised)});
      return;
    }
  }

  /// From what 95 % of the machines do: settling of a load that swings back to the very edge of its band
  /// jumps.
  [[nodiscard]] double distance(const SimulatedFigure& simulated) const {
    const auto* figure = t_.proposed().figure(simulated.name);
    double low = *simulated.promised, high = low;
    if (figure != nullptr && figure->low && figure->high && figure->value != 0.0) {
      low = std::min(low, low * *figure->low / figure->value);
      high = std::max(high, high * *figure->high / figure->value);
    }
    return std::max({0.0, low - simulated.simulated, simulated.simulated - high});
  }

  static void put(SimulatedRun& run, const TunedController& c, const char* name, double simulated,
                  double times = 1.0) {
    if (const auto* figure = c.figure(name))
      run.figures.push_back({name, figure->unit, figure->value * times, simulated});
  }

  void put_figures(const TunedController& c, const std::string& what, const std::vector<double>& motor,
                   SimulatedRun& run) const {
    const double peak = std::abs(*std::max_element(
        run.torque.begin(), run.torque.end(), [](double a, double b) { return std::abs(a) < std::abs(b); }));
    const double step = t_.options.reference_step;
    if (what.starts_with("reference")) {
      double overshoot = 0.0, settled = 0.0, begin = 0.0;
      for (std::size_t k = 0; k < run.velocity.size(); ++k) {
        if (!(run.reference[k] > 0.0)) begin = run.time_s[k];
        overshoot = std::max(overshoot, run.velocity[k] / step - 1.0);
        if (std::abs(run.velocity[k] / step - 1.0) > 0.02) settled = run.time_s[k] + t_.sample_time_s;
      }
      put(run, c, "reference_overshoot", 100.0 * overshoot);
      put(run, c, "reference_settling_s", std::max(0.0, settled - begin));
      put(run, c, "reference_peak_torque", peak);
    } else if (what.starts_with("load")) {
      // Of a cascade the motor's position counts, which leaves the course and comes back; the load stands off
      // by torque over stiffness.
      const auto& moved = c.position_gain ? motor : run.velocity;
      const double before = moved[1];
      double largest = 0.0, sum = 0.0, position = 0.0;
      for (const double v : moved) {
        position += t_.sample_time_s * (before - v);
        const double away = c.position_gain ? position : before - v;
        largest = std::max(largest, away);
        sum += t_.sample_time_s * std::abs(away);
      }
      put(run, c, "load_step_peak", largest, load_torque());
      put(run, c, "load_step_iae", sum, load_torque());
    } else {
      double worst = 0.0;
      for (std::size_t k = 0; k < run.velocity.size(); ++k)
        worst = std::max(worst, std::abs(run.reference[k] - run.velocity[k]));
      run.figures.push_back({"velocity_error", t_.units.velocity, {}, worst});
      run.figures.push_back({"peak_torque", t_.units.torque, {}, peak});
    }
  }

  Tuning& t_;
  ExperimentConfig base_;
  bool told_cut_ = false;
};

}  // namespace

ExperimentConfig experiment_of(const Result& result, const TuneOptions& options) {
  ExperimentConfig config;
  const auto& model = *result.model;
  config.drive = drive_config(model.drive);
  if (result.units.inertia == "kg") config.drive.motion = data::Motion::linear;
  if (model.coulomb_friction) config.friction.driven.coulomb = std::max(0.0, model.coulomb_friction->value);
  const auto& further = model.further_friction;
  if (further.breakaway) config.friction.driven.breakaway = further.breakaway->value;
  if (further.stribeck_velocity) config.friction.driven.stribeck_velocity = further.stribeck_velocity->value;
  if (further.load_coulomb) config.friction.load.coulomb = further.load_coulomb->value;
  config.actuator.lag_s = model.drive.torque_lag_s;
  config.measurement.delay_s = std::max(0.0, model.drive.known_delay_s + model.drive.delay_s);
  config.measurement.filter_s = model.drive.output_filter_s;
  config.measurement.hold_samples = hold_of(result);
  if (model.drive.velocity == fit::Velocity::differences)
    config.measurement.velocity = plant::VelocitySource::encoder;
  config.controller.torque_limit = options.torque_limit.value_or(0.0);
  config.run.sample_rate_hz = 1.0 / model.drive.sample_time_s;
  return config;
}

expected<void, Error> simulate_on(Tuning& tuning, const ExperimentConfig& experiment) {
  return Simulator(tuning, experiment).run();
}

void simulate_on_model(Tuning& tuning, const Result& result) {
  const auto done = simulate_on(tuning, experiment_of(result, tuning.options));
  if (!done)
    tuning.findings.push_back({"not-simulated",
                               diagnostics::Severity::info,
                               {},
                               {},
                               "The model cannot be simulated as it is: " + message_of(done.error()) + "."});
}

}  // namespace resonid::identification
