// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <resonid/base/constants.hpp>
#include <resonid/report/detail/compare.hpp>

#include "report/document/result_parts.hpp"
#include "report/document/words.hpp"

namespace resonid::report {
namespace {

using identification::Changes;
using identification::Difference;

/// "phase_margin" -> "phase margin"
std::string words(std::string name) {
  std::replace(name.begin(), name.end(), '_', ' ');
  return name;
}

std::string capitalised(std::string text) {
  if (!text.empty()) text[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(text[0])));
  return text;
}

/// 0.0003 -> "0.0003"; what no record can tell from 0 -> "< 1e-12".
std::string probability_text(double p) { return p < 1e-12 ? "< 1e-12" : fmt::format("{:.2g}", p); }

std::string with_unit(const std::string& number, const std::string& unit) {
  return unit.empty() ? number : number + " " + unit;
}

/// "Stiffness fell by 5.1 +- 0.4 %, from 143.75 to 136.4 Nm/rad."
std::string sentence(const Difference& d, double z) {
  const double half = z * d.std.value_or(0.0);
  const char* verb = d.change < 0.0 ? "fell" : "rose";
  if (d.relative && std::abs(d.first.value) > 3.0 * d.first.std) {
    const double scale = 100.0 / std::abs(d.first.value);
    return fmt::format("{} {} by {} %, from {:.5g} to {}.", capitalised(words(d.name)), verb,
                       with_error(scale * std::abs(d.change), scale * half), d.first.value,
                       with_unit(fmt::format("{:.5g}", d.second.value), d.unit));
  }
  return fmt::format("{} {} by {}.", capitalised(words(d.name)), verb,
                     with_unit(with_error(std::abs(d.change), half), d.unit));
}

std::string gap_sentence(const Changes& c) {
  const std::size_t i = c.gap.largest();
  std::string text = fmt::format(
      "The measured responses{} lie at most {} apart (chordal distance, at {:.4g} Hz)",
      c.weighted ? ", scaled," : "",
      c.gap.std.empty() ? fmt::format("{:.3g}", c.gap.distance[i])
                        : with_error(c.gap.distance[i], two_sided_quantile(c.confidence) * c.gap.std[i]),
      c.gap.frequency_hz[i]);
  if (!c.gap_probability) return text + "; without error bars no more can be said.";
  return text + (c.gap_significant ? ": more than noise explains."
                                   : fmt::format("; noise alone produces as much with probability {}.",
                                                 probability_text(*c.gap_probability)));
}

std::string bootstrap_sentence(const Changes& c) {
  const auto& b = *c.model_gap_bootstrap;
  return fmt::format(
      "In {} repetitions of both experiments the v-gap lies between {:.3g} and {:.3g} ({:.0f} %). Two "
      "experiments on one machine stay below {:.3g}; they produce a gap as large as the one found with "
      "probability {}{:.2g}.",
      b.pairs, b.low, b.high, 100.0 * c.confidence, b.noise,
      b.probability * static_cast<double>(b.pairs + 1) < 1.5 ? "at most " : "", b.probability);
}

Table difference_table(const Changes& c) {
  const double z = two_sided_quantile(c.confidence);
  Table table{"", {"Quantity", "First", "Second", "Change", "Change in %", "p", "Verdict"}, {}};
  const auto all = c.all();
  const bool repeated =
      std::any_of(all.begin(), all.end(), [](const Difference& d) { return d.interval.has_value(); });
  if (repeated) table.columns.emplace_back("Change, bootstrap");
  for (const auto& d : all) {
    const double percent = d.relative ? 100.0 * *d.relative : 0.0;
    const double scale = d.first.value != 0.0 ? 100.0 / std::abs(d.first.value) : 0.0;
    table.rows.push_back(
        {words(d.name) + (d.unit.empty() ? "" : ", " + d.unit), with_error(d.first.value, z * d.first.std),
         with_error(d.second.value, z * d.second.std), with_error(d.change, z * d.std.value_or(0.0)),
         d.relative ? with_error(percent, scale * z * d.std.value_or(0.0)) : "",
         d.probability ? probability_text(*d.probability) : "",
         d.significant ? "changed" : (d.probability ? "within noise" : "not judged")});
    if (repeated)
      table.rows.back().push_back(d.interval ? interval_text(d.interval->first, d.interval->second) : "");
  }
  return table;
}

Curve magnitude(const data::FrequencyResponse& g, const std::string& name) {
  Curve curve{name, Curve::Mark::line, g.frequency_hz, {}};
  for (const auto& v : g.value) curve.y.push_back(20.0 * std::log10(std::abs(v)));
  return curve;
}

Curve phase(const data::FrequencyResponse& g, const std::string& name) {
  Curve curve{name, Curve::Mark::line, g.frequency_hz, {}};
  double last = 0.0;
  for (const auto& v : g.value) {
    double degrees = std::arg(v) * 360.0 / kTwoPi;
    degrees += 360.0 * std::round((last - degrees) / 360.0);
    curve.y.push_back(last = degrees);
  }
  return curve;
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

Section response_section(const Changes& c) {
  Section s;
  s.title = "Responses";
  Chart amplitude{"Magnitude", "Frequency in Hz", "Magnitude in dB", true, false, {}, ""};
  amplitude.curves = {magnitude(c.first_response, "first"), magnitude(c.second_response, "second")};
  Chart angle{"Phase", "Frequency in Hz", "Phase in degrees", true, false, {}, ""};
  angle.curves = {phase(c.first_response, "first"), phase(c.second_response, "second")};
  s.charts = {amplitude, angle};
  if (!c.gap.frequency_hz.empty()) s.charts.push_back(gap_chart(c));
  return s;
}

}  // namespace

std::vector<std::string> sentences(const Changes& c) {
  const double z = two_sided_quantile(c.confidence);
  std::vector<std::string> list;
  std::size_t judged = 0;
  double smallest = 1.0;
  for (const auto& d : c.all()) {
    if (!d.probability) continue;
    ++judged;
    smallest = std::min(smallest, *d.probability);
    if (d.significant) list.push_back(sentence(d, z));
  }
  if (list.empty() && judged > 0)
    list.push_back(
        fmt::format("No resonance, parameter or margin changed beyond what noise explains ({} compared, "
                    "smallest p {}, {:.0f} % confidence over all).",
                    judged, probability_text(smallest), 100.0 * c.confidence));
  if (judged == 0) list.emplace_back("No quantity has error bars on both sides: nothing can be judged.");
  if (!c.gap.frequency_hz.empty()) list.push_back(gap_sentence(c));
  if (c.model_gap) {
    list.push_back(
        c.model_gap->condition_holds
            ? fmt::format("The v-gap of the models{} is {} (at {:.4g} Hz).", c.weighted ? ", scaled," : "",
                          with_error(c.model_gap->gap,
                                     c.model_gap_bootstrap ? 0.0 : z * c.model_gap_std.value_or(0.0)),
                          c.model_gap->frequency_hz)
            : "The v-gap of the models is 1: their winding-number condition fails, no one controller is "
              "right for both.");
  }
  if (c.model_gap_bootstrap) list.push_back(bootstrap_sentence(c));
  return list;
}

std::string summary_text(const Changes& c) {
  std::string text = fmt::format("first   {}\nsecond  {}\n\n", c.first.file, c.second.file);
  for (const auto& s : sentences(c)) text += wrapped(s, "", "  ") + "\n";
  const auto all = c.all();
  if (!all.empty()) {
    const double z = two_sided_quantile(c.confidence);
    text += fmt::format("\nChanges, {:.0f} % confidence\n", 100.0 * c.confidence);
    for (const auto& d : all)
      text += fmt::format(
          "  {:<18} {:>10.5g} -> {:>10.5g} {:<8} {}{}{}\n", words(d.name), d.first.value, d.second.value,
          d.unit, d.change < 0.0 ? "" : "+", with_error(d.change, z * d.std.value_or(0.0)),
          (d.significant ? "  changed" : (d.probability ? "" : "  not judged")) +
              (d.interval
                   ? fmt::format("  ({}, bootstrap)", interval_text(d.interval->first, d.interval->second))
                   : ""));
  }
  text += findings_text(c.findings);
  text += c.changed ? "\nChanged." : "\nNo change shown.";
  return text + (c.trusted ? "\n" : " NOT trusted: the result is not reliable; see the errors above.\n");
}

Document document(const Changes& c) {
  Document d;
  d.kind = "comparison";
  d.title = fmt::format("{} against {}", c.second.file, c.first.file);
  d.summary = sentences(c);
  d.summary.push_back(
      fmt::format("{} {}", c.changed ? "Changed." : "No change shown.",
                  c.trusted ? "" : "NOT trusted: the result is not reliable; see the findings."));
  Section changes;
  changes.title = "What changed";
  changes.text = {
      fmt::format("Ranges are {:.0f} % confidence intervals. p is the probability that noise alone makes a "
                  "difference at least as large; the verdict accounts for all comparisons together (Holm).",
                  100.0 * c.confidence)};
  changes.plain_tables.push_back(difference_table(c));
  d.sections = {changes, response_section(c)};
  if (!c.findings.empty()) d.sections.push_back(findings_section(c.findings));
  return d;
}

}  // namespace resonid::report
