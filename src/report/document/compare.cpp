// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <resonid/base/constants.hpp>
#include <resonid/report/detail/compare.hpp>

#include "report/document/compare_words.hpp"
#include "report/document/words.hpp"

namespace resonid::report {
std::string spaced_name(std::string name) { return quantity_words(std::move(name)); }

std::string capitalised(std::string text) {
  if (!text.empty()) text[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(text[0])));
  return text;
}

std::string probability_of_change(double p) { return p < 1e-12 ? "< 1e-12" : fmt::format("{:.2g}", p); }

std::string with_unit(const std::string& number, const std::string& unit) {
  return unit.empty() ? number : number + " " + unit;
}

namespace {

using identification::Changes;
using identification::Difference;

/// "Stiffness fell by 5.1 +- 0.4 %, from 143.75 to 136.4 Nm/rad."
std::string sentence(const Difference& d, double z) {
  const double half = z * d.std.value_or(0.0);
  const char* verb = d.change < 0.0 ? "fell" : "rose";
  if (d.relative && std::abs(d.first.value) > 3.0 * d.first.std) {
    const double scale = 100.0 / std::abs(d.first.value);
    return fmt::format("{} {} by {} %, from {:.5g} to {}.", capitalised(spaced_name(d.name)), verb,
                       with_error(scale * std::abs(d.change), scale * half), d.first.value,
                       with_unit(fmt::format("{:.5g}", d.second.value), d.unit));
  }
  return fmt::format("{} {} by {}.", capitalised(spaced_name(d.name)), verb,
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
                                                 probability_of_change(*c.gap_probability)));
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
                    judged, probability_of_change(smallest), 100.0 * c.confidence));
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
      text += fmt::format("  {:<18} {:>10.5g} -> {:>10.5g} {:<8} {}{}{}\n", spaced_name(d.name),
                          d.first.value, d.second.value, unit_words(d.unit), d.change < 0.0 ? "" : "+",
                          with_error(d.change, z * d.std.value_or(0.0)),
                          (d.significant ? "  changed" : (d.probability ? "" : "  not judged")) +
                              (d.interval ? fmt::format("  ({}, bootstrap)",
                                                        interval_text(d.interval->first, d.interval->second))
                                          : ""));
  }
  text += findings_text(c.findings);
  text += c.changed ? "\nChanged." : "\nNo change shown.";
  return text + (c.trusted ? "\n" : " NOT trusted: the result is not reliable; see the errors above.\n");
}

}  // namespace resonid::report
