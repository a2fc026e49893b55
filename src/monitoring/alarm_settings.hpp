// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <monitoring/alarm_id.hpp>
#include <resonid/base/enum_names.hpp>
#include <resonid/base/expected.hpp>
#include <span>

namespace resonid::monitoring {

/// How soon people should act.
enum class Severity : std::uint8_t { low, medium, high };
inline constexpr EnumName<Severity> kSeverityNames[] = {
    {Severity::low, "low"}, {Severity::medium, "medium"}, {Severity::high, "high"}};
[[nodiscard]] constexpr std::span<const EnumName<Severity>> enum_names(Severity) noexcept {
  return kSeverityNames;
}

/// How one alarm behaves.
struct AlarmSettings {
  bool enabled = true;
  Severity severity = Severity::medium;
  double on_delay_s = 0.0;
  double off_delay_s = 10.0;
  double realarm_s = 0.0;
  bool latch = false;
  double longest_shelving_s = 604800.0;
  bool operator==(const AlarmSettings&) const = default;
};
template <class Visitor>
void describe(Visitor&& v, AlarmSettings& c) {
  v("enabled", c.enabled, "whether there is this alarm");
  v("severity", c.severity, "how soon people should act");
  v("on_delay_s", c.on_delay_s, "how long the condition must last before the alarm is raised, >= 0 (s)");
  v("off_delay_s", c.off_delay_s,
    "how long the condition must be gone before the alarm is cleared, >= 0 (s)");
  v("realarm_s", c.realarm_s,
    "time after which an alarm that is active and not acknowledged is told again; 0: never (s)");
  v("latch", c.latch, "whether an alarm that has cleared stays until a person resets it");
  v("longest_shelving_s", c.longest_shelving_s, "longest time for which it can be shelved, > 0 (s)");
}

/// Alarms of one watched figure: its change, and its absolute limits.
struct FigureAlarmSettings {
  AlarmSettings alarm;
  bool changes = true;
  double least_change = 0.0;
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  double deadband = 0.0;
  bool operator==(const FigureAlarmSettings&) const = default;
};
template <class Visitor>
void describe(Visitor&& v, FigureAlarmSettings& c) {
  describe(v, c.alarm);
  v("changes", c.changes, "whether a change against the baseline is an alarm");
  v("least_change", c.least_change,
    "how large a change must be to be an alarm, however sure it is, >= 0, in the figure's unit");
  v("low", c.low, "least value that is no alarm, in the figure's unit; -inf: none");
  v("high", c.high, "greatest value that is no alarm, in the figure's unit; inf: none");
  v("deadband", c.deadband,
    "by how much the figure must be back inside its limits before that alarm clears, >= 0 and below half of "
    "their distance, in its unit");
}

/// Alarms of an axis. Margins hang on the friction, which is known slowly: what they wander by in hours is
/// no change that anybody could use.
struct AxisAlarmSettings {
  AxisAlarmSettings() noexcept {
    (*this)[Watched::phase_margin].least_change = 1.0;
    (*this)[Watched::modulus_margin].least_change = 0.01;
    (*this)[Watched::gap].least_change = 0.01;
  }

  std::array<FigureAlarmSettings, kWatched> figures{};
  AlarmSettings data{};
  AlarmSettings stale{true, Severity::high};
  AlarmSettings estimate{true, Severity::low, 60.0};
  AlarmSettings controller{true, Severity::medium, 10.0};

  [[nodiscard]] const FigureAlarmSettings& operator[](Watched w) const noexcept {
    return figures[static_cast<std::size_t>(w)];
  }
  [[nodiscard]] FigureAlarmSettings& operator[](Watched w) noexcept {
    return figures[static_cast<std::size_t>(w)];
  }
};
template <class Visitor>
void describe(Visitor&& v, AxisAlarmSettings& c) {
  v("resonance", c[Watched::resonance], "resonance (Hz)");
  v("antiresonance", c[Watched::antiresonance], "anti-resonance (Hz)");
  v("stiffness", c[Watched::stiffness], "stiffness at the driven shaft (Nm/rad)");
  v("driven_inertia", c[Watched::driven_inertia], "inertia of motor and what turns with it (kgm2)");
  v("load_inertia", c[Watched::load_inertia], "inertia of the load (kgm2)");
  v("damping", c[Watched::damping], "damping (Nms/rad)");
  v("coulomb_friction", c[Watched::coulomb_friction], "dry friction (Nm)");
  v("load_torque", c[Watched::load_torque], "constant torque of the load (Nm)");
  v("modulus_margin", c[Watched::modulus_margin], "least distance of the loop to -1");
  v("phase_margin", c[Watched::phase_margin], "phase margin (degrees)");
  v("gap", c[Watched::gap], "largest chordal distance of the response to the baseline, 0 ... 1");
  v("data", c.data, "samples are missing, faulty, or contradict what was told");
  v("stale", c.stale, "no samples come");
  v("estimate", c.estimate, "nothing is trusted for too long although the drive is excited");
  v("controller", c.controller, "another controller runs than the one that was given");
}

[[nodiscard]] expected<void, Error> check(const AlarmSettings& settings) noexcept;
[[nodiscard]] expected<void, Error> check(const FigureAlarmSettings& settings) noexcept;
/// Fields as "stiffness.low".
[[nodiscard]] expected<void, Error> check(const AxisAlarmSettings& settings);

}  // namespace resonid::monitoring
