// SPDX-License-Identifier: MIT
#include "design/export.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <resonid/identification/first_loop.hpp>
#include <resonid/identification/tune_export.hpp>
#include <type_traits>
#include <utility>

#include "identification/tune/figure_values.hpp"
#include "identification/tune/law.hpp"

namespace resonid::identification {
namespace {

constexpr const char* kOneSetOfGains =
    "must be taken away as c, c-float or st: a controller file has one set of gains";
constexpr const char* kNoShaper = "must have been asked for: Klipper takes an input shaper, no controller";

Error not_in_hal(std::string_view structure) {
  return Error{
      "structure",
      fmt::format("must be a P, a PI with or without biquads, or a cascade, for HAL, whose pid has no lag in "
                  "its derivative and no polynomials, found {}; c, st and json take every structure",
                  structure)};
}

expected<std::string> klipper_text(const Tuning& tuning, const ExportNames& names) {
  const auto chosen = std::find_if(tuning.shapers.begin(), tuning.shapers.end(),
                                   [](const TunedShaper& s) { return s.chosen; });
  if (chosen == tuning.shapers.end())
    return refuse("shaper",
                  tuning.shapers.empty() ? kNoShaper : "must stay below the limit: none of them does");
  if (!(chosen->duration_s > 0.0))
    return refuse("shaper",
                  "is not needed: the loop by itself leaves less vibration than the limit, so that there is "
                  "nothing to export for Klipper; leave this export out");
  if (tuning.second_shaped_mode)
    return refuse("shaper",
                  "must be of one mode for Klipper, found " + chosen->kind + "; json has its impulses");
  design::KlipperAxis axis;
  axis.axis = names.axis;
  axis.limit = tuning.options.shaper_limit;
  for (const auto& known : design::enum_names(design::ShaperKind{}))
    if (known.name == chosen->kind) axis.kinds = {known.value};
  axis.modes = {{tuning.shaped_mode->frequency_hz, tuning.shaped_mode->damping_ratio}};
  return design::to_klipper({axis});
}

template <class Design>
expected<std::string> in_language(Design design, ExportFormat format, const ExportNames& names) {
  design.name = names.name;
  if (names.name.empty()) {
    design.name = "velocity_controller";
    if constexpr (std::is_same_v<Design, design::ExportedController>)
      if (design.kv > 0.0) design.name = "position_controller";
  }
  switch (format) {
    case ExportFormat::c_float:
      return design::to_c(design, design::CNumber::in_float);
    case ExportFormat::structured_text:
      return design::to_structured_text(design);
    case ExportFormat::hal:
      if constexpr (std::is_same_v<Design, design::ExportedController>)
        return design::to_hal(design, names.thread);
      else
        return tl::unexpected(not_in_hal(design.what));
    default:
      return design::to_c(design, design::CNumber::in_double);
  }
}

expected<std::string> rst_text(const Tuning& tuning, ExportFormat format, const ExportNames& names) {
  const TunedController& c = tuning.proposed();
  if (c.position_gain)
    return refuse("evaluate",
                  "must be a velocity controller to be taken away in this language: json takes it");
  design::ExportedRst design;
  design.r = c.feedback.numerator;
  design.s = c.feedback.denominator;
  design.t = c.reference_numerator;
  design.sample_time_s = tuning.sample_time_s;
  design.torque_limit = tuning.options.torque_limit;
  design.what = c.name;
  return in_language(std::move(design), format, names);
}

expected<std::string> controller_text(const Tuning& tuning, ExportFormat format, const ExportNames& names) {
  if (format == ExportFormat::klipper) return klipper_text(tuning, names);
  const TunedController& c = tuning.proposed();
  if (!c.gains || c.derivative_gain) return rst_text(tuning, format, names);
  design::ExportedController design;
  design.controller = *c.gains;
  design.sample_time_s = tuning.sample_time_s;
  design.set_point_weight = c.set_point_weight;
  design.torque_limit = tuning.options.torque_limit;
  if (c.position_gain) design.kv = *c.position_gain;
  if (c.feed_forward)
    design.feed_forward = {c.feed_forward->inertia, c.feed_forward->viscous, c.feed_forward->coulomb,
                           c.feed_forward->delay_s};
  if (tuning.schedule) {
    if (tuning.schedule->largest_speed.value_or(0.0) > 0.0)
      design.largest_speed = tuning.schedule->largest_speed;
    design.controller.kp = design.controller.ki = 0.0;
    for (const auto& node : tuning.schedule->nodes)
      design.schedule.push_back({node.position, node.kp, node.ki});
  }
  return in_language(std::move(design), format, names);
}

bool in_word(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '/'; }

void replace_words(std::string& text, const std::string& word, const std::string& by) {
  for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at)) {
    const std::size_t end = at + word.size();
    const bool whole = (at == 0 || !in_word(text[at - 1])) && (end == text.size() || !in_word(text[end]));
    if (whole) text.replace(at, word.size(), by);
    at += whole ? by.size() : word.size();
  }
}

/// The comments of the languages are in SI units of a rotary drive; those of a linear one, or of volts, take
/// their place.
std::string in_units(std::string text, const Units& units) {
  if (units.velocity != "rad/s") {
    replace_words(text, "rad/s", units.velocity);
    replace_words(text, "rad", place_unit(units.velocity));
  }
  if (units.torque != "Nm") replace_words(text, "Nm", units.torque);
  return text;
}

/// A comment of the language before its text.
std::string with_comment(const std::string& comment, const std::string& text, ExportFormat format) {
  switch (format) {
    case ExportFormat::hal:
    case ExportFormat::klipper:
      return fmt::format("# {}\n{}", comment, text);
    case ExportFormat::structured_text:
      return fmt::format("(* {} *)\n{}", comment, text);
    default:
      return fmt::format("/* {} */\n{}", comment, text);
  }
}

/// Whether a text can stand in a comment of every language: names of columns may end one.
bool fits_comment(const std::string& text) {
  for (const char* end : {"*/", "*)", "/*", "(*", "\n"})
    if (text.find(end) != std::string::npos) return false;
  return true;
}

/// Gains and those of the first step, times a factor, in some units; empty without gains, or where there is
/// one for every position.
std::string gains_and_first_step(const Tuning& tuning, double factor, const GainUnits& units) {
  const TunedController& proposed = tuning.proposed();
  if (!proposed.gains || tuning.schedule) return {};
  const auto with = [&](double gain, const std::string& unit) {
    return fmt::format("{:.4g}{}", factor * gain, unit.empty() ? "" : " " + unit);
  };
  const auto& gains = *proposed.gains;
  const auto all = [&](double part, double integral_part) {
    std::string words = "kp " + with(part * gains.kp, units.kp);
    if (integrates(proposed)) words += ", ki " + with(integral_part * gains.ki, units.ki);
    if (proposed.derivative_gain)
      words += fmt::format(", kd {} (lag {:.4g} s)", with(part * *proposed.derivative_gain, units.kd),
                           *proposed.derivative_time_s);
    if (proposed.position_gain) words += fmt::format(", kv {:.4g} 1/s", part * *proposed.position_gain);
    return words;
  };
  return fmt::format("{}; first step {}.", all(1.0, 1.0), all(kFirstGain, kFirstIntegralGain));
}

/// What a drive that is set by hand takes: in the recording's own units where they are others than the
/// result's, and can be told.
std::string gains_comment(const Tuning& tuning) {
  if (const auto own = own_gains(tuning)) {
    std::string text = gains_and_first_step(tuning, own->factor, own->units);
    if (text.empty())
      text = fmt::format("{} is times {:.4g}{}.",
                         tuning.proposed().gains ? "every gain" : "every coefficient of T and R", own->factor,
                         own->units.kp.empty() ? "" : " " + own->units.kp);
    if (fits_comment(text)) return "In the recording's own units " + text;
  }
  const auto text = gains_and_first_step(tuning, 1.0, gain_units(tuning.units.input, tuning.units.velocity));
  return text.empty() || !fits_comment(text) ? std::string() : "Gains: " + text;
}

/// What stands behind the polynomials of a state feedback; empty for other structures.
std::string states_comment(const Tuning& tuning) {
  const auto& states = tuning.proposed().states;
  if (states.empty()) return {};
  const Units& units = tuning.units;
  std::string text = fmt::format(
      "Torque is minus the sum of gains ({0} per unit) times estimated states. The observer corrects an\n"
      "   estimate per {1} by which the measured velocity differs from it.",
      units.torque, units.velocity);
  for (const auto& state : states)
    text += fmt::format("\n   {}, {}: gain {:.4g}, corrected by {:.4g}", state.name, state.unit, state.gain,
                        state.observer_gain);
  return text;
}

}  // namespace

expected<void, Error> check_exportable(const TuneOptions& options, ExportFormat format) {
  if (format == ExportFormat::klipper) {
    if (!options.shaper) return refuse("shaper", kNoShaper);
    return {};
  }
  const bool is_file = format == ExportFormat::json || format == ExportFormat::first_step;
  if (!options.positions.empty() && is_file) return refuse("schedule", kOneSetOfGains);
  if (!options.positions.empty() && format == ExportFormat::hal)
    return refuse("schedule",
                  "must be taken away as c, c-float or st: LinuxCNC's pid multiplies its sum by Igain, so "
                  "that the torque would jump");
  const auto structure = options.structure;
  const bool by_polynomials = structure == ControllerStructure::pid ||
                              structure == ControllerStructure::rst ||
                              structure == ControllerStructure::state_feedback;
  if (by_polynomials && !options.evaluate && format == ExportFormat::hal)
    return tl::unexpected(not_in_hal(name_of(structure)));
  if (structure == ControllerStructure::state_feedback && !options.evaluate &&
      format == ExportFormat::first_step)
    return refuse("structure",
                  "must have gains of which the first step is a part, found state-feedback, whose poles are "
                  "those of its full gain; take the first step of a pi");
  return {};
}

expected<void, Error> check_exportable(const Tuning& tuning) {
  if (!tuning.proposed().stable)
    return refuse("evaluate", tuning.by_response
                                  ? "must be told stable by the measured response to be taken away"
                                  : "must be stable on the identified machine to be taken away");
  return {};
}

expected<TunedController, Error> first_step(const Tuning& tuning) {
  const TunedController& full = tuning.proposed();
  if (tuning.schedule) return refuse("schedule", kOneSetOfGains);
  if (!full.gains)
    return refuse("structure",
                  fmt::format("must have gains of which the first step is a part, found {}, whose poles are "
                              "those of its full gain; take the first step of a pi",
                              full.name));
  design::FilteredPi soft = *full.gains;
  soft.kp *= kFirstGain;
  soft.ki *= kFirstIntegralGain;
  const double step = full.feedback.sample_time_s;
  if (full.position_gain)
    return law_of(design::Cascade{std::move(soft), kFirstGain * *full.position_gain}, step).what;
  Law law =
      full.derivative_gain
          ? law_of(design::Pid{soft.kp, soft.ki, kFirstGain * *full.derivative_gain, *full.derivative_time_s},
                   step)
          : law_of(soft, step);
  set_weight(law, full.set_point_weight);
  return std::move(law.what);
}

expected<std::string> exported(const Tuning& tuning, ExportFormat format, const ExportNames& names) {
  if (auto checked = check_exportable(tuning); !checked) return tl::unexpected(checked.error());
  if (format == ExportFormat::json || format == ExportFormat::first_step)
    return refuse("format", "must be a language: a controller file is written by controller_json()");
  auto text = controller_text(tuning, format, names);
  if (!text) return text;
  if (format != ExportFormat::klipper) {
    *text = in_units(std::move(*text), tuning.units);
    if (const auto comment = states_comment(tuning); !comment.empty())
      *text = with_comment(comment, *text, format);
    if (const auto comment = gains_comment(tuning); !comment.empty())
      *text = with_comment(comment, *text, format);
  }
  constexpr const char* kWarning =
      "WARNING: this design is not trusted. Do not run it before its findings are cured.";
  return tuning.trusted ? *text : with_comment(kWarning, *text, format);
}

expected<std::string> exported(const FirstLoop& loop, ExportFormat format, const ExportNames& names) {
  if (format == ExportFormat::klipper)
    return refuse("format", "must be that of a controller: Klipper takes an input shaper");
  if (format == ExportFormat::first_step)
    return refuse("format", "must be that of the loop itself, which is soft enough to begin with");
  design::ExportedController design;
  design.controller = *loop.controller.gains;
  design.sample_time_s = 1.0 / loop.options.sample_rate_hz;
  design.torque_limit = loop.options.torque_limit;
  return in_language(std::move(design), format, names);
}

}  // namespace resonid::identification
