// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <resonid/report/detail/tune.hpp>

#include "report/document/tune_words.hpp"
#include "report/document/words.hpp"

namespace resonid::report {
namespace {

using design::TradeOff;
using identification::TunedController;
using identification::Tuning;

/// "of 10 000 machines that the identification leaves possible, 4.2 % exceed one, none is unstable"
std::string counted_text(const Tuning& t) {
  const auto& c = t.proposed();
  if (c.draws == 0) return "of every response within the error bars of all lines at once";
  const bool several = is_for_several(t);
  return fmt::format("of {} machines that {} identification leaves possible, {}{} one, {}", grouped(c.draws),
                     several ? "each" : "the", several && c.exceeding > 0 ? "at most " : "",
                     c.exceeding == 0 ? "none exceeds" : share_text(c.probability()) + " exceed",
                     c.unstable == 0   ? std::string("none is unstable")
                     : c.unstable == 1 ? std::string("one is UNSTABLE")
                                       : grouped(c.unstable) + " are UNSTABLE");
}

/// What exceeds its bound on the machine that figures are of: "|T_load| is 1.91 (bound 1.30)".
std::string exceeded_text(const TunedController& c) {
  std::string text;
  for (const auto& figure : c.figures) {
    if (!figure.bound || !figure.probability || *figure.probability < 0.5) continue;
    if (figure.value <= *figure.bound) continue;  // by another machine
    const auto unit = shown_unit(figure);
    if (unit.number(figure.value) == unit.number(*figure.bound)) continue;
    text += fmt::format("{}{} is {} (bound {})", text.empty() ? "" : ", ",
                        loop_figure_symbol(figure.name, c.position_gain.has_value()), unit.text(figure.value),
                        unit.text(*figure.bound));
  }
  return text;
}

/// " up to 25 Hz" where nothing is promised above.
std::string promised_to(const Tuning& t) {
  const auto ends = std::ranges::find(t.findings, "promise-ends-with-band", &diagnostics::Finding::id);
  return ends == t.findings.end() || !ends->value
             ? std::string()
             : fmt::format(" up to {} Hz, where the machine was measured,", three_digits(*ends->value));
}

/// What has to be otherwise for a design that is not trusted to keep its bounds: " if the result were right".
std::string condition_text(const Tuning& t) {
  struct Cause {
    std::string_view finding, condition;
  };
  constexpr Cause kCauses[] = {{"tuned-untrusted", "the result were right"},
                               {"prediction-fails", "the loop were the one that was promised"},
                               {"measured-beyond-bound", "the recording did not show otherwise"},
                               {"fails-in-simulation", "the drive were the identified one"},
                               {"simulation-beyond-bound", "the drive were the identified one"},
                               {"crossover-not-measured", "the model held where the loop crosses"},
                               {"step-not-kept", "the drive had the torque that its step takes"}};
  if (t.trusted) return {};
  for (const auto& cause : kCauses)
    for (const auto& finding : t.findings)
      if (finding.id == cause.finding && finding.severity == diagnostics::Severity::error)
        return fmt::format(" if {}", cause.condition);
  return " if the result were right";
}

std::string verdict_sentence(const Tuning& t) {
  const auto& c = t.proposed();
  const std::string who = t.is_evaluation() ? fmt::format("The given controller ({})", c.name) : c.name;
  const auto bounds = bounds_text(c);
  const double percent = 100.0 * t.options.confidence;
  if (stability_is_unknown(t))
    return fmt::format("{}: by {} its loop is NOT TOLD to be stable.", who, machine_words(t));
  if (!c.stable && t.by_response)
    return fmt::format("{}: by {} its loop is UNSTABLE.", who, machine_words(t));
  if (!c.stable)
    return fmt::format("{}: the loop of {} is UNSTABLE with it.", who,
                       is_for_several(t) ? "an identified machine" : "the identified machine");
  const std::string keeps = t.trusted ? "keeps" : "would keep";
  const std::string condition = condition_text(t), where = promised_to(t);
  if (c.within && t.options.guarantee == identification::Guarantee::ellipsoid)
    return fmt::format("{} {} every bound ({}){} on every machine of the {:g} % confidence ellipsoid{}: {}.",
                       who, keeps, bounds, where, percent, condition, counted_text(t));
  if (c.within)
    return fmt::format("{} {} every bound ({}){} with at least {:g} % probability{}: {}.", who, keeps, bounds,
                       where, percent, condition, counted_text(t));
  const auto exceeded = exceeded_text(c);
  const std::string on = exceeded.empty() ? "" : fmt::format(" On {} {}.", machine_words(t), exceeded);
  if (t.is_evaluation())
    return fmt::format("{} does NOT keep every bound ({}) with {:g} % probability: {}.{}", who, bounds,
                       percent, counted_text(t), on);
  return fmt::format(
      "No controller keeps every bound ({}) with {:g} % probability; what follows is the closest, {}: {}.{}",
      bounds, percent, who, counted_text(t), on);
}

/// What a reader must know before the verdict; empty for nothing. That bounds are not kept is the verdict's.
std::string warning_sentence(const Tuning& t) {
  if (t.trusted) return {};
  if (t.options.force)
    return "Made by force (.force): results or controller are not trusted. Nothing below may be relied on "
           "before it has been measured on the machine.";
  return results_are_trusted(t) ? std::string() : "Not trusted: see the findings.";
}

std::string filter_kind(const design::Biquad& b) {
  return b.numerator_damping < b.denominator_damping ? "notch" : "lead";
}

/// Gains in some units, a part of them: a recording's scales do not touch times, kv and set-point weight.
struct ShownGains {
  GainUnits units;
  double scale = 1.0, part = 1.0;
};

/// What kp and ki leave out.
std::string rest_of_gains(const TunedController& c, const ShownGains& shown) {
  std::string text;
  if (c.position_gain)
    text += fmt::format(", position gain kv {} 1/s", three_digits(shown.part * *c.position_gain));
  if (c.derivative_gain) {
    text += fmt::format(", kd {}{}", three_digits(shown.scale * shown.part * *c.derivative_gain),
                        shown.units.kd.empty() ? "" : " " + shown.units.kd);
    if (c.gains && c.gains->kp > 0.0)
      text += fmt::format(" (Td {})", time_text(*c.derivative_gain / c.gains->kp));
  }
  if (c.derivative_time_s)
    text += fmt::format(" filtered with {} ms", three_digits(1e3 * *c.derivative_time_s));
  if (shown.part == 1.0 && c.set_point_weight != 1.0)
    text += fmt::format(", set-point weight b {:.2g}", c.set_point_weight);
  return text;
}

std::string feed_forward_sentence(const Tuning& t, const identification::TunedFeedForward& f) {
  std::string text = fmt::format(
      "Feed-forward: the reference's velocity to the velocity loop, and a torque of {} {} times its "
      "acceleration",
      three_digits(f.inertia), t.units.inertia);
  if (f.viscous > 0.0)
    text += fmt::format(" and {} {} times its velocity", three_digits(f.viscous), t.units.damping);
  if (f.coulomb > 0.0)
    text += fmt::format(", and {} {} in its direction", three_digits(f.coulomb), t.units.torque);
  if (f.delay_s > 0.0)
    text += fmt::format(
        "; the feedback is given position and velocity of the reference {} ms later, as late as "
        "it measures",
        three_digits(1e3 * f.delay_s));
  return text + ".";
}

std::string all_gains(const TunedController& c, const ShownGains& shown) {
  return gains_text(c, shown.units, shown.scale * shown.part) + rest_of_gains(c, shown);
}

/// A controller without gains: what its numbers are to be multiplied by in the recording's own units.
std::string own_numerator_sentence(const Tuning& t) {
  const auto own = own_gains(t);
  if (!own) return {};
  const bool apart = !t.proposed().reference_numerator.empty();
  return fmt::format("In the recording's own units{}: its numerator{} times {}.",
                     own->units.kp.empty() ? "" : " (" + own->units.kp + ")",
                     apart ? ", and that of the reference," : "", three_digits(own->factor));
}

/// "-0.21 Nm/(rad/s)"; of a torque per torque the number alone.
std::string state_gain_text(const Tuning& t, const identification::TunedState& state) {
  const auto number = three_digits(state.gain);
  if (state.unit == t.units.torque) return number;
  const bool is_ratio = state.unit.find('/') != std::string::npos;
  return number + " " + t.units.torque + "/" + (is_ratio ? "(" + state.unit + ")" : state.unit);
}

void put_states(const Tuning& t, std::vector<std::string>& list) {
  std::string gains, corrections;
  for (const auto& state : t.proposed().states) {
    gains += fmt::format("{}{} {}", gains.empty() ? "" : ", ", state.name, state_gain_text(t, state));
    corrections += fmt::format("{}{} {} {}", corrections.empty() ? "" : ", ", state.name,
                               three_digits(state.observer_gain), state.unit);
  }
  if (gains.empty()) return;
  list.push_back("Its torque is minus the sum of gains times estimated states: " + gains + ".");
  list.push_back(
      fmt::format("Its observer corrects them, for every {} by which the measured velocity differs "
                  "from its estimate, by: {}.",
                  t.units.velocity, corrections));
}

void put_gains(const Tuning& t, std::vector<std::string>& list) {
  const auto& c = t.proposed();
  const ShownGains si{gain_units(t.units.input, t.units.velocity)};
  if (!c.gains) {
    if (c.feedback.denominator.empty()) return;
    list.push_back(fmt::format("Controller of order {} from velocity error to torque, at {:g} Hz{}.",
                               std::max(c.feedback.numerator.size(), c.feedback.denominator.size()) - 1,
                               1.0 / c.feedback.sample_time_s, rest_of_gains(c, si)));
    put_states(t, list);
    if (auto text = own_numerator_sentence(t); !text.empty()) list.push_back(std::move(text));
    return;
  }
  std::string text = fmt::format("Gains: {}.", all_gains(c, si));
  for (std::size_t i = 0; i < c.gains->biquads.size(); ++i) {
    const auto& b = c.gains->biquads[i];
    text += fmt::format(" Biquad {} ({}): {} Hz, damping {} over {}, {:+.1f} dB there.", i + 1,
                        filter_kind(b), three_digits(b.frequency_hz), three_digits(b.numerator_damping),
                        three_digits(b.denominator_damping),
                        20.0 * std::log10(b.numerator_damping / b.denominator_damping));
  }
  list.push_back(std::move(text));
  if (c.feed_forward) list.push_back(feed_forward_sentence(t, *c.feed_forward));
  if (const auto own = own_gains(t))
    list.push_back(fmt::format("In the recording's own units: {}.{}", all_gains(c, {own->units, own->factor}),
                               own->factor < 0.0 ? " Negative, as a scale of the recording is." : ""));
}

/// What is made of polynomials has no part that could be halved alone.
std::string first_step_of_pi(const Tuning& t) {
  const auto pi = std::find_if(t.candidates.begin(), t.candidates.end(), [](const TunedController& c) {
    return c.structure == "pi" && c.gains.has_value();
  });
  if (pi == t.candidates.end()) return {};
  TunedController soft = *pi;
  soft.gains->ki *= identification::kFirstIntegralGain / identification::kFirstGain;
  return fmt::format(
      "First step: there is none of this controller, whose poles are those of its full gain. Begin with that "
      "of the PI beside it, half of kp and a quarter of ki, {}, record under it and compare the measured "
      "loop "
      "with what is promised of it (.evaluate).",
      gains_text(soft, gain_units(t.units.input, t.units.velocity), identification::kFirstGain));
}

/// Every first step on a machine is a small one: half of kp with half of ki would be damped less.
std::string first_step_sentence(const Tuning& t) {
  using identification::kFirstGain;
  if (t.is_evaluation()) return {};
  if (!t.proposed().gains) return first_step_of_pi(t);
  TunedController soft = t.proposed();
  soft.gains->ki *= identification::kFirstIntegralGain / kFirstGain;
  std::string text =
      (is_p(soft) ? "First step: half of kp, " : "First step: half of kp and a quarter of ki, ") +
      all_gains(soft, {gain_units(t.units.input, t.units.velocity), 1.0, kFirstGain});
  if (const auto own = own_gains(t))
    text += "; in the recording's own units " + all_gains(soft, {own->units, own->factor, kFirstGain});
  return text +
         ". Record under them and compare the measured loop with this one before taking the full gains.";
}

/// The error of the load on a curve of trade-offs, at the bound and a tenth or more above it.
std::string cost_text(const std::vector<TradeOff>& curve, double bound, double TradeOff::*of,
                      const char* symbol) {
  const TradeOff *here = nullptr, *next = nullptr;
  for (const auto& point : curve) {
    if (here == nullptr || std::abs(point.*of - bound) < std::abs(here->*of - bound)) here = &point;
    if (next == nullptr && point.*of >= 1.1 * bound && std::isfinite(point.*of)) next = &point;
  }
  if (here == nullptr || next == nullptr || !(here->iae > 0.0)) return {};
  const double less = 1.0 - next->iae / here->iae;
  if (less < 0.005)
    return fmt::format(" A bound of {} on {} would gain nothing for a PI.", three_digits(next->*of), symbol);
  return fmt::format(" A bound of {} on {} would make the load step's IAE of the best PI {:.0f} % smaller.",
                     three_digits(next->*of), symbol, 100.0 * less);
}

/// What loosens a bound; nothing where no option does.
std::string_view option_of_bound(std::string_view figure, bool of_position) {
  struct Loosened {
    std::string_view figure, option;
  };
  constexpr Loosened kOptions[] = {{"sensitivity_peak", ".largest_sensitivity"},
                                   {"complementary_peak", ".largest_complementary"},
                                   {"controller_sensitivity_peak", ".largest_controller_sensitivity"}};
  if (figure == "load_peak") return of_position ? ".largest_position_transfer" : ".largest_load_transfer";
  for (const auto& known : kOptions)
    if (known.figure == figure) return known.option;
  return {};
}

/// Bounds whose price was not worked out: where each is reached, what loosens it, and how to learn the price.
std::string looser_bounds_sentence(const TunedController& c, const std::vector<std::string>& names) {
  const bool of_position = c.position_gain.has_value();
  std::string text;
  for (const auto& name : names) {
    const auto* figure = c.figure(name);
    const auto option = option_of_bound(name, of_position);
    text += (text.empty() ? "" : " or ") + loop_figure_symbol(name, of_position);
    if (figure != nullptr && figure->frequency_hz)
      text += fmt::format(", largest near {} Hz", three_digits(*figure->frequency_hz));
    if (!option.empty()) text += fmt::format(" ({})", option);
  }
  if (text.empty()) return {};
  return fmt::format(
      " Larger gains need a looser bound on {}: design again with one, and compare the {} of the load step.",
      text, is_p(c) ? "peak" : "IAE");
}

std::string limit_sentence(const Tuning& t) {
  const auto& c = t.proposed();
  if (c.limits.empty() || t.is_evaluation()) return {};
  std::string text;
  for (std::size_t i = 0; i < c.limits.size(); ++i)
    text += (i == 0                     ? ""
             : i + 1 == c.limits.size() ? " and "
                                        : ", ") +
            loop_figure_symbol(c.limits[i], c.position_gain.has_value());
  text = fmt::format("What limits the design: the bound{} on {}.", c.limits.size() > 1 ? "s" : "", text);
  const auto limits = [&](const char* name) {
    return std::find(c.limits.begin(), c.limits.end(), name) != c.limits.end();
  };
  const bool has_prices = !c.position_gain && !is_p(c);  // the curves of bounds are those of a velocity PI
  std::vector<std::string> unknown;
  for (const auto& name : c.limits) {
    const bool is_computed = has_prices && (name == "sensitivity_peak" || name == "load_peak");
    if (is_computed || name == "beyond_band_peak") continue;  // the band's worth is a finding
    unknown.push_back(name);
  }
  text += looser_bounds_sentence(c, unknown);
  if (!has_prices) return text;
  if (limits("sensitivity_peak"))
    text += cost_text(t.over_sensitivity, t.options.largest_sensitivity, &TradeOff::sensitivity, "|S|");
  if (limits("load_peak"))
    text += cost_text(t.over_load_transfer, t.options.largest_load_transfer, &TradeOff::load_transfer,
                      "|T_load|");
  return text;
}

/// What an engineer looks for: "crossover 4.90 Hz, phase margin 63.2 deg, gain margin 12.1 dB".
std::string margins_sentence(const TunedController& c) {
  std::string text;
  for (const auto& figure : c.figures) {
    if (figure.name != "crossover_hz" && figure.name != "phase_margin_deg" &&
        figure.name != "gain_margin_db" && figure.name != "delay_margin_s")
      continue;
    if (!std::isfinite(figure.value)) continue;
    const auto unit = shown_unit(figure);
    text += (text.empty() ? "" : ", ") + loop_figure_symbol(figure.name) + " " + unit.text(figure.value);
    if (figure.low && figure.high)
      text += fmt::format(" ({} ... {})", unit.number(*figure.low), unit.number(*figure.high));
  }
  if (text.empty() || !c.stable) return {};
  text[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(text[0])));
  return text + (c.draws > 0 ? "; in brackets what 95 % of the machines have." : ".");
}

std::string running_sentence(const Tuning& t) {
  if (!t.running) return {};
  if (!t.running->stable)
    return fmt::format("The loop of the running controller is unstable on {}.",
                       is_for_several(t) ? "an identified machine" : "the identified machine");
  const auto ratio = stiffer_by(t);
  if (!ratio) return {};
  std::string text = fmt::format(
      "Against the running controller: {}; the load's error after a torque step (IAE) is {}, before {}.",
      stiffness_words(*ratio), figure_text(t.proposed(), "load_step_iae"),
      figure_text(*t.running, "load_step_iae"));
  const auto s = value_of(*t.running, "sensitivity_peak"), load = value_of(*t.running, "load_peak");
  if (s && load)
    text += fmt::format(" The running one has |S| {} and {} {}.", three_digits(*s),
                        loop_figure_symbol("load_peak", t.running->position_gain.has_value()),
                        three_digits(*load));
  return text;
}

/// Where the crossover lies against the common rule of half the anti-resonance (docs/methods/tune.md 5.3).
std::string crossover_sentence(const Tuning& t) {
  if (!t.proposed().stable) return {};
  const auto crossover = value_of(t.proposed(), "crossover_hz");
  if (!crossover || t.machines.size() != 1 || t.machines[0].structure != fit::Structure::two_mass) return {};
  const auto& machine = t.machines.front();
  const double anti = machine.antiresonance().value;
  if (!(anti > 0.0)) return {};
  return fmt::format(
      "The crossover is {:.2f} of the anti-resonance ({} Hz). The common rule, half of it, suits inertia "
      "ratios (load over motor) of 0.5 ... 1 only; here the ratio is {:.2f}.",
      *crossover / anti, three_digits(anti),
      machine.parameters.load_inertia / machine.parameters.driven_inertia);
}

}  // namespace

std::vector<std::string> lead_sentences(const Tuning& t) {
  std::vector<std::string> list;
  const auto put = [&](std::string text) {
    if (!text.empty()) list.push_back(std::move(text));
  };
  put(warning_sentence(t));
  put(verdict_sentence(t));
  put(several_sentence(t));
  put(check_sentence(t));
  put_gains(t, list);
  put(first_step_sentence(t));
  put(running_sentence(t));
  put(limit_sentence(t));
  for (auto& sentence : uncertainty_sentences(t)) put(std::move(sentence));
  return list;
}

std::vector<std::string> loop_sentences(const Tuning& t) {
  std::vector<std::string> list;
  for (auto& text : {margins_sentence(t.proposed()), crossover_sentence(t)})
    if (!text.empty()) list.push_back(text);
  return list;
}

std::vector<std::string> sentences(const Tuning& t) {
  auto list = lead_sentences(t);
  for (auto& text : loop_sentences(t)) list.push_back(std::move(text));
  for (auto& text : {nominal_sentence(t), schedule_sentence(t), shaper_sentence(t)})
    if (!text.empty()) list.push_back(text);
  for (auto& text : simulated_sentences(t)) list.push_back(std::move(text));
  return list;
}

}  // namespace resonid::report
