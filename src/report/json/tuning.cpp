// SPDX-License-Identifier: MIT
#include <limits>
#include <resonid/identification/tune_export.hpp>

#include "report/json/results.hpp"

namespace resonid::report {
namespace {

using design::TradeOff;
using identification::TunedController;
using identification::TuneOptions;
using identification::Tuning;

constexpr double kUsualPosition = 1.05;
constexpr double kNoBound = std::numeric_limits<double>::infinity();

void describe_given(Fields& f, const Key& key, std::optional<data::Controller>& controller) {
  f.object(key, controller.has_value(), [&] {
    if (!controller) controller.emplace();
    const bool law = f.reading() ? f.holds("gain") : controller->law.has_value();
    f.one_of(2, law ? 1 : 0, [&](std::size_t kind) {
      if (kind == 0) return describe(f, static_cast<data::TransferFunction&>(*controller));
      if (!controller->law) controller->law = data::Controller::Pi{};
      f({"gain", "of gain (1 + Ts/integral_time z/(z - 1))"}, controller->law->gain);
      f({"integral_time_s", "its integral time", "s", positive}, controller->law->integral_time_s);
    });
  });
}

void describe_bounds(Fields& f, TuneOptions& o) {
  f({"sensitivity", "on |S|"}, o.largest_sensitivity);
  f.unless(kNoBound, {"load_transfer", "on |T_load|; absent: none"}, o.largest_load_transfer);
  f.unless(kUsualPosition,
           {"position_transfer", "of a cascade, on |position of the load by its reference|; absent: 1.05"},
           o.largest_position_transfer);
  f({"complementary", "on |T|"}, o.largest_complementary);
  f({"controller_sensitivity", "on |C S|; absent: that of filters is twice that of the best PI"},
    o.largest_controller_sensitivity);
  f({"bandwidth_hz", "least bandwidth of the load", "Hz"}, o.least_bandwidth_hz);
  f({"torque", "of the drive"}, o.torque_limit);
  f({"noise_torque", "rms of the torque that measurement noise makes"}, o.largest_noise_torque);
  f({"overshoot", "of the load after the reference step"}, o.overshoot);
}

void describe_wanted(Fields& f, Tuning& t) {
  auto& o = t.options;
  auto seed = static_cast<std::size_t>(o.seed);
  f.object({"wanted", "what was wanted of the controller"}, [&] {
    f.choice({"structure", "what it may be made of"}, o.structure);
    f.object({"bounds", "bounds on the loop"}, [&] { describe_bounds(f, o); });
    f({"biquads", "filters at most"}, o.biquads);
    f({"reference_step", "step of the reference that its figures are of: velocity, of a cascade position"},
      o.reference_step);
    f({"confidence", "with which all bounds are to be met"}, o.confidence);
    f.choice({"guarantee",
              "what the confidence is of: the probability that every bound is met, or every "
              "machine of the confidence ellipsoid"},
             o.guarantee);
    f({"delay_std_s", "standard deviation of the delay, where it was given", "s", not_negative},
      o.delay_std_s);
    describe_given(f, {"evaluate", "controller that was judged instead"}, o.evaluate);
    describe_given(f, {"running", "controller under which was recorded"}, o.running);
    f.unless_empty({"positions", "positions of the machines, over which gains are scheduled"}, o.positions);
    f({"largest_speed", "of the position along them, in its unit per s"}, o.largest_speed);
    f.unless(false, {"shaper", "whether an input shaper was to be chosen"}, o.shaper);
    f({"shaper_limit", "residual vibration that it may leave"}, o.shaper_limit);
    f.unless(false, {"forced", "made of results that need not be trusted"}, o.force);
    f({"draws", "machines that the confidence is counted on"}, o.draws);
    f({"seed", "seed of the draws"}, seed);
  });
  if (f.reading()) o.seed = seed;
}

void describe_trade_off(Fields& f, const Key& key, std::vector<TradeOff>& list) {
  f.list(key, !list.empty(), list, [&](TradeOff& p) {
    f({"sensitivity", "bound on |S|"}, p.sensitivity);
    f.unless(kNoBound, {"load_transfer", "bound on |T_load|; absent: none"}, p.load_transfer);
    f({"kp", "of the best PI under them"}, p.kp);
    f({"ki", "of the best PI under them"}, p.ki);
    f({"iae", "its error of the load after a torque step of 1, integral of the size"}, p.iae);
  });
}

void describe_schedule(Fields& f, std::optional<identification::TunedSchedule>& schedule) {
  f.object({"schedule", "gains over position, linear between nodes"}, schedule.has_value(), [&] {
    if (!schedule) schedule.emplace();
    f.list(
        {"nodes", "ascending in position"}, true, schedule->nodes,
        [&](identification::TunedSchedule::Node& n) {
          f({"position", "where"}, n.position);
          f({"kp", "proportional gain there"}, n.kp);
          f({"ki", "integral gain there"}, n.ki);
          f.unless(0.0,
                   {"radius", "of the ellipsoid over which the bounds are met there, in standard deviations"},
                   n.radius);
        },
        Presence::required);
    f.unless(1.0, {"set_point_weight", "b, that of every position"}, schedule->set_point_weight);
    f({"figures", "largest over the stroke, with the position fixed"}, schedule->figures);
    f.list({"places", "positions that were looked at, ascending"}, !schedule->places.empty(),
           schedule->places, [&](identification::TunedSchedule::Place& place) {
             f({"position", "where"}, place.position);
             f({"probability", "that a machine exceeds a bound there", "", not_negative}, place.probability);
           });
    f({"worst_position", "where machines exceed a bound most often"}, schedule->worst_position);
    f({"largest_speed",
       "of the position, in its unit per s, up to which a run disturbs the load no more than a slow one"},
      schedule->largest_speed);
    f({"looked_speed", "up to which was looked for it, no further than slowly varying loops tell"},
      schedule->looked_speed);
    f({"fixed_iae", "error of the load on a run through the stroke with one PI"}, schedule->fixed_iae);
    f({"scheduled_iae", "the same with the schedule"}, schedule->scheduled_iae);
    f({"within", "every bound is met with the confidence at every position"}, schedule->within);
  });
}

void describe_mode(Fields& f, const Key& key, std::optional<design::ClosedLoopMode>& mode) {
  f.object(key, mode.has_value(), [&] {
    if (!mode) mode.emplace();
    f({"frequency_hz", "undamped", "Hz", positive}, mode->frequency_hz);
    f({"damping_ratio", "share of critical damping"}, mode->damping_ratio);
  });
}

void describe_shapers(Fields& f, std::vector<identification::TunedShaper>& shapers) {
  f.list(
      {"shapers", "input shapers for the closed loop, ascending in duration"}, !shapers.empty(), shapers,
      [&](identification::TunedShaper& s) {
        f({"kind", "\"none\", \"zv\", \"mzv\", \"zvd\", \"ei\" or \"2hump_ei\"; of two modes with + between"},
          s.kind);
        f({"duration_s", "time of its last impulse", "s", not_negative}, s.duration_s);
        f({"vibration",
           "what 95 % of the machines stay below, of that of an unshaped step; of \"none\" as a part of the "
           "step",
           "", not_negative},
          s.vibration);
        f({"chosen", "the shortest that leaves little enough"}, s.chosen);
        f({"amplitudes", "of the impulses"}, s.amplitudes);
        f({"times_s", "of the impulses", "s"}, s.times_s);
      });
}

void describe_runs(Fields& f, std::vector<identification::SimulatedRun>& runs) {
  f.list({"simulated", "runs on a simulated machine"}, !runs.empty(), runs,
         [&](identification::SimulatedRun& run) {
           f({"what", "\"reference step\", \"load step\", \"motion\" and what it is of"}, run.what);
           f.list({"figures", "what was promised, and what came"}, !run.figures.empty(), run.figures,
                  [&](identification::SimulatedFigure& figure) {
                    f({"name", "name of the figure"}, figure.name);
                    f.unless_empty({"unit", "unit of its numbers"}, figure.unit);
                    f({"promised", "by the design, the linear loop of the identified machine", "unit"},
                      figure.promised);
                    f({"simulated", "by the run", "unit"}, figure.simulated);
                  });
           Gaps time{run.time_s}, reference{run.reference}, velocity{run.velocity}, torque{run.torque};
           f.only_if(!run.time_s.empty(), {"time_s", "of the samples", "s"}, time);
           f.only_if(!run.reference.empty(), {"reference", "velocity that was wanted"}, reference);
           f.only_if(!run.velocity.empty(), {"velocity", "velocity of the load"}, velocity);
           f.only_if(!run.torque.empty(), {"torque", "torque of the machine"}, torque);
         });
}

/// The proposed gains as the drive takes them, and those of the first step.
void describe_own_gains(Fields& f, const Tuning& t) {
  const auto own = f.reading() ? std::nullopt : own_gains(t);
  const auto* first = t.candidates.empty() ? nullptr : &t.candidates.front();
  const bool known = own && first != nullptr && first->gains;
  const double factor = own ? own->factor : 1.0, kp = known ? factor * first->gains->kp : 0.0,
               ki = known ? factor * first->gains->ki : 0.0;
  const auto units = own ? own->units : identification::GainUnits{};
  const bool d = known && first->derivative_gain;
  f.derived({"gain", "of every gain and of every term of the numerators, in the recording's own units"},
            factor, own.has_value());
  f.derived({"kp", "of the first candidate in them, output_unit and input_unit"}, kp, known);
  f.derived({"ki", "of it"}, ki, known);
  f.derived({"kd", "of it, where it is a PID"}, d ? factor * *first->derivative_gain : 0.0, d);
  f.derived({"kp_unit", "\"A/rpm\""}, units.kp, known && !units.kp.empty());
  f.derived({"ki_unit", "\"A/(rpm s)\""}, units.ki, known && !units.kp.empty());
  f.derived({"kd_unit", "\"A s/rpm\""}, units.kd, d && !units.kp.empty());
  f.derived({"first_kp", "of the first step on the machine: half of kp"}, identification::kFirstGain * kp,
            known);
  f.derived({"first_ki", "a quarter of ki"}, identification::kFirstIntegralGain * ki, known);
}

/// A file of this kind serves as a controller's: what such a file needs stands on top.
void describe_controller_file(Fields& f, const Tuning& t) {
  static const TunedController none;
  const auto& c = t.candidates.empty() ? none : t.candidates.front();
  const bool known = !c.feedback.denominator.empty();
  f.derived({"numerator",
             "numerator of the first candidate's feedback, from velocity error to torque, in "
             "powers of z^-1: with it the file can be given as a controller"},
            c.feedback.numerator, known);
  f.derived({"denominator", "denominator of it"}, c.feedback.denominator, known);
  f.derived({"structure", "structure of it"}, c.structure, known);
  f.derived({"reference_numerator", "T of u = (T r - R y)/S where it is not the numerator"},
            c.reference_numerator, known && !c.reference_numerator.empty());
  f.derived({"position_gain", "kv of it, where it is a cascade", "1/s"}, c.position_gain.value_or(0.0),
            known && c.position_gain.has_value());
}

void describe_machines(Fields& f, Tuning& t) {
  f.list(
      {"machines", "identified drives that the controller is for"}, true, t.machines,
      [&](fit::DriveModel& drive) { describe_machine(f, drive, t.units); }, Presence::required);
  f.object({"delay", "what is known of the delay"}, [&] {
    f({"std_s", "standard deviation", "s", not_negative}, t.delay_std_s);
    f({"assumed", "a quarter of a sample, as the result tells none"}, t.delay_std_assumed);
  });
}

}  // namespace

void describe(Fields& f, Tuning& t) {
  f.schema({"resonid.tuning/1"});
  f({"trusted", "all results are, and the first candidate is within the bounds"}, t.trusted);
  f({"files", "recordings that were identified"}, t.files);
  describe_units(f, t.units);
  f({"sample_time_s", "sample time of the loop", "s", positive}, t.sample_time_s);
  describe_controller_file(f, t);
  describe_machines(f, t);
  describe_wanted(f, t);
  f.object({"scale", "units of the recording per unit of torque and of velocity"},
           t.input_scale != 1.0 || t.output_scale != 1.0, [&] {
             f({"input", "of torque"}, t.input_scale);
             f({"output", "of velocity"}, t.output_scale);
             f.unless_empty({"input_unit", "its name"}, t.input_unit);
             f.unless_empty({"output_unit", "its name"}, t.output_unit);
             describe_own_gains(f, t);
           });
  f.unless(false, {"by_response", "designed by the lines of a response, without a drive model"},
           t.by_response);
  f({"candidates", "controllers, the best first; one that was judged alone"}, t.candidates);
  f.require(!t.candidates.empty(), "candidates", "at least one controller");
  f({"running", "the controller under which was recorded"}, t.running);
  f({"nominal", "the first candidate's structure, designed without regard to uncertainty"}, t.nominal);
  describe_trade_off(f, {"over_sensitivity", "what the bound on |S| costs"}, t.over_sensitivity);
  describe_trade_off(f, {"over_load_transfer", "what the bound on |T_load| costs"}, t.over_load_transfer);
  f.list(
      {"experiment", "what a better experiment would buy"}, !t.experiment.empty(), t.experiment,
      [&](auto& v) {
        f({"variance_factor", "of every variance", "", not_negative}, v.factor);
        f.unless(1.0,
                 {"delay_variance_factor",
                  "of the delay's, which no experiment changes where it was told; absent: as it is", "",
                  not_negative},
                 v.delay_factor);
        f({"ki", "integral gain that would then be possible; 0: of a structure that is not designed again"},
          v.ki);
        f({"iae", "error of the load after a torque step of 1"}, v.iae);
      });
  describe_schedule(f, t.schedule);
  describe_mode(f, {"shaped_mode", "mode of the closed loop that the shapers are for"}, t.shaped_mode);
  describe_mode(f, {"second_shaped_mode", "the other one, where they are for two"}, t.second_shaped_mode);
  describe_shapers(f, t.shapers);
  describe_runs(f, t.simulated);
  f({"check", "what a recording under the first candidate shows"}, t.check);
  f({"findings", "what to know of results and controller"}, t.findings);
}

}  // namespace resonid::report
