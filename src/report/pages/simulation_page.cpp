// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <cctype>
#include <complex>
#include <resonid/base/constants.hpp>
#include <resonid/base/enum_names.hpp>
#include <resonid/report/detail/truth.hpp>

#include "report/document/document_cells.hpp"
#include "report/pages/curves.hpp"

namespace resonid::report {
namespace {

Table modes_table(const plant::Truth& truth) {
  Table table{"Modes of the undamped machine", {"mode", "frequency in Hz", "damping ratio"}, {}};
  const auto add = [&table](const char* name, const std::vector<data::UndampedMode>& modes) {
    for (const auto& mode : modes)
      table.rows.push_back({name, number_text(mode.frequency_hz), number_text(mode.damping_ratio)});
  };
  add("anti-resonance", truth.antiresonances);
  add("resonance", truth.resonances);
  return table;
}

Table margins_table(const diagnostics::LoopMargins& m) {
  Table table{"Margins of the real loop", {"figure", "value"}, {}};
  const auto add = [&table](const char* name, const std::optional<double>& value) {
    if (value) table.rows.push_back({name, number_text(*value)});
  };
  add("crossover in Hz", m.crossover_hz());
  add("phase margin in deg", m.phase_margin_deg());
  add("gain margin in dB", m.gain_margin_db);
  add("modulus margin", m.modulus_margin);
  return table;
}

Section truth_section(const SimulatedTruth& simulated) {
  const auto& truth = simulated.truth;
  Section s;
  s.title = "What is true";
  if (!truth.resonances.empty()) s.plain_tables.push_back(modes_table(truth));
  if (truth.controller) s.plain_tables.push_back(margins_table(simulated.margins));
  Chart magnitude, phase;
  magnitude.title = "Magnitude";
  magnitude.y_label = "Torque to what is measured, in dB";
  magnitude.curves = {level_db("machine", truth.response)};
  phase.title = "Phase";
  phase.y_label = "Phase in deg";
  phase.curves = {{"machine", Curve::Mark::line, truth.response.frequency_hz, {}}};
  for (const auto& value : truth.response.value) phase.curves[0].y.push_back(180.0 / kPi * std::arg(value));
  for (Chart* chart : {&magnitude, &phase}) {
    chart->x_label = "Frequency in Hz";
    chart->log_x = true;
    if (!truth.response.value.empty()) s.charts.push_back(*chart);
  }
  if (truth.over_time) {
    Chart course;
    course.title = "Resonance over time";
    course.x_label = "Time in s";
    course.y_label = "Resonance in Hz";
    course.curves = {
        {"resonance", Curve::Mark::line, truth.over_time->time_s, truth.over_time->resonance_hz}};
    s.charts.push_back(std::move(course));
  }
  return s;
}

Section record_section(const data::Record& record) {
  Section s;
  s.title = "Record";
  for (const auto& [name, channel] : {std::pair{"Excitation", &record.excitation},
                                      {"Input", &record.input},
                                      {"Output", &record.output},
                                      {"Reference", &record.reference},
                                      {"Position", &record.position},
                                      {"Second output", &record.second_output}}) {
    if (!channel->present()) continue;
    Chart chart;
    chart.title = name;
    chart.x_label = "Time in s";
    chart.y_label = fmt::format("{} in {}", channel->name, channel->unit);
    chart.curves = {thinned(channel->name, channel->samples, record.start_time_s, record.sample_rate_hz)};
    s.charts.push_back(std::move(chart));
  }
  return s;
}

}  // namespace

Document document(const plant::Simulation& simulation) {
  const auto& record = simulation.record;
  const auto& truth = simulation.truth;
  Document d;
  d.kind = "simulation";
  d.title = fmt::format("{} drive, simulated", name_of(truth.structure));
  d.title[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(d.title[0])));
  d.summary = {fmt::format("{} samples at {:g} Hz in {} loop, seed {}.", record.samples(),
                           record.sample_rate_hz, truth.controller ? "closed" : "open", truth.seed)};
  if (truth.delay_s > 0.0)
    d.summary.push_back(fmt::format("The measurement is {:g} ms late; the response shown leaves that out.",
                                    1e3 * truth.delay_s));
  d.sections = {truth_section(simulated_truth(truth)), record_section(record)};
  return d;
}

}  // namespace resonid::report
