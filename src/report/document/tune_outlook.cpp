// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "report/document/tune_words.hpp"

namespace resonid::report {
namespace {

using design::ExperimentValue;
using identification::Tuning;

/// Standard deviation of the delay of one of several machines; 0 where it is assumed.
double own_delay_std(const fit::DriveModel& machine) {
  return machine.estimated[fit::kDelay] ? machine.estimate(fit::kDelay).std : 0.0;
}

/// " for the machines of b.json, c.json" where others have their own.
std::string assumed_for(const Tuning& t) {
  std::vector<std::string> files;
  for (std::size_t i = 0; i < t.machines.size(); ++i)
    if (!(own_delay_std(t.machines[i]) > 0.0)) files.push_back(file_of_machine(t, i));
  if (files.empty() || files.size() == t.machines.size()) return {};
  return fmt::format(" for the machine{} of {}", files.size() > 1 ? "s" : "", fmt::join(files, ", "));
}

/// "0.120 ms, that of the result"
std::string own_delay_words(const Tuning& t) {
  if (t.options.delay_std_s) return three_digits(1e3 * t.delay_std_s) + " ms, as specified";
  if (t.machines.size() < 2) return three_digits(1e3 * t.delay_std_s) + " ms, that of the result";
  const auto [least, most] = std::ranges::minmax(t.machines, {}, own_delay_std);
  const auto from = three_digits(1e3 * own_delay_std(least)), to = three_digits(1e3 * own_delay_std(most));
  return (from == to ? to : from + " ... " + to) + " ms, those of the results";
}

std::string delay_sentence(const Tuning& t) {
  if (t.by_response) return {};
  if (t.delay_std_assumed)
    return fmt::format(
        "The delay's standard deviation, {} ms, is assumed{}: a quarter of a sample. It decides most of the "
        "margins: identify without .delay_s, which estimates it with its error bar, or give .delay_std_s "
        "where it is known better.",
        three_digits(1e3 * t.delay_std_s), assumed_for(t));
  return fmt::format("The delay's standard deviation is {}.", own_delay_words(t));
}

/// Half of each standard deviation, as `plan` takes it.
std::string half_deviations(const fit::DriveModel& machine) {
  std::string text;
  for (int i = 0; i < fit::kParameterCount; ++i) {
    if (!machine.estimated[static_cast<std::size_t>(i)]) continue;
    const auto e = machine.estimate(static_cast<fit::Parameter>(i));
    if (!(e.std > 0.0) || !(e.std < std::abs(e.value))) continue;
    text += fmt::format("{}{}={:.2g}%", text.empty() ? "" : ",",
                        fit::kParameterNames[static_cast<std::size_t>(i)], 50.0 * e.std / std::abs(e.value));
  }
  return text;
}

/// Of an experiment; the delay's variance is that of the parameters, or stays.
std::string variance_words(const ExperimentValue& value) {
  const bool with_delay = value.delay_factor == value.factor;
  if (value.factor == 0.0)
    return with_delay ? "with no uncertainty at all" : "with no uncertainty but the delay's";
  if (value.factor != 0.25) return fmt::format("with {:.2g} times every variance", value.factor);
  return with_delay ? "with half of every standard deviation, the delay's too,"
                    : "with half of every standard deviation but the delay's";
}

/// How much less of the load step is left.
double less_than(const ExperimentValue& now, const ExperimentValue& value) {
  return 1.0 - value.iae / now.iae;
}

/// What a known delay would buy beside parameters that stay as they are.
std::string known_delay_sentence(const Tuning& t, const ExperimentValue& now) {
  const auto known = std::find_if(t.experiment.begin(), t.experiment.end(), [](const ExperimentValue& v) {
    return v.factor == 1.0 && v.delay_factor == 0.0;
  });
  constexpr double kWorthWhile = 0.03;
  if (known == t.experiment.end() || less_than(now, *known) < kWorthWhile) return {};
  return fmt::format("With the delay known exactly ki could be {}, and the load step's IAE {:.0f} % smaller.",
                     three_digits(known->ki), 100.0 * less_than(now, *known));
}

/// A command ends its line, so that it can be copied.
void put_plans(const Tuning& t, std::vector<std::string>& list) {
  for (std::size_t i = 0; i < t.machines.size(); ++i) {
    const auto accuracy = half_deviations(t.machines[i]);
    if (accuracy.empty()) continue;
    const auto file = i < t.results.size() ? t.results[i] : std::string("RESULT.json");
    const auto of_which = t.machines.size() > 1 ? " of the machine of " + file : std::string();
    list.push_back("To plan one that halves the standard deviations" + of_which + ": resonid plan .model " +
                   file + " .accuracy " + accuracy);
  }
}

void put_experiment(const Tuning& t, std::vector<std::string>& list) {
  const ExperimentValue* now = nullptr;
  for (const auto& value : t.experiment)
    if (value.factor == 1.0 && value.delay_factor == 1.0) now = &value;
  if (now == nullptr || !(now->iae > 0.0)) return;
  std::string text;
  double most = 0.0;
  for (const auto& value : t.experiment) {
    if (value.factor >= 1.0) continue;
    const double less = less_than(*now, value);
    most = std::max(most, less);
    text += fmt::format("{}{} ", text.empty() ? "" : "; ", variance_words(value));
    if (value.ki > 0.0) text += fmt::format("ki could be {}, and ", three_digits(value.ki));
    text += fmt::format("the load step's IAE {}{:.0f} % smaller", value.ki > 0.0 ? "" : "could be ",
                        std::max(0.0, 100.0 * less));
  }
  if (text.empty()) return;
  constexpr double kWorthWhile = 0.03;  // of the load's error: less is lost in everything else
  const auto by_delay = known_delay_sentence(t, *now);
  if (most < kWorthWhile) {
    list.push_back(by_delay.empty()
                       ? "A better experiment would buy nothing: the uncertainty hardly costs any stiffness."
                       : "Better known parameters would buy nothing by themselves. " + by_delay);
    return;
  }
  list.push_back("What a better experiment would buy: " + text + "." +
                 (by_delay.empty() ? "" : " " + by_delay));
  // A delay that was told is part of "no uncertainty at all", and no experiment changes it.
  if (now->ki > 0.0 || (!t.delay_std_assumed && !t.options.delay_std_s)) put_plans(t, list);
}

/// How quickly the gains may change.
std::string speed_words(const identification::TunedSchedule& s) {
  if (!s.largest_speed || !s.looked_speed) return {};
  if (*s.largest_speed >= *s.looked_speed)
    return fmt::format(
        ". The position may move at up to {} of its units per s; what it does faster was not looked at",
        three_digits(*s.largest_speed));
  if (*s.largest_speed > 0.0)
    return fmt::format(
        ". The position may move at up to {} of its units per s: beyond it the gains change so quickly "
        "that the load is "
        "disturbed a tenth more",
        three_digits(*s.largest_speed));
  return ". The gains suit a position that rests: even a slow run disturbs the load a tenth more";
}

/// What the simulated cascade is given of its reference.
std::string_view fed_forward_words(const identification::TunedController& c) {
  if (!c.position_gain) return "";
  return c.feed_forward ? " with feed-forward of velocity and torque" : " with feed-forward of velocity";
}

/// The torque of a load step: its figures are promised for it, those of the controller for a torque of 1.
std::string load_size(const identification::TunedController& c, const identification::SimulatedRun& run,
                      const std::string& unit) {
  for (const auto& figure : run.figures) {
    const auto of_one = value_of(c, figure.name);
    if (figure.promised && of_one && *of_one > 0.0)
      return " of " + three_digits(*figure.promised / *of_one) + " " + unit;
  }
  return {};
}

/// What a simulated step leaves of the load's way, in percent.
std::optional<double> deviation_left(const Tuning& t, std::string_view what) {
  for (const auto& run : t.simulated)
    for (const auto& figure : run.figures)
      if (run.what == what && figure.name == "deviation_left") return figure.simulated;
  return std::nullopt;
}

/// A slow loop is off its reference without any vibration, and by more through a shaper, which ends later.
std::string creep_sentence(const Tuning& t) {
  constexpr double kHardlyLess = 0.5;
  const auto plain = deviation_left(t, "reference step"),
             shaped = deviation_left(t, "reference step through the shaper");
  if (!plain || !shaped || *shaped < 100.0 * t.options.shaper_limit || *shaped < kHardlyLess * *plain)
    return {};
  return fmt::format(
      " What is left of the load's deviation on the simulated machine, {} % through it and {} % without, is "
      "no "
      "vibration but how slowly the loop comes to its reference: no shaper makes that quicker, and each "
      "begins "
      "it later.",
      three_digits(*shaped), three_digits(*plain));
}

}  // namespace

std::vector<std::string> uncertainty_sentences(const Tuning& t) {
  std::vector<std::string> list;
  if (auto text = delay_sentence(t); !text.empty()) list.push_back(std::move(text));
  put_experiment(t, list);
  return list;
}

std::string nominal_sentence(const Tuning& t) {
  if (!t.nominal || t.nominal->draws == 0) return {};
  const auto& n = *t.nominal;
  std::string gains;
  if (n.gains && t.proposed().gains && is_p(n))
    gains = fmt::format("have kp {} in place of {} and ", three_digits(n.gains->kp),
                        three_digits(t.proposed().gains->kp));
  else if (n.gains && t.proposed().gains)
    gains = fmt::format("have ki {} in place of {} and ", three_digits(n.gains->ki),
                        three_digits(t.proposed().gains->ki));
  return fmt::format(
      "Designed for the identified machine{} alone it would {}exceed a bound with {} probability.",
      is_for_several(t) ? "s" : "", gains, share_text(n.probability()));
}

std::string schedule_sentence(const Tuning& t) {
  if (!t.schedule) return {};
  const auto& s = *t.schedule;
  std::string text = fmt::format("Gains over position, {} nodes: every bound is {} at every position",
                                 s.nodes.size(), s.within ? "met" : "NOT met");
  if (!s.places.empty())
    text += fmt::format(" with at least {:g} % probability; it is exceeded most often at {:.4g}: {}",
                        100.0 * t.options.confidence, s.worst_position, share_text(s.probability()));
  if (s.fixed_iae && s.scheduled_iae)
    text += fmt::format("; on a run through the stroke IAE {} against {} with one controller for all",
                        three_digits(*s.scheduled_iae), three_digits(*s.fixed_iae));
  else if (s.scheduled_iae && !s.places.empty())
    text += "; no single PI suits all positions";
  text += speed_words(s);
  return text + ".";
}

std::string shaper_sentence(const Tuning& t) {
  if (t.shapers.empty()) return {};
  for (const auto& s : t.shapers)
    if (s.chosen)
      return s.duration_s <= 0.0
                 ? fmt::format(
                       "No input shaper is needed: a period after a step of the reference its "
                       "vibration is {} of it or less.",
                       share_text(s.vibration))
                 : fmt::format("Input shaper: {}, {} ms long, leaves {} of the vibration or less.", s.kind,
                               three_digits(1e3 * s.duration_s), share_text(s.vibration)) +
                       creep_sentence(t);
  return fmt::format("No input shaper leaves less than {} of the vibration.",
                     share_text(t.options.shaper_limit));
}

RunName name_of_run(const identification::SimulatedRun& run) {
  constexpr std::string_view kRunning = " with the running controller";
  if (!run.what.ends_with(kRunning)) return {run.what, false};
  return {run.what.substr(0, run.what.size() - kRunning.size()), true};
}

std::string run_words(const Tuning& t, const identification::SimulatedRun& run) {
  const auto [what, running] = name_of_run(run);
  const auto& controller = running && t.running ? *t.running : t.proposed();
  const auto size = three_digits(t.options.reference_step);
  const std::string velocity = size + " " + t.units.velocity;
  std::string text = what;
  if (what.starts_with("reference step"))
    text.insert(std::string_view("reference step").size(), " of " + velocity);
  if (what == "load step") text += load_size(controller, run, t.units.torque);
  if (what == "motion") text += fmt::format(" to {}{}", velocity, fed_forward_words(controller));
  // A move of the load by as much as a second at that velocity makes.
  if (what.starts_with("motion with") && !run.figures.empty())
    text.insert(std::string_view("motion").size(), " by " + size + " " + run.figures.front().unit);
  return text + (running ? " with the running controller" : "");
}

std::vector<std::string> simulated_sentences(const Tuning& t) {
  std::vector<std::string> list;
  for (const auto& run : t.simulated) {
    if (name_of_run(run).running) continue;
    std::string text;
    for (const auto& figure : run.figures) {
      if (!figure.promised) continue;
      const auto unit = shown_unit({figure.name, figure.unit, *figure.promised, {}, {}, {}, {}, {}, {}});
      text += fmt::format("{}{} {} (promised {})", text.empty() ? "" : ", ",
                          loop_figure_symbol(figure.name, t.proposed().position_gain.has_value()),
                          unit.text(figure.simulated), unit.text(*figure.promised));
    }
    if (!text.empty())
      list.push_back(fmt::format("On the simulated machine, {}: {}.", run_words(t, run), text));
  }
  return list;
}

}  // namespace resonid::report
