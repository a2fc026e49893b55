// SPDX-License-Identifier: MIT
#include "monitor/service/recorder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>
#include <nlohmann/json.hpp>
#include <resonid/base/error_text.hpp>
#include <resonid/io/detail/atomic_file.hpp>
#include <set>
#include <string_view>

#include "monitor/service/baseline_curve.hpp"
#include "monitor/service/log.hpp"
#include "monitor/service/raw_csv.hpp"

namespace resonid::monitor {
namespace {

constexpr auto kCommitEvery = std::chrono::milliseconds(200);
constexpr double kBefore_s = 30.0, kAfter_s = 5.0;  // of an alarm: its evidence
constexpr std::int64_t kSecond_ns = 1'000'000'000;
constexpr std::int64_t kEvidencePatience_ns = 60 * kSecond_ns;  // with a full disk
constexpr std::size_t kMostReplayed = 100'000;                  // events
constexpr std::int64_t kCopyFor_ns = 100'000'000;
constexpr std::int64_t kRemoveEvidenceEvery_ns = 10 * kSecond_ns;
constexpr auto kLongestPause = std::chrono::seconds(5);
constexpr auto kUpkeepIsWell = std::chrono::seconds(15);  // retention has its turn each ten

/// A former process queued these, or has sent them.
void leave_out(std::vector<OutboxRecord>& messages, const std::vector<std::string>& known) {
  std::erase_if(messages, [&](const OutboxRecord& message) {
    return std::find(known.begin(), known.end(), message.key) != known.end();
  });
}

std::vector<AlarmRecord> newest_of_each(const std::vector<AlarmRecord>& records) {
  std::vector<AlarmRecord> newest;
  std::set<std::string_view> seen;
  for (auto record = records.rbegin(); record != records.rend(); ++record)
    if (seen.insert(record->id).second) newest.push_back(*record);
  return newest;
}

}  // namespace

Recorder::Recorder(Store store, Reader reader, Engine& engine, std::vector<Axis> axes,
                   const Installation& installation, const std::vector<AlarmRecord>& known,
                   std::unique_ptr<Deliveries> deliveries, std::function<void(const AlarmRecord&)> told)
    : store_(std::move(store)),
      reader_(std::move(reader)),
      engine_(engine),
      axes_(std::move(axes)),
      installation_(installation),
      known_(known),
      deliveries_(std::move(deliveries)),
      told_(std::move(told)) {
  for (const auto& axis : axes_) baselines_.push_back(stored_baselines(axis));
  for (const auto& record : known_)
    if (record.axis.empty() && record.alarm == DiskAlarm::kName)
      disk_alarm_.know(record);
    else
      alarms_.know(record);
}
Recorder::~Recorder() { stop(); }

void Recorder::start() {
  // What is known of an axis stays until more is: hours of a former process are still to be made of its rows.
  std::map<std::string, double> memory_s;
  if (const auto stored = reader_.axes())
    for (const auto& one : *stored) memory_s[one.axis] = one.memory_s;
  for (const auto& axis : axes_) {
    const std::string& name = axis.installed->spec.name;
    first_.axes.push_back({name, memory_s[name]});
    first_.configurations.push_back({axis.installed->configuration, now_ns()});
  }
  tidy_evidence(folder_of_evidence(), reader_, first_);
  close_orphans();
  expect_replays();
  find_evidence();
  deliveries_->start();
  thread_ = std::thread([this] { run(); });
}

void Recorder::stop() {
  if (!thread_.joinable()) return;
  stopping_.store(true);
  thread_.join();
}

void Recorder::run() {
  while (!stopping_.load()) {
    const auto due = std::chrono::steady_clock::now() + kCommitEvery;
    write(false);
    upkeep(due);
    std::this_thread::sleep_until(due);
  }
  deliveries_->stop();  // what became of its messages is still written
  write(true);
}

void Recorder::upkeep(std::chrono::steady_clock::time_point due) {
  auto done = store_.upkeep(now_ns());
  while (done && done->more && std::chrono::steady_clock::now() < due) done = store_.upkeep(now_ns());
  note_upkeep(done ? nullptr : &done.error());
  if (!upkeep_fault_.empty()) {
    const std::scoped_lock lock(status_mutex_);
    status_.over_limit = "Statistics and retention have stopped: " + upkeep_fault_;
    return;
  }
  if (!done) return;
  const std::scoped_lock lock(status_mutex_);
  status_.over_limit.clear();
  if (done->over_limit)
    status_.over_limit = fmt::format(
        "Database and evidence exceed the limit of {} bytes ([retention] size_bytes), and nothing is left "
        "that may be removed",
        installation_.retention.bytes);
}

/// A full disk and other programs show in commits, and pass.
void Recorder::note_upkeep(const StoreError* fault) {
  const auto now = std::chrono::steady_clock::now();
  if (fault != nullptr && fault->fault != StoreFault::full && fault->fault != StoreFault::locked) {
    upkeep_failed_ = now;
    if (upkeep_fault_ == fault->text) return;
    upkeep_fault_ = fault->text;
    say(LogLevel::error, "statistics and retention have stopped: {}", upkeep_fault_);
  } else if (!upkeep_fault_.empty() && now - upkeep_failed_ > kUpkeepIsWell) {
    upkeep_fault_.clear();
    say(LogLevel::info, "statistics and retention go on");
  }
}

void Recorder::write(bool last) {
  Batch batch = std::exchange(first_, {});
  const Status before = status_;  // which no other thread changes
  auto all = engine_.take();
  gather(batch, all);
  const std::int64_t now = now_ns();
  copy_evidence(batch, now, last);
  if (now - evidence_removed_ns_ > kRemoveEvidenceEvery_ns || now < evidence_removed_ns_) {
    evidence_removed_ns_ = now;
    remove_evidence(folder_of_evidence(), reader_, batch);
    count_evidence(folder_of_evidence(), evidence_sizes_, batch);
  }
  disk_alarm_.look(before.fault.empty() ? before.fault : "Rows and alarms cannot be written: " + before.fault,
                   before.over_limit, now, batch);
  for (std::size_t i = 0; i < batch.alarms.size(); ++i) {  // an event each
    AlarmRecord& alarm = batch.alarms[i];
    alarm.evidence = !alarm.axis.empty() && !lacks_evidence(alarm.id);
    const EventRecord& event = batch.events[i];
    deliveries_->queue(alarm, event, now, batch);
    say(event.transition == "raised" ? LogLevel::warning : LogLevel::info, "alarm {} of {} {}: {}",
        alarm.alarm, alarm.axis.empty() ? "the installation" : alarm.axis, event.transition, event.text);
  }
  batch.deliveries = deliveries_->take();
  const std::vector<AlarmRecord> fresh = batch.alarms;
  std::vector<OutboxRecord> messages = batch.outbox;
  backlog_.add(std::move(batch));
  Status status;
  status.over_limit = before.over_limit;
  const bool committed = commit(status, messages, last);
  if (status.fault != before.fault) {
    if (status.fault.empty())
      say(LogLevel::info, "rows and alarms are written again");
    else
      say(LogLevel::error, "rows and alarms cannot be written: {}", status.fault);
  }
  engine_.keep_going(!status.fault.empty());
  status.bytes = store_.file_bytes();
  const auto& left = backlog_.batch();
  status.pending = left.rows.size() + left.events.size() + left.actions.size();
  if (!committed) status.unwritten = newest_of_each(left.alarms);
  {
    const std::scoped_lock lock(status_mutex_);
    status_ = status;
  }
  // People hear of an alarm even where it cannot be written.
  for (const auto& record : fresh) told_(record);
  deliveries_->send(std::move(messages));
}

/// Whether nothing is left to be written; then without the messages that are known.
bool Recorder::commit(Status& status, std::vector<OutboxRecord>& messages, bool last) {
  status.fault = store_.lost();
  if (!status.fault.empty()) return backlog_.empty();
  if (backlog_.empty()) return true;
  const auto begin = std::chrono::steady_clock::now();
  if (begin < commit_again_ && !last) {
    status.fault = status_.fault;
    status.disk_full = status_.disk_full;
    return false;
  }
  const auto done = store_.commit(backlog_.batch());
  if (!done) {
    // What waits since hours takes long to fail, too.
    const auto now = std::chrono::steady_clock::now();
    commit_again_ = now + std::min<std::chrono::steady_clock::duration>(2 * (now - begin), kLongestPause);
    status.fault = done.error().text;
    status.disk_full = done.error().fault == StoreFault::full;
    if (done.error().fault != StoreFault::invalid) return false;
  } else {
    leave_out(messages, done->known_messages);
  }
  backlog_.clear();
  for (const auto& [axis, position] : snapshots_) engine_.stored(axis, position);
  snapshots_.clear();
  return true;
}

void Recorder::gather(Batch& batch, std::vector<Results>& all) {
  for (auto& r : all) {
    const Axis& axis = axes_[r.axis];
    const auto& spec = axis.installed->spec;
    for (auto& row : r.rows) batch.rows.push_back({spec.name, row.time_ns, row.row});
    for (const auto& event : r.events) {
      const bool is_new = alarms_.add(spec.name, spec.sample_rate_hz, event, batch);
      if (event.event.transition != monitoring::Transition::raised) continue;
      auto id = std::to_string(alarm_number(spec.name, event.event.alarm, event.event.state.raised_sample));
      if (is_new || lacks_evidence(id))
        evidence_.push_back(evidence_around(std::move(id), r.axis, event.event.sample));
    }
    for (const auto& told : r.actions) {
      const nlohmann::json arguments{{"id", told.action.id},
                                     {"alarm", told.action.alarm.index()},
                                     {"until_sample", told.action.until_sample},
                                     {"until_ns", told.action.until_ns}};
      // With the time, since an axis without its snapshots counts its actions from 1 on again.
      batch.actions.push_back({fmt::format("{}:{}:{}", spec.name, told.time_ns, told.action.id), spec.name,
                               told.action.sample, told.time_ns, std::string(name_of(told.action.kind)),
                               told.who, told.reason, arguments.dump()});
      if (told.action.kind == monitoring::ActionKind::set_baseline) set_baseline(r.axis, told, batch);
      if (told.action.kind == monitoring::ActionKind::relearn) {
        const std::scoped_lock lock(status_mutex_);
        baselines_[r.axis] = {told.time_ns, nullptr};
      }
    }
    if (r.snapshot) {
      batch.snapshots.push_back({spec.name, r.snapshot->sample, r.snapshot->position, installation_.version,
                                 axis.configuration_hash, std::move(r.snapshot->bytes)});
      snapshots_[r.axis] = r.snapshot->position;
      const auto progress = axis.intake->progress();
      batch.positions.push_back(
          {spec.name, progress.next_sample, progress.sender_offset, progress.position.word});
    }
    if (const auto live = engine_.live(r.axis); live && live->memory_s > 0.0 && r.snapshot)
      batch.axes.push_back({spec.name, live->memory_s});
  }
}

/// An axis that begins anew forgets its baseline for good, too: that is kept as an action of the service.
Recorder::Baselines Recorder::stored_baselines(const Axis& axis) {
  const std::string& name = axis.installed->spec.name;
  const std::string relearn(name_of(monitoring::ActionKind::relearn));
  Baselines baselines;
  if (const auto relearned = reader_.newest_action_ns(name, relearn); relearned && *relearned)
    baselines.forgotten_ns = **relearned;
  const auto newest = reader_.baselines(name, 1);
  if (!newest || newest->empty() || newest->front().time_ns <= baselines.forgotten_ns) return baselines;
  if (axis.begins_anew.empty()) {
    if (auto curve = curve_of(newest->front().bytes))
      baselines.curve = std::make_shared<const monitoring::ResponseCurve>(std::move(*curve));
    return baselines;
  }
  baselines.forgotten_ns = now_ns();
  // With the sample and the id of the former axis' last action, it is one that no later start does again.
  if (auto last = reader_.newest_action(name); last && *last) {
    ActionRecord& action = **last;
    action.key = fmt::format("{}:{}:anew", name, baselines.forgotten_ns);
    action.time_ns = baselines.forgotten_ns;
    action.kind = relearn;
    action.who = "service";
    action.reason = "the axis begins anew: " + axis.begins_anew;
    first_.actions.push_back(std::move(action));
  }
  return baselines;
}

void Recorder::set_baseline(std::size_t axis, const Told& told, Batch& batch) {
  const auto live = engine_.live(axis);
  auto curve = live->curve && !live->curve->frequency_hz.empty() ? live->curve : nullptr;
  batch.baselines.push_back({axes_[axis].installed->spec.name, told.action.sample, told.time_ns,
                             fmt::format("baseline-{}", told.action.id), told.who, told.reason, live->row,
                             curve ? curve_bytes(*curve) : std::vector<std::byte>()});
  const std::scoped_lock lock(status_mutex_);
  baselines_[axis].curve = std::move(curve);
}

std::filesystem::path Recorder::folder_of_evidence() const { return installation_.data / "evidence"; }

Recorder::Evidence Recorder::evidence_around(std::string alarm_id, std::size_t axis,
                                             std::uint64_t sample) const {
  const double rate_hz = axes_[axis].installed->spec.sample_rate_hz;
  const auto before = static_cast<std::uint64_t>(kBefore_s * rate_hz);
  const auto after = static_cast<std::uint64_t>(kAfter_s * rate_hz);
  return {std::move(alarm_id), axis, sample - std::min(sample, before), sample + after,
          now_ns() + static_cast<std::int64_t>(3.0 * kAfter_s) * kSecond_ns};
}

/// What a former process told is told once, and stays as it was told: without a sender's clock its times
/// would come out differently.
void Recorder::expect_replays() {
  for (const auto& axis : axes_) {
    if (!axis.begins_anew.empty()) continue;
    const auto events = reader_.events_from(axis.installed->spec.name, axis.replayed_from, kMostReplayed);
    if (!events) continue;
    for (const auto& event : *events) alarms_.expect(event);
  }
}

bool Recorder::lacks_evidence(const std::string& alarm_id) {
  if (std::any_of(evidence_.begin(), evidence_.end(), [&](const auto& e) { return e.alarm_id == alarm_id; }))
    return false;  // soon
  const auto files = reader_.evidence(alarm_id);
  return files && files->empty();
}

/// Open alarms of the store that no axis has.
void Recorder::close_orphans() {
  for (const auto& record : known_) {
    if (record.axis.empty()) continue;
    const auto axis = std::find_if(axes_.begin(), axes_.end(),
                                   [&](const Axis& one) { return one.installed->spec.name == record.axis; });
    std::string reason;
    if (axis == axes_.end()) {
      reason = "its axis was removed from the configuration";
    } else if (!axis->begins_anew.empty()) {
      reason = "its axis begins anew: " + axis->begins_anew;
    } else {
      const auto live = engine_.live(static_cast<std::size_t>(axis - axes_.begin()));
      const auto alarm = monitoring::alarm_from_name(record.alarm);
      const bool mine = alarm && live->alarms[alarm->index()].of_interest() &&
                        record.id == std::to_string(alarm_number(record.axis, *alarm,
                                                                 live->alarms[alarm->index()].raised_sample));
      if (mine || record.sample >= live->next_sample) continue;  // or it is still to come
      reason = "its axis does not know it";
    }
    alarms_.close(record, reason, now_ns(), first_);
  }
}

/// Evidence that a former process had no time to copy, or not all of it, as far as the ring still has it.
void Recorder::find_evidence() {
  for (const auto& record : std::exchange(known_, {})) {
    const auto axis = std::find_if(axes_.begin(), axes_.end(),
                                   [&](const Axis& one) { return one.installed->spec.name == record.axis; });
    const auto files = reader_.evidence(record.id);
    if (axis == axes_.end() || !files) continue;
    const auto events = reader_.events(record.id, 1);
    if (!events || events->empty()) continue;
    const std::uint64_t raised = events->front().sample, oldest = oldest_sample(*axis->ring);
    auto around = evidence_around(record.id, static_cast<std::size_t>(axis - axes_.begin()), raised);
    const bool lacks = files->empty()
                           ? oldest <= raised
                           : files->front().to_sample < around.to && oldest <= files->front().from_sample;
    if (!files->empty()) around.known_to = files->front().to_sample;
    if (lacks) evidence_.push_back(std::move(around));
  }
}

/// As much as a moment allows: rows and alarms wait meanwhile, and the ring has time.
void Recorder::copy_evidence(Batch& batch, std::int64_t now, bool last) {
  const std::int64_t begin = now_ns();
  std::erase_if(evidence_, [&](const Evidence& e) {
    const Axis& axis = axes_[e.axis];
    if (axis.ring->next_sample() < e.to && now < e.due_ns && !last) return false;
    if (!last && now_ns() - begin > kCopyFor_ns) return false;
    // What is told to be in it is what a next process goes by (find_evidence()).
    const auto [from, to] = copied(*axis.ring, *axis.installed, {e.from, e.to});
    if (to <= e.known_to) return true;  // nothing came since
    const std::string text = raw_csv(*axis.ring, *axis.installed, {from, to}, downloaded_name(e.alarm_id));
    if (text.empty()) return true;  // the machine stood still for longer than the ring is
    const std::string name = e.alarm_id + ".csv";
    const auto written = io::write_file_atomically(folder_of_evidence() / name, text);
    if (written) {
      remove_report(folder_of_evidence() / name);  // of less than there is now
      batch.evidence.push_back({name, e.alarm_id, axis.installed->spec.name, from, to, now, text.size()});
    }
    if (!written && now < e.due_ns + kEvidencePatience_ns && !last) return false;
    if (!written) say(LogLevel::warning, "{}", message_of(written.error()));
    return true;
  });
}

Recorder::Status Recorder::status() const {
  const std::scoped_lock lock(status_mutex_);
  Status status = status_;
  status.deliveries = deliveries_->status();
  return status;
}

Recorder::Baselines Recorder::baselines(std::size_t axis) const {
  const std::scoped_lock lock(status_mutex_);
  return baselines_[axis];
}

}  // namespace resonid::monitor
