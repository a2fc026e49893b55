// SPDX-License-Identifier: MIT
#include "monitor/service/recorder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>
#include <nlohmann/json.hpp>
#include <resonid/io/detail/atomic_file.hpp>

#include "monitor/service/raw_csv.hpp"
#include "monitor/store/reader.hpp"

namespace resonid::monitor {
namespace {

constexpr auto kCommitEvery = std::chrono::milliseconds(200);
constexpr double kBefore_s = 30.0, kAfter_s = 5.0;  // of an alarm: its evidence
constexpr std::int64_t kSecond_ns = 1'000'000'000;

}  // namespace

Recorder::Recorder(Store store, Engine& engine, std::vector<Axis> axes, const Installation& installation,
                   std::vector<AlarmRecord> known, std::function<void(const AlarmRecord&)> told)
    : store_(std::move(store)),
      engine_(engine),
      axes_(std::move(axes)),
      installation_(installation),
      told_(std::move(told)) {
  for (const auto& record : known) alarms_.know(record);
}
Recorder::~Recorder() { stop(); }

void Recorder::start() {
  Batch batch;
  for (const auto& axis : axes_) {
    batch.axes.push_back({axis.installed->spec.name, 0.0});
    batch.configurations.push_back({axis.installed->configuration, now_ns()});
  }
  backlog_.add(std::move(batch));
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
    if (const auto upkeep = store_.upkeep(now_ns()); upkeep && upkeep->more)
      while (std::chrono::steady_clock::now() < due)
        if (const auto again = store_.upkeep(now_ns()); !again || !again->more) break;
    std::this_thread::sleep_until(due);
  }
  write(true);
}

void Recorder::write(bool last) {
  Batch batch;
  auto all = engine_.take();
  gather(batch, all);
  copy_evidence(batch, now_ns(), last);
  std::vector<AlarmRecord> fresh = batch.alarms;
  backlog_.add(std::move(batch));
  Status status;
  if (!backlog_.empty()) {
    const auto done = store_.commit(backlog_.batch());
    if (done || done.error().fault == StoreFault::invalid) {
      if (!done) status.fault = done.error().text;
      backlog_.clear();
      for (const auto& [axis, position] : snapshots_) engine_.stored(axis, position);
      snapshots_.clear();
    } else {
      status.fault = done.error().text;
      status.disk_full = done.error().fault == StoreFault::full;
    }
  }
  engine_.keep_going(!status.fault.empty());
  status.bytes = store_.file_bytes();
  const auto& left = backlog_.batch();
  status.pending = left.rows.size() + left.events.size() + left.actions.size();
  {
    const std::scoped_lock lock(status_mutex_);
    status_ = status;
  }
  // People hear of an alarm even where it cannot be written.
  for (const auto& record : fresh) told_(record);
}

void Recorder::gather(Batch& batch, std::vector<Results>& all) {
  for (auto& r : all) {
    const Axis& axis = axes_[r.axis];
    const auto& spec = axis.installed->spec;
    for (auto& row : r.rows) batch.rows.push_back({spec.name, row.time_ns, row.row});
    for (const auto& event : r.events) {
      alarms_.add(spec.name, spec.sample_rate_hz, event, batch);
      if (event.event.transition != monitoring::Transition::raised) continue;
      const auto before = static_cast<std::uint64_t>(kBefore_s * spec.sample_rate_hz);
      const auto after = static_cast<std::uint64_t>(kAfter_s * spec.sample_rate_hz);
      const std::uint64_t at = event.event.sample;
      evidence_.push_back({batch.alarms.back().id, r.axis, at - std::min(at, before), at + after,
                           now_ns() + static_cast<std::int64_t>(3.0 * kAfter_s) * kSecond_ns});
    }
    for (const auto& told : r.actions) {
      const nlohmann::json arguments{{"id", told.action.id},
                                     {"alarm", told.action.alarm.index()},
                                     {"until_sample", told.action.until_sample}};
      batch.actions.push_back({fmt::format("{}:{}", spec.name, told.action.id), spec.name, told.action.sample,
                               told.time_ns, std::string(name_of(told.action.kind)), told.who, told.reason,
                               arguments.dump()});
      if (told.action.kind != monitoring::ActionKind::set_baseline) continue;
      if (const auto live = engine_.live(r.axis))
        batch.baselines.push_back({spec.name,
                                   told.action.sample,
                                   told.time_ns,
                                   fmt::format("baseline-{}", told.action.id),
                                   told.who,
                                   told.reason,
                                   live->row,
                                   {}});
    }
    if (r.snapshot) {
      batch.snapshots.push_back({spec.name, r.snapshot->sample, r.snapshot->position, installation_.version,
                                 axis.configuration_hash, std::move(r.snapshot->bytes)});
      snapshots_.emplace_back(r.axis, r.snapshot->position);
    }
    if (const auto live = engine_.live(r.axis); live && live->memory_s > 0.0 && r.snapshot)
      batch.axes.push_back({spec.name, live->memory_s});
  }
}

std::filesystem::path Recorder::folder_of_evidence() const { return installation_.data / "evidence"; }

void Recorder::copy_evidence(Batch& batch, std::int64_t now, bool last) {
  std::erase_if(evidence_, [&](const Evidence& e) {
    const Axis& axis = axes_[e.axis];
    if (axis.ring->next_sample() < e.to && now < e.due_ns && !last) return false;
    const std::string text = raw_csv(*axis.ring, *axis.installed, e.from, e.to);
    const std::string name = e.alarm_id + ".csv";
    if (io::write_file_atomically(folder_of_evidence() / name, text))
      batch.evidence.push_back({name, e.alarm_id, axis.installed->spec.name, e.from, e.to, now, text.size()});
    return true;
  });
}

Recorder::Status Recorder::status() const {
  const std::scoped_lock lock(status_mutex_);
  return status_;
}

}  // namespace resonid::monitor
