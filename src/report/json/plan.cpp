// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cmath>

#include "report/document/plan_words.hpp"
#include "report/json/results.hpp"

namespace resonid::report {
namespace {

using planning::Experiment;
using planning::Figure;
using planning::Plan;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

void describe_figure(Fields& f, Figure& figure) {
  f({"name", "name of the figure, \"stiffness\", \"resonance\""}, figure.name);
  f({"value", "value of the nominal model", "unit"}, figure.value);
  f.unless_empty({"unit", "unit of value and std"}, figure.unit);
  f.unless(kInfinity, {"std", "predicted for the nominal model", "unit", not_negative}, figure.std);
}

void describe_figures(Fields& f, std::vector<Figure>& figures) {
  f.list(
      {"figures", "what the experiment will tell"}, true, figures,
      [&](Figure& figure) { describe_figure(f, figure); }, Presence::required);
}

void describe_extremes(Fields& f, planning::PeakValues& e) {
  f.object({"extremes", "largest values over all possible drives"}, [&] {
    f({"excitation", "peak of what is added to the controller's output"}, e.excitation);
    f({"torque", "peak of what the machine gets"}, e.torque);
    f({"torque_rms", "rms of that torque"}, e.torque_rms);
    f({"velocity", "peak, above the operating point"}, e.velocity);
    f({"stroke", "largest less smallest position"}, e.stroke);
  });
}

void describe_kind(Fields& f, Experiment& x, planning::ExcitationType type) {
  using enum planning::ExcitationType;
  if (type == multisine) {
    f({"period_samples", "length of one period"}, x.period_samples);
    f({"periods", "number of them"}, x.periods);
    f({"settle_periods", "periods until the drive has settled"}, x.settle_periods);
    f({"lines_hz", "excited", "Hz"}, x.frequency_hz);
    f({"amplitudes", "per line"}, x.line_amplitude);
    f({"phases_rad", "per line", "rad"}, x.phase_rad);
  } else if (type == chirp) {
    f({"from_hz", "first frequency", "Hz"}, x.from_hz);
    f({"to_hz", "last frequency", "Hz"}, x.to_hz);
  } else {
    f({"register_length", "length of the shift register"}, x.register_length);
    f({"clock_divider", "samples per bit"}, x.clock_divider);
    f({"power_below_band", "part of the power below the band"}, x.power_below_band);
    f({"power_above_band", "part of the power above it"}, x.power_above_band);
  }
}

void describe_excitation(Fields& f, bool there, Experiment& x) {
  f.object({"excitation", "what is injected"}, there, [&] {
    f({"peak", "peak of its samples"}, x.amplitude);
    f({"crest_factor", "peak over rms"}, x.crest_factor);
    f.one_of(3, static_cast<std::size_t>(x.type),
             [&](std::size_t kind) { describe_kind(f, x, static_cast<planning::ExcitationType>(kind)); });
  });
}

void describe_limits(Fields& f, planning::Limits& l) {
  f.object({"limits", "what the drive stands, above the operating point; absent: no limit"}, [&] {
    f.unless(kInfinity, {"torque", "peak of what the machine gets"}, l.torque);
    f.unless(kInfinity, {"excitation", "peak of what is added to the controller's output"}, l.excitation);
    f.unless(kInfinity, {"torque_rms", "rms of that torque over the experiment"}, l.torque_rms);
    f.unless(kInfinity, {"velocity", "peak"}, l.velocity);
    f.unless(kInfinity, {"stroke", "largest less smallest position"}, l.stroke);
    f.unless(kInfinity, {"time_s", "whole experiment", "s"}, l.time_s);
  });
}

void describe_drive(Fields& f, planning::NominalDrive& drive) {
  auto& m = drive.model;
  f.object({"model", "nominal model that was planned with"}, [&] {
    f.choice({"structure", "what the drive is taken for"}, m.structure);
    f.object({"parameters", "estimated ones, in SI units"}, [&] {
      for (int i = 0; i < fit::kParameterCount; ++i) {
        const auto at = static_cast<std::size_t>(i);
        const auto parameter = static_cast<fit::Parameter>(i);
        double value = f.reading() ? 0.0 : m.value(parameter);
        const bool there =
            f.only_if(m.estimated[at], {fit::kParameterNames[at], "as in resonid.identification/1"}, value);
        if (!f.reading() || !there) continue;
        m.set(parameter, value);
        m.estimated[at] = true;
      }
    });
    f({"delay_s", "known one, in the measured velocity", "s", not_negative}, m.known_delay_s);
    double noise = std::sqrt(drive.noise.innovation_variance);
    f({"noise_rms", "rms of the white noise behind that of the measured velocity", "", not_negative}, noise);
    if (f.reading()) drive.noise.innovation_variance = noise * noise;
  });
}

/// An accuracy target with what is expected of it.
struct Wanted {
  std::string figure, unit;
  double wanted = 0.0, expected = kInfinity;
  bool reached = false;
};

void describe_targets(Fields& f, Plan& plan, Experiment& x) {
  std::vector<Wanted> list;
  for (std::size_t i = 0; f.writing() && i < x.targeted.size(); ++i) {
    const double wanted = wanted_of(plan, i), expected = x.targeted[i].std;
    list.push_back(
        {x.targeted[i].name, x.targeted[i].unit, wanted, expected, expected <= wanted * (1.0 + 1e-9)});
  }
  f.list(
      {"wishes", "accuracy targets: standard deviations that are wanted"}, true, list,
      [&](Wanted& w) {
        f({"figure", "name of it"}, w.figure);
        f({"wanted_std", "wanted standard deviation", "unit", positive}, w.wanted);
        f.unless(kInfinity, {"expected_std", "expected over the possible drives; absent: unknown", "unit"},
                 w.expected);
        f({"reached", "whether it is met"}, w.reached);
        f.unless_empty({"unit", "unit of both"}, w.unit);
      },
      Presence::required);
  if (!f.reading()) return;
  for (const auto& w : list) {
    plan.config.targets.push_back({w.figure, w.wanted, false});
    x.targeted.push_back({w.figure, w.unit, 0.0, w.expected});
  }
}

void describe_alternative(Fields& f, Experiment& x) {
  f.choice({"type", "kind of excitation"}, x.type);
  f({"peak", "peak of its samples"}, x.amplitude);
  f.unless(kInfinity, {"worst_ratio", "largest of expected over wanted std"}, x.ratio);
  f({"needed_s", "time after which all targets would be met", "s"}, x.needed_s);
  f({"least_s", "least time of its kind that meets all targets", "s"}, x.least_s);
  describe_extremes(f, x.peaks);
  describe_figures(f, x.figures);
  describe_excitation(f, x.type == planning::ExcitationType::prbs, x);
}

void describe_alternatives(Fields& f, Plan& plan) {
  std::vector<Experiment> others;
  if (!f.reading()) others.assign(plan.experiments.begin() + 1, plan.experiments.end());
  f.list(
      {"alternatives", "other kinds of the same length"}, true, others,
      [&](Experiment& x) { describe_alternative(f, x); }, Presence::required);
  if (f.reading()) plan.experiments.insert(plan.experiments.end(), others.begin(), others.end());
}

void describe_two_steps(Fields& f, std::optional<planning::TwoStagePlan>& two) {
  f.object({"two_steps", "two runs, where they take clearly less time"}, two.has_value(), [&] {
    if (!two) two.emplace();
    f({"first_s", "time limit of the first", "s"}, two->first_s);
    f({"spread", "spread of the second plan"}, two->spread);
    f({"second_s", "predicted length of the second", "s"}, two->second_s);
    f.derived({"total_s", "sum of both", "s"}, two->total_s());
    f({"one_s", "what one run takes", "s"}, two->one_s);
  });
}

void describe_experiment(Fields& f, Plan& plan, Experiment& x) {
  f.choice({"type", "kind of excitation"}, x.type);
  f({"duration_s", "duration of the experiment", "s", positive}, x.duration_s);
  double rate = f.writing() ? 1.0 / plan.config.drive.model.sample_time_s : 0.0;
  f({"sample_rate_hz", "sample rate of the drive", "Hz", positive}, rate);
  if (f.reading()) plan.config.drive.model.sample_time_s = 1.0 / rate;
  f.derived({"samples", "samples of the experiment"},
            x.excitation.empty() ? static_cast<std::size_t>(std::llround(
                                       std::clamp(x.duration_s * rate, 0.0, planning::kMostSamples)))
                                 : x.excitation.size());
  f({"binding_limit", "limit that keeps the amplitude down, \"torque\""}, x.binding);
  f.choice({"criterion", "what the power is distributed for"}, plan.config.criterion);
  f({"spread", "part by which the nominal model may be wrong"}, plan.config.spread);
  f({"drives", "possible drives that were averaged over"}, plan.drives);
  describe_limits(f, plan.config.limits);
  describe_drive(f, plan.config.drive);
  describe_excitation(f, true, x);
  describe_extremes(f, x.peaks);
  describe_targets(f, plan, x);
  f.unless(kInfinity, {"worst_ratio", "largest of expected over wanted std"}, x.ratio);
  describe_figures(f, x.figures);
  for (auto& targeted : x.targeted)
    for (const auto& figure : x.figures)
      if (f.reading() && figure.name == targeted.name) targeted.value = figure.value;
}

}  // namespace

void describe(Fields& f, Plan& plan) {
  f.schema({"resonid.plan/1"});
  f({"reached", "all targets within the limits"}, plan.reached);
  if (plan.experiments.empty()) plan.experiments.emplace_back();
  Experiment x = f.writing() ? plan.planned() : Experiment{};
  describe_experiment(f, plan, x);
  auto& band = plan.config.band_hz;
  std::vector<double> ends;
  if (band) ends = {band->first, band->second};
  f.unless_empty({"band_hz", "lowest and highest frequency that may be excited", "Hz"}, ends);
  if (f.reading() && !ends.empty()) {
    f.require(ends.size() == 2, "band_hz", "two numbers");
    band = {ends.front(), ends.back()};
  }
  f({"needed_s", "time after which all targets would be met", "s"}, x.needed_s);
  f({"needed_amplitude", "factor with which all targets would be met in the same time"}, x.needed_amplitude);
  f({"noise_dominates", "fed-back noise tells more than the excitation"}, x.noise_dominates);
  f({"noise_torque", "standard deviation of the torque that the controller makes of noise"},
    plan.noise_torque);
  f.list({"left_out", "kinds that could not be compared"}, !plan.skipped.empty(), plan.skipped,
         [&](planning::SkippedKind& out) {
           f.choice({"type", "kind of excitation"}, out.type);
           f({"reason", "why"}, out.reason);
         });
  describe_two_steps(f, plan.two_stages);
  if (f.reading()) plan.experiments.front() = std::move(x);
  describe_alternatives(f, plan);
}

}  // namespace resonid::report
