// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <monitor/service/alarm_record.hpp>
#include <monitor/service/service.hpp>
#include <monitor/store/reader.hpp>
#include <nlohmann/json.hpp>
#include <resonid/base/error_text.hpp>

#include "folder.hpp"
#include "pulsed.hpp"

namespace resonid::monitor {
namespace {

using web::AlarmFilter;

constexpr auto kOne = [](const auto& alarms) { return alarms.size() == 1; };
constexpr auto kTwo = [](const auto& alarms) { return alarms.size() == 2; };
constexpr auto kNone = [](const auto& alarms) { return alarms.empty(); };

/// Samples come and stop again; the alarms of that.
std::vector<web::Alarm> stale_again(const web::Backend& backend, Pulses& pulses,
                                    const std::vector<web::Alarm>& former) {
  pulses.send();
  return alarms_once(backend, AlarmFilter::active, [&](const auto& alarms) {
    return alarms.size() == former.size() && std::none_of(alarms.begin(), alarms.end(), [&](const auto& a) {
             return std::any_of(former.begin(), former.end(), [&](const auto& b) { return a.id == b.id; });
           });
  });
}

web::Action acknowledgement_of(std::uint64_t alarm) {
  web::Action action;
  action.kind = web::ActionKind::acknowledge;
  action.alarm = alarm;
  action.who = "tester";
  return action;
}

TEST(AlarmRecords, OnlyTheNewestRaisingIsLeftToBeAcknowledged) {
  const Folder folder;
  Pulses pulses;
  const auto service = Service::start(pulses.installation(folder.path(), {"x"}));
  ASSERT_TRUE(service) << message_of(service.error());
  auto& backend = (*service)->backend();
  const auto first = alarms_once(backend, AlarmFilter::active, kOne);
  ASSERT_EQ(first.size(), 1U);
  const auto second = stale_again(backend, pulses, first);
  ASSERT_EQ(second.size(), 1U);
  const auto events = backend.events(first[0].id);
  ASSERT_TRUE(events);
  EXPECT_EQ(events->back().transition, "superseded");
  EXPECT_EQ(events->back().text, "No samples: raised again, which is an alarm of its own");
  const auto former = backend.act(acknowledgement_of(first[0].id));
  ASSERT_FALSE(former);
  EXPECT_EQ(former.error().kind, web::Problem::Kind::conflict);
  const auto open = backend.alarms({AlarmFilter::unacknowledged, "", 100}).value();
  ASSERT_EQ(open.size(), 1U);
  EXPECT_EQ(open[0].id, second[0].id);
  EXPECT_TRUE(backend.act(acknowledgement_of(open[0].id)));
  EXPECT_TRUE(alarms_once(backend, AlarmFilter::unacknowledged, kNone).empty());
}

TEST(AlarmRecords, EachReminderOfASilentAxisIsKept) {
  const Folder folder;
  Pulses pulses;
  auto all = pulses.installation(folder.path(), {"x"});
  all.axes[0].spec.alarms.stale.realarm_s = 0.1;
  const auto service = Service::start(std::move(all));
  ASSERT_TRUE(service) << message_of(service.error());
  auto& backend = (*service)->backend();
  const auto alarm = alarms_once(backend, AlarmFilter::active, kOne).at(0).id;
  const auto reminders = [&] {
    const auto events = backend.events(alarm).value();
    return std::count_if(events.begin(), events.end(),
                         [](const auto& e) { return e.transition == "realarmed"; });
  };
  for (int i = 0; i < 500 && reminders() < 3; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_GE(reminders(), 3);
}

TEST(AlarmRecords, ActionsThatCannotBeAreRefusedAtOnce) {
  const Folder folder;
  Pulses pulses;
  const auto service = Service::start(pulses.installation(folder.path(), {"x"}));
  ASSERT_TRUE(service) << message_of(service.error());
  auto& backend = (*service)->backend();
  auto action = acknowledgement_of(alarms_once(backend, AlarmFilter::active, kOne).at(0).id);
  const auto refusal = [&](web::ActionKind kind, double seconds) {
    action.kind = kind;
    action.until_time_s = static_cast<double>(now_ns()) * 1e-9 + seconds;
    const auto done = backend.act(action);
    EXPECT_FALSE(done) << static_cast<int>(kind);
    return done ? std::string() : done.error().field + ": " + done.error().message;
  };
  EXPECT_NE(refusal(web::ActionKind::shelve, 30 * 86400.0).find("at most 168.0 h"), std::string::npos);
  EXPECT_NE(refusal(web::ActionKind::shelve, -60.0).find("ahead"), std::string::npos);
  EXPECT_TRUE(refusal(web::ActionKind::shelve, 30 * 86400.0).starts_with("until_time_s: "));
  action.in_seconds = true;
  EXPECT_TRUE(refusal(web::ActionKind::shelve, 30 * 86400.0).starts_with("seconds: "));
  EXPECT_NE(refusal(web::ActionKind::unshelve, 0.0).find("not shelved"), std::string::npos);
  EXPECT_NE(refusal(web::ActionKind::reset, 0.0).find("not latched"), std::string::npos);
  const auto audit = backend.audit(10).value();
  for (const auto& entry : audit) EXPECT_NE(entry.who, "tester");
}

TEST(AlarmRecords, SayWhereSamplesComeAndAreRefused) {
  const Folder folder;
  Pulses pulses;
  auto all = pulses.installation(folder.path(), {"x"});
  all.engine.stale_s = all.engine.first_sample_s = 0.5;
  const auto service = Service::start(std::move(all));
  ASSERT_TRUE(service) << message_of(service.error());
  pulses.send_other_columns();
  const auto alarms = alarms_once((*service)->backend(), AlarmFilter::active, kOne);
  ASSERT_EQ(alarms.size(), 1U);
  EXPECT_EQ(alarms[0].text.find("No usable samples since "), 0U) << alarms[0].text;
}

TEST(AlarmRecords, AreFoundOfAnAxisThatTheConfigurationOrAnAlarmKnows) {
  const Folder folder;
  Pulses pulses;
  for (const bool configured : {true, false}) {
    const auto service = Service::start(pulses.installation(folder.path(), {configured ? "x" : "y"}));
    ASSERT_TRUE(service) << message_of(service.error());
    const auto& backend = (*service)->backend();
    EXPECT_FALSE(alarms_once(backend, AlarmFilter::active, kOne).empty());
    const auto of_x = backend.alarms({AlarmFilter::all, "x", 10});
    ASSERT_TRUE(of_x) << configured;
    EXPECT_EQ(of_x->size(), 1U) << configured;
    EXPECT_TRUE(backend.alarms({AlarmFilter::shelved, "x", 10})) << configured;
    const auto unknown = backend.alarms({AlarmFilter::all, "z", 10});
    ASSERT_FALSE(unknown);
    EXPECT_EQ(unknown.error().kind, web::Problem::Kind::not_found);
    EXPECT_EQ(unknown.error().field, "axis");
    (*service)->stop();
  }
}

TEST(AlarmRecords, ARingThatWasThrownBackGoesOnWhereItWas) {
  const Folder folder;
  Pulses pulses;
  const auto ring = folder.path() / "rings" / "x.ring", old = folder.path() / "old";
  const auto run = [&](std::uint64_t pulses_sent) {
    auto all = pulses.installation(folder.path(), {"x"});
    all.engine.stale_s = 1e6;
    const auto service = Service::start(std::move(all));
    ASSERT_TRUE(service) << message_of(service.error());
    for (std::uint64_t i = 0; i < pulses_sent; ++i) pulses.send();
    for (int i = 0; i < 500 && (*service)->backend().axis("x")->status.samples.received < 10U * pulses_sent;
         ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    (*service)->stop();
  };
  run(2);
  std::filesystem::copy_file(ring, old);
  run(3);
  std::filesystem::rename(old, ring);  // as after a power cut
  run(1);
  EXPECT_EQ(Reader::open((folder.path() / "monitor.sqlite").string())->position("x").value()->next_sample,
            60U);
}

/// What became of the alarm of axis x that was open when the service ended.
struct Ending {
  std::vector<web::AlarmEvent> events;
  std::uint64_t alarm = 0;
  std::vector<web::Alarm> open;
};
Ending after_restart(const std::function<void(Installation&)>& change) {
  const Folder folder;
  Pulses pulses;
  Ending ending;
  {
    const auto service = Service::start(pulses.installation(folder.path(), {"x", "y"}));
    EXPECT_TRUE(service) << message_of(service.error());
    auto& backend = (*service)->backend();
    const auto first = alarms_once(backend, AlarmFilter::active, kTwo);
    for (const auto& alarm : stale_again(backend, pulses, first))
      if (alarm.axis == "x") ending.alarm = alarm.id;
    (*service)->stop();
  }
  Installation changed = pulses.installation(folder.path(), {"x", "y"});
  changed.engine.stale_s = 1e6;
  change(changed);
  const auto service = Service::start(std::move(changed));
  EXPECT_TRUE(service) << message_of(service.error());
  auto& backend = (*service)->backend();
  alarms_once(backend, AlarmFilter::active, kOne);
  std::this_thread::sleep_for(std::chrono::milliseconds(200));  // samples that it had come again
  ending.open = backend.alarms({AlarmFilter::active, "", 100}).value();
  if (const auto events = backend.events(ending.alarm)) ending.events = *events;
  return ending;
}

TEST(AlarmRecords, AreOverWhereTheirAxisBeginsAnew) {
  const auto ending = after_restart([](Installation& all) { all.axes[0].configuration = "other"; });
  ASSERT_EQ(ending.open.size(), 1U);
  EXPECT_EQ(ending.open[0].axis, "y");
  ASSERT_FALSE(ending.events.empty());
  EXPECT_EQ(ending.events.back().transition, "reset");
  EXPECT_EQ(ending.events.back().text, "stale: over, as its axis begins anew: its configuration has changed");
}

TEST(AlarmRecords, WhatWasDoneToAnAxisThatBeganAnewIsNotDoneAgain) {
  const Folder folder;
  Pulses pulses;
  const auto start = [&](const std::string& configuration) {
    auto all = pulses.installation(folder.path(), {"x"});
    all.engine.stale_s = 1e6;
    all.axes[0].configuration = configuration;
    auto service = Service::start(std::move(all));
    EXPECT_TRUE(service) << message_of(service.error());
    return std::move(*service);
  };
  const auto in_maintenance = [](const Service& service) {
    for (int i = 0; i < 100; ++i) {
      if (std::isfinite(service.backend().axis("x")->status.maintenance_until_time_s)) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return false;
  };
  auto service = start("first");
  pulses.send();
  web::Action action;
  action.kind = web::ActionKind::maintenance;
  action.axis = "x";
  action.who = "tester";
  action.until_time_s = static_cast<double>(now_ns()) * 1e-9 + 3600.0;
  ASSERT_TRUE(service->backend().act(action));
  EXPECT_TRUE(in_maintenance(*service));
  service.reset();
  for (int run = 0; run < 2; ++run) {  // the second one goes on from a snapshot before that sample
    service = start("second");
    EXPECT_FALSE(in_maintenance(*service)) << run;
    service.reset();
  }
}

TEST(AlarmRecords, AreOverWhereTheirAxisIsRemoved) {
  const auto ending = after_restart([](Installation& all) { all.axes.erase(all.axes.begin()); });
  ASSERT_EQ(ending.open.size(), 1U);
  EXPECT_EQ(ending.open[0].axis, "y");
  ASSERT_FALSE(ending.events.empty());
  EXPECT_EQ(ending.events.back().text, "stale: over, as its axis was removed from the configuration");
}

TEST(AlarmRecords, StayWhereTheirAxisGoesOn) {
  const auto ending = after_restart([](Installation& all) { all.axes[1].configuration = "other"; });
  ASSERT_EQ(ending.open.size(), 1U);
  EXPECT_EQ(ending.open[0].id, ending.alarm);
  ASSERT_FALSE(ending.events.empty());
  EXPECT_EQ(ending.events.back().transition, "raised");
}

TEST(AlarmRecords, ThatTheStoreHasAreNotToldAgain) {
  Results::TimedEvent event;
  event.event.sample = event.event.state.raised_sample = 500;
  event.event.transition = monitoring::Transition::raised;
  event.event.state.active = true;
  event.time_ns = event.since_ns = 1'000'000'000;
  Batch told, again;
  EXPECT_TRUE(AlarmRecords().add("x", 100.0, event, told));
  ASSERT_EQ(told.events.size(), 1U);
  AlarmRecords restarted;
  restarted.know(told.alarms[0]);
  restarted.expect(told.events[0]);
  event.time_ns = event.since_ns = 31'000'000'000;  // no sender told it
  EXPECT_FALSE(restarted.add("x", 100.0, event, again));
  EXPECT_TRUE(again.alarms.empty());
  EXPECT_TRUE(again.events.empty());
  event.event.sample = 700;
  event.event.transition = monitoring::Transition::cleared;
  event.event.state.active = false;
  event.time_ns = 40'000'000'000;  // after a silence: not 2 s later
  EXPECT_TRUE(restarted.add("x", 100.0, event, again));
  EXPECT_EQ(again.alarms.at(0).raised_ns, 1'000'000'000);
  EXPECT_EQ(again.alarms[0].cleared_ns, 40'000'000'000);
  auto json = nlohmann::json::parse(again.alarms[0].json);
  json.erase("cleared_ns");
  EXPECT_EQ(json.dump(), told.alarms[0].json);
}

TEST(AlarmRecords, AShelvedAlarmThatIsRaisedAgainTellsWhoShelvedItAndWhy) {
  Results::TimedEvent event;
  event.event.sample = event.event.state.raised_sample = 500;
  event.event.transition = monitoring::Transition::raised;
  event.event.state.active = true;
  Batch batch;
  AlarmRecords records;
  EXPECT_TRUE(records.add("x", 100.0, event, batch));
  event.event.transition = monitoring::Transition::shelved;
  event.event.state.shelving = monitoring::Shelving::timed;
  event.who = "Lee";
  event.reason = "waits for a part";
  EXPECT_TRUE(records.add("x", 100.0, event, batch));
  AlarmRecords restarted;
  restarted.know(batch.alarms.back());
  event.event.transition = monitoring::Transition::raised;
  event.event.sample = event.event.state.raised_sample = 900;
  event.who = event.reason = "";
  EXPECT_TRUE(restarted.add("x", 100.0, event, batch));
  EXPECT_EQ(nlohmann::json::parse(batch.alarms.back().json).at("shelved").at("reason"), "waits for a part");
  event.event.transition = monitoring::Transition::unshelved;
  event.event.state.shelving = monitoring::Shelving::none;
  EXPECT_TRUE(restarted.add("x", 100.0, event, batch));
  EXPECT_FALSE(nlohmann::json::parse(batch.alarms.back().json).contains("shelved"));
}

}  // namespace
}  // namespace resonid::monitor
