// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <monitoring/alarm_state.hpp>
#include <optional>
#include <vector>

namespace resonid::monitoring::test {

/// An alarm from its definition: it keeps all that ever happened and looks back over it, where the class
/// under test keeps counters.
class AlarmModel {
 public:
  struct Told {
    Transition transition{};
    AlarmState state;
  };
  explicit AlarmModel(const AlarmRules& rules) : rules_(rules) {}

  std::vector<Told> step(std::uint64_t sample, double over) {
    begin(sample);
    rows_.push_back({sample, over});
    if (state_.shelving != Shelving::none && sample >= state_.shelved_until) expire();
    if (const auto holds = condition_at(rows_.size() - 1); holds && *holds != state_.active) {
      const auto needed = *holds ? rules_.on_delay : rules_.off_delay;
      if (known_time_of(*holds) >= needed) *holds ? raise() : clear();
    }
    refresh();
    const bool waits = state_.active && !state_.acknowledged && state_.annunciated();
    if (waits && rules_.realarm > 0 && sample >= told_ + rules_.realarm) {
      told_ = sample;
      tell(Transition::realarmed);
    }
    return told_now_;
  }
  std::vector<Told> suppress(Suppression cause, bool on) {
    begin(now_);
    const bool before = state_.suppressed != 0;
    if (state_.suppressed_by(cause) != on) state_.suppressed ^= static_cast<std::uint8_t>(cause);
    const bool after = state_.suppressed != 0;
    if (before && !after) told_ = now_;
    if (before != after && (state_.of_interest() || cause == Suppression::person))
      tell(after ? Transition::suppressed : Transition::unsuppressed);
    return told_now_;
  }
  /// Nothing where it must be refused.
  std::optional<std::vector<Told>> act(ActionKind kind, std::uint64_t until) {
    begin(now_);
    const std::uint64_t latest = now_ + rules_.longest_shelving;
    switch (kind) {
      case ActionKind::acknowledge:
        if (state_.acknowledged) return {};
        state_.acknowledged = true;
        tell(Transition::acknowledged);
        return told_now_;
      case ActionKind::shelve:
        if (until <= now_ || until > latest) return {};
        state_.shelving = Shelving::timed;
        state_.shelved_until = until;
        tell(Transition::shelved);
        return told_now_;
      case ActionKind::shelve_once:
        state_.shelving = Shelving::one_shot;
        state_.shelved_until = latest;
        tell(Transition::shelved);
        return told_now_;
      case ActionKind::unshelve:
        if (state_.shelving == Shelving::none) return {};
        state_.shelving = Shelving::none;
        state_.shelved_until = 0;
        told_ = now_;
        tell(Transition::unshelved);
        return told_now_;
      case ActionKind::reset:
        if (!state_.latched || !state_.acknowledged) return {};
        state_.latched = false;
        tell(Transition::reset);
        return told_now_;
      case ActionKind::suppress:
      case ActionKind::unsuppress: {
        const bool on = kind == ActionKind::suppress;
        if (state_.suppressed_by(Suppression::person) == on) return {};
        return suppress(Suppression::person, on);
      }
      case ActionKind::remind:
        if (!state_.active || state_.acknowledged || !state_.annunciated()) return {};
        told_ = now_;
        tell(Transition::realarmed);
        return told_now_;
      case ActionKind::maintenance:
      case ActionKind::set_baseline:
      case ActionKind::relearn:
      case ActionKind::stop:
      case ActionKind::resume:
      case ActionKind::gather:
        break;
    }
    return {};
  }
  [[nodiscard]] const AlarmState& state() const { return state_; }
  [[nodiscard]] std::uint64_t now() const { return now_; }

 private:
  struct RowSeen {
    std::uint64_t sample = 0;
    double over = 0.0;
  };
  void begin(std::uint64_t sample) {
    now_ = sample;
    told_now_.clear();
  }
  void tell(Transition t) { told_now_.push_back({t, state_}); }

  /// The condition at a row: nothing where unknown; within the deadband what it was at the last row outside.
  [[nodiscard]] std::optional<bool> condition_at(std::size_t row) const {
    if (std::isnan(rows_[row].over)) return {};
    for (std::size_t i = row + 1; i-- > 0;) {
      if (rows_[i].over > 0.0) return true;
      if (rows_[i].over <= -rules_.deadband) return false;
    }
    return false;
  }
  /// Sum of the intervals between neighbouring rows that both say so, back to a row that says otherwise.
  [[nodiscard]] std::uint64_t known_time_of(bool holds) const {
    std::uint64_t sum = 0;
    for (std::size_t i = rows_.size() - 1; i > 0; --i) {
      const auto here = condition_at(i), before = condition_at(i - 1);
      if (before && *before != holds) break;
      if (here && before) sum += rows_[i].sample - rows_[i - 1].sample;
    }
    return sum;
  }
  void raise() {
    raises_.push_back(now_);
    if (!state_.acknowledged || state_.latched || state_.shelving != Shelving::none) {
      const AlarmState before = state_;
      state_.acknowledged = true;
      state_.latched = false;
      state_.shelving = Shelving::none;
      state_.shelved_until = 0;
      tell(Transition::superseded);
      state_ = before;
    }
    state_.active = true;
    state_.acknowledged = state_.latched = state_.fleeting = false;
    state_.raised_sample = told_ = now_;
    refresh();
    tell(Transition::raised);
  }
  void clear() {
    state_.active = false;
    state_.fleeting = !state_.acknowledged && now_ < state_.raised_sample + rules_.fleeting;
    state_.cleared_sample = now_;
    refresh();
    tell(Transition::cleared);
    if (rules_.latch) {
      state_.latched = true;
      tell(Transition::latched);
    }
    if (state_.shelving == Shelving::one_shot) expire();
  }
  void expire() {
    state_.shelving = Shelving::none;
    state_.shelved_until = 0;
    told_ = now_;
    tell(Transition::shelving_expired);
  }
  void refresh() {
    int recent = 0;
    for (const auto raise : raises_) recent += raise + rules_.chattering >= now_ ? 1 : 0;
    state_.chattering = recent >= 3;
  }

  AlarmRules rules_;
  std::vector<RowSeen> rows_;
  std::vector<std::uint64_t> raises_;
  AlarmState state_;
  std::uint64_t now_ = 0, told_ = 0;
  std::vector<Told> told_now_;
};

}  // namespace resonid::monitoring::test
