// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <resonid/base/constants.hpp>
#include <resonid/report/detail/batch.hpp>
#include <resonid/report/json.hpp>

#include "report/document/batch_tables.hpp"
#include "report/document/result_parts.hpp"
#include "report/document/words.hpp"

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
                  identified > kMostCurves ? fmt::format(" The first {} records.", kMostCurves) : "",
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
  Chart chart{"Open loops", "Real part of L", "Imaginary part of L", false, true, {}, ""};
  const auto add = [&](const std::string& name, const data::FrequencyResponse& loop) {
    Curve curve{name, Curve::Mark::line, {}, {}, {}};
    constexpr double kFar = 4.0;
    for (const std::size_t i : spread_lines(loop.lines())) {
      const bool near = std::abs(loop.value[i]) < kFar;
      curve.x.push_back(near ? loop.value[i].real() : std::nan(""));
      curve.y.push_back(near ? loop.value[i].imag() : std::nan(""));
      curve.at.push_back(loop.frequency_hz[i]);
    }
    chart.curves.push_back(std::move(curve));
  };
  if (result.joint && result.joint->result.loop) add("joined", result.joint->result.loop->curve);
  for (const auto& e : result.batch.entries)
    if (e.result && e.result->loop && chart.curves.size() < kMostCurves) add(e.file, e.result->loop->curve);
  Section section;
  if (chart.curves.empty()) return section;
  Shape unit;
  unit.kind = Shape::Kind::circle;
  unit.name = "unit circle |L| = 1";
  unit.radius = 1.0;
  Shape critical;
  critical.kind = Shape::Kind::cross;
  critical.name = "the point -1";
  critical.x = -1.0;
  chart.shapes = {unit, critical};
  chart.x_range = AxisRange{-2.0, 2.0};
  chart.y_range = AxisRange{-2.0, 2.0};
  section.title = "All loops";
  section.charts = {chart};
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

Section joint_section(const identification::Joint& joint) {
  Section section;
  section.title = "Joint estimate";
  section.text = {
      "All records as one experiment. Each record's parameters are compared with those of all others; p is "
      "the probability of such a distance by noise alone. The lines' chi2 per degree of freedom is 1 where "
      "the records scatter as their error bars say."};
  auto records = consistency_table(joint);
  records.title = "Each record against the others";
  auto figures = figures_table(joint.result);
  figures.title = "Joint figures";
  section.plain_tables = {figures, records};
  if (!joint.result.findings.empty()) {
    auto findings = findings_section(joint.result.findings).plain_tables.front();
    findings.title = "Findings";
    section.plain_tables.push_back(std::move(findings));
  }
  return section;
}

}  // namespace

Document document(const BatchResult& result) {
  Document d;
  d.kind = "identification of several records";
  d.title = fmt::format("{} records", result.batch.entries.size());
  d.summary = sentences(result);
  const auto& entries = result.batch.entries;
  const auto good = std::count_if(entries.begin(), entries.end(),
                                  [](const BatchEntry& e) { return e.result && e.result->trusted; });
  d.badge = Badge{good == std::ssize(entries), fmt::format("{} of {} trusted", good, entries.size()), ""};
  Section table;
  table.title = "Records";
  table.text = {fmt::format("Ranges are {:.0f} % confidence intervals.", 100.0 * result.batch.confidence)};
  table.plain_tables.push_back(records_table(result));
  d.sections.push_back(std::move(table));
  if (auto spread = spread_table(result); !spread.rows.empty()) {
    Section section;
    section.title = "Over the records";
    section.text = {
        "Mean weighted by the error bars, scatter over the records, and whether the error bars explain it: "
        "chi2 per degree of freedom is near 1 for repetitions of one experiment. Judged over all figures "
        "together (Holm)."};
    section.plain_tables.push_back(std::move(spread));
    d.sections.push_back(std::move(section));
  }
  if (result.joint) d.sections.push_back(joint_section(*result.joint));
  if (std::any_of(result.batch.entries.begin(), result.batch.entries.end(),
                  [](const BatchEntry& e) { return e.result.has_value(); }))
    d.sections.push_back(responses_section(result));
  if (auto loops = loops_section(result); !loops.charts.empty()) d.sections.push_back(std::move(loops));
  for (const auto& e : result.batch.entries) d.sections.push_back(record_section(e));
  return d;
}

}  // namespace resonid::report
