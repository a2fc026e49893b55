// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>

#include "report/json/results.hpp"

namespace resonid::report {
namespace {

using identification::Band;
using identification::LoopCurves;
using identification::LoopFigure;
using identification::TunedController;

void describe_band(Fields& f, const Key& key, Band& band) {
  f.object(key, !band.value.empty(), [&] {
    Gaps value{band.value}, low{band.low}, high{band.high};
    f({"value", "of the identified machine; null: none"}, value);
    f.only_if(!band.low.empty(), {"low", "lower bound of 95 % of the machines that may be"}, low);
    f.only_if(!band.high.empty(), {"high", "upper bound of them"}, high);
  });
}

/// L as two lists.
void describe_loop_values(Fields& f, LoopCurves& c) {
  std::vector<double> real, imag;
  for (const auto& value : c.loop) {
    real.push_back(value.real());
    imag.push_back(value.imag());
  }
  Gaps re{real}, im{imag};
  const bool there = f.only_if(!c.loop.empty(), {"loop_real", "real part of the open loop L = C Gd"}, re);
  f.with(there, {"loop_imag", "imaginary part of it"}, im);
  if (!f.reading()) return;
  f.require(real.size() == imag.size(), "loop_imag", "as many numbers as loop_real has");
  c.loop.clear();
  for (std::size_t i = 0; i < std::min(real.size(), imag.size()); ++i) c.loop.emplace_back(real[i], imag[i]);
}

void describe_ellipse(Fields& f, LoopCurves::Ellipse& e) {
  double real = e.value.real(), imag = e.value.imag();
  Eigen::MatrixXd covariance = e.covariance;
  f({"frequency_hz", "key frequency", "Hz", positive}, e.frequency_hz);
  f({"real", "real part of L there"}, real);
  f({"imag", "imaginary part of it"}, imag);
  const bool known = f.only_if(covariance.allFinite(),
                               {"covariance",
                                "covariance of real and imaginary part over the machines that "
                                "may be"},
                               covariance);
  if (!f.reading()) return;
  e.value = {real, imag};
  if (known) e.covariance = covariance;
}

void describe_curves(Fields& f, LoopCurves& c) {
  const bool there = !c.frequency_hz.empty() || !c.time_s.empty() || !c.ellipses.empty();
  f.object({"curves", "what the loop looks like, for pictures"}, there, [&] {
    f.unless_empty({"frequency_hz", "lines of all curves over frequency", "Hz"}, c.frequency_hz);
    describe_loop_values(f, c);
    describe_band(f, {"loop_size", "|L|"}, c.loop_size);
    describe_band(f, {"loop_phase_deg", "arg L, without jumps"}, c.loop_phase_deg);
    describe_band(f, {"sensitivity", "|S|"}, c.sensitivity);
    describe_band(f, {"complementary", "|T|"}, c.complementary);
    describe_band(f, {"load_transfer", "|T_load|, from the reference to the load's velocity"},
                  c.load_transfer);
    f.list({"ellipses", "L at key frequencies"}, !c.ellipses.empty(), c.ellipses,
           [&](LoopCurves::Ellipse& e) { describe_ellipse(f, e); });
    f.unless_empty({"time_s", "times of all curves over time", "s"}, c.time_s);
    describe_band(
        f, {"load_by_reference", "velocity of the load after the reference step, of a cascade its position"},
        c.load_by_reference);
    describe_band(f, {"torque_by_reference", "torque meanwhile"}, c.torque_by_reference);
    describe_band(f, {"load_by_torque", "velocity of the load after a torque step of 1 on it"},
                  c.load_by_torque);
  });
}

/// What a drive takes; they follow from the biquad.
void describe_coefficients(Fields& f, const design::Biquad& biquad, double sample_time_s) {
  design::Biquad::Coefficients c;
  if (!f.reading() && sample_time_s > 0.0) c = biquad.coefficients(sample_time_s);
  const auto finite = [](double v) { return std::isfinite(v); };
  const bool known = sample_time_s > 0.0 && std::all_of(c.b.begin(), c.b.end(), finite) &&
                     std::all_of(c.a.begin(), c.a.end(), finite);
  f.derived({"b", "b0, b1, b2 in powers of z^-1"}, std::vector<double>(c.b.begin(), c.b.end()), known);
  f.derived({"a", "1, a1, a2"}, std::vector<double>(c.a.begin(), c.a.end()), known);
}

void describe_gains(Fields& f, TunedController& c) {
  f.object({"gains", "of u = F (kp (b r - y) + sum of ki Ts (r - y)), F the product of the biquads"},
           c.gains.has_value(), [&] {
             if (!c.gains) c.gains.emplace();
             f({"kp", "torque per velocity"}, c.gains->kp);
             f({"ki", "torque per velocity and second"}, c.gains->ki);
             f.list({"biquads", "(s^2 + 2 zn w s + w^2)/(s^2 + 2 zd w s + w^2) by Tustin's rule, prewarped"},
                    !c.gains->biquads.empty(), c.gains->biquads, [&](design::Biquad& b) {
                      f({"frequency_hz", "w/(2 pi)", "Hz", positive}, b.frequency_hz);
                      f({"numerator_damping", "zn"}, b.numerator_damping);
                      f({"denominator_damping", "zd"}, b.denominator_damping);
                      describe_coefficients(f, b, c.feedback.sample_time_s);
                    });
           });
  f({"position_gain", "kv of a cascade", "1/s"}, c.position_gain);
  f.object({"feed_forward", "what a cascade adds by its reference"}, c.feed_forward.has_value(), [&] {
    if (!c.feed_forward) c.feed_forward.emplace();
    f({"inertia", "torque per acceleration of the reference"}, c.feed_forward->inertia);
    f({"viscous", "torque per its velocity"}, c.feed_forward->viscous);
    f({"coulomb", "torque in the direction of its velocity"}, c.feed_forward->coulomb);
    f({"delay_s", "by which the feedback is given the reference later", "s", not_negative},
      c.feed_forward->delay_s);
  });
  f({"derivative_gain", "kd of a PID, torque per acceleration"}, c.derivative_gain);
  f({"derivative_time_s", "time constant of its filter", "s"}, c.derivative_time_s);
  f({"set_point_weight", "b"}, c.set_point_weight);
  f.unless_empty({"reference_numerator",
                  "T of u = (T r - R y)/S in powers of z^-1, R and S being numerator and denominator of the "
                  "feedback, where T is not R"},
                 c.reference_numerator);
  f.list({"states", "of a state feedback, torque = -sum of gain times estimated state"}, !c.states.empty(),
         c.states, [&](identification::TunedState& state) {
           f({"name", "\"velocity of the load\", \"load torque\""}, state.name);
           f({"unit", "unit of the state"}, state.unit);
           f({"gain", "torque per unit of the state"}, state.gain);
           f({"observer_gain",
              "by what the estimate is corrected per unit by which the measured velocity differs from it"},
             state.observer_gain);
         });
}

void describe_crossing(Fields& f, identification::TunedCrossing& x) {
  f({"frequency_hz", "where", "Hz", positive}, x.frequency_hz);
  f({"frequency_low_hz", "lower end of the central 95 % over the machines that cross there", "Hz", positive},
    x.frequency_low_hz);
  f({"frequency_high_hz", "upper end of it", "Hz", positive}, x.frequency_high_hz);
  f({"phase_margin_deg", "180 deg + arg L there", "deg"}, x.phase_margin_deg);
  f({"phase_margin_low_deg", "lower end of its central 95 % over them", "deg"}, x.phase_margin_low_deg);
  f({"phase_margin_high_deg", "upper end of it", "deg"}, x.phase_margin_high_deg);
  f({"phase_margin_worst_deg", "of the worst machine of the ellipsoid that was designed for", "deg"},
    x.phase_margin_worst_deg);
  f({"falling", "|L| falls with the frequency"}, x.falling);
}

void describe_posterior(Fields& f, TunedController& c) {
  f.object({"posterior", "what machines that may be say of the bounds"}, c.draws > 0, [&] {
    f({"draws", "machines that were looked at"}, c.draws);
    f({"exceeding", "those that exceed a bound"}, c.exceeding);
    f({"unstable", "those with an unstable loop"}, c.unstable);
    f.derived({"probability", "that a bound is exceeded"}, c.probability());
  });
}

}  // namespace

void describe(Fields& f, LoopFigure& figure) {
  f({"name", "name of the figure, \"sensitivity_peak\""}, figure.name);
  f.unless_empty({"unit", "unit of its numbers"}, figure.unit);
  f.unless(kUnknown, {"value", "of the identified machine; absent: infinite, or none", "unit"}, figure.value);
  f({"frequency_hz", "where a maximum over frequency is", "Hz"}, figure.frequency_hz);
  f({"low", "lower end of the central 95 % over the machines that may be", "unit"}, figure.low);
  f({"high", "upper end of it", "unit"}, figure.high);
  f({"worst", "of the worst machine of the ellipsoid that was designed for", "unit"}, figure.worst);
  f({"bound", "bound that was wanted", "unit"}, figure.bound);
  f({"probability", "that the bound is exceeded", "", not_negative}, figure.probability);
}

void describe(Fields& f, TunedController& c) {
  f({"structure",
     "\"pi\", \"p\", \"cascade\", \"pi+biquads\", \"pid\", \"rst\", \"state-feedback\", \"running\" or "
     "\"given\""},
    c.structure);
  f({"name", "the same for people"}, c.name);
  f.object({"feedback", "from velocity error to torque"}, [&] { describe(f, c.feedback); });
  describe_gains(f, c);
  f({"stable", "loop of the identified machine"}, c.stable);
  f({"spectral_radius", "largest magnitude of its poles"}, c.spectral_radius);
  f.list(
      {"figures", "what the loop does"}, true, c.figures, [&](LoopFigure& figure) { describe(f, figure); },
      Presence::required);
  f.list({"crossings", "all frequencies with |L| = 1"}, !c.crossings.empty(), c.crossings,
         [&](identification::TunedCrossing& x) { describe_crossing(f, x); });
  f.list({"modes", "oscillating modes of the closed loop"}, !c.modes.empty(), c.modes,
         [&](design::ClosedLoopMode& m) {
           f({"frequency_hz", "undamped", "Hz", positive}, m.frequency_hz);
           f({"damping_ratio", "share of critical damping"}, m.damping_ratio);
         });
  describe_posterior(f, c);
  f.unless(0.0, {"radius", "of the ellipsoid over which the bounds are met, in standard deviations"},
           c.radius);
  f.unless_empty({"limits", "names of the figures whose bounds keep the gains down"}, c.limits);
  f({"within", "every bound is met with the confidence that was wanted"}, c.within);
  f.unless_empty({"remark", "why it was not proposed"}, c.remark);
  describe_curves(f, c.curves);
}

}  // namespace resonid::report
