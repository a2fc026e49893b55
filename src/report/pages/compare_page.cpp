// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <resonid/base/constants.hpp>
#include <resonid/diagnostics/margins.hpp>
#include <resonid/report/detail/compare.hpp>

#include "report/document/compare_words.hpp"
#include "report/document/words.hpp"
#include "report/pages/curves.hpp"

namespace resonid::report {
namespace {

using identification::Changes;
using identification::Difference;

/// Where dense curves are drawn: the band of both responses.
std::vector<double> grid_of(const Changes& c) {
  std::vector<double> grid;
  const auto& g = c.first_response.lines() > 0 ? c.first_response : c.second_response;
  if (g.lines() < 2) return grid;
  const auto& h = c.second_response.lines() > 0 ? c.second_response : g;
  const double low = std::max(std::min(g.frequency_hz.front(), h.frequency_hz.front()), 1e-9);
  const double high = std::min(std::max(g.frequency_hz.back(), h.frequency_hz.back()),
                               0.49 * std::min(c.first.sample_rate_hz, c.second.sample_rate_hz));
  constexpr int kPoints = 500;
  for (int i = 0; i < kPoints; ++i) grid.push_back(low * std::pow(high / low, i / (kPoints - 1.0)));
  return grid;
}

/// As it was measured; no lines without a model.
data::FrequencyResponse model_of(const identification::Result& result, const std::vector<double>& grid) {
  data::FrequencyResponse g;
  if (!result.model || grid.empty()) return g;
  g.frequency_hz = grid;
  g.value = result.model->drive.values(grid, true);
  return g;
}

std::pair<std::string, std::string> names_of(const Changes& c) {
  auto first = base_name(c.first.file), second = base_name(c.second.file);
  if (first != second) return {first, second};
  if (c.first.file != c.second.file) return {c.first.file, c.second.file};
  return {first + " (first)", second + " (second)"};
}

Table difference_table(const Changes& c) {
  const double z = two_sided_quantile(c.confidence);
  const auto [first, second] = names_of(c);
  Table table{"", {"Quantity", "Verdict", first, second, "Change", "Change in %", "p"}, {}};
  const auto all = c.all();
  const bool repeated =
      std::any_of(all.begin(), all.end(), [](const Difference& d) { return d.interval.has_value(); });
  if (repeated) table.columns.emplace_back("Change, bootstrap");
  for (const auto& d : all) {
    const double percent = d.relative ? 100.0 * *d.relative : 0.0;
    const double scale = d.first.value != 0.0 ? 100.0 / std::abs(d.first.value) : 0.0;
    // Per cent of a value that may be 0 say nothing.
    const bool known = std::abs(d.first.value) > z * d.first.std;
    table.rows.push_back({spaced_name(d.name) + (d.unit.empty() ? "" : ", " + d.unit),
                          d.significant ? "changed" : (d.probability ? "within noise" : "not judged"),
                          with_error(d.first.value, z * d.first.std),
                          with_error(d.second.value, z * d.second.std),
                          with_error(d.change, z * d.std.value_or(0.0)),
                          d.relative && known ? with_error(percent, scale * z * d.std.value_or(0.0)) : "",
                          d.probability ? probability_of_change(*d.probability) : ""});
    if (repeated)
      table.rows.back().push_back(d.interval ? interval_text(d.interval->first, d.interval->second) : "");
  }
  return table;
}

Chart gap_chart(const Changes& c) {
  Chart chart;
  chart.title = "Chordal distance of the responses";
  chart.x_label = "Frequency in Hz";
  chart.y_label = "Distance, 0 ... 1";
  chart.log_x = true;
  Curve curve{"distance", Curve::Mark::line, c.gap.frequency_hz, c.gap.distance};
  const double z = two_sided_quantile(c.confidence);
  for (std::size_t i = 0; i < c.gap.std.size(); ++i) {
    curve.lower.push_back(std::max(0.0, c.gap.distance[i] - z * c.gap.std[i]));
    curve.upper.push_back(std::min(1.0, c.gap.distance[i] + z * c.gap.std[i]));
  }
  chart.curves.push_back(std::move(curve));
  if (!c.gap.noise.empty()) {
    // |error|^2 over its mean is exponential.
    Curve noise{fmt::format("noise alone, {:.0f} %", 100.0 * c.confidence),
                Curve::Mark::dashed,
                c.gap.frequency_hz,
                {}};
    for (const double n : c.gap.noise) noise.y.push_back(n * std::sqrt(-std::log(1.0 - c.confidence)));
    chart.curves.push_back(std::move(noise));
  }
  chart.caption = fmt::format(
      "Pointwise, {}. The dashed curve is what two measurements of the same machine show at a line. Lines do "
      "not show the winding number, so this is not Vinnicombe's gap.",
      c.weighted ? "both responses scaled by the weight given" : "responses as they are, without scaling");
  return chart;
}

Section response_section(const Changes& c, const ComparedResults* results) {
  Section s;
  s.title = "Responses";
  BodeCharts bode;
  const auto [first, second] = names_of(c);
  const auto mark = Curve::Mark::line;
  bode.add_measured(first, c.first_response, mark);
  bode.add_measured(second, c.second_response, mark);
  if (results != nullptr) {
    const auto grid = grid_of(c);
    if (const auto model = model_of(results->first, grid); model.lines() > 0)
      bode.add_model("model of " + first, model);
    if (const auto model = model_of(results->second, grid); model.lines() > 0)
      bode.add_model("model of " + second, model);
  }
  bode.magnitude.y_label = "Magnitude in dB, 0 dB = 1 " + c.units.response;
  s.charts = {bode.magnitude, bode.phase};
  if (!c.gap.frequency_hz.empty()) s.charts.push_back(gap_chart(c));
  return s;
}

/// L = C G with the known delay: of the model where there is one, else at the measured lines.
data::FrequencyResponse loop_of(const identification::Result& result, const data::FrequencyResponse& measured,
                                const data::TransferFunction& controller, const std::vector<double>& grid) {
  auto loop = model_of(result, grid);
  if (loop.lines() == 0) loop = measured;
  for (std::size_t i = 0; i < loop.lines(); ++i)
    loop.value[i] *= controller.response(loop.frequency_hz[i]) *
                     std::polar(1.0, -kTwoPi * loop.frequency_hz[i] * result.known_delay_s);
  return loop;
}

Section loop_section(const Changes& c, const ComparedResults& results) {
  Section s;
  if (!results.controller) return s;
  s.title = "Loop before and after";
  Chart chart = nyquist_plane("Nyquist curves of L = C G, delay included");
  const auto [first, second] = names_of(c);
  const auto grid = grid_of(c);
  const auto add = [&](const std::string& name, const identification::Result& result,
                       const data::FrequencyResponse& measured) {
    const auto loop = loop_of(result, measured, *results.controller, grid);
    const auto margins = diagnostics::loop_margins(loop);
    chart.curves.push_back(nyquist_curve(name, loop));
    Shape circle;
    circle.kind = Shape::Kind::circle;
    circle.name = fmt::format("{}: modulus margin {:.3g}", name, margins.modulus_margin);
    circle.x = -1.0;
    circle.radius = margins.modulus_margin;
    chart.shapes.push_back(std::move(circle));
  };
  add(first, results.first, results.first.response);
  add(second, results.second, results.second.response);
  chart.caption =
      "With the controller given, or stored in a result. The circles around -1 touch their curve where it "
      "comes closest.";
  s.charts = {std::move(chart)};
  s.sheet = true;
  return s;
}

std::vector<Card> cards_of(const Changes& c) {
  const auto all = c.all();
  const double z = two_sided_quantile(c.confidence);
  const auto judged =
      std::count_if(all.begin(), all.end(), [](const Difference& d) { return d.probability; });
  const auto changed =
      std::count_if(all.begin(), all.end(), [](const Difference& d) { return d.significant; });
  std::vector<Card> cards = {{"Changed", fmt::format("{} of {}", changed, judged), "", {"figures judged"}}};
  auto sorted = all;
  std::stable_sort(sorted.begin(), sorted.end(), [](const Difference& a, const Difference& b) {
    return a.probability.value_or(2.0) < b.probability.value_or(2.0);
  });
  constexpr std::size_t kMostCards = 4;
  for (const auto& d : sorted) {
    if (cards.size() == kMostCards) break;
    const bool relative = d.relative && std::abs(d.first.value) > 3.0 * d.first.std;
    const double scale = relative ? 100.0 / std::abs(d.first.value) : 1.0;
    auto card = estimate_card(capitalised(spaced_name(d.name)), scale * d.change,
                              scale * z * d.std.value_or(0.0), relative ? "%" : d.unit, c.confidence,
                              {fmt::format("{:.4g} to {}", d.first.value,
                                           with_unit(fmt::format("{:.4g}", d.second.value), d.unit))});
    if (d.change > 0.0) card.value = "+" + card.value;
    cards.push_back(std::move(card));
  }
  if (!c.gap.distance.empty()) {
    const auto i = c.gap.largest();
    cards.push_back({"Chordal distance",
                     fmt::format("{:.3g}", c.gap.distance[i]),
                     "",
                     {fmt::format("of the responses, at {:.4g} Hz", c.gap.frequency_hz[i])}});
  }
  if (c.model_gap) cards.push_back({"v-gap", fmt::format("{:.3g}", c.model_gap->gap), "", {"of the models"}});
  return cards;
}

Document page_of(const Changes& c, const ComparedResults* results) {
  Document d;
  d.kind = "comparison";
  const auto [first, second] = names_of(c);
  d.title = fmt::format("{} against {}", second, first);
  d.facts = {"first: " + c.first.file, "second: " + c.second.file};
  d.summary = sentences(c);
  d.badge = Badge{
      c.trusted && !c.changed,
      !c.trusted  ? "Not trusted"
      : c.changed ? "Changed"
                  : "No change shown",
      c.trusted ? fmt::format("at {:.0f} % confidence over all", 100.0 * c.confidence) : "see the findings",
      c.trusted};
  d.cards = cards_of(c);
  d.findings = c.findings;
  Section changes;
  changes.title = "What changed";
  changes.text = {
      fmt::format("Ranges are {:.0f} % confidence intervals. p is the probability that noise alone makes a "
                  "difference at least as large; the verdict accounts for all comparisons together (Holm).",
                  100.0 * c.confidence)};
  changes.plain_tables.push_back(difference_table(c));
  changes.sheet = true;
  d.sections = {changes};
  if (results != nullptr)
    if (auto loops = loop_section(c, *results); !loops.charts.empty()) d.sections.push_back(std::move(loops));
  d.sections.push_back(response_section(c, results));
  return d;
}

}  // namespace

Document document(const Changes& c) { return page_of(c, nullptr); }
Document document(const Changes& c, const ComparedResults& results) { return page_of(c, &results); }

}  // namespace resonid::report
