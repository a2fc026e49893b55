// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <monitoring/axis_alarms.hpp>

namespace resonid::monitoring {
namespace {

constexpr AlarmId kData{AlarmKind::data, {}}, kStale{AlarmKind::stale, {}},
    kEstimate{AlarmKind::estimate, {}}, kController{AlarmKind::controller, {}};

constexpr double kSure = 3.0;  // standard deviations beyond a limit

/// Whether an alarm is judged from estimates.
bool estimated(AlarmId id) noexcept { return id != kData && id != kStale; }

Condition condition_of(const AxisAlarmRules& rules, const AlarmFacts& facts, AlarmId id) noexcept {
  const Row& row = facts.row;
  const bool usable = !facts.data_fault && !facts.stale;
  switch (id.kind) {
    case AlarmKind::data:
      return Condition::of(facts.data_fault);
    case AlarmKind::stale:
      return Condition::of(facts.stale);
    case AlarmKind::estimate:
      if (!usable || (facts.learning ? !facts.refused : !row.gates.excited)) return {};
      return Condition::of(facts.learning || !row.trusted);
    case AlarmKind::controller:
      return usable && facts.controller_known ? Condition::of(facts.controller_differs) : Condition{};
    case AlarmKind::change:
      return usable && row.gates.excited
                 ? Condition::of(facts.changes[static_cast<std::size_t>(id.figure)].changed)
                 : Condition{};
    case AlarmKind::limit: {
      const auto& [value, std] = row[id.figure];
      if (!usable || facts.learning || !row.trusted || !std::isfinite(value)) return {};
      const double over = std::max(rules.low(id.figure) - value, value - rules.high(id.figure));
      const bool unsure = over > 0.0 && over <= kSure * std;  // false where there is no std
      return unsure ? Condition{} : Condition{over};
    }
  }
  return {};
}

std::uint64_t sample_at(double time_s, double sample_rate_hz) noexcept {
  constexpr double kLast = 9e18;
  const double sample = std::round(time_s * sample_rate_hz);
  return sample > 0.0 ? static_cast<std::uint64_t>(std::min(sample, kLast)) : 0;
}

AlarmEvent event_of(const AxisAlarmRules& rules, const AlarmFacts& facts, AlarmId id,
                    const Transitions::Entry& entry) noexcept {
  AlarmEvent e;
  e.sample = facts.sample;
  e.alarm = id;
  e.transition = entry.transition;
  e.severity = rules.severity(id);
  e.state = entry.state;
  e.since_sample = entry.state.raised_sample;
  e.verdict = facts.learning ? online::AxisVerdict::not_measured : facts.row.verdict;
  if (id == kData) e.contradiction = facts.contradiction;
  if (!id.has_figure()) return e;
  e.change = facts.changes[static_cast<std::size_t>(id.figure)];
  if (facts.row.trusted) e.value = facts.row[id.figure];
  if (id.kind == AlarmKind::limit) {
    e.low = rules.low(id.figure);
    e.high = rules.high(id.figure);
    return e;
  }
  if (e.change.changed) e.since_sample = sample_at(e.change.change.time_s, rules.sample_rate_hz());
  if (entry.transition == Transition::raised || entry.transition == Transition::realarmed)
    e.cause = likely_cause(shifts_of(facts));
  return e;
}

void add(const AxisAlarmRules& rules, const AlarmFacts& facts, AlarmId id, const Transitions& transitions,
         std::vector<AlarmEvent>& events) {
  for (const auto& entry : transitions) events.push_back(event_of(rules, facts, id, entry));
}

}  // namespace

expected<AxisAlarmRules, Error> AxisAlarmRules::create(const AxisAlarmSettings& settings,
                                                       double sample_rate_hz) {
  if (!(sample_rate_hz > 0.0) || !std::isfinite(sample_rate_hz))
    return refuse("sample_rate_hz", "must be > 0", sample_rate_hz);
  if (const auto fine = check(settings); !fine) return unexpected<Error>(fine.error());
  AxisAlarmRules rules(sample_rate_hz);
  for (std::size_t i = 0; i < kWatched; ++i) {
    const auto figure = static_cast<Watched>(i);
    const FigureAlarmSettings& s = settings.figures[i];
    AlarmSettings change = s.alarm, limit = s.alarm;
    change.enabled = change.enabled && s.changes;
    limit.enabled = limit.enabled && (std::isfinite(s.low) || std::isfinite(s.high));
    rules.put({AlarmKind::change, figure}, change, 0.0);
    rules.put({AlarmKind::limit, figure}, limit, s.deadband);
    rules.low_[i] = s.low;
    rules.high_[i] = s.high;
  }
  rules.put(kData, settings.data, 0.0);
  AlarmSettings stale = settings.stale;
  stale.on_delay_s = stale.off_delay_s = stale.realarm_s = 0.0;
  rules.put(kStale, stale, 0.0);
  // How long silence lasted and how often it came cannot be told by counting samples.
  rules.rules_[kStale.index()].chattering = rules.rules_[kStale.index()].fleeting = 0;
  rules.put(kEstimate, settings.estimate, 0.0);
  rules.put(kController, settings.controller, 0.0);
  return rules;
}

void AxisAlarmRules::put(AlarmId id, const AlarmSettings& settings, double deadband) noexcept {
  rules_[id.index()] = rules_of(settings, deadband, sample_rate_hz_);
  severity_[id.index()] = settings.severity;
}

void AxisAlarms::step(const AxisAlarmRules& rules, const AlarmFacts& facts, std::vector<AlarmEvent>& events) {
  // What suppresses others comes first.
  for (const AlarmId id : {kData, kStale}) step_one(rules, facts, id, condition_of(rules, facts, id), events);
  for (std::size_t i = 0; i < kAlarms; ++i)
    if (const AlarmId id = AlarmId::of(i); estimated(id))
      step_one(rules, facts, id, condition_of(rules, facts, id), events);
}

void AxisAlarms::step_one(const AxisAlarmRules& rules, const AlarmFacts& facts, AlarmId id,
                          Condition condition, std::vector<AlarmEvent>& events) {
  // So that what is raised knows whether anybody is to look at it.
  suppress(rules, facts, id, events);
  Alarm& alarm = alarms_[id.index()];
  const bool before = alarm.state().active;
  add(rules, facts, id, alarm.step(rules[id], facts.sample, condition), events);
  if (before && id.kind == AlarmKind::change && facts.changes[static_cast<std::size_t>(id.figure)].grown)
    add(rules, facts, id, alarm.worsen(facts.sample), events);
}

void AxisAlarms::suppress(const AxisAlarmRules& rules, const AlarmFacts& facts, AlarmId id,
                          std::vector<AlarmEvent>& events) {
  struct Reason {
    Suppression cause;
    bool on;
  };
  const bool judged = estimated(id);
  const Reason reasons[] = {
      {Suppression::maintenance, facts.sample < maintenance_until_},
      {Suppression::learning, judged && facts.learning && !(id == kEstimate && facts.refused)},
      {Suppression::data, judged && (*this)[kData].active}};
  // Those that begin first: from one reason to another it stays suppressed.
  for (const bool on : {true, false})
    for (const Reason& r : reasons)
      if (r.on == on && (*this)[id].suppressed_by(r.cause) != on)
        add(rules, facts, id, alarms_[id.index()].suppress(facts.sample, r.cause, on), events);
}

expected<void, Error> AxisAlarms::act(const AxisAlarmRules& rules, const Action& action,
                                      std::vector<AlarmEvent>& events) {
  AlarmFacts facts;  // a person's action tells nothing of the machine
  facts.sample = action.sample;
  switch (action.kind) {
    case ActionKind::set_baseline:
    case ActionKind::relearn:
      return {};
    case ActionKind::maintenance:
      // At once: of a machine that is switched off no row comes.
      maintenance_until_ = action.until_sample;
      maintenance_until_ns_ = action.until_ns;
      for (std::size_t i = 0; i < kAlarms; ++i)
        add(rules, facts, AlarmId::of(i),
            alarms_[i].suppress(action.sample, Suppression::maintenance, action.sample < maintenance_until_),
            events);
      return {};
    default:
      break;
  }
  if (action.alarm.index() >= kAlarms) return refuse("alarm", "must be one of the axis");
  const auto done = alarms_[action.alarm.index()].act(rules[action.alarm], action);
  if (!done) return unexpected<Error>(done.error());
  add(rules, facts, action.alarm, *done, events);
  return {};
}

bool AxisAlarms::intact() const noexcept {
  return std::all_of(alarms_.begin(), alarms_.end(), [](const Alarm& a) { return a.intact(); });
}

std::array<FigureShift, kWatched> shifts_of(const AlarmFacts& facts) noexcept {
  std::array<FigureShift, kWatched> shifts{};
  // The load's torque goes up and down with the work: it tells of a cause where nothing else changed.
  const auto changed = std::count_if(facts.changes.begin(), facts.changes.end(),
                                     [](const FigureChange& c) { return c.changed; });
  for (std::size_t i = 0; i < kWatched; ++i) {
    const FigureChange& c = facts.changes[i];
    if (static_cast<Watched>(i) == Watched::load_torque && !(c.changed && changed == 1)) continue;
    shifts[i].before = {c.before, c.before_std};
    if (facts.row.trusted)
      shifts[i].after = facts.row.figures[i];
    else if (c.changed)
      shifts[i].after = {c.before + c.change.size, c.change.size_std};
  }
  return shifts;
}

}  // namespace resonid::monitoring
