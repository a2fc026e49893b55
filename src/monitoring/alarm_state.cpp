// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <monitoring/alarm_state.hpp>
#include <resonid/base/detail/intact.hpp>

namespace resonid::monitoring {
namespace {

constexpr double kChattering_s = 60.0, kFleeting_s = 10.0;
constexpr std::uint8_t kAllSuppressions = 15;
/// Longest time in samples: sums with it do not overflow.
constexpr double kLongest = 4.0e18;

std::uint64_t samples_of(double seconds, double sample_rate_hz) noexcept {
  return static_cast<std::uint64_t>(std::min(std::round(seconds * sample_rate_hz), kLongest));
}

std::uint64_t later_by(std::uint64_t sample, std::uint64_t by) noexcept {
  return sample > std::numeric_limits<std::uint64_t>::max() - by ? std::numeric_limits<std::uint64_t>::max()
                                                                 : sample + by;
}

}  // namespace

AlarmRules rules_of(const AlarmSettings& settings, double deadband, double sample_rate_hz) noexcept {
  AlarmRules rules;
  rules.enabled = settings.enabled;
  rules.latch = settings.latch;
  rules.deadband = deadband;
  rules.on_delay = samples_of(settings.on_delay_s, sample_rate_hz);
  rules.off_delay = samples_of(settings.off_delay_s, sample_rate_hz);
  // What was asked for must not round to never.
  rules.realarm = settings.realarm_s > 0.0
                      ? std::max<std::uint64_t>(1, samples_of(settings.realarm_s, sample_rate_hz))
                      : 0;
  rules.longest_shelving =
      std::max<std::uint64_t>(1, samples_of(settings.longest_shelving_s, sample_rate_hz));
  rules.chattering = samples_of(kChattering_s, sample_rate_hz);
  rules.fleeting = samples_of(kFleeting_s, sample_rate_hz);
  return rules;
}

Transitions Alarm::step(const AlarmRules& rules, std::uint64_t sample, Condition condition) noexcept {
  Transitions out;
  sample = sample_ = std::max(sample, sample_);
  if (!rules.enabled) {
    disable(out);
    return out;
  }
  if (state_.shelving != Shelving::none && sample >= state_.shelved_until)
    end_shelving(sample, Transition::shelving_expired, out);
  follow(rules, sample, condition, out);
  look_for_chattering(rules, sample);
  if (rules.realarm > 0 && state_.active && !state_.acknowledged && state_.annunciated() &&
      sample - told_ >= rules.realarm) {
    told_ = sample;
    out.add(Transition::realarmed, state_);
  }
  return out;
}

void Alarm::disable(Transitions& out) noexcept {
  const bool ends = state_.of_interest();
  const std::uint64_t now = sample_;
  const AlarmState before = state_;
  *this = Alarm{};
  sample_ = now;
  state_.suppressed = before.suppressed;
  state_.raised_sample = before.raised_sample;
  state_.cleared_sample = before.active ? now : before.cleared_sample;
  if (ends) out.add(Transition::reset, state_);
}

void Alarm::follow(const AlarmRules& rules, std::uint64_t sample, Condition condition,
                   Transitions& out) noexcept {
  const bool knew = known_, before = holds_;
  known_ = !std::isnan(condition.over);
  const std::uint64_t since_row = sample - row_;
  row_ = sample;
  if (!known_) return;
  if (condition.over > 0.0)
    holds_ = true;
  else if (condition.over <= -rules.deadband)
    holds_ = false;
  if (holds_ == state_.active) {
    pending_ = 0;
    return;
  }
  if (knew && holds_ == before) pending_ += since_row;
  if (holds_ && pending_ >= rules.on_delay)
    raise(rules, sample, out);
  else if (!holds_ && pending_ >= rules.off_delay)
    clear(rules, sample, out);
}

void Alarm::raise(const AlarmRules& rules, std::uint64_t sample, Transitions& out) noexcept {
  pending_ = 0;
  if (state_.of_interest()) {
    AlarmState former = state_;
    former.acknowledged = true;
    former.latched = false;
    former.shelving = Shelving::none;
    former.shelved_until = 0;
    former.shelved_until_ns = 0;
    out.add(Transition::superseded, former);
  }
  state_.active = true;
  state_.acknowledged = state_.latched = state_.fleeting = false;
  state_.raised_sample = told_ = sample;
  std::copy_backward(raises_.begin(), raises_.end() - 1, raises_.end());
  raises_[0] = sample;
  raised_ = static_cast<std::uint8_t>(std::min<std::size_t>(kRaises, raised_ + std::size_t{1}));
  look_for_chattering(rules, sample);
  out.add(Transition::raised, state_);
}

void Alarm::clear(const AlarmRules& rules, std::uint64_t sample, Transitions& out) noexcept {
  pending_ = 0;
  state_.active = false;
  state_.cleared_sample = sample;
  state_.fleeting = !state_.acknowledged && sample - state_.raised_sample < rules.fleeting;
  look_for_chattering(rules, sample);
  out.add(Transition::cleared, state_);
  if (rules.latch) {
    state_.latched = true;
    out.add(Transition::latched, state_);
  }
  if (state_.shelving == Shelving::one_shot) end_shelving(sample, Transition::shelving_expired, out);
}

void Alarm::look_for_chattering(const AlarmRules& rules, std::uint64_t sample) noexcept {
  state_.chattering = raised_ == kRaises && sample - raises_[kRaises - 1] <= rules.chattering;
}

void Alarm::end_shelving(std::uint64_t sample, Transition how, Transitions& out) noexcept {
  state_.shelving = Shelving::none;
  state_.shelved_until = 0;
  state_.shelved_until_ns = 0;
  told_ = sample;
  out.add(how, state_);
}

Transitions Alarm::worsen(std::uint64_t sample) noexcept {
  Transitions out;
  if (!state_.active || !state_.annunciated()) return out;
  state_.acknowledged = false;
  told_ = sample_ = std::max(sample, sample_);
  out.add(Transition::realarmed, state_);
  return out;
}

Transitions Alarm::suppress(std::uint64_t sample, Suppression cause, bool on) noexcept {
  Transitions out;
  sample_ = std::max(sample, sample_);
  const auto bit = static_cast<std::uint8_t>(cause);
  const bool before = state_.suppressed != 0;
  state_.suppressed = static_cast<std::uint8_t>(on ? state_.suppressed | bit : state_.suppressed & ~bit);
  const bool after = state_.suppressed != 0;
  if (before == after) return out;
  if (!after) told_ = sample_;
  if (state_.of_interest() || cause == Suppression::person)
    out.add(after ? Transition::suppressed : Transition::unsuppressed, state_);
  return out;
}

expected<Transitions, Error> Alarm::act(const AlarmRules& rules, const Action& action) noexcept {
  if (!rules.enabled) return refuse("alarm", "must be enabled");
  const std::uint64_t now = std::max(action.sample, sample_);
  Transitions out;
  switch (action.kind) {
    case ActionKind::acknowledge:
      if (state_.acknowledged) return refuse("acknowledge", "needs an alarm that is not acknowledged");
      state_.acknowledged = true;
      out.add(Transition::acknowledged, state_);
      break;
    case ActionKind::shelve:
    case ActionKind::shelve_once:
      return shelve(rules, action, now);
    case ActionKind::unshelve:
      if (state_.shelving == Shelving::none) return refuse("unshelve", "needs an alarm that is shelved");
      end_shelving(now, Transition::unshelved, out);
      break;
    case ActionKind::reset:
      if (!state_.latched) return refuse("reset", "needs a latched alarm that has cleared");
      if (!state_.acknowledged) return refuse("reset", "needs an alarm that is acknowledged");
      state_.latched = false;
      out.add(Transition::reset, state_);
      break;
    case ActionKind::suppress:
    case ActionKind::unsuppress: {
      const bool on = action.kind == ActionKind::suppress;
      if (state_.suppressed_by(Suppression::person) == on)
        return on ? refuse("suppress", "needs an alarm that no person suppressed")
                  : refuse("unsuppress", "needs an alarm that a person suppressed");
      out = suppress(now, Suppression::person, on);
      break;
    }
    case ActionKind::remind:
      if (!state_.active || state_.acknowledged || !state_.annunciated())
        return refuse("remind", "needs an alarm that people are to acknowledge");
      told_ = now;
      out.add(Transition::realarmed, state_);
      break;
    case ActionKind::maintenance:
    case ActionKind::set_baseline:
    case ActionKind::relearn:
    case ActionKind::stop:
    case ActionKind::resume:
    case ActionKind::gather:
      return refuse("action", "must be about an alarm");
  }
  sample_ = now;
  return out;
}

expected<Transitions, Error> Alarm::shelve(const AlarmRules& rules, const Action& action,
                                           std::uint64_t now) noexcept {
  const std::uint64_t latest = later_by(now, rules.longest_shelving);
  const bool timed = action.kind == ActionKind::shelve;
  if (timed && action.until_sample <= now) return refuse("until", "must lie ahead");
  if (timed && action.until_sample > latest)
    return refuse("until", "must not be later than the longest time for shelving allows");
  state_.shelving = timed ? Shelving::timed : Shelving::one_shot;
  state_.shelved_until = timed ? action.until_sample : latest;
  state_.shelved_until_ns = timed ? action.until_ns : 0;
  sample_ = now;
  Transitions out;
  out.add(Transition::shelved, state_);
  return out;
}

bool Alarm::intact() const noexcept {
  return intact_flags(state_.active, state_.acknowledged, state_.latched, state_.chattering, state_.fleeting,
                      holds_, known_) &&
         resonid::intact(state_.shelving, Shelving::timed) && state_.suppressed <= kAllSuppressions &&
         !(state_.active && state_.latched) && raised_ <= kRaises && row_ <= sample_ && told_ <= sample_ &&
         state_.raised_sample <= sample_ &&
         std::all_of(raises_.begin(), raises_.end(), [this](std::uint64_t at) { return at <= sample_; });
}

}  // namespace resonid::monitoring
