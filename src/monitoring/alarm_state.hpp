// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <monitoring/action.hpp>
#include <monitoring/alarm_settings.hpp>
#include <resonid/base/enum_names.hpp>
#include <resonid/base/expected.hpp>
#include <span>

namespace resonid::monitoring {

/// What a row says of an alarm's condition: by how much the limit is exceeded, in the figure's unit; 0 and
/// below: it is not. Not a number: unknown, then the alarm stays as it is and time does not count.
struct Condition {
  double over = std::numeric_limits<double>::quiet_NaN();

  /// For what has no amount.
  [[nodiscard]] static constexpr Condition of(bool holds) noexcept {
    constexpr double kFar = std::numeric_limits<double>::infinity();
    return {holds ? kFar : -kFar};
  }
};

/// AlarmSettings in samples, as an alarm is stepped with them. They are no part of its state: after a new
/// configuration a snapshot goes on.
struct AlarmRules {
  bool enabled = true;
  bool latch = false;
  double deadband = 0.0;
  std::uint64_t on_delay = 0, off_delay = 0;
  std::uint64_t realarm = 0;  ///< 0: never.
  std::uint64_t longest_shelving = 1;
  std::uint64_t chattering = 0;  ///< Three raises within so many samples are chattering: a minute.
  std::uint64_t fleeting = 0;    ///< Cleared within so many samples, and by nobody: 10 s.
};
/// `settings` must have passed check(), `sample_rate_hz` be > 0.
[[nodiscard]] AlarmRules rules_of(const AlarmSettings& settings, double deadband,
                                  double sample_rate_hz) noexcept;

enum class Shelving : std::uint8_t {
  none,
  one_shot,  ///< Until the alarm has cleared, or the longest time is over.
  timed,
};
inline constexpr EnumName<Shelving> kShelvingNames[] = {
    {Shelving::none, "none"}, {Shelving::one_shot, "one-shot"}, {Shelving::timed, "timed"}};
[[nodiscard]] constexpr std::span<const EnumName<Shelving>> enum_names(Shelving) noexcept {
  return kShelvingNames;
}

/// Why an alarm is suppressed: bits, as there may be several reasons at once.
enum class Suppression : std::uint8_t { learning = 1, maintenance = 2, data = 4, person = 8 };
inline constexpr EnumName<Suppression> kSuppressionNames[] = {{Suppression::learning, "learning"},
                                                              {Suppression::maintenance, "maintenance"},
                                                              {Suppression::data, "data"},
                                                              {Suppression::person, "person"}};
[[nodiscard]] constexpr std::span<const EnumName<Suppression>> enum_names(Suppression) noexcept {
  return kSuppressionNames;
}

/// Where an alarm stands (OPC UA Part 9, ISA-18.2).
struct AlarmState {
  bool active = false;
  bool acknowledged = true;
  bool latched = false;     ///< Cleared, but to be reset by a person. Never while active.
  bool chattering = false;  ///< Raised three times within a minute.
  bool fleeting = false;    ///< When it last cleared it was within 10 s, before anybody acknowledged it.
  Shelving shelving = Shelving::none;
  std::uint8_t suppressed = 0;  ///< Bits of Suppression.
  std::uint64_t raised_sample = 0, cleared_sample = 0;
  std::uint64_t shelved_until = 0;    ///< While shelved: the sample at which that ends.
  std::int64_t shelved_until_ns = 0;  ///< Likewise, where it was told: UNIX time.

  [[nodiscard]] bool suppressed_by(Suppression cause) const noexcept {
    return (suppressed & static_cast<std::uint8_t>(cause)) != 0;
  }
  /// Whether there is anything to know of it.
  [[nodiscard]] bool of_interest() const noexcept {
    return active || !acknowledged || latched || shelving != Shelving::none;
  }
  /// Whether people are to look at it now.
  [[nodiscard]] bool annunciated() const noexcept {
    return (active || !acknowledged || latched) && shelving == Shelving::none && suppressed == 0;
  }
  bool operator==(const AlarmState&) const = default;
};

enum class Transition : std::uint8_t {
  raised,
  cleared,
  latched,  ///< Right after `cleared`.
  acknowledged,
  reset,  ///< By a person, or as the alarm is no longer enabled.
  realarmed,
  shelved,
  unshelved,
  shelving_expired,  ///< By its time, or as the alarm cleared (one-shot).
  suppressed,
  unsuppressed,
  superseded,  ///< Right before `raised`, where the former raising was not done with: it is then.
};
inline constexpr EnumName<Transition> kTransitionNames[] = {
    {Transition::raised, "raised"},
    {Transition::cleared, "cleared"},
    {Transition::latched, "latched"},
    {Transition::acknowledged, "acknowledged"},
    {Transition::reset, "reset"},
    {Transition::realarmed, "realarmed"},
    {Transition::shelved, "shelved"},
    {Transition::unshelved, "unshelved"},
    {Transition::shelving_expired, "shelving-expired"},
    {Transition::suppressed, "suppressed"},
    {Transition::unsuppressed, "unsuppressed"},
    {Transition::superseded, "superseded"}};
[[nodiscard]] constexpr std::span<const EnumName<Transition>> enum_names(Transition) noexcept {
  return kTransitionNames;
}

/// The transitions of one step in their order, each with the state after it.
class Transitions {
 public:
  struct Entry {
    Transition transition{};
    AlarmState state;
  };
  static constexpr std::size_t kMost = 4;

  void add(Transition transition, const AlarmState& state) noexcept {
    if (count_ < kMost) entries_[count_++] = {transition, state};
  }
  [[nodiscard]] const Entry* begin() const noexcept { return entries_.data(); }
  [[nodiscard]] const Entry* end() const noexcept { return entries_.data() + count_; }

 private:
  std::array<Entry, kMost> entries_{};
  std::size_t count_ = 0;
};

/// One alarm as a state machine after OPC UA Part 9 and ISA-18.2. Time is a count of samples; what comes
/// with an earlier one than before counts as now. Its bytes are its snapshot.
///
/// Shelved and suppressed alarms are raised and cleared like others: only that people are to look at them
/// ends (AlarmState::annunciated). A delay counts what lies between two rows that both know the condition.
class Alarm {
 public:
  /// What a row says; shelving that is over ends first.
  [[nodiscard]] Transitions step(const AlarmRules& rules, std::uint64_t sample, Condition condition) noexcept;

  /// What it was raised for has become worse: it is to be acknowledged anew, where people look at it.
  [[nodiscard]] Transitions worsen(std::uint64_t sample) noexcept;

  /// Sets one reason of suppression. Told for the first reason and the end of the last, and, unless a person
  /// did it, only of an alarm that there is anything to know of.
  [[nodiscard]] Transitions suppress(std::uint64_t sample, Suppression cause, bool on) noexcept;

  /// What a person does; refused with what it needs, then nothing has changed. Kinds that are about the axis
  /// are refused.
  [[nodiscard]] expected<Transitions, Error> act(const AlarmRules& rules, const Action& action) noexcept;

  [[nodiscard]] const AlarmState& state() const noexcept { return state_; }

  /// For a state of unknown origin (base/detail/intact.hpp).
  [[nodiscard]] bool intact() const noexcept;

 private:
  static constexpr std::size_t kRaises = 3;  // make chattering
  void disable(Transitions& out) noexcept;
  void follow(const AlarmRules& rules, std::uint64_t sample, Condition condition, Transitions& out) noexcept;
  void raise(const AlarmRules& rules, std::uint64_t sample, Transitions& out) noexcept;
  void clear(const AlarmRules& rules, std::uint64_t sample, Transitions& out) noexcept;
  void look_for_chattering(const AlarmRules& rules, std::uint64_t sample) noexcept;
  void end_shelving(std::uint64_t sample, Transition how, Transitions& out) noexcept;
  [[nodiscard]] expected<Transitions, Error> shelve(const AlarmRules& rules, const Action& action,
                                                    std::uint64_t now) noexcept;

  AlarmState state_;
  bool holds_ = false;                           // the condition, behind the deadband, when it was last known
  bool known_ = false;                           // whether the row before knew it
  std::uint64_t sample_ = 0;                     // of the newest step or action
  std::uint64_t row_ = 0;                        // of the newest step
  std::uint64_t pending_ = 0;                    // known time for which holds_ differs from active
  std::uint64_t told_ = 0;                       // when the alarm was last announced
  std::array<std::uint64_t, kRaises> raises_{};  // newest first
  std::uint8_t raised_ = 0;                      // those of them that there were
};

}  // namespace resonid::monitoring
