// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <resonid/base/constants.hpp>
#include <resonid/report/detail/validate.hpp>

#include "report/document/document_cells.hpp"
#include "report/document/words.hpp"
#include "report/pages/curves.hpp"

namespace resonid::report {
namespace {

using diagnostics::ResidualCorrelation;
using identification::ModelValidation;

Section signal_section(const ModelValidation& v, const data::Record& record) {
  Section s;
  s.title = "Measured and simulated";
  s.sheet = true;
  const double start = record.start_time_s + static_cast<double>(v.first_sample) / record.sample_rate_hz;
  std::vector<double> output(v.residual.size());
  for (std::size_t k = 0; k < output.size(); ++k) output[k] = v.simulated[k] + v.residual[k];
  Chart outputs;
  outputs.title = "Output, measured and simulated";
  outputs.x_label = "Time in s";
  outputs.y_label = fmt::format("Output in {}", record.output.unit);
  outputs.curves = {thinned("measured", output, start, record.sample_rate_hz),
                    thinned("simulated", v.simulated, start, record.sample_rate_hz)};
  outputs.caption = "Drag sideways to enlarge, double-click to see all.";
  Chart residual;
  residual.title = "Residual";
  residual.x_label = outputs.x_label;
  residual.y_label = fmt::format("Measured less simulated, in {}", record.output.unit);
  residual.curves = {thinned("residual", v.residual, start, record.sample_rate_hz)};
  s.charts = {outputs, residual};
  return s;
}

Chart correlation_chart(const std::string& title, const ResidualCorrelation& c,
                        const diagnostics::ResidualTest& t, bool judged) {
  Chart chart;
  chart.title = title;
  chart.x_label = "Lag in samples";
  chart.y_label = "Correlation";
  const auto m = static_cast<double>(t.max_lag);
  Curve points{"correlation", Curve::Mark::points, {}, c.value};
  for (std::size_t i = 0; i < c.value.size(); ++i) points.x.push_back(static_cast<double>(i) - m);
  chart.curves = {points};
  const auto within = [&](const std::string& name, double limit) {
    Curve band{name, Curve::Mark::band, {-m, m}, {}};
    band.lower = {-limit, -limit};
    band.upper = {limit, limit};
    chart.curves.push_back(std::move(band));
  };
  if (judged) within("practical limit, 0.15", diagnostics::kPracticalCorrelation);
  within(fmt::format("limit of 3 % per lag, {:.3f}", t.limit), t.limit);
  if (judged) {
    Shape shape;
    shape.kind = Shape::Kind::rectangle;
    shape.name = fmt::format("judged, lags 1 ... {}", t.judged_lags);
    shape.x = 0.5;
    shape.x_end = static_cast<double>(t.judged_lags) + 0.5;
    shape.y = -HUGE_VAL;
    shape.y_end = HUGE_VAL;
    chart.shapes.push_back(shape);
    const double most = std::max(
        0.2, 1.1 * std::abs(*std::max_element(c.value.begin(), c.value.end(),
                                              [](double a, double b) { return std::abs(a) < std::abs(b); })));
    chart.y_range = AxisRange{-most, most};
  }
  return chart;
}

Section correlation_section(const ModelValidation& v) {
  const auto& t = v.residual_test;
  Section s;
  s.title = "Residual tests";
  if (v.judged || v.judged_from_hz)
    s.text.push_back(
        v.in_loop && v.judged && !t.with_excitation.value.empty()
            ? "All signals are filtered to the judged band. The correlation with the excitation decides: the "
              "input, and what is simulated from it, hold noise that feedback put there."
            : "All signals are filtered to the judged band.");
  s.text.push_back(
      fmt::format("Lags 1 ... {} are judged: max(na, nb + d). Negative lags are only shown: in closed loop "
                  "the noise acts on later inputs through the controller, which does not speak against the "
                  "model. The limit of 3 % is per lag; with the simulated output {:.0f} dB above the "
                  "residual, even small errors of a model of the right structure exceed it.",
                  t.judged_lags, t.snr_db));
  const auto add = [&](const char* title, const ResidualCorrelation& c) {
    if (!c.value.empty()) s.charts.push_back(correlation_chart(title, c, t, true));
  };
  add("Residual with simulated output", t.with_simulated);
  add("Residual with input", t.with_input);
  add("Residual with excitation", t.with_excitation);
  s.charts.push_back(correlation_chart("Residual with itself", t.self, t, false));
  return s;
}

Chart map_chart(const diagnostics::StaticMap& map, const ModelValidation& v) {
  Chart chart;
  const bool velocity = map.over == "velocity";
  chart.title = fmt::format("Input error over the {}", map.over);
  chart.x_label = fmt::format("{} in {}", velocity ? "Measured output" : "Input",
                              velocity ? v.units.velocity : v.units.input);
  chart.y_label = fmt::format("Mean in {}", v.units.input);
  Curve curve{"mean of the bin, 95 %", Curve::Mark::points, map.level, map.mean};
  for (std::size_t b = 0; b < map.mean.size(); ++b) {
    const double half = 1.96 * map.std[b];
    curve.lower.push_back(map.mean[b] - half);
    curve.upper.push_back(map.mean[b] + half);
  }
  chart.curves = {std::move(curve)};
  // Its probability by chance is not shown: it assumes a residual that is white beside the map.
  chart.caption = "Disturbance of the model's input, off a straight line, that no linear model describes.";
  return chart;
}

/// Frequencies that the verdict is about, behind the curves.
void shade_judged(const ModelValidation& v, Chart& chart) {
  const auto shade = [&](std::string name, double from, double to) {
    Shape shape;
    shape.kind = Shape::Kind::rectangle;
    shape.name = std::move(name);
    shape.x = from;
    shape.x_end = to;
    shape.y = -HUGE_VAL;
    shape.y_end = HUGE_VAL;
    chart.shapes.push_back(std::move(shape));
  };
  if (v.fit_band_hz) shade("band that was specified", v.fit_band_hz->first, v.fit_band_hz->second);
  if (v.judged)
    shade(fmt::format("judged, {:.3g} ... {:.3g} Hz", v.judged->low_hz, v.judged->high_hz), v.judged->low_hz,
          v.judged->high_hz);
  else if (v.judged_from_hz)
    shade(fmt::format("judged, from {:.3g} Hz", *v.judged_from_hz), *v.judged_from_hz, HUGE_VAL);
}

Section residual_section(const ModelValidation& v) {
  Section s;
  s.title = "Residual by frequency";
  Chart spectrum;
  spectrum.title = "Power";
  spectrum.x_label = "Frequency in Hz";
  spectrum.y_label = fmt::format("Power in dB of ({})^2 per line", v.units.velocity);
  spectrum.log_x = true;
  spectrum.curves = {power_curve("output", v.output_spectrum, Curve::Mark::line),
                     power_curve("residual", v.residual_spectrum, Curve::Mark::dashed)};
  shade_judged(v, spectrum);
  s.charts = {std::move(spectrum)};
  for (const auto& map : v.maps) s.charts.push_back(map_chart(map, v));
  Table table;
  table.title = "By bands";
  table.columns = {"Band in Hz", "Share of the output's power", "Share of the residual's",
                   "Residual over output"};
  if (v.judged) table.columns.emplace_back("Judged");
  for (const auto& b : v.bands) {
    table.rows.push_back({fmt::format("{:.4g} ... {:.4g}", b.low_hz, b.high_hz),
                          fmt::format("{:.2f} %", 100.0 * b.output_share),
                          fmt::format("{:.2f} %", 100.0 * b.residual_share),
                          fmt::format("{:.3g} %", 100.0 * b.residual_over_output)});
    if (!v.judged) continue;
    const bool apart = b.high_hz <= v.judged->low_hz || b.low_hz >= v.judged->high_hz;
    const bool all = b.low_hz >= v.judged->low_hz && b.high_hz <= v.judged->high_hz;
    table.rows.back().emplace_back(apart ? "no" : all ? "yes" : "in part");
  }
  s.plain_tables = {std::move(table)};
  return s;
}

/// The distance is no part of the sheet that is printed: that has to fit one page.
std::array<Section, 2> response_sections(const ModelValidation& v) {
  Section s;
  s.title = "Responses";
  s.sheet = true;
  BodeCharts bode;
  bode.add_measured("measured on this recording", *v.measured, Curve::Mark::points);
  bode.add_model("model", *v.modelled);
  bode.magnitude.y_label = fmt::format("Magnitude in dB, 0 dB = 1 {}", v.units.response);
  Chart gap;
  gap.title = "Chordal distance";
  gap.x_label = bode.magnitude.x_label;
  gap.y_label = "Distance, 0 ... 1";
  gap.log_x = true;
  gap.curves = {Curve{"distance", Curve::Mark::line, v.gap->frequency_hz, v.gap->distance}};
  if (!v.gap->noise.empty())
    gap.curves.push_back({"noise alone (rms)", Curve::Mark::dashed, v.gap->frequency_hz, v.gap->noise});
  gap.caption =
      "Pointwise, in the units of the recording, by the response from input to residual. Lines do not show "
      "the "
      "winding number, so this is not the v-gap.";
  const auto& lines = v.gap->frequency_hz;
  const bool all = v.judged && v.judged->low_hz <= lines.front() && v.judged->high_hz >= lines.back();
  for (Chart* chart : {&bode.magnitude, &bode.phase, &gap})
    if (!all) shade_judged(v, *chart);
  s.charts = {bode.magnitude, bode.phase};
  Section distance;
  distance.title = "Distance of the responses";
  distance.charts = {gap};
  return {std::move(s), std::move(distance)};
}

std::string verdict_word(const ModelValidation& v) {
  switch (v.verdict) {
    case identification::Verdict::accepted:
      return "Accepted";
    case identification::Verdict::doubtful:
      return "Doubtful";
    case identification::Verdict::rejected:
      return "Rejected";
  }
  return "";
}

std::string reason_of(const ModelValidation& v) {
  if (!v.trusted) return "not trusted, see the findings";
  const auto warnings = std::count_if(v.findings.begin(), v.findings.end(), [](const auto& f) {
    return f.severity == diagnostics::Severity::warning;
  });
  if (warnings > 0) return fmt::format("with {} warning{}", warnings, warnings > 1 ? "s" : "");
  return v.verdict == identification::Verdict::accepted ? "Every check passed." : "";
}

std::vector<Card> cards_of(const ModelValidation& v) {
  std::vector<Card> cards = {
      {"Fit, simulated", fmt::format("{:.1f}", v.simulation_fit_percent), "%", {"NRMSE"}},
      {"Fit one step ahead", fmt::format("{:.1f}", v.prediction_fit_percent), "%"}};
  if (v.judged)
    cards.push_back({"Fit where judged",
                     fmt::format("{:.1f}", v.judged->fit_percent),
                     "%",
                     {fmt::format("{:.3g} ... {:.3g} Hz", v.judged->low_hz, v.judged->high_hz)}});
  else if (v.judged_from_hz && v.judged_fit_percent)
    cards.push_back({"Fit where judged",
                     fmt::format("{:.1f}", *v.judged_fit_percent),
                     "%",
                     {fmt::format("above {:.3g} Hz", *v.judged_from_hz)}});
  if (v.fit_in_band_percent)
    cards.push_back({"Fit in the band",
                     fmt::format("{:.1f}", *v.fit_in_band_percent),
                     "%",
                     {fmt::format("{:g} ... {:g} Hz", v.fit_band_hz->first, v.fit_band_hz->second)}});
  if (v.expected_fit_percent)
    cards.push_back({"Fit to be expected",
                     fmt::format("{:.1f}", *v.expected_fit_percent),
                     "%",
                     {"with the residual of its own recording"}});
  if (v.response_error)
    cards.push_back({"Distance to the response",
                     fmt::format("{:.1f}", 100.0 * *v.response_error),
                     "%",
                     {"beyond the noise, rms over the lines"}});
  cards.push_back({"Residual",
                   fmt::format("{:#.3g}", v.residual_test.rms),
                   v.units.velocity,
                   {fmt::format("rms, {:.1f} dB below the output", v.residual_test.snr_db)}});
  if (cards.size() > 6) cards.resize(6);
  return cards;
}

}  // namespace

Document document(const ModelValidation& v, const data::Record& record) {
  Document d;
  d.kind = "validation";
  d.title = fmt::format("{} on {}", base_name(v.candidate.source), base_name(v.record.file));
  d.facts = {fmt::format("{} samples", v.record.samples), fmt::format("{:g} Hz", v.record.sample_rate_hz),
             v.approach + " approach"};
  d.summary = sentences(v);
  d.badge = Badge{v.trusted && v.verdict == identification::Verdict::accepted, verdict_word(v), reason_of(v),
                  v.verdict != identification::Verdict::rejected};
  d.cards = cards_of(v);
  d.findings = v.findings;
  d.sections = {signal_section(v, record)};
  if (v.gap && !v.gap->distance.empty())
    for (auto& section : response_sections(v)) d.sections.push_back(std::move(section));
  d.sections.push_back(residual_section(v));
  d.sections.push_back(correlation_section(v));
  return d;
}

}  // namespace resonid::report
