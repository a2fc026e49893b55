// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <resonid/report/detail/inspection.hpp>
#include <resonid/response/detail/power_spectrum.hpp>
#include <utility>

#include "report/document/document_cells.hpp"
#include "report/document/words.hpp"
#include "report/pages/curves.hpp"

namespace resonid::report {
namespace {

using identification::Inspection;
using identification::LoopState;
using identification::SignalFacts;

std::string or_dash(const std::string& text) { return text.empty() ? "-" : text; }

Table columns_table(const FileInspection& i) {
  Table table{"Columns", {"Column", "Unit", "Seems to be", "From", "To", "Missing"}, {}};
  for (const auto& c : i.columns) {
    const bool any = c.least <= c.greatest;
    table.rows.push_back(
        {c.name, or_dash(c.unit), or_dash(c.guess), any ? fmt::format("{:.5g}", c.least) : "-",
         any ? fmt::format("{:.5g}", c.greatest) : "-", c.missing == 0 ? "" : fmt::format("{}", c.missing)});
  }
  return table;
}

Table signals_table(const Inspection& r) {
  Table table{"Signals", {"Signal", "Column", "Unit", "From", "To", "Rms", "Resolution", "Drift"}, {}};
  for (const SignalFacts& s : r.signals)
    table.rows.push_back({s.role, s.name, s.unit, fmt::format("{:.5g}", s.least),
                          fmt::format("{:.5g}", s.greatest), fmt::format("{:.3g}", s.rms),
                          s.step > 0.0 ? fmt::format("{:.3g}", s.step) : "fine",
                          fmt::format("{:.2g}", s.drift)});
  return table;
}

std::string aligned(const Table& table) {
  std::vector<std::size_t> width;
  for (std::size_t c = 0; c < table.columns.size(); ++c) {
    width.push_back(columns_of(table.columns[c]));
    for (const auto& row : table.rows) width[c] = std::max(width[c], columns_of(row[c]));
  }
  std::string text;
  const auto put = [&](const std::vector<std::string>& row) {
    std::string line = " ";
    for (std::size_t c = 0; c < row.size(); ++c) line += fmt::format(" {:<{}}", row[c], width[c] + 1);
    text += line.substr(0, line.find_last_not_of(' ') + 1) + "\n";
  };
  put(table.columns);
  for (const auto& row : table.rows) put(row);
  return text;
}

std::string sampling_sentence(const Inspection& r) {
  std::string text =
      fmt::format("{} samples at {:g} Hz, {:.4g} s", r.record.samples, r.record.sample_rate_hz, r.duration_s);
  const auto& s = r.sampling;
  if (!s.measured) return text + ".";
  const double jitter = s.jitter_rms_s * r.record.sample_rate_hz;
  constexpr double kNone = 1e-4;  // of the sample time
  text +=
      jitter < kNone ? "; no jitter" : fmt::format("; jitter {:.2g} % of the sample time", 100.0 * jitter);
  text += s.gaps == 0 ? "; no gaps"
                      : fmt::format("; {} gap{}, the longest {:.3g} s", s.gaps, s.gaps == 1 ? "" : "s",
                                    s.largest_gap_s);
  if (!s.filled.empty()) text += fmt::format("; {} samples interpolated", s.filled.size());
  return text + ".";
}

std::string excitation_sentence(const Inspection& r) {
  std::string unit;
  for (const auto& s : r.signals)
    if (s.name == r.exciting) unit = " " + s.unit;
  return fmt::format("Excitation: {} ({}). {} excites {:.3g} ... {:.3g} Hz with {:.3g}{} rms.", r.excitation,
                     r.excitation_because, r.exciting, r.low_hz, r.high_hz, r.strength, unit);
}

std::string loop_sentence(const Inspection& r) {
  switch (r.loop) {
    case LoopState::closed:
      return "Loop: closed; the noise of the output comes back in the input. For its margins give the "
             "controller.";
    case LoopState::open:
      return "Loop: open, or so soft that no noise of the output comes back in the input.";
    case LoopState::unknown:
      break;
  }
  return "Loop: open or closed, the recording does not tell.";
}

Chart signal_chart(const data::Record& record, const data::Channel& channel, const std::string& role) {
  Chart chart;
  chart.title = fmt::format("{}: {}", role, channel.name);
  chart.x_label = "Time in s";
  chart.y_label = fmt::format("{} in {}", channel.name, channel.unit);
  chart.curves = {thinned(channel.name, channel.samples, record.start_time_s, record.sample_rate_hz)};
  return chart;
}

Chart spectrum_chart(const data::Record& record, const data::Channel& channel) {
  Chart chart;
  chart.title = fmt::format("Spectrum of {}", channel.name);
  chart.x_label = "Frequency in Hz";
  chart.y_label = fmt::format("Power in dB of ({})^2 per line", channel.unit);
  chart.log_x = true;
  chart.curves = {
      power_curve(channel.name, response::power_spectrum(channel.samples, record.sample_rate_hz))};
  return chart;
}

std::vector<std::string> sentences(const FileInspection& i) {
  if (!i.recording) return {"No recording yet: " + i.obstacle};
  return {sampling_sentence(*i.recording), excitation_sentence(*i.recording), loop_sentence(*i.recording)};
}

}  // namespace

std::string summary_text(const FileInspection& i) {
  std::string text = fmt::format("{}: {} rows, {} columns\n", i.file, i.rows, i.columns.size());
  text += reading_text(i.recording ? i.recording->record.reading : i.reading) + "\n";
  text += aligned(columns_table(i)) + "\n";
  if (i.recording) text += aligned(signals_table(*i.recording)) + "\n";
  for (const auto& s : sentences(i)) text += wrapped(s, "", "  ") + "\n";
  if (i.recording) text += findings_text(i.recording->findings);
  return text + fmt::format("\nGo on with:\n  {}\n", i.command);
}

Document document(const FileInspection& i, const data::Record* record) {
  Document d;
  d.title = i.file;
  d.kind = "inspection";
  d.summary = sentences(i);
  d.summary.push_back("Go on with: " + i.command);
  d.facts = {fmt::format("{} rows", i.rows), fmt::format("{} columns", i.columns.size())};
  const auto& reading = i.recording ? i.recording->record.reading : i.reading;
  Section columns;
  columns.title = "What the file holds";
  columns.sheet = true;
  for (const auto& note : reading) columns.text.push_back(note);
  columns.plain_tables = {columns_table(i)};
  if (i.recording) columns.plain_tables.push_back(signals_table(*i.recording));
  d.sections.push_back(std::move(columns));
  if (!i.recording || record == nullptr) {
    d.badge = Badge{false, "No recording", "see the summary", true};
    return d;
  }
  const auto& r = *i.recording;
  d.badge = Badge{true, "Readable", fmt::format("{} with {}", r.record.output, r.record.input)};
  d.findings = r.findings;
  d.cards = {{"Sample rate",
              fmt::format("{:g}", r.record.sample_rate_hz),
              "Hz",
              {fmt::format("{} samples", r.record.samples)}},
             {"Excitation", r.excitation, "", {fmt::format("{:.3g} ... {:.3g} Hz", r.low_hz, r.high_hz)}},
             {"Loop", std::string(name_of(r.loop))}};
  Section signals, spectra;
  signals.title = "Signals";
  spectra.title = "Spectra";
  spectra.side_by_side = true;
  const std::pair<const char*, const data::Channel*> channels[] = {{"Input", &record->input},
                                                                   {"Output", &record->output},
                                                                   {"Excitation", &record->excitation},
                                                                   {"Reference", &record->reference}};
  for (const auto& [role, channel] : channels) {
    if (!channel->present()) continue;
    signals.charts.push_back(signal_chart(*record, *channel, role));
    auto spectrum = spectrum_chart(*record, *channel);
    if (!spectrum.curves.front().x.empty())
      spectra.charts.push_back(std::move(spectrum));  // of a constant: none
  }
  d.sections.push_back(std::move(signals));
  d.sections.push_back(std::move(spectra));
  return d;
}

}  // namespace resonid::report
