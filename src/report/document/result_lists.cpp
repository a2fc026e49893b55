// SPDX-License-Identifier: MIT
#include "report/document/result_lists.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <resonid/identification/detail/figures.hpp>

#include "report/document/words.hpp"

namespace resonid::report {
using identification::Result;

std::string choices_text(const Result& result) {
  if (result.choices.empty()) return "";
  std::string text = "\nChosen from the recording\n";
  for (const auto& c : result.choices)
    text += wrapped(fmt::format("{}: {}; {}", c.what, c.chosen, c.because), "  ", "    ") + "\n";
  return text;
}

std::string structures_text(const Result& result) {
  if (result.structures.size() < 2) return "";
  std::size_t wide = 9;
  for (const auto& t : result.structures) wide = std::max(wide, columns_of(t.name));
  double best = HUGE_VAL;
  for (const auto& t : result.structures)
    if (t.bic < best) best = t.bic;
  std::string text =
      fmt::format("\nStructures side by side\n    {:<{}}  parameters  BIC above best  fit on hold-out data\n",
                  "structure", wide);
  for (const auto& t : result.structures) {
    text += fmt::format("  {} {:<{}}  {:>10}", t.chosen ? '*' : ' ', t.name, wide, t.parameters);
    const double above = t.bic - best;
    text += std::isfinite(above) ? fmt::format("  {:>14.1f}", above) : fmt::format("  {:>14}", "-");
    text += t.holdout_fit_percent ? fmt::format("  {:>18.2f} %", *t.holdout_fit_percent)
                                  : fmt::format("  {:>20}", "-");
    if (t.independent_fit_percent)
      text += fmt::format("\n      {:.2f} % of the other recording", *t.independent_fit_percent);
    text += "\n";
    if (!t.remark.empty()) text += wrapped(t.remark, "      ", "      ") + "\n";
  }
  return text;
}

std::string bootstrap_text(const Result& result) {
  if (!result.bootstrap) return "";
  const auto& b = *result.bootstrap;
  std::string text = fmt::format("\nBootstrap, {} replicas{}; {:.0f} % intervals\n  {:<28}  {:<24}  {}\n",
                                 b.replicas, b.failed > 0 ? fmt::format(" ({} more failed)", b.failed) : "",
                                 100.0 * result.confidence, "", "of the replicas", "by the covariance");
  const double z = two_sided_quantile(result.confidence);
  const auto told = identification::figures(result);
  for (const auto& i : b.intervals) {
    const auto unit = i.unit.empty() ? std::string() : ", " + unit_words(i.unit);
    text +=
        fmt::format("  {:<28}  {:<24}", quantity_words(i.name, i.unit) + unit, interval_text(i.low, i.high));
    const auto* figure = identification::find(told, i.name);
    if (figure != nullptr && figure->std)
      text += "  " + interval_text(figure->value - z * *figure->std, figure->value + z * *figure->std);
    text += "\n";
  }
  return text;
}

}  // namespace resonid::report
