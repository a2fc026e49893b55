// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <cctype>
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

Section truth_section(const SimulatedTruth& simulated, const data::Record& record) {
  const auto& truth = simulated.truth;
  Section s;
  s.title = "What is true";
  s.sheet = true;
  if (!truth.resonances.empty()) s.plain_tables.push_back(modes_table(truth));
  if (truth.controller) s.plain_tables.push_back(margins_table(simulated.margins));
  if (!truth.response.value.empty()) {
    BodeCharts bode;
    bode.magnitude.y_label =
        fmt::format("Magnitude in dB, 0 dB = 1 ({})/{}", record.output.unit, record.input.unit);
    bode.magnitude.curves = {level_db("machine", truth.response)};
    bode.phase.curves = {phase_deg("machine", truth.response)};
    s.charts = {bode.magnitude, bode.phase};
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
  s.title = "Recording";
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

std::vector<Card> cards_of(const SimulatedTruth& simulated) {
  std::vector<Card> cards;
  const auto add = [&](const char* name, double value, const char* unit, std::string under) {
    if (cards.size() < 6) cards.push_back({name, fmt::format("{:.4g}", value), unit, {std::move(under)}});
  };
  const auto& truth = simulated.truth;
  const auto modes = [&](const char* name, const std::vector<data::UndampedMode>& list) {
    for (const auto& mode : list)
      add(name, mode.frequency_hz, "Hz", fmt::format("damping ratio {:.2g}", mode.damping_ratio));
  };
  modes("Anti-resonance", truth.antiresonances);
  modes("Resonance", truth.resonances);
  if (!truth.controller) return cards;
  const auto& m = simulated.margins;
  if (const auto f = m.crossover_hz()) add("Crossover", *f, "Hz", "of the open loop");
  if (const auto phase = m.phase_margin_deg()) add("Phase margin", *phase, "deg", "delay included");
  add("Modulus margin", m.modulus_margin, "", fmt::format("Ms {:.3g}", 1.0 / m.modulus_margin));
  return cards;
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
  d.facts = {fmt::format("{} samples", record.samples()), fmt::format("{:g} Hz", record.sample_rate_hz),
             fmt::format("{:.3g} s", static_cast<double>(record.samples()) / record.sample_rate_hz)};
  d.badge = Badge{true, "Simulated", "what is true of the drive is known"};
  const auto simulated = simulated_truth(truth);
  d.cards = cards_of(simulated);
  d.sections = {truth_section(simulated, record), record_section(record)};
  return d;
}

}  // namespace resonid::report
