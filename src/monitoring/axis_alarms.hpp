// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <monitoring/action.hpp>
#include <monitoring/alarm_settings.hpp>
#include <monitoring/alarm_state.hpp>
#include <monitoring/cause.hpp>
#include <monitoring/row.hpp>
#include <monitoring/scale_check.hpp>
#include <resonid/base/expected.hpp>
#include <resonid/online/axis_result.hpp>
#include <vector>

namespace resonid::monitoring {

/// What a figure's detector of changes says.
struct FigureChange {
  bool changed = false;
  online::Change change{};  ///< Where changed; times in seconds since sample 0.
  /// Level of the baseline, changed or not; not a number before it is learned.
  double before = std::numeric_limits<double>::quiet_NaN();
  double before_std = std::numeric_limits<double>::quiet_NaN();
  bool grown = false;  ///< With this row it is more than twice what was told of it.
};

/// What is known of an axis at one sample: what its alarms are stepped with, at each row and, when no samples
/// come, now and then.
struct AlarmFacts {
  std::uint64_t sample = 0;
  Row row{};  ///< As it begins (`not_measured`): none.
  std::array<FigureChange, kWatched> changes{};
  bool learning = false;            ///< No estimates, or no baseline yet.
  bool refused = false;             ///< Then: the drive is excited, and what it does could not be learned.
  bool data_fault = false;          ///< Samples are missing, faulty, or contradict what was told.
  ScaleFinding contradiction{};     ///< Then: what they contradict.
  bool stale = false;               ///< No samples come.
  bool controller_known = false;    ///< Whether the controller could be compared.
  bool controller_differs = false;  ///< Then: whether another one runs.
};

/// AxisAlarmSettings as alarms are stepped with them.
class AxisAlarmRules {
 public:
  /// Refuses what check() does, and a sample rate that is not > 0.
  static expected<AxisAlarmRules, Error> create(const AxisAlarmSettings& settings, double sample_rate_hz);

  [[nodiscard]] const AlarmRules& operator[](AlarmId id) const noexcept { return rules_[id.index()]; }
  [[nodiscard]] Severity severity(AlarmId id) const noexcept { return severity_[id.index()]; }
  [[nodiscard]] double low(Watched w) const noexcept { return low_[static_cast<std::size_t>(w)]; }
  [[nodiscard]] double high(Watched w) const noexcept { return high_[static_cast<std::size_t>(w)]; }
  [[nodiscard]] double sample_rate_hz() const noexcept { return sample_rate_hz_; }

 private:
  explicit AxisAlarmRules(double sample_rate_hz) noexcept : sample_rate_hz_(sample_rate_hz) {}
  void put(AlarmId id, const AlarmSettings& settings, double deadband) noexcept;

  std::array<AlarmRules, kAlarms> rules_{};
  std::array<Severity, kAlarms> severity_{};
  std::array<double, kWatched> low_{}, high_{};
  double sample_rate_hz_;
};

/// A transition of an alarm, with what was known of it then. Its key is {axis, sample, alarm, transition}.
struct AlarmEvent {
  std::uint64_t sample = 0;
  AlarmId alarm{};
  Transition transition{};
  Severity severity{};
  AlarmState state{};              ///< After it.
  std::uint64_t since_sample = 0;  ///< When what it tells began: of a change, as far as it shows.
  FigureChange change{};           ///< Of a figure's alarm.
  online::Figure value{};          ///< Of a figure's alarm: the newest trusted estimate at that row.
  double low = 0.0, high = 0.0;    ///< Of a limit's alarm.
  online::AxisVerdict verdict{};   ///< Of the row.
  ScaleFinding contradiction{};    ///< Of the alarm `data`: what the samples contradict.
  LikelyCause cause{};             ///< Where a change is raised or told again; else without weights.
};

/// The alarms of one axis. Its bytes are its snapshot; the same facts and actions give the same events.
///
/// - A figure's alarms follow rows that are excited (changes) or trusted (limits); others leave them as they
///   are, so do bad data.
/// - While learning, and while the alarm `data` is active, alarms that are judged from estimates are
///   suppressed; under maintenance all of the axis are.
/// - A change ends when its detector takes a new baseline, or the figure is back at the one it had; one that
///   has grown is told again, as not acknowledged.
/// - The alarm `stale` has no samples to count: its delays, and being told again, are for whoever has a clock
///   and tells that samples stop, come again, and that it is still so (ActionKind).
class AxisAlarms {
 public:
  /// Adds to `events`.
  void step(const AxisAlarmRules& rules, const AlarmFacts& facts, std::vector<AlarmEvent>& events);

  /// What a person does. Refused with what it needs, then nothing has changed. set_baseline and relearn are
  /// for the detectors and change nothing here.
  [[nodiscard]] expected<void, Error> act(const AxisAlarmRules& rules, const Action& action,
                                          std::vector<AlarmEvent>& events);

  [[nodiscard]] const AlarmState& operator[](AlarmId id) const noexcept {
    return alarms_[id.index()].state();
  }
  /// End of the maintenance, 0: none was told.
  [[nodiscard]] std::uint64_t maintenance_until() const noexcept { return maintenance_until_; }
  /// The same as UNIX time, ns, where it was told; 0: it is over.
  [[nodiscard]] std::int64_t maintenance_until_ns() const noexcept { return maintenance_until_ns_; }

  /// For a state of unknown origin (base/detail/intact.hpp).
  [[nodiscard]] bool intact() const noexcept;

 private:
  void step_one(const AxisAlarmRules& rules, const AlarmFacts& facts, AlarmId id, Condition condition,
                std::vector<AlarmEvent>& events);
  void suppress(const AxisAlarmRules& rules, const AlarmFacts& facts, AlarmId id,
                std::vector<AlarmEvent>& events);

  std::array<Alarm, kAlarms> alarms_{};
  std::uint64_t maintenance_until_ = 0;
  std::int64_t maintenance_until_ns_ = 0;
};

/// Figures in the baseline and now, as likely_cause() takes them: by the row, all at the same instant; where
/// it is not trusted by what changed, the others unknown.
[[nodiscard]] std::array<FigureShift, kWatched> shifts_of(const AlarmFacts& facts) noexcept;

}  // namespace resonid::monitoring
