// SPDX-License-Identifier: MIT
#include "reproduce/i_design.hpp"

#include <algorithm>
#include <cmath>
#include <resonid/fit/response_fit.hpp>
#include <utility>

#include "design/closed_loop.hpp"
#include "design/figures.hpp"
#include "design/largest_gain.hpp"
#include "design/machine.hpp"
#include "reproduce/runs.hpp"
#include "reproduce/spread.hpp"

namespace resonid::reproduction::i {
namespace {

using design::Cascade;
using design::Machine;
using design::Machines;

design::Bounds rst_bounds() {
  design::Bounds bounds;
  bounds.sensitivity = 1.4;
  bounds.load_transfer = 1.3;
  bounds.controller_sensitivity = 6.0;
  return bounds;
}

/// A cascade on the machine, against the one that the machine's own parameters give.
struct OnMachine {
  double kv = 0.0;             ///< 1/s
  double sensitivity = 0.0;    ///< Largest |S|; infinite where the loop is unstable.
  double complementary = 0.0;  ///< Largest |T|.
  double iae = 0.0;            ///< Of the position after a load step, rad s.
};
OnMachine on_machine(const Machine& machine, const Cascade& cascade) {
  const auto figures = design::figures_of(machine, linear_controller(cascade, machine.sample_time_s()));
  const double size = figures.stable ? 1.0 : INFINITY;
  return {cascade.kv, size * figures.peak(design::Transfer::sensitivity).value,
          size * figures.peak(design::Transfer::complementary).value,
          design::position_step_of(machine, cascade).iae};
}
OnMachine designed_on(const Machine& machine, const fit::DriveModel& model) {
  const auto cascade = cascade_for(model);
  return cascade ? on_machine(machine, *cascade) : OnMachine{NAN, NAN, NAN, NAN};
}

report::ComparisonTable table_of(std::string title, const std::vector<OnMachine>& found,
                                 const OnMachine& own) {
  const auto over = [&](double OnMachine::*value) {
    std::vector<double> values;
    for (const OnMachine& one : found) values.push_back(one.*value);
    return spread(values);
  };
  report::ComparisonTable table{std::move(title), {}};
  const auto put = [&](std::string quantity, std::string unit, double OnMachine::*value) {
    if (found.size() == 1)
      table.rows.push_back(row(std::move(quantity), std::move(unit), found.front().*value, own.*value));
    else
      table.rows.push_back(row(std::move(quantity), std::move(unit), over(value), own.*value));
  };
  put("gain of the position, kv", "1/s", &OnMachine::kv);
  put("largest |S| on the machine", "", &OnMachine::sensitivity);
  put("largest |T| on the machine", "", &OnMachine::complementary);
  put("integrated error of the position after a torque step of 1 Nm on the load", "rad s", &OnMachine::iae);
  return table;
}

report::Chart chart_of(std::string title, const std::string& unit, std::vector<double> Sensitivities::*value,
                       const std::vector<Sensitivities>& loops, std::string caption) {
  report::Chart chart;
  chart.title = std::move(title);
  chart.x_label = "frequency (Hz)";
  chart.y_label = "magnitude (dB, 0 dB = 1" + (unit.empty() ? "" : " " + unit) + ")";
  chart.log_x = true;
  for (const Sensitivities& loop : loops) {
    std::vector<double> decibel;
    for (const double v : loop.*value) decibel.push_back(20.0 * std::log10(v));
    chart.curves.push_back({loop.name,
                            chart.curves.empty() ? report::Curve::Mark::line : report::Curve::Mark::dashed,
                            loop.frequency_hz, std::move(decibel)});
  }
  chart.caption = std::move(caption);
  return chart;
}

std::vector<report::Chart> charts_of(const std::vector<Sensitivities>& loops) {
  return {
      chart_of("Sensitivity S = 1/(1 + C G)", "", &Sensitivities::s, loops,
               "From a disturbance of the measured velocity to that velocity. Each loop on the machine; "
               "identified: seed 1. The RST loop is that of the velocity, the cascades' that of the "
               "position, whose loop integrates twice."),
      chart_of("Complementary sensitivity T = C G S", "", &Sensitivities::t, loops,
               "From the reference to the measured velocity, and from its noise, with the sign turned."),
      chart_of("Input sensitivity S G", "(rad/s)/Nm", &Sensitivities::sg, loops,
               "From a torque at the motor to the velocity: what a load disturbance leaves. The source "
               "shapes it where the model neglects dynamics (4.4.1)."),
      chart_of("Output sensitivity C S", "Nm/(rad/s)", &Sensitivities::cs, loops,
               "From noise of the velocity to the torque: robustness against what the model lacks, and "
               "what the drive has to give. The zero of R at the Nyquist frequency takes it away there.")};
}

}  // namespace

fit::DriveModel machine_of(const plant::Truth& truth, double sample_time_s) {
  fit::DriveModel model;
  model.sample_time_s = sample_time_s;
  static_cast<data::TwoMassParameters&>(model.parameters) = truth.two_mass.value();
  model.delay_s = truth.delay_s;
  return model;
}

fit::DriveModel reference_of(const fit::DriveModel& machine) {
  fit::DriveModel model = machine;
  model.parameters.stiffness *= 0.95;
  model.parameters.damping *= 1.20;
  model.parameters.driven_inertia *= 1.15;
  model.parameters.load_inertia *= 1.15;
  return model;
}

fit::DriveModel read_as_two_masses(data::FrequencyResponse response, double sample_time_s, double delay_s) {
  constexpr double kAlike = 0.01;  // of its size: every line counts as much as any other
  response.std.clear();
  for (const auto& value : response.value) response.std.push_back(kAlike * std::abs(value));
  fit::ResponseFitConfig config;
  config.sample_time_s = sample_time_s;
  config.weighting = fit::Weighting::deviations;
  fit::DriveModel read = fit::fit_response(response, config).value().model;
  read.delay_s = delay_s;
  return read;
}

std::optional<Cascade> cascade_for(const fit::DriveModel& model) {
  Machines machines({Machine(model)});
  const auto found = search_cascade(machines, design::default_cascade_bounds());
  if (!found) return std::nullopt;
  return found->cascade;
}

std::optional<design::Rst> rst_for(const fit::DriveModel& model) {
  Machines machines({Machine(model)});
  const auto found = search_rst(machines, rst_bounds(), {{1.0, 1.0}, {1.0, -1.0}});
  if (!found) return std::nullopt;
  return found->rst;
}

Sensitivities sensitivities(std::string name, const fit::DriveModel& machine,
                            const design::LinearController& controller) {
  Sensitivities found;
  found.name = std::move(name);
  constexpr int kLines = 400;
  const double low = 0.2, nyquist_hz = 0.5 / machine.sample_time_s;
  for (int i = 0; i < kLines; ++i)
    found.frequency_hz.push_back(low * std::pow(0.999 * nyquist_hz / low, i / (kLines - 1.0)));
  const fit::SampledResponse plant(machine);
  for (const auto& v : design::LoopFunctions(plant, controller).at(found.frequency_hz)) {
    found.s.push_back(v.size_of(design::Transfer::sensitivity));
    found.t.push_back(v.size_of(design::Transfer::complementary));
    found.sg.push_back(v.size_of(design::Transfer::process_sensitivity));
    found.cs.push_back(v.size_of(design::Transfer::controller_sensitivity));
  }
  return found;
}

report::Section design_section(const fit::DriveModel& machine_model, const Identified& identified) {
  const double step = machine_model.sample_time_s;
  const Machine machine(machine_model);
  const fit::DriveModel reference = reference_of(machine_model);
  const OnMachine own = designed_on(machine, machine_model);
  const auto all_on = [&](const std::vector<fit::DriveModel>& models) {
    std::vector<OnMachine> found;
    for (const auto& model : models) found.push_back(designed_on(machine, model));
    return found;
  };
  report::Section section;
  section.title = "What the model is for: a controller";
  section.text = {
      "Publication I shapes S and T of a position controller in cascade with velocity feed-forward, from the "
      "identified and from the reference model, and compares both. Taken here: a proportional position "
      "controller over a PI of the velocity, all three gains together for the least integrated error of the "
      "position after a torque step on the load, with |S| at most 1.4 and |position of the load by its "
      "reference| at most 1.05 at every frequency of the model (docs/methods/tune.md 8). The feed-forward "
      "is in no loop and changes none of this. Every design is then judged on the machine.",
      "The reference model has 5 % less stiffness, 20 % more damping and 15 % more inertia than the machine, "
      "the bands that the source gives its own. The published model, B/A of order 3, is read as two masses "
      "first, fitted to its response from 2 to 33 Hz.",
      "Beside the cascades stands an RST controller of the velocity from the published model of seed 1, "
      "which "
      "the source names as what such a model allows (4.4.1): poles placed with an integrator and a zero at "
      "the Nyquist frequency as fixed parts, searched for the least error of the load under |S| <= 1.4, "
      "|T_load| <= 1.3 and |C S| <= 6 Nm/(rad/s) (docs/methods/tune.md 9)."};
  section.tables = {table_of("Cascade from the reference model", {designed_on(machine, reference)}, own),
                    table_of("Cascade from the output error of order 3, direct, as published",
                             all_on(identified.published), own),
                    table_of("Cascade from the machine's own parameters", all_on(identified.physical), own)};
  std::vector<Sensitivities> loops;
  for (const auto& [name, model] :
       {std::pair("cascade, the machine itself", machine_model), std::pair("cascade, reference", reference),
        std::pair("cascade, identified", identified.published.front())})
    if (const auto cascade = cascade_for(model))
      loops.push_back(sensitivities(name, machine_model, linear_controller(*cascade, step)));
  if (const auto rst = rst_for(identified.published.front())) {
    const design::LinearController controller(rst->controller(step));
    loops.push_back(sensitivities("RST, identified", machine_model, controller));
    const auto f = design::figures_of(machine, controller);
    report::ComparisonTable table{"RST from the output error of order 3, on the machine", {}};
    const auto put = [&](const char* quantity, const char* unit, design::Transfer transfer) {
      constexpr double kDigits = 100.0;  // a search's least has no more
      table.rows.push_back(row(quantity, unit, std::round(kDigits * f.peak(transfer).value) / kDigits));
    };
    put("largest |S|", "", design::Transfer::sensitivity);
    put("largest |T_load|", "", design::Transfer::load_transfer);
    put("largest |C S|", "Nm s/rad", design::Transfer::controller_sensitivity);
    section.tables.push_back(std::move(table));
  }
  section.charts = charts_of(loops);
  return section;
}

}  // namespace resonid::reproduction::i
