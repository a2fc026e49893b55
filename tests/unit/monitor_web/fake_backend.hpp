// SPDX-License-Identifier: MIT
#pragma once

#include <fmt/core.h>

#include <map>
#include <mutex>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "monitor/web/backend.hpp"

namespace resonid::monitor::web::test {

inline constexpr double kTime = 1.7e9;  // s

/// An axis of which all is known; the figures differ from axis to axis.
inline AxisStatus an_axis(const std::string& name, double scale = 1.0) {
  AxisStatus axis;
  axis.name = name;
  axis.state = AxisState::following;
  axis.trusted = true;
  axis.verdict = online::AxisVerdict::trusted;
  axis.why = "all gates are open";
  axis.time_s = kTime;
  axis.age_s = 0.01;
  axis.latency_s = 0.02;
  axis.newest_time_s = kTime + 0.5;
  axis.rate_hz = 2000.0;
  axis.sample = 123456;
  for (std::size_t i = 0; i < axis.figures.size(); ++i) {
    const double value = scale * static_cast<double>(i + 1);
    axis.figures[i] = {{value, 0.01 * value}, 1.01 * value, -0.01 * value,
                       0.002 * value,         0.5 * value,  kUnknown};
  }
  axis.samples = {1000, 5, 4, 3, 2};
  axis.faults = {{"clock", 2, "1700000000 after \"1700000001\"\n\xff"}};
  axis.source = "line-1";
  return axis;
}

inline Alarm an_alarm(std::uint64_t id) {
  Alarm alarm;
  alarm.id = id;
  alarm.axis = "x";
  alarm.alarm = "stiffness";
  alarm.severity = Severity::high;
  alarm.active = true;
  alarm.text = "stiffness fell by 5.1 %";
  alarm.cause = "belt or coupling";
  alarm.since_time_s = kTime;
  alarm.raised_time_s = kTime + 2.0;
  alarm.change = AlarmChange{1000.0, 949.0, -51.0, 4.0, -0.051, 12.75};
  alarm.evidence = true;
  return alarm;
}

/// What the rest of the service would be: two axes, x and y, the second unknown in all that may be.
class FakeBackend : public Backend {
 public:
  FakeBackend() {
    AxisStatus unknown;
    unknown.name = "y";
    set({an_axis("x"), unknown});
  }

  void set(std::vector<AxisStatus> axes) {
    const std::lock_guard lock(mutex_);
    for (auto& axis : axes) {
      auto& [revision, status] = axes_[axis.name];
      revision = ++revision_;
      status = std::move(axis);
    }
  }
  void remove(const std::string& name) {
    const std::lock_guard lock(mutex_);
    axes_.erase(name);
  }
  std::vector<Action> actions() const {
    const std::lock_guard lock(mutex_);
    return actions_;
  }

  AxisNews axes(std::uint64_t after) const override {
    const std::lock_guard lock(mutex_);
    AxisNews news;
    news.revision = revision_;
    for (const auto& [name, entry] : axes_)
      if (entry.first > after) news.axes.push_back(entry.second);
    return news;
  }
  Answer<AxisDetail> axis(const std::string& name) const override {
    if (name == "throws") throw std::runtime_error("no memory");
    const std::lock_guard lock(mutex_);
    const auto found = axes_.find(name);
    if (found == axes_.end()) return none("axis");
    AxisDetail detail;
    detail.status = found->second.second;
    if (name == "y") return detail;
    detail.estimator = {"physical", 2.0, {true, true, true, true, true, true, true}, 30.0, "an experiment"};
    detail.loop = {"pi:0.5,0.02", 5e-4, 40.0, 8.0, 120.0, 90.0, 45.0};
    detail.baselines = {{kTime, 100, "Ann", "commissioning", true, {}}};
    detail.baselines[0].figures[0] = {60.0, 0.1};
    detail.longest_shelving_s = 7.0 * 86400.0;
    detail.raw_from_time_s = kTime - 120.0;
    detail.configuration_hash = "abc";
    return detail;
  }
  Answer<AxisResponse> response(const std::string& name) const override {
    if (name != "x") return none("axis");
    const Curve curve{{1.0, 2.0}, {0.5, kUnknown}, {0.0, -1.0}, {0.1, 0.1}, {}, {}};
    Curve plant = curve;
    plant.coherence = {0.9, kUnknown};
    plant.coherence_std = {0.02, kUnknown};
    const std::lock_guard lock(mutex_);
    return AxisResponse{kTime + static_cast<double>(revision_), plant, curve, curve};
  }
  Answer<History> history(const std::string& name, const HistoryQuestion& question) const override {
    if (name != "x") return none("axis");
    History history;
    history.time_s = {question.from_s, question.to_s};
    for (const auto figure : question.figures)
      history.trends.push_back(
          {figure, {1.0, kUnknown}, {0.1, kUnknown}, {0.9, kUnknown}, {1.1, kUnknown}, {1.0, 0.0}});
    return history;
  }
  Answer<std::string> raw(const std::string& name, double from_s, double to_s) const override {
    if (name == "long") return std::string(8'000'000, '1');
    if (name != "x") return none("axis");
    return fmt::format("sample,ru,u,y\n0,{},{},0\n", from_s, to_s);
  }
  Answer<Comparison> compare(const std::string& name, double a, double b) const override {
    if (name != "x") return none("axis");
    return Comparison{a, b, {{monitoring::Watched::stiffness, {1000.0, 4.0}, {949.0, 4.0}, -51.0, 5.7, 9.0}}};
  }
  Answer<std::vector<Alarm>> alarms(const AlarmQuestion& question) const override {
    if (question.axis == "z") return none("axis");
    auto shelved = an_alarm(2);
    shelved.shelved = Alarm::Shelved{kTime + 60.0, "waits for a spare belt", "Ann"};
    shelved.suppressed = "maintenance";
    shelved.active = false;
    shelved.cleared_time_s = kTime + 30.0;
    Alarm bare;
    bare.id = 3;
    bare.alarm = "disk";
    std::vector<Alarm> all{bare, shelved, an_alarm(1)};
    if (question.state == AlarmFilter::active || question.state == AlarmFilter::open) all = {an_alarm(1)};
    std::erase_if(all, [&](const Alarm& a) { return a.raised_time_s >= question.to_s; });
    if (all.size() > question.limit) all.resize(question.limit);
    return all;
  }
  Answer<AlarmCounts> active_alarms() const override { return AlarmCounts{0, 2500, 1}; }
  Answer<Alarm> alarm(std::uint64_t alarm) const override {
    if (alarm != 1) return none("id");
    auto found = an_alarm(1);
    found.longest_shelving_s = 3600.0;
    return found;
  }
  Answer<std::vector<AlarmEvent>> events(std::uint64_t alarm) const override {
    if (alarm != 1) return none("id");
    return std::vector<AlarmEvent>{{kTime, 5, "raised", "active", "stiffness fell", "", "", AlarmChange{}},
                                   {kTime, 6, "acknowledged", "active", "", "Ann", "seen", {}}};
  }
  Answer<std::string> evidence(std::uint64_t alarm) const override {
    if (alarm != 1) return none("id");
    return std::string("sample,ru,u,y\n");
  }
  Answer<std::string> report(std::uint64_t alarm) const override {
    if (alarm == 8)
      return unexpected<Problem>(Problem{Problem::Kind::conflict, "id", "its raw samples show no result"});
    if (alarm != 1) return none("id");
    return std::string("<!doctype html><script>1</script>");
  }
  Answer<std::vector<AuditEntry>> audit(const AuditQuestion& question) const override {
    if (question.to_s <= kTime || question.from_s > kTime) return std::vector<AuditEntry>{};
    return std::vector<AuditEntry>(std::min(question.limit, 3U),
                                   {kTime, "x", "shelve", "Ann", "spare", "shelved"});
  }
  ServiceStatus status() const override {
    ServiceStatus s;
    s.version = "0.1.0";
    s.started_time_s = kTime;
    s.uptime_s = 10.0;
    s.axes = 2;
    s.sources = {{"line-1",
                  "mqtt",
                  "connected",
                  "nothing while the broker's queue lasts",
                  10,
                  1000,
                  1,
                  "",
                  {{"format", 2, ""}}}};
    s.store = {4096, 3, true, "the disk is full", true, false};
    s.threshold = {3.6e6, 3.6e7, 1.8e6};
    s.deliveries = {{"webhook", 2, 40, 3, 1, "answer 503"}};
    return s;
  }
  Readiness readiness() const override {
    const std::lock_guard lock(mutex_);
    return ready;
  }
  Answer<void> act(const Action& action) override {
    if (action.axis == "nowhere" || action.alarm == 99) return none("target");
    if (action.kind == ActionKind::reset)
      return unexpected<Problem>(Problem{Problem::Kind::conflict, "id", "has not cleared"});
    if (action.kind == ActionKind::relearn)
      return unexpected<Problem>(Problem{Problem::Kind::unavailable, "engine", "is starting"});
    const std::lock_guard lock(mutex_);
    actions_.push_back(action);
    return {};
  }

  Readiness ready{true, true, true, ""};

 private:
  static unexpected<Problem> none(const char* field) {
    return unexpected<Problem>(Problem{Problem::Kind::not_found, field, "there is none of that name"});
  }

  mutable std::mutex mutex_;
  std::map<std::string, std::pair<std::uint64_t, AxisStatus>> axes_;
  std::uint64_t revision_ = 0;
  std::vector<Action> actions_;
};

}  // namespace resonid::monitor::web::test
