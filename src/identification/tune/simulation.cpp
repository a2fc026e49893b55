// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <resonid/base/error_text.hpp>
#include <resonid/identification/tune.hpp>
#include <resonid/plant/detail/simulation_error.hpp>
#include <resonid/plant/experiment.hpp>

#include "design/feed_forward.hpp"
#include "identification/tune/checks.hpp"
#include "identification/tune/figure_values.hpp"
#include "identification/tune/law.hpp"
#include "identification/tune/simulated_differences.hpp"

namespace resonid::identification {
namespace {

using plant::ControllerKind;
using plant::ExperimentConfig;
using plant::MotionKind;

constexpr double kStepAt = 0.05;        // of the run
constexpr double kLeastSettling = 0.1;  // s

double total_inertia(const fit::DriveModel& m) {
  const auto& p = m.parameters;
  double total = p.driven_inertia;
  if (m.structure != fit::Structure::rigid) total += p.load_inertia;
  if (m.structure == fit::Structure::three_mass) total += p.middle_inertia;
  return total;
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
    if (const auto& f = c.feed_forward) {
      config.acceleration_feedforward = f->inertia;
      config.viscous_feedforward = f->viscous;
      config.coulomb_feedforward = f->coulomb;
      config.reference_delay_s = f->delay_s;
    }
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
    if (auto same = check_motion(); !same) return same;
    if (const double most = most_settling_in_stroke(); most < kLeastSettling) {
      const auto& d = base_.drive;
      const double least_s = 2.0 * kLeastSettling + further_s();
      return refuse(
          "reference_step",
          fmt::format("must be at most {:.3g} {} on the simulated tooth belt: within the {:.3g} s of "
                      "a step its cart would leave its stroke, {:g} ... {:g} m",
                      room() / least_s, t_.units.velocity, least_s, d.stroke_from_m, d.stroke_to_m),
          t_.options.reference_step);
    }
    if (auto done = runs_of(t_.proposed(), ""); !done) return done;
    feed_forward_runs();
    if (!t_.running || t_.simulated.empty()) return {};
    return runs_of(*t_.running, " with the running controller");
  }

 private:
  /// A shaft is not simulated by an axis, whose numbers mean something else; a tooth belt is told at its
  /// shaft.
  [[nodiscard]] expected<void, Error> check_motion() const {
    const bool linear = t_.units.inertia == "kg";
    const bool is_axis = !is_belt() && base_.drive.motion == data::Motion::linear;
    if ((!linear && t_.units.inertia != "kgm2") || linear == is_axis) return {};
    return refuse("simulate", fmt::format("the experiment's drive is {}, the result's {} ({}): required an "
                                          "experiment of the same motion",
                                          is_axis ? "linear" : "rotary", linear ? "linear" : "rotary",
                                          t_.units.velocity));
  }

  expected<void, Error> runs_of(const TunedController& c, const std::string& with) {
    const bool cascade = c.position_gain.has_value();
    const double settling = settling_s();
    if (!cascade)
      if (auto done = one(c, "reference step" + with, reference_step(settling)); !done) return done;
    if (!cascade && &c == &t_.proposed() && shaper() != nullptr)
      if (auto done = one(c, "reference step through the shaper", shaped_step(settling)); !done) return done;
    if (auto done = one(c, "load step" + with, load_step(settling)); !done) return done;
    const bool moves =
        base_.motion.kind == MotionKind::trapezoidal || base_.motion.kind == MotionKind::s_curve;
    if (!moves) return own_motion(c, "motion" + with, settling);
    ExperimentConfig config = base_;
    config.run.duration_s = std::max(base_.run.duration_s, settling);
    return one(c, "motion of the experiment" + with, config);
  }

  /// Where the drive cannot make it, the steps have to do.
  expected<void, Error> own_motion(const TunedController& c, const std::string& what, double settling) {
    if (const auto done = one(c, what, motion(settling)); !done)
      t_.findings.push_back({"not-simulated",
                             diagnostics::Severity::info,
                             {},
                             {},
                             "A motion cannot be simulated: " + message_of(done.error()) + "."});
    return {};
  }

  /// [motion unit per shaft unit] A tooth belt's motion is that of its cart, m and m/s, and everything else
  /// here that of the shaft.
  [[nodiscard]] double motion_unit() const { return is_belt() ? base_.drive.radius_m : 1.0; }
  [[nodiscard]] bool is_belt() const { return base_.drive.structure == plant::Structure::tooth_belt; }

  /// What the cart may go beyond the reference's way: a load step pushes it by no more than its IAE, a
  /// cascade by its peak.
  [[nodiscard]] double aside_m() const {
    constexpr double kLeast = 0.01, kMost = 0.45;  // of the stroke
    const double stroke = base_.drive.stroke_to_m - base_.drive.stroke_from_m;
    double aside = kLeast * stroke;
    const auto include = [&](const TunedController& c) {
      const auto* pushed = c.figure(c.position_gain ? "load_step_peak" : "load_step_iae");
      if (c.stable && pushed != nullptr)
        aside = std::max(aside, base_.drive.radius_m * load_torque() * pushed->value);
    };
    include(t_.proposed());
    if (t_.running) include(*t_.running);
    return std::min(aside, kMost * stroke);
  }
  /// Way of the shaft that the stroke of a tooth belt leaves.
  [[nodiscard]] double room() const {
    return (base_.drive.stroke_to_m - base_.drive.stroke_from_m - 2.0 * aside_m()) / base_.drive.radius_m;
  }
  /// What a step lasts beyond two settling times.
  [[nodiscard]] double further_s() const {
    return t_.sample_time_s + (shaper() != nullptr ? shaper()->duration_s : 0.0);
  }
  [[nodiscard]] double most_settling_in_stroke() const {
    const bool in_order = plant::check(base_.drive).has_value();  // what is not is refused where it runs
    if (!is_belt() || !in_order) return std::numeric_limits<double>::infinity();
    return 0.5 * (room() / t_.options.reference_step - further_s());
  }

  /// A motion of the shaft in the plant's own unit, over `way` of the shaft from where the experiment begins;
  /// a tooth belt's cart from no nearer to the ends of its stroke than it takes to stay within.
  [[nodiscard]] plant::MotionConfig on_plant(plant::MotionConfig m, double way) const {
    const double unit = motion_unit();
    m.velocity *= unit;
    m.acceleration *= unit;
    m.jerk *= unit;
    m.from = base_.motion.from;
    if (is_belt()) {
      const double last = base_.drive.stroke_to_m - aside_m() - way * unit;
      m.from = std::max(base_.drive.stroke_from_m + aside_m(), std::min(m.from, last));
    }
    m.to = m.from + way * unit;
    return m;
  }

  /// From rest to rest over the velocity of the step, with limited jerk: with what the drive has, and not
  /// faster than the loop follows.
  [[nodiscard]] ExperimentConfig motion(double settling) const {
    constexpr double kPart = 0.5, kPeriods = 2.0;  // of the torque limit; of the bandwidth
    ExperimentConfig config = base_;
    const double velocity = t_.options.reference_step;
    const auto* bandwidth = t_.proposed().figure("load_bandwidth_hz");
    double rise = bandwidth != nullptr && bandwidth->value > 0.0 ? kPeriods / bandwidth->value : settling;
    if (t_.options.torque_limit)
      rise =
          std::max(rise, velocity * total_inertia(t_.machines.front()) / (kPart * *t_.options.torque_limit));
    config.disturbance = {};
    plant::MotionConfig shaft;
    shaft.kind = MotionKind::s_curve;
    shaft.velocity = velocity;
    shaft.acceleration = velocity / rise;
    shaft.jerk = 2.0 * velocity / (rise * rise);
    shaft.wait_s = step_at_s(settling);
    // One and a half times the rise to get up to it, as long down again, and the settling in between.
    config.motion = on_plant(shaft, velocity * (1.5 * rise + settling));
    config.run.duration_s = 3.0 * rise + 2.5 * settling;
    return config;
  }

  /// Until the slower of both controllers has let go of all but a thousandth, so that their steps stand at
  /// one time; at most kLongest, beyond kShort no more samples than a page can take, and on a tooth belt no
  /// longer than its stroke lets the cart go on.
  [[nodiscard]] double settling_s() {
    constexpr double kLongest = 60.0, kShort = 5.0, kSamples = 20'000.0;
    double longest = kLeastSettling;
    const auto follow = [&](const TunedController& c) {
      if (!c.stable) return;
      const double decay = -std::log(std::clamp(c.spectral_radius, 0.1, 1.0 - 1e-12));
      longest = std::max(longest, std::log(1e3) / decay * t_.sample_time_s);
    };
    follow(t_.proposed());
    if (t_.running) follow(*t_.running);
    const double most =
        std::min(std::clamp(kSamples * t_.sample_time_s, kShort, kLongest), most_settling_in_stroke());
    if (longest > most && !told_cut_) {
      t_.findings.push_back(
          {"simulation-cut", diagnostics::Severity::info, longest, most,
           fmt::format("The loop takes {:.3g} s to settle, and its steps are simulated for {:.3g} s{}: what "
                       "figures sum up until then, as IAE and settling, come out smaller than promised.",
                       longest, most,
                       most < most_settling_in_stroke() ? "" : ", as long as the cart stays in its stroke")});
      told_cut_ = true;
    }
    return std::min(longest, most);
  }

  /// When steps come: at a sample, since between two of them a controller sees a part of the step first.
  [[nodiscard]] double step_at_s(double settling) const {
    return std::max(1.0, std::round(kStepAt * settling * base_.run.sample_rate_hz)) /
           base_.run.sample_rate_hz;
  }

  /// From one sample to the next: within a part of the time between them, so that rounding leaves nothing of
  /// the ramp at either. Through a shaper it takes all of that time, which places impulses between samples.
  [[nodiscard]] ExperimentConfig reference_step(double settling, double further = 0.0,
                                                double ramp_samples = 0.5) const {
    ExperimentConfig config = base_;
    const double step = t_.options.reference_step;
    config.disturbance = {};
    config.run.duration_s = 2.0 * settling + further;
    plant::MotionConfig shaft;
    shaft.kind = MotionKind::trapezoidal;
    shaft.velocity = step;
    shaft.acceleration = step * base_.run.sample_rate_hz / ramp_samples;
    shaft.wait_s = step_at_s(settling) + 0.5 * (1.0 - ramp_samples) / base_.run.sample_rate_hz;
    // So far that it is still under way when the run ends.
    config.motion = on_plant(shaft, step * (config.run.duration_s + t_.sample_time_s));
    return config;
  }

  /// The chosen one; none where none is wanted, needed or good enough.
  [[nodiscard]] const TunedShaper* shaper() const {
    const auto found = std::ranges::find(t_.shapers, true, &TunedShaper::chosen);
    return found != t_.shapers.end() && found->duration_s > 0.0 && t_.shaped_mode ? &*found : nullptr;
  }

  [[nodiscard]] ExperimentConfig shaped_step(double settling) const {
    ExperimentConfig config = reference_step(settling, shaper()->duration_s, 1.0);
    config.motion.shaper_amplitudes = shaper()->amplitudes;
    config.motion.shaper_times_s = shaper()->times_s;
    return config;
  }

  /// While it turns, since at rest dry friction takes small torques.
  [[nodiscard]] ExperimentConfig load_step(double settling) const {
    ExperimentConfig config = base_;
    config.disturbance = {};
    config.disturbance.load_step = {-load_torque()};
    config.disturbance.load_step_at_s = {step_at_s(settling)};
    config.run.duration_s = 2.0 * settling;
    plant::MotionConfig shaft;
    shaft.kind = MotionKind::constant;
    shaft.velocity = t_.options.reference_step;
    config.motion = on_plant(shaft, shaft.velocity * config.run.duration_s);
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
    const auto& steps = config.disturbance.load_step_at_s;
    put_figures(c, config, record.output.samples, steps.empty() ? 0.0 : steps.front(), run);
    if (what.starts_with("load")) put_loop(c, config, simulation->truth, run);
    if (&c == &t_.proposed()) compare_with_promise(t_, config, run, told_cut_);
    t_.simulated.push_back(std::move(run));
    return {};
  }

  /// The loop of the drive that is simulated, every delay in it: |S|, and what else of it is bounded.
  void put_loop(const TunedController& c, const ExperimentConfig& config, const plant::Truth& truth,
                SimulatedRun& run) {
    const auto& loop = truth.loop;
    const auto put_largest = [&](const char* name, const auto& size_at) {
      const auto* figure = c.figure(name);
      if (figure == nullptr || loop.lines() == 0) return;
      double largest = 0.0, at_hz = 0.0;
      for (std::size_t i = 0; i < loop.lines(); ++i)
        if (const double size = size_at(i); size > largest) {
          largest = size;
          at_hz = loop.frequency_hz[i];
        }
      run.figures.push_back({figure->name, figure->unit, figure->value, largest});
      if (&c == &t_.proposed()) compare_with_bound(t_, config, *figure, largest, at_hz);
    };
    const auto put_bounded = [&](const char* name, const auto& size_at) {
      if (const auto* figure = c.figure(name); figure != nullptr && figure->bound) put_largest(name, size_at);
    };
    const auto sensitivity = [&](std::size_t i) { return 1.0 / std::abs(1.0 + loop.value[i]); };
    put_largest("sensitivity_peak", sensitivity);
    put_bounded("complementary_peak",
                [&](std::size_t i) { return std::abs(loop.value[i]) * sensitivity(i); });
    // The position of a cascade has no filter, so that its loop has no one C.
    if (!truth.controller || c.position_gain) return;
    put_bounded("controller_sensitivity_peak", [&](std::size_t i) {
      return std::abs(truth.controller->response(loop.frequency_hz[i])) * sensitivity(i);
    });
  }

  static void put(SimulatedRun& run, const TunedController& c, const char* name, double simulated,
                  double times = 1.0) {
    if (const auto* figure = c.figure(name))
      run.figures.push_back({name, figure->unit, figure->value * times, simulated});
  }

  /// How far a load step takes the load's velocity off, of a cascade the motor's position, which leaves the
  /// course and comes back (the load stands off by torque over stiffness): from the mean before the step,
  /// since one sample of an encoder is as good as a count. A place is summed up from the reference, not from
  /// that mean, whose error would add up with it.
  [[nodiscard]] std::vector<double> way_off(const std::vector<double>& velocity,
                                            const std::vector<double>& reference, double step_at_s,
                                            bool of_place) const {
    std::vector<double> away(velocity.size(), 0.0);
    for (std::size_t k = 1; k < away.size(); ++k)
      away[k] = of_place ? away[k - 1] + t_.sample_time_s * (reference[k] - velocity[k]) : -velocity[k];
    if (away.size() < 2) return away;
    constexpr double kRounding = 1e-6;  // of a sample
    const auto step = static_cast<std::size_t>(std::max(0.0, step_at_s / t_.sample_time_s + kRounding));
    const std::size_t last = std::clamp<std::size_t>(step, 1, away.size() - 1);
    double mean = 0.0;
    for (std::size_t k = 1; k <= last; ++k) mean += away[k] / static_cast<double>(last);
    away[0] = away[1];
    for (double& a : away) a -= mean;
    return away;
  }

  void put_figures(const TunedController& c, const ExperimentConfig& config, const std::vector<double>& motor,
                   double step_at_s, SimulatedRun& run) const {
    const std::string& what = run.what;
    const double peak = std::abs(*std::max_element(
        run.torque.begin(), run.torque.end(), [](double a, double b) { return std::abs(a) < std::abs(b); }));
    const double step = t_.options.reference_step;
    if (!config.motion.shaper_times_s.empty()) {
      put_deviation(c, run);
      run.figures.push_back({"reference_peak_torque", t_.units.torque,
                             linear_run(c, run.reference, no_torque(run)).peak_torque, peak});
    } else if (what.starts_with("reference")) {
      const double begin = run.time_s[step_sample(run)] + seen_late_s();
      double overshoot = 0.0, settled = 0.0;
      for (std::size_t k = 0; k < run.velocity.size(); ++k) {
        overshoot = std::max(overshoot, run.velocity[k] / step - 1.0);
        if (std::abs(run.velocity[k] / step - 1.0) > 0.02) settled = run.time_s[k] + t_.sample_time_s;
      }
      put(run, c, "reference_overshoot", 100.0 * overshoot);
      put(run, c, "reference_settling_s", std::max(0.0, settled - begin));
      put(run, c, "reference_peak_torque", peak);
      if (&c == &t_.proposed() && shaper() != nullptr) put_deviation(c, run);
    } else if (what.starts_with("load")) {
      const auto away = way_off(c.position_gain ? motor : run.velocity, run.reference, step_at_s,
                                c.position_gain.has_value());
      double largest = 0.0, sum = 0.0;
      for (const double a : away) {
        largest = std::max(largest, a);
        sum += t_.sample_time_s * std::abs(a);
      }
      put(run, c, "load_step_peak", largest, load_torque());
      put(run, c, "load_step_iae", sum, load_torque());
    } else {
      put_motion(c, fed_forward(c, config, run.velocity.size()), peak, run);
    }
  }

  /// The first sample at which the reference has stepped.
  static std::size_t step_sample(const SimulatedRun& run) {
    constexpr double kRounding = 1e-9;
    const auto begin = std::ranges::find_if(run.reference, [](double r) { return r > kRounding; });
    return begin == run.reference.end() ? 0 : static_cast<std::size_t>(begin - run.reference.begin());
  }

  /// A difference of positions is the velocity half a sample before.
  [[nodiscard]] double seen_late_s() const {
    const bool sampled = is_rigid(base_.drive) && base_.measurement.velocity == plant::VelocitySource::sensor;
    return sampled ? 0.0 : 0.5 * t_.sample_time_s;
  }

  static std::vector<double> no_torque(const SimulatedRun& run) {
    return std::vector<double>(run.reference.size(), 0.0);
  }

  /// How far the load is off a step when the shaper's last impulse and a period of its mode are over, whether
  /// it was shaped or not.
  void put_deviation(const TunedController& c, SimulatedRun& run) const {
    const double wait_s = std::max(shaper()->duration_s, 1.0 / t_.shaped_mode->frequency_hz);
    const std::size_t from =
        step_sample(run) + static_cast<std::size_t>(std::ceil(wait_s / t_.sample_time_s));
    const auto swing = [&](const std::vector<double>& load) {
      double largest = 0.0;
      for (std::size_t k = from; k < load.size(); ++k)
        largest = std::max(largest, std::abs(load[k] / t_.options.reference_step - 1.0));
      return 100.0 * largest;
    };
    run.figures.push_back({"deviation_left", "%", swing(linear_run(c, run.reference, no_torque(run)).load),
                           swing(run.velocity)});
  }

  /// [sample] Torque by the reference alone. That against dry friction is not in it: the linear loop has
  /// none.
  [[nodiscard]] std::vector<double> fed_forward(const TunedController& c, const ExperimentConfig& config,
                                                std::size_t samples) const {
    std::vector<double> torque(samples, 0.0);
    const auto profile = plant::MotionProfile::create(config.motion);
    if (!c.feed_forward || !profile) return torque;
    const double at_shaft = 1.0 / motion_unit();
    for (std::size_t k = 0; k < samples; ++k) {
      const auto asked = profile->at(static_cast<double>(k) / config.run.sample_rate_hz);
      torque[k] = at_shaft *
                  (c.feed_forward->inertia * asked.acceleration + c.feed_forward->viscous * asked.velocity);
    }
    return torque;
  }

  void put_motion(const TunedController& c, const std::vector<double>& added, double peak,
                  SimulatedRun& run) const {
    const LinearRun linear = linear_run(c, run.reference, added);
    const bool rigid = t_.machines.front().structure == fit::Structure::rigid;
    const Followed promised = followed(run.reference, linear.load, !rigid),
                   came = followed(run.reference, run.velocity, !is_rigid(base_.drive));
    run.figures.push_back(
        {"velocity_error", t_.units.velocity, promised.velocity_error, came.velocity_error});
    if (c.position_gain)
      run.figures.push_back(
          {"position_error", place_unit(t_.units.velocity), promised.position_error, came.position_error});
    run.figures.push_back({"peak_torque", t_.units.torque, linear.peak_torque, peak});
  }

  static bool is_rigid(const plant::DriveConfig& drive) { return drive.structure == plant::Structure::rigid; }

  /// How a load followed a reference; its velocity by differences of positions lies half a sample behind.
  struct Followed {
    double velocity_error = 0.0, position_error = 0.0;
  };
  [[nodiscard]] Followed followed(std::vector<double> reference, const std::vector<double>& velocity,
                                  bool by_differences) const {
    Followed f;
    if (by_differences) reference = later(reference, 0.5);
    double away = 0.0;
    for (std::size_t k = 0; k < velocity.size(); ++k) {
      away += t_.sample_time_s * (reference[k] - velocity[k]);
      f.velocity_error = std::max(f.velocity_error, std::abs(reference[k] - velocity[k]));
      f.position_error = std::max(f.position_error, std::abs(away));
    }
    return f;
  }

  /// The same reference on the linear loop of the identified machine, whose load is seen as late as it is
  /// measured: a cascade's way of position and velocity together is that of its law. `added`: [sample] torque
  /// that is fed forward.
  struct LinearRun {
    std::vector<double> load;
    double peak_torque = 0.0;
  };
  [[nodiscard]] LinearRun linear_run(const TunedController& c, const std::vector<double>& reference,
                                     const std::vector<double>& added) const {
    const design::Machine machine(t_.machines.front());
    const auto loop = loop_of(machine, law_of(c));
    const bool rigid = machine.model().structure == fit::Structure::rigid;
    const auto& command = machine.states().command;
    Eigen::VectorXd x = Eigen::VectorXd::Zero(loop.a.rows());
    std::vector<double> load;
    double peak = 0.0;
    for (std::size_t k = 0; k < reference.size(); ++k) {
      const double r = reference[k];
      load.push_back(rigid ? loop.measured * x : loop.load * x);
      peak = std::max(peak, std::abs(loop.torque * x + loop.torque_by_reference * r + added[k]));
      x = (loop.a * x + r * loop.reference).eval();
      x.head(command.size()) += added[k] * command;
    }
    // As if by differences of positions.
    const double late_s = std::max(0.0, machine.model().known_delay_s + machine.model().delay_s);
    return {rigid ? load : later(load, late_s / t_.sample_time_s + 0.5), peak};
  }

  static std::vector<double> later(const std::vector<double>& samples, double by) {
    const auto whole = static_cast<std::size_t>(by);
    const double part = by - static_cast<double>(whole);
    std::vector<double> late(samples.size(), 0.0);
    for (std::size_t k = whole + 1; k < samples.size(); ++k)
      late[k] = (1.0 - part) * samples[k - whole] + part * samples[k - whole - 1];
    return late;
  }

  /// What each part of the feed-forward does to a move of the load, on the identified machine with its dry
  /// friction, beside what it would do without that friction.
  void feed_forward_runs() {
    const auto& c = t_.proposed();
    if (!c.feed_forward || !c.gains || !c.stable) return;
    const auto& model = t_.machines.front();
    const design::Machine machine(model);
    const design::Cascade cascade{*c.gains, *c.position_gain};
    const auto* bandwidth = c.figure("load_bandwidth_hz");
    constexpr double kPart = 0.5, kPeriods = 2.5,
                     kPeak = 9.4;  // of the move's acceleration, distance/duration^2
    design::PolynomialMove move{t_.options.reference_step, settling_s()};
    if (bandwidth != nullptr && bandwidth->value > 0.0) move.duration_s = kPeriods / bandwidth->value;
    if (t_.options.torque_limit)
      move.duration_s = std::max(move.duration_s, std::sqrt(kPeak * move.distance_rad * total_inertia(model) /
                                                            (kPart * *t_.options.torque_limit)));
    const auto samples = static_cast<std::size_t>((move.duration_s + settling_s()) / t_.sample_time_s);
    const double coulomb = c.feed_forward->coulomb;
    const std::pair<design::FeedForward, const char*> kinds[] = {
        {design::FeedForward::none, "motion without feed-forward"},
        {design::FeedForward::velocity, "motion with feed-forward of velocity"},
        {design::FeedForward::delayed, "motion with feed-forward of velocity and torque"}};
    for (const auto& [kind, what] : kinds) {
      const auto free = move_samples(model, move, kind, samples),
                 rubbing = move_samples(model, move, kind, samples, coulomb);
      const auto promised = move_figures_of(machine, cascade, *free, move.duration_s),
                 came = move_figures_of(machine, cascade, *rubbing, move.duration_s, coulomb);
      SimulatedRun run;
      run.what = what;
      const auto place = place_unit(t_.units.velocity);
      run.figures = {{"position_error_during", place, promised.error_during, came.error_during},
                     {"position_error_after", place, promised.error_after, came.error_after},
                     {"peak_torque", t_.units.torque, promised.peak_torque, came.peak_torque}};
      t_.simulated.push_back(std::move(run));
    }
  }

  Tuning& t_;
  ExperimentConfig base_;
  bool told_cut_ = false;
};

}  // namespace

plant::DriveConfig drive_config_of(const fit::DriveModel& m) {
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

ExperimentConfig experiment_of(const Result& result, const TuneOptions& options) {
  assert(result.model);
  ExperimentConfig config;
  const auto& model = *result.model;
  config.drive = drive_config_of(model.drive);
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
  if (tuning.machines.empty())
    return refuse("simulate", "needs a design from a drive model: this one rests on a response");
  return Simulator(tuning, experiment).run();
}

void simulate_on_model(Tuning& tuning, const Result& result) {
  const auto done = result.model
                        ? simulate_on(tuning, experiment_of(result, tuning.options))
                        : expected<void, Error>(refuse("model", "must be a drive's: the result has none"));
  if (!done)
    tuning.findings.push_back({"not-simulated",
                               diagnostics::Severity::info,
                               {},
                               {},
                               "The model cannot be simulated as it is: " + message_of(done.error()) + "."});
}

}  // namespace resonid::identification
