// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <monitoring/alarm_text.hpp>
#include <monitoring/axis_spec.hpp>
#include <resonid/base/detail/number_text.hpp>
#include <string_view>

namespace resonid::monitoring {
namespace {

/// How a figure is spoken of.
struct FigureWords {
  std::string_view name, linear_name, unit, linear_unit;
  bool by_ratio = true;  ///< Changes in per cent.
};

FigureWords words_of(Watched figure) noexcept {
  switch (figure) {
    case Watched::resonance:
      return {"Resonance", "Resonance", "Hz", "Hz"};
    case Watched::antiresonance:
      return {"Anti-resonance", "Anti-resonance", "Hz", "Hz"};
    case Watched::stiffness:
      return {"Stiffness", "Stiffness", "Nm/rad", "N/m"};
    case Watched::driven_inertia:
      return {"Motor inertia", "Motor mass", "kg m2", "kg"};
    case Watched::load_inertia:
      return {"Load inertia", "Load mass", "kg m2", "kg"};
    case Watched::damping:
      return {"Damping", "Damping", "Nm s/rad", "N s/m"};
    case Watched::coulomb_friction:
      return {"Dry friction", "Dry friction", "Nm", "N"};
    case Watched::load_torque:
      return {"Load torque", "Load force", "Nm", "N", false};
    case Watched::modulus_margin:
      return {"Modulus margin", "Modulus margin", "", "", false};
    case Watched::phase_margin:
      return {"Phase margin", "Phase margin", "deg", "deg", false};
    case Watched::gap:
      return {"Distance to the baseline", "Distance to the baseline", "", "", false};
  }
  return {};
}

std::string with_unit(std::string text, std::string_view unit) {
  if (!unit.empty()) text.append(" ").append(unit);
  return text;
}

/// An event with the words for it.
class AlarmSentence {
 public:
  AlarmSentence(const AlarmEvent& event, const AlarmWords& words)
      : e_(event), words_(words), figure_(words_of(event.alarm.figure)) {}

  [[nodiscard]] std::string text() const {
    const AlarmState& s = e_.state;
    switch (e_.transition) {
      case Transition::raised:
        return condition() + cause() +
               (s.chattering
                    ? "; chattering, three times within a minute: a longer off_delay_s or a deadband "
                      "helps"
                    : "");
      case Transition::realarmed:
        return condition() + cause() +
               (e_.change.grown ? "; more than was told before" : "; still not acknowledged");
      case Transition::cleared:
        return over() + (s.fleeting ? "; it lasted for less than 10 s: a longer on_delay_s helps" : "");
      case Transition::latched:
        return title() + ": stays until it is reset";
      case Transition::acknowledged:
        return title() + ": acknowledged";
      case Transition::reset:
        return title() + ": reset";
      case Transition::shelved:
        return fmt::format("{}: shelved until {}{}", title(),
                           s.shelving == Shelving::one_shot ? "it clears, at the latest " : "",
                           s.shelved_until_ns != 0 && words_.clock ? words_.clock(s.shelved_until_ns)
                                                                   : words_.time(s.shelved_until));
      case Transition::unshelved:
        return title() + ": no longer shelved" + still_active();
      case Transition::shelving_expired:
        return title() + ": shelving is over" + still_active();
      case Transition::suppressed:
        return title() + ": suppressed by " + suppressions();
      case Transition::unsuppressed:
        return title() + ": no longer suppressed" + still_active();
      case Transition::superseded:
        return title() + ": raised again, which is an alarm of its own";
    }
    return {};
  }

 private:
  [[nodiscard]] std::string name() const {
    return std::string(words_.linear ? figure_.linear_name : figure_.name);
  }
  [[nodiscard]] std::string_view unit() const {
    const auto own = unit_of(e_.alarm.figure, words_.units);
    if (!words_.units.physical && !own.empty()) return own;
    return words_.linear ? figure_.linear_unit : figure_.unit;
  }
  [[nodiscard]] std::string since() const { return " since " + words_.time(e_.since_sample); }
  [[nodiscard]] std::string still_active() const { return e_.state.active ? ", still active" : ""; }

  [[nodiscard]] std::string title() const {
    switch (e_.alarm.kind) {
      case AlarmKind::change:
        return name();
      case AlarmKind::limit:
        return name() + ", limit";
      case AlarmKind::data:
        return "Data";
      case AlarmKind::stale:
        return words_.refused ? "No usable samples" : "No samples";
      case AlarmKind::estimate:
        return "Estimate";
      case AlarmKind::controller:
        return "Controller";
    }
    return {};
  }

  [[nodiscard]] std::string condition() const {
    switch (e_.alarm.kind) {
      case AlarmKind::change:
        return change() + since();
      case AlarmKind::limit:
        return limit() + since();
      case AlarmKind::data:
        return (e_.contradiction.fault == ScaleFault::none
                    ? "Samples are missing or not finite"
                    : "Samples contradict the configuration (" + scale_text(e_.contradiction) + ")") +
               since();
      case AlarmKind::stale:
        return title() + since() + (words_.refused ? ": what comes is refused, its page says why" : "");
      case AlarmKind::estimate: {
        if (e_.verdict == online::AxisVerdict::not_measured)
          return "Nothing could be learned although the drive is excited" + since();
        std::string why(name_of(e_.verdict));
        std::replace(why.begin(), why.end(), '-', ' ');
        return "Estimates are not valid although the drive is excited (" + why + ")" + since();
      }
      case AlarmKind::controller:
        return "Another controller runs than the one that was given" + since();
    }
    return {};
  }

  [[nodiscard]] std::string change() const {
    const auto& c = e_.change.change;
    if (!e_.change.changed) return name() + " changed";  // until the alarm clears
    const double before = e_.change.before, after = before + c.size;
    const std::string moved = name() + (c.size < 0.0 ? " fell by " : " rose by ");
    const double size = std::abs(c.size);
    if (!std::isfinite(before)) return moved + with_unit(with_error(size, c.size_std), unit());
    const ErrorDigits digits(before, c.size_std);
    const std::string from_to =
        with_unit(fmt::format("{} -> {}", digits.value(before), digits.value(after)), unit());
    if (!figure_.by_ratio || !(before > 0.0))
      return fmt::format("{}{} ({})", moved, with_unit(with_error(size, c.size_std), unit()), from_to);
    return fmt::format("{}{} % ({})", moved, with_error(100.0 * size / before, 100.0 * c.size_std / before),
                       from_to);
  }

  [[nodiscard]] std::string limit() const {
    const double value = e_.value.value;
    const bool below = value < e_.low;
    if (!below && !(value > e_.high))  // within the deadband, or not known
      return name() + " was outside of its limits and is not safely back";
    return fmt::format("{} is {}, {} its limit of {}", name(),
                       with_unit(with_error(value, e_.value.std), unit()), below ? "below" : "above",
                       with_unit(fmt::format("{:.5g}", below ? e_.low : e_.high), unit()));
  }

  [[nodiscard]] std::string over() const {
    switch (e_.alarm.kind) {
      case AlarmKind::change:
        return std::isfinite(e_.change.before)
                   ? fmt::format("{} is back at its baseline of {}", name(),
                                 with_unit(with_error(e_.change.before, e_.change.before_std), unit()))
                   : name() + " is no longer changed: a new baseline counts";
      case AlarmKind::limit:
        return fmt::format("{} is back within its limits: {}", name(),
                           with_unit(with_error(e_.value.value, e_.value.std), unit()));
      case AlarmKind::data:
        return "Samples are complete again, and contradict nothing";
      case AlarmKind::stale:
        return "Samples come again";
      case AlarmKind::estimate:
        return "Estimates are valid again";
      case AlarmKind::controller:
        return "The controller that was given runs again";
    }
    return {};
  }

  [[nodiscard]] std::string cause() const {
    const std::string text = cause_text(e_.cause);
    return text.empty() ? text : "; " + text;
  }

  [[nodiscard]] std::string suppressions() const {
    std::string list;
    for (const auto& [cause, word] : kSuppressionNames)
      if (e_.state.suppressed_by(cause)) list.append(list.empty() ? "" : ", ").append(word);
    return list;
  }

  const AlarmEvent& e_;
  const AlarmWords& words_;
  FigureWords figure_;
};

}  // namespace

std::string alarm_text(const AlarmEvent& event, const AlarmWords& words) {
  return AlarmSentence(event, words).text();
}

std::string cause_text(const LikelyCause& cause) {
  constexpr double kPossible = 0.1;
  const auto& [first, second] = std::pair(cause.ranked[0], cause.ranked[1]);
  if (!(first.weight > 0.0)) return {};
  if (first.cause == Cause::unknown) return "cause unknown";
  const std::string words(cause_words(first.cause));
  if (cause.sure()) return "likely cause: " + words;
  const bool two = second.weight >= kPossible && second.cause != Cause::unknown;
  return "possible cause: " + words + (two ? " or " + std::string(cause_words(second.cause)) : "");
}

}  // namespace resonid::monitoring
