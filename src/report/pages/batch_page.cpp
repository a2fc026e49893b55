// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <complex>
#include <resonid/base/constants.hpp>
#include <resonid/report/detail/batch.hpp>
#include <resonid/report/json.hpp>

#include "report/document/batch_tables.hpp"
#include "report/document/result_parts.hpp"
#include "report/document/words.hpp"
#include "report/pages/curves.hpp"

namespace resonid::report {
namespace {

using identification::BatchEntry;

constexpr std::size_t kMostCurves = 24;  // more cannot be told apart
constexpr std::size_t kMostBands = 4;
constexpr std::size_t kMostPoints = 400;  // per curve, spread over the lines

/// Every so many lines of a curve, the first and last included.
std::vector<std::size_t> spread_lines(std::size_t lines) {
  std::vector<std::size_t> rows;
  const std::size_t count = std::min(lines, kMostPoints);
  for (std::size_t i = 0; i < count; ++i) rows.push_back(count > 1 ? i * (lines - 1) / (count - 1) : 0);
  return rows;
}

double decibels(double x) { return 20.0 * std::log10(x); }

/// Magnitude with the region of the given confidence as its band.
Curve magnitude(const std::string& name, const data::FrequencyResponse& g, double confidence, bool band) {
  Curve curve{name, Curve::Mark::line, {}, {}};
  for (const std::size_t i : spread_lines(g.lines())) {
    if (!determined(g, i)) continue;  // nothing excites it
    const double size = std::abs(g.value[i]);
    curve.x.push_back(g.frequency_hz[i]);
    curve.y.push_back(decibels(size));
    if (!band || g.std.size() != g.lines()) continue;
    constexpr double kFloor = 0.03;  // a band below -30 dB under its curve ends there
    const double radius = data::confidence_radius(g.std[i], confidence);
    curve.lower.push_back(decibels(std::max(size - radius, kFloor * size)));
    curve.upper.push_back(decibels(size + radius));
  }
  return curve;
}

/// Unwrapped phase in degrees.
Curve phase(const std::string& name, const data::FrequencyResponse& g) {
  Curve curve{name, Curve::Mark::line, {}, {}};
  double turns = 0.0, last = 0.0;
  for (const std::size_t i : spread_lines(g.lines())) {
    if (!determined(g, i)) continue;
    const double angle = std::arg(g.value[i]) * 180.0 / kPi;
    if (!curve.y.empty()) turns -= 360.0 * std::round((angle + turns - last) / 360.0);
    last = angle + turns;
    curve.x.push_back(g.frequency_hz[i]);
    curve.y.push_back(last);
  }
  return curve;
}

Section responses_section(const BatchResult& result) {
  Chart amplitude{"Magnitude", "Frequency in Hz", "Magnitude in dB", true, false, {}, ""};
  Chart angle{"Phase", "Frequency in Hz", "Phase in degrees", true, false, {}, ""};
  const auto& batch = result.batch;
  const auto identified = static_cast<std::size_t>(std::count_if(
      batch.entries.begin(), batch.entries.end(), [](const BatchEntry& e) { return e.result.has_value(); }));
  const auto add = [&](const std::string& name, const data::FrequencyResponse& g, bool band) {
    amplitude.curves.push_back(magnitude(name, g, batch.confidence, band));
    angle.curves.push_back(phase(name, g));
  };
  if (result.joint) add("joined", result.joint->result.response, true);
  for (const auto& e : batch.entries)
    if (e.result && amplitude.curves.size() < kMostCurves)
      add(e.file, e.result->response, identified <= kMostBands && !result.joint);
  amplitude.caption =
      fmt::format("Measured responses, known delay removed.{}{}",
                  identified > kMostCurves ? fmt::format(" The first {} recordings.", kMostCurves) : "",
                  result.joint || identified <= kMostBands
                      ? fmt::format(" Bands: {:.0f} % confidence.", 100.0 * batch.confidence)
                      : "");
  Section section;
  section.title = "All responses";
  section.charts = {amplitude, angle};
  return section;
}

/// The loops near the point -1.
Section loops_section(const BatchResult& result) {
  Chart chart = nyquist_plane("Open loops");
  const auto add = [&](const std::string& name, const data::FrequencyResponse& loop) {
    data::FrequencyResponse shown;
    for (const std::size_t i : spread_lines(loop.lines())) {
      shown.frequency_hz.push_back(loop.frequency_hz[i]);
      shown.value.push_back(loop.value[i]);
    }
    chart.curves.push_back(nyquist_curve(name, shown));
  };
  if (result.joint && result.joint->result.loop) add("joined", result.joint->result.loop->curve);
  for (const auto& e : result.batch.entries)
    if (e.result && e.result->loop && chart.curves.size() < kMostCurves) add(e.file, e.result->loop->curve);
  Section section;
  if (chart.curves.empty()) return section;
  section.title = "All loops";
  section.charts = {chart};
  return section;
}

/// Every figure over the recordings, each with its interval.
Section intervals_section(const BatchResult& result) {
  Section section;
  section.title = "Parameters over the recordings";
  section.side_by_side = section.sheet = true;
  const double z = two_sided_quantile(result.batch.confidence);
  for (const auto& f : result.batch.figures) {
    if (f.values.size() < 2) continue;
    Intervals list;
    const std::string name = heading(f);
    list.title = name.substr(0, name.rfind(", "));
    list.unit = f.unit;
    list.mean = f.mean;
    if (f.std) list.mean_half_width = z * *f.std;
    if (f.probability) list.verdict = f.agrees ? "agrees" : "differs";
    for (const auto& v : f.values) {
      const auto& entry = result.batch.entries[v.record];
      list.rows.push_back({base_name(entry.file), v.value, v.std ? z * *v.std : 0.0,
                           !(entry.result && entry.result->trusted)});
    }
    section.intervals.push_back(std::move(list));
  }
  if (!section.intervals.empty())
    section.text = {
        fmt::format("Bars: {:.0f} % confidence intervals; the band through all rows is the weighted mean. "
                    "Recordings that "
                    "are not trusted are pale and do not widen the scale.",
                    100.0 * result.batch.confidence)};
  return section;
}

Section record_section(const BatchEntry& entry) {
  Section section;
  section.folded = true;
  section.title =
      entry.file + (entry.result ? (entry.result->trusted ? ": trusted" : ": not trusted") : ": error");
  if (!entry.result) {
    section.text = {error_line(entry)};
    return section;
  }
  const auto& r = *entry.result;
  section.text = sentences(r);
  section.text.push_back(fmt::format("{} samples at {:g} Hz; response by {}, {} approach, {} lines.",
                                     r.record.samples, r.record.sample_rate_hz, r.method, r.approach,
                                     r.response.lines()));
  section.plain_tables.push_back(figures_table(r));
  if (!r.choices.empty()) section.plain_tables.push_back(choices_table(r.choices));
  if (!r.structures.empty()) section.plain_tables.push_back(structures_table(r.structures));
  if (!r.findings.empty()) {
    auto findings = findings_section(r.findings).plain_tables.front();
    findings.title = "Findings";
    section.plain_tables.push_back(std::move(findings));
  }
  return section;
}

/// The verdict beside the name, so that it shows however many figures follow.
Table verdict_first(Table table) {
  const auto is_verdict = [](const std::string& name) { return name == "verdict" || name == "Verdict"; };
  const auto at =
      std::find_if(table.columns.begin(), table.columns.end(), is_verdict) - table.columns.begin();
  if (at < 2 || at == std::ssize(table.columns)) return table;
  std::rotate(table.columns.begin() + 1, table.columns.begin() + at, table.columns.begin() + at + 1);
  for (auto& row : table.rows)
    if (std::ssize(row) > at) std::rotate(row.begin() + 1, row.begin() + at, row.begin() + at + 1);
  return table;
}

Section joint_section(const identification::Joint& joint) {
  Section section;
  section.title = "Joint estimate";
  section.text = {
      "All recordings as one experiment. Each recording's parameters are compared with those of all others; "
      "p is "
      "the probability of such a distance by noise alone. The lines' chi2 per degree of freedom is 1 where "
      "the standard deviation between the recordings is that of their error bars."};
  auto records = consistency_table(joint);
  records.title = "Each recording against the others";
  auto figures = figures_table(joint.result);
  figures.title = "Joint figures";
  section.plain_tables = {figures, verdict_first(std::move(records))};
  return section;
}

/// The joint estimate's findings; else the warnings and errors of all recordings, those of one kind together.
std::vector<diagnostics::Finding> findings_of(const BatchResult& result) {
  if (result.joint) return result.joint->result.findings;
  std::vector<diagnostics::Finding> list;
  std::vector<std::string> files;
  for (const auto& entry : result.batch.entries) {
    if (!entry.result) {
      list.push_back({"not identified", diagnostics::Severity::error, {}, {}, error_line(entry)});
      files.emplace_back();
      continue;
    }
    for (const auto& f : entry.result->findings) {
      if (f.severity == diagnostics::Severity::info) continue;
      std::size_t i = 0;
      while (i < list.size() && (list[i].id != f.id || list[i].severity != f.severity)) ++i;
      if (i == list.size()) {
        list.push_back({f.id, f.severity, {}, {}, f.meaning});
        files.emplace_back();
      }
      files[i] += (files[i].empty() ? "" : ", ") + base_name(entry.file);
    }
  }
  for (std::size_t i = 0; i < list.size(); ++i)
    if (!files[i].empty()) list[i].meaning = files[i] + ": " + list[i].meaning;
  return list;
}

/// Means over the recordings, or the joint estimate's figures.
std::vector<Card> cards_of(const BatchResult& result) {
  constexpr std::size_t kMostCards = 6;
  const double z = two_sided_quantile(result.batch.confidence);
  std::vector<Card> cards;
  for (const auto& f : result.batch.figures) {
    if (f.values.size() < 2 || f.name == "offset" || f.name.find("damping_ratio") != std::string::npos)
      continue;
    if (cards.size() == kMostCards) break;
    const std::string name = heading(f);
    Card card = estimate_card(name.substr(0, name.rfind(", ")), f.mean, f.std ? z * *f.std : 0.0, f.unit,
                              result.batch.confidence, {fmt::format("mean of {}", f.values.size())});
    card.name[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(card.name[0])));
    cards.push_back(std::move(card));
  }
  return cards;
}

}  // namespace

Document document(const BatchResult& result) {
  Document d;
  d.kind = "identification of several recordings";
  const auto& entries = result.batch.entries;
  d.title = fmt::format("{} recordings", entries.size());
  d.summary = sentences(result);
  const auto good = std::count_if(entries.begin(), entries.end(),
                                  [](const BatchEntry& e) { return e.result && e.result->trusted; });
  d.badge = Badge{
      good == std::ssize(entries), fmt::format("{} of {} trusted", good, entries.size()),
      result.joint ? (result.joint->result.trusted ? "joint estimate trusted" : "joint estimate not trusted")
                   : "",
      good > 0};
  d.cards = cards_of(result);
  Section table;
  table.title = "Recordings";
  table.text = {fmt::format("Ranges are {:.0f} % confidence intervals.", 100.0 * result.batch.confidence)};
  table.plain_tables.push_back(verdict_first(records_table(result)));
  table.sheet = true;
  d.sections.push_back(std::move(table));
  if (auto bars = intervals_section(result); !bars.intervals.empty()) d.sections.push_back(std::move(bars));
  if (auto spread = spread_table(result); !spread.rows.empty()) {
    Section section;
    section.title = "Over the recordings";
    section.text = {
        "Mean weighted by the error bars, standard deviation over the recordings, and whether it agrees with "
        "the "
        "error bars: chi2 per degree of freedom is near 1 for repetitions of one experiment. Judged over all "
        "figures together (Holm)."};
    section.plain_tables.push_back(verdict_first(std::move(spread)));
    d.sections.push_back(std::move(section));
  }
  if (result.joint) d.sections.push_back(joint_section(*result.joint));
  if (std::any_of(entries.begin(), entries.end(), [](const BatchEntry& e) { return e.result.has_value(); }))
    d.sections.push_back(responses_section(result));
  if (auto loops = loops_section(result); !loops.charts.empty()) d.sections.push_back(std::move(loops));
  for (const auto& e : entries) d.sections.push_back(record_section(e));
  d.findings = findings_of(result);
  return d;
}

}  // namespace resonid::report
