// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <resonid/report/detail/plan.hpp>

#include "report/document/plan_words.hpp"
#include "report/document/words.hpp"

namespace resonid::report {
using planning::Experiment;
using planning::Figure;
using planning::Plan;

double wanted_of(const Plan& plan, std::size_t i) {
  const auto& target = plan.config.targets[i];
  return target.relative ? target.accuracy * std::abs(plan.planned().targeted[i].value) : target.accuracy;
}

std::string relative_text(const Figure& f) {
  if (!std::isfinite(f.std)) return "unknown";
  if (f.unit == "deg" || f.value == 0.0) return fmt::format("{:.3g} {}", f.std, f.unit);
  return fmt::format("{:.3g} %", 100.0 * f.std / std::abs(f.value));
}

std::string_view type_words(planning::ExcitationType type) {
  return type == planning::ExcitationType::prbs ? "PRBS" : name_of(type);
}

namespace {

/// How to go about it in two runs, and what they take.
std::string two_stages_text(const planning::TwoStagePlan& two) {
  return fmt::format(
      "Two runs would take about {:.3g} s in all instead of {:.3g} s. The first takes {:.3g} s (the same "
      "options with .time_s {:.4g}). Identify it, and plan again with its .model, with .spread {:.2g} and "
      "the same limits and accuracy targets: the second takes about {:.3g} s.",
      two.total_s(), two.one_s, two.first_s, two.first_s, two.spread, two.second_s);
}

/// Another kind against the planned one, both as they were laid out.
std::string compared(const Plan& plan, const Experiment& other) {
  const auto& x = plan.planned();
  if (plan.reached && other.least_s)
    return fmt::format("A {} within the same limits would take {:.3g} s, {:.2g} times as long.",
                       type_words(other.type), *other.least_s, *other.least_s / x.duration_s);
  if (!std::isfinite(other.ratio) || !(x.ratio > 0.0))
    return fmt::format("A {} of the same length would leave a target unknown.", type_words(other.type));
  return fmt::format(
      "A {} of the same length within the same limits would leave error bars {:.2g} times as wide.",
      type_words(other.type), other.ratio / x.ratio);
}

}  // namespace

std::vector<std::string> sentences(const Plan& plan) {
  const auto& x = plan.planned();
  std::vector<std::string> list;
  if (plan.reached) {
    list.push_back(fmt::format("All targets met by a {} of {:.3g} s.", type_words(x.type), x.duration_s));
  } else {
    list.push_back(fmt::format(
        "The accuracy targets cannot be met within the limits: after {:.3g} s the worst error bar is still "
        "{:.3g} times as wide as its target. What follows is the best plan of that length.",
        x.duration_s, x.ratio));
    std::string way = fmt::format("With the amplitude that the limit of {} allows, ", x.binding);
    if (x.needed_s && std::isfinite(*x.needed_s))
      way += fmt::format("about {:.3g} s would suffice; ", *x.needed_s);
    list.push_back(way + (x.needed_amplitude ? fmt::format("in the time given, {:.3g} times the amplitude.",
                                                           *x.needed_amplitude)
                                             : std::string("in the time given no amplitude would suffice.")));
    if (!std::isfinite(plan.config.limits.time_s))
      list.push_back(fmt::format("No time was given: experiments of up to {:g} s were looked at.",
                                 planning::kMostTime_s));
  }
  if (x.noise_dominates)
    list.push_back(
        "Most of the information comes from the noise that the controller feeds back, not from the "
        "excitation, which is too weak to matter.");
  list.push_back(fmt::format("The limit of {} keeps the amplitude at {:.4g} (peak, crest factor {:.3g}).",
                             x.binding, x.amplitude, x.crest_factor));
  if (plan.noise_torque > 0.0)
    list.push_back(
        fmt::format("The limits are met without noise; through the controller, noise adds a torque of {:.3g} "
                    "(three standard deviations).",
                    3.0 * plan.noise_torque));
  if (plan.two_stages) list.push_back(two_stages_text(*plan.two_stages));
  for (std::size_t i = 1; i < plan.experiments.size(); ++i)
    list.push_back(compared(plan, plan.experiments[i]));
  for (const auto& out : plan.skipped)
    list.push_back(fmt::format("No {} was laid out: {}.", type_words(out.type), out.reason));
  for (const auto& e : plan.experiments)
    if (plan.band_given && e.type == planning::ExcitationType::prbs)
      list.push_back(
          fmt::format("{:.0f} % of the PRBS's power lies below {:.4g} Hz and {:.0f} % above {:.4g} Hz.",
                      100.0 * e.power_below_band, plan.config.band_hz->first, 100.0 * e.power_above_band,
                      plan.config.band_hz->second));
  return list;
}

std::string summary_text(const Plan& plan) {
  const auto& x = plan.planned();
  std::string text;
  for (const auto& sentence : sentences(plan)) text += wrapped(sentence, "", "") + "\n";
  text += fmt::format("\n{:<24} {:>12} {:>12}", "one standard deviation", "target", "expected");
  text += "\n";
  for (std::size_t i = 0; i < x.targeted.size(); ++i) {
    Figure wanted = x.targeted[i];
    wanted.std = wanted_of(plan, i);
    text += fmt::format("  {:<22} {:>12} {:>12}\n", quantity_words(wanted.name), relative_text(wanted),
                        relative_text(x.targeted[i]));
  }
  text += fmt::format("\n{:<24} {:>12}", "on the nominal model", type_words(x.type));
  for (std::size_t i = 1; i < plan.experiments.size(); ++i)
    text += fmt::format(" {:>12}", type_words(plan.experiments[i].type));
  text += "\n";
  for (std::size_t f = 0; f < x.figures.size(); ++f) {
    text += fmt::format("  {:<22}", quantity_words(x.figures[f].name));
    for (const auto& e : plan.experiments) text += fmt::format(" {:>12}", relative_text(e.figures[f]));
    text += "\n";
  }
  if (x.type == planning::ExcitationType::multisine)
    text += fmt::format(
                "\n{} lines {:.3g} ... {:.3g} Hz, {} periods of {} samples; the first {} until the drive has "
                "settled\n",
                x.frequency_hz.size(), x.frequency_hz.front(), x.frequency_hz.back(), x.periods,
                x.period_samples, x.settle_periods) +
            fmt::format("identify the recording with .lines_hz {:.10g}:{:.10g}:{:.10g}\n",
                        x.frequency_hz.front(), x.frequency_hz.back(),
                        1.0 / plan.config.drive.model.sample_time_s / static_cast<double>(x.period_samples));
  text += fmt::format(
      "torque {:.4g} peak, {:.4g} rms; velocity {:.4g}; stroke {:.4g} (largest of {} possible {})\n",
      x.peaks.torque, x.peaks.torque_rms, x.peaks.velocity, x.peaks.stroke, plan.drives,
      plan.drives == 1 ? "drive" : "drives");
  return text;
}

}  // namespace resonid::report
