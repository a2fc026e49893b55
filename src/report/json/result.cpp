// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>

#include "report/json/results.hpp"

namespace resonid::report {
namespace {

using identification::Result;

constexpr std::array<std::string_view, 2> kKinds = {"resonance", "antiresonance"};
constexpr std::array<std::string_view, 2> kSources = {"response", "model"};
constexpr std::array<std::string_view, 2> kFitOf = {"lines", "record"};

/// Poles or zeros of the list, which in the file are two.
void describe_roots(Fields& f, const Key& key, std::string_view kind,
                    std::vector<identification::Root>& all) {
  std::vector<identification::Root> roots;
  if (!f.reading())
    std::copy_if(all.begin(), all.end(), std::back_inserter(roots),
                 [&](const identification::Root& root) { return root.kind == kind; });
  f.unless_empty(key, roots);
  if (!f.reading()) return;
  for (auto& root : roots) {
    root.kind = kind;
    all.push_back(root);
  }
}

void describe_distortion(Fields& f, identification::Distortion& d, std::size_t lines) {
  f.unless(std::size_t{0},
           {"realisations", "realisations of the random-phase excitation; absent: only detection lines tell"},
           d.realisations);
  const bool several = d.realisations > 0;
  const auto per_line = [&](const Key& key, std::vector<double>& list) {
    f.with(several, key, list);
    f.require(!several || list.size() == lines, key.name,
              "as many numbers as the frequency response has lines");
  };
  per_line({"noise_std", "per line of the response, of the mean, by noise alone", "", not_negative},
           d.noise_std);
  per_line(
      {"distortion_std", "per line, of the response of one realisation, by distortion", "", not_negative},
      d.distortion_std);
  f.with(several, {"scatter", "standard deviation of the realisations beyond their noise"}, d.scatter);
  const bool even = d.even.lines > 0, odd = d.odd.lines > 0;
  f.object({"detection_lines", "distortion at lines that the excitation leaves out"}, even || odd, [&] {
    f.only_if(even, {"even", "even multiples of the base frequency"}, d.even);
    f.only_if(odd, {"odd", "odd ones"}, d.odd);
  });
}

void describe_loop(Fields& f, identification::LoopResult& loop) {
  auto& m = loop.margins;
  auto crossover = m.crossover_hz(), phase = m.phase_margin_deg();
  f.assumed({"source", "what the margins were read from: \"model\" or \"response\""}, loop.source);
  f({"modulus_margin", "smallest distance of L to -1 over the band"}, m.modulus_margin);
  f.assumed({"modulus_margin_hz", "where that is", "Hz"}, m.modulus_margin_hz);
  f({"crossover_hz", "first downward crossing of |L| = 1", "Hz", positive}, crossover);
  f({"phase_margin_deg", "at the crossover", "deg"}, phase);
  f({"worst_phase_margin_deg", "smallest over all crossings of |L| = 1", "deg"}, m.worst_phase_margin_deg);
  f({"gain_margin_db", "smallest factor > 1 at arg L = -180 deg", "dB"}, m.gain_margin_db);
  f({"gain_margin_hz", "where that is", "Hz"}, m.gain_margin_hz);
  f({"crossover_std_hz", "standard deviation of the crossover", "Hz"}, loop.crossover_std_hz);
  f({"phase_margin_std_deg", "standard deviation of the phase margin", "deg"}, loop.phase_margin_std_deg);
  f({"modulus_margin_std", "standard deviation of the modulus margin"}, loop.modulus_margin_std);
  f({"gain_margin_std_db", "standard deviation of the gain margin", "dB"}, loop.gain_margin_std_db);
  f.only_if(m.crossovers.size() > 1, {"crossovers", "all of them, where there are several"}, m.crossovers);
  if (!f.reading() || !m.crossovers.empty() || !crossover) return;
  f.require(phase.has_value(), "phase_margin_deg", "this key");
  m.crossovers.push_back({*crossover, phase.value_or(0.0)});
}

void describe_options(Fields& f, std::vector<identification::GivenOption>& options) {
  std::vector<std::string> names;
  for (const auto& option : options) names.push_back(option.name);
  f.object({"options",
            "options of identify as they were given, by their names without dashes; verbs that read "
            "this file inherit columns, units, scales, controller and delay"},
           !options.empty(), [&] {
             std::size_t next = 0;
             f.each(names, [&](const Key& key) {
               if (f.reading()) options.push_back({std::string(key.name), {}});
               identification::GivenOption none;
               auto& option = f.sketching() ? none : f.reading() ? options.back() : options[next++];
               f({key.name, "its value, as the command line has it"}, option.value);
             });
           });
}

void describe_result(Fields& f, Result& r) {
  describe_units(f, r.units);
  f.unless(0.0,
           {"known_delay_s", "known delay in the measured output; taken out of response and model", "s",
            not_negative},
           r.known_delay_s);
  f({"radius_m", "radius of the driven roller", "m", positive}, r.radius_m);
  f({"frequency_response", "response of the velocity; known delay removed, as zero-order-hold equivalent"},
    r.response);
  f.object({"distortion", "non-linear distortion beside noise"}, r.distortion.has_value(), [&] {
    if (!r.distortion) r.distortion.emplace();
    describe_distortion(f, *r.distortion, r.response.lines());
  });
  f({"second_output", "what was measured at the load"}, r.second_output);
  f({"resonances", "resonances and anti-resonances, ascending; empty: none"}, r.modes);
  describe_model(f, r);
  f.object({"planned_loop", "the same with the controller that is to run"}, r.planned_loop.has_value(), [&] {
    if (!r.planned_loop) r.planned_loop.emplace();
    describe_loop(f, *r.planned_loop);
  });
  f.object({"loop", "margins of the real loop, every delay included"}, r.loop.has_value(), [&] {
    if (!r.loop) r.loop.emplace();
    describe_loop(f, *r.loop);
  });
  f({"validation", "how well the model reproduces what it was fitted to"}, r.validation);
  f({"cross_validation", "how the model holds on a recording that it was not fitted to"}, r.independent);
  f.unless_empty({"choices", "what the recording decided, in the order of the work"}, r.choices);
  f.unless_empty({"structures", "all that were fitted, side by side"}, r.structures);
  describe_roots(f, {"poles", "poles of the model, in the s-plane"}, "pole", r.roots);
  describe_roots(f, {"zeros", "zeros of the model, in the s-plane"}, "zero", r.roots);
  f({"bootstrap", "repetitions of the experiment on the fitted model"}, r.bootstrap);
}

}  // namespace

void describe(Fields& f, response::DistortionLevel& level) {
  f({"lines", "lines that tell"}, level.lines);
  f({"level", "non-linear part of the output over its linear part, noise taken off", "", not_negative},
    level.level);
  f({"noise", "what noise alone gives there", "", not_negative}, level.noise);
  f({"significant", "more than noise: F test, 0.1 %"}, level.significant);
}

void describe(Fields& f, identification::SecondOutputResult& s) {
  std::string factor = "1", seconds = "s";
  f.choice({"kind", "what it measures"}, s.kind);
  f({"signal", "its column"}, s.signal);
  f({"unit", "unit of its response, \"(rad/s)/Nm\""}, s.unit);
  f({"frequency_response", "response of the load's velocity; known delay removed"}, s.response);
  f({"fitted", "whether the drive model is that of both outputs"}, s.fitted);
  f({"model_error", "relative difference to the drive model that noise does not explain", "", not_negative},
    s.model_error);
  quantity(f, {"gain", "measured over expected, where it is not 1"}, s.gain, factor);
  quantity(f, {"delay", "by which it is later than the output, where it is not 0"}, s.delay_s, seconds);
}

void describe(Fields& f, data::Mode& r) {
  f.choice({"kind", "resonance or anti-resonance"}, kKinds, r.anti);
  f({"frequency_hz", "undamped frequency of the model, or extremum of the response", "Hz", positive},
    r.frequency_hz.value);
  f.unless(kUnknown, {"std_hz", "its standard deviation", "Hz", not_negative}, r.frequency_hz.std);
  f.unless(kUnknown, {"damping_ratio", "share of critical damping"}, r.damping_ratio.value);
  f.unless(kUnknown, {"damping_ratio_std", "its standard deviation"}, r.damping_ratio.std);
  f.choice({"source", "fitted model, or measured response"}, kSources, r.from_model);
}

void describe(Fields& f, identification::Validation& v) {
  f({"fit_percent", "100 (1 - |y - yh|/|y - mean y|)", "%"}, v.fit_percent);
  f.choice({"of", "whether the fit is that of the simulated recording, or of the response's lines"}, kFitOf,
           v.of_record, Presence::assumed);
  f({"cross_correlation_max", "largest correlation of the residual with the simulated output"},
    v.cross_correlation_max);
  f({"limit", "limit of that correlation, 3 %"}, v.limit);
  f({"residual_rms", "in the output's unit"}, v.residual_rms);
}

void describe(Fields& f, identification::IndependentValidation& v) {
  f({"file", "name of the other recording's file"}, v.file);
  f({"approach", "\"direct\" or \"indirect\""}, v.approach);
  f({"simulation_fit_percent", "100 (1 - |y - yh|/|y - mean y|), simulated", "%"}, v.simulation_fit_percent);
  f({"prediction_fit_percent", "the same one step ahead", "%"}, v.prediction_fit_percent);
  f({"response_error", "relative distance to that recording's own response beyond the noise"},
    v.response_error);
  f({"verdict", "\"accepted\", \"doubtful\" or \"rejected\""}, v.verdict);
}

void describe(Fields& f, identification::Choice& c) {
  f({"what", "what was to be chosen, \"method\""}, c.what);
  f({"chosen", "\"local-cubic\""}, c.chosen);
  f({"because", "what of the recording decided, a sentence"}, c.because);
}

void describe(Fields& f, identification::StructureTrial& t) {
  f({"name", "\"two-mass with friction and delay\", \"black-box of order 5\""}, t.name);
  f({"parameters", "number of estimated ones"}, t.parameters);
  f.unless(kUnknown, {"information", "Bayesian information criterion, smaller is better"}, t.bic);
  f({"validation_fit_percent", "fit of the simulation to the hold-out data", "%"}, t.holdout_fit_percent);
  f({"validation_information", "N ln(mean square) there, smaller is better"}, t.holdout_score);
  f({"independent_fit_percent", "fit of the simulation to another recording", "%"},
    t.independent_fit_percent);
  f({"chosen", "whether the result is this one"}, t.chosen);
  f.unless_empty({"remark", "why not"}, t.remark);
}

void describe(Fields& f, identification::Root& root) {
  double real = root.value.real(), imag = root.value.imag();
  Eigen::MatrixXd covariance = root.covariance;
  f({"real", "real part", "1/s"}, real);
  f({"imag", "imaginary part", "1/s"}, imag);
  const bool known =
      f.only_if(covariance.allFinite(), {"covariance", "covariance of real and imaginary part"}, covariance);
  if (!f.reading()) return;
  root.value = {real, imag};
  if (known)
    root.covariance = covariance;
  else
    root.covariance.setConstant(kUnknown);
}

void describe(Fields& f, identification::BootstrapInterval& i) {
  f({"name", "figure, \"stiffness\", \"resonance_hz\""}, i.name);
  f({"unit", "unit of all numbers here"}, i.unit);
  f({"low", "lower end at the result's confidence"}, i.low);
  f({"high", "upper end"}, i.high);
  f({"std", "standard deviation over the replicas", "", not_negative}, i.std);
  f.assumed({"values", "values of the replicas that have all figures"}, i.values);
}

void describe(Fields& f, identification::Bootstrap& b) {
  f({"replicas", "number of repetitions"}, b.replicas);
  f({"failed", "repetitions whose fit did not converge, left out"}, b.failed);
  f.list(
      {"intervals", "what each figure would be in repetitions"}, true, b.intervals,
      [&](identification::BootstrapInterval& i) {
        describe(f, i);
        if (f.reading())
          f.require(i.values.empty() || i.values.size() == b.intervals.front().values.size(), "values",
                    "as many numbers as the other figures have");
      },
      Presence::required);
}

void describe(Fields& f, Result& r) {
  f.schema({"resonid.identification/1"});
  f({"record", "what was identified"}, r.record);
  f({"method", "how the response was measured, \"local-polynomial\""}, r.method);
  f({"approach", "\"direct\", \"indirect\" or \"joint\""}, r.approach);
  describe_options(f, r.options);
  f.assumed({"confidence", "confidence of all intervals", "", positive}, r.confidence);
  describe_result(f, r);
  f({"trusted", "no finding is an error"}, r.trusted);
  f.object(
      {"reliable", "what holds by itself, where the whole need not be trusted; absent: nothing"},
      r.reliable.response || r.reliable.resonances || r.reliable.parameters || r.reliable.margins,
      [&] {
        f({"response", "the lines that are known to 30 %"}, r.reliable.response);
        f({"resonances", "all that are given"}, r.reliable.resonances);
        f({"parameters", "of the drive model"}, r.reliable.parameters);
        f({"margins", "of the loop"}, r.reliable.margins);
      },
      Presence::assumed);
  f({"findings", "what to know of recording and result"}, r.findings);
}

}  // namespace resonid::report
