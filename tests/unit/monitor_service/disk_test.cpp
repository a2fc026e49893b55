// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>

#include <algorithm>
#include <monitor/service/disk_alarm.hpp>
#include <monitor/service/live_backend.hpp>
#include <monitor/service/service.hpp>
#include <monitor/store/reader.hpp>
#include <nlohmann/json.hpp>
#include <resonid/base/error_text.hpp>

#include "drive.hpp"
#include "folder.hpp"
#include "targets.hpp"

namespace resonid::monitor {
namespace {

constexpr std::int64_t kMillisecond = 1'000'000, kBegin = 1'700'000'000'000 * kMillisecond;

/// Looks every 200 ms for so long; the transitions that come of it.
std::vector<EventRecord> look(DiskAlarm& alarm, std::int64_t& time, int milliseconds,
                              const std::string& fault, const std::string& over_limit,
                              std::vector<AlarmRecord>& records) {
  Batch batch;
  for (const std::int64_t end = time + milliseconds * kMillisecond; time < end; time += 200 * kMillisecond)
    alarm.look(fault, over_limit, time, batch);
  records.insert(records.end(), batch.alarms.begin(), batch.alarms.end());
  EXPECT_EQ(batch.alarms.size(), batch.events.size());
  return batch.events;
}

TEST(DiskAlarm, ComesAndGoesWithTheDisk) {
  DiskAlarm alarm;
  std::vector<AlarmRecord> records;
  std::int64_t time = kBegin;
  EXPECT_TRUE(look(alarm, time, 20'000, "", "", records).empty());
  EXPECT_TRUE(look(alarm, time, 800, "full", "", records).empty());  // a moment is none
  EXPECT_TRUE(look(alarm, time, 400, "", "", records).empty());
  auto events = look(alarm, time, 3000, "", "too much", records);
  ASSERT_EQ(events.size(), 1U);
  EXPECT_EQ(events[0].transition, "raised");
  EXPECT_EQ(events[0].text, "too much");
  EXPECT_EQ(records.back().severity, static_cast<int>(monitoring::Severity::medium));
  EXPECT_TRUE(records.back().active && records.back().open && records.back().acknowledged);
  events = look(alarm, time, 3000, "full", "too much", records);  // worse
  ASSERT_EQ(events.size(), 1U);
  EXPECT_EQ(events[0].transition, "realarmed");
  EXPECT_EQ(events[0].text, "full");
  EXPECT_EQ(records.back().severity, static_cast<int>(monitoring::Severity::high));
  EXPECT_TRUE(look(alarm, time, 9000, "", "", records).empty());
  events = look(alarm, time, 2000, "", "", records);
  ASSERT_EQ(events.size(), 1U);
  EXPECT_EQ(events[0].transition, "cleared");
  EXPECT_FALSE(records.back().active || records.back().open);
  EXPECT_TRUE(records.back().cleared_ns);
  for (const auto& record : records) EXPECT_EQ(record.id, records.front().id);
  const auto told = alarm_of(records.back());
  EXPECT_EQ(std::to_string(told.id), records.back().id);
  EXPECT_FALSE(told.evidence);
  events = look(alarm, time, 3000, "full", "", records);
  ASSERT_EQ(events.size(), 1U);
  EXPECT_NE(events[0].alarm_id, records.front().id);  // another raising
}

TEST(DiskAlarm, GoesOnWithWhatAFormerProcessLeft) {
  DiskAlarm former;
  std::vector<AlarmRecord> records;
  std::int64_t time = kBegin;
  ASSERT_EQ(look(former, time, 3000, "full", "", records).size(), 1U);
  DiskAlarm alarm;
  alarm.know(records.back());
  EXPECT_TRUE(look(alarm, time, 5000, "full", "", records).empty());
  const auto events = look(alarm, time, 12'000, "", "", records);
  ASSERT_EQ(events.size(), 1U);
  EXPECT_EQ(events[0].transition, "cleared");
  EXPECT_EQ(events[0].alarm_id, records.front().id);
  EXPECT_GT(events[0].sample, records.front().sample);
}

TEST(DiskAlarm, NamesAPathOfAnyBytes) {
  DiskAlarm alarm;
  std::vector<AlarmRecord> records;
  std::int64_t time = kBegin;
  ASSERT_EQ(look(alarm, time, 3000,
                 "'/Pr\xfc"
                 "fstand/monitor.sqlite' is full",
                 "", records)
                .size(),
            1U);
  EXPECT_NE(alarm_of(records.back()).text.find("monitor.sqlite' is full"), std::string::npos);
}

TEST(Disk, AnInstallationBeyondItsLimitSaysSoEverywhere) {
  const Folder folder;
  FakeReceiver receiver;
  const std::vector<std::vector<double>> none;
  auto all = installation(folder.path(), none, 1.0);
  all.sources.clear();
  all.retention.bytes = 1;
  all.targets = {receiver.target("webhook")};
  const auto service = Service::start(std::move(all));
  ASSERT_TRUE(service) << message_of(service.error());
  ASSERT_TRUE(eventually([&] { return !receiver.keys().empty(); }));
  const auto body = nlohmann::json::parse(receiver.bodies().front());
  EXPECT_EQ(body["alarm"]["alarm"], "disk");
  EXPECT_EQ(body["event"]["transition"], "raised");
  auto& backend = (*service)->backend();
  ASSERT_EQ(backend.alarms({web::AlarmFilter::active, "", 10}).value().size(), 1U);
  EXPECT_TRUE(backend.status().store.over_limit);
  EXPECT_FALSE(backend.status().store.failing);
  ASSERT_TRUE(eventually([&] { return backend.status().deliveries.at(0).delivered == 1; }));
  EXPECT_TRUE(backend.readiness().store);
  EXPECT_NE(backend.readiness().text.find("limit of 1 bytes"), std::string::npos);
  web::Action action;
  action.alarm = body["alarm"]["id"].get<std::uint64_t>();
  const auto acted = backend.act(action);
  ASSERT_FALSE(acted);
  EXPECT_EQ(acted.error().kind, web::Problem::Kind::conflict);
}

/// A bound on the size of this process' files, as of a full disk.
class SmallFiles {
 public:
  explicit SmallFiles(::rlim_t bytes = 10'000) : handler_(::signal(SIGXFSZ, SIG_IGN)) {
    ::getrlimit(RLIMIT_FSIZE, &before_);
    ::rlimit limits = before_;
    limits.rlim_cur = bytes;
    ::setrlimit(RLIMIT_FSIZE, &limits);
  }
  SmallFiles(const SmallFiles&) = delete;
  SmallFiles& operator=(const SmallFiles&) = delete;
  ~SmallFiles() {
    ::setrlimit(RLIMIT_FSIZE, &before_);
    ::signal(SIGXFSZ, handler_);
  }

 private:
  void (*handler_)(int);
  ::rlimit before_{};
};

TEST(Disk, AFullDiskIsToldAtOnceAndWrittenLater) {
  const Folder folder;
  FakeReceiver receiver;
  const std::vector<std::vector<double>> values{drive_samples(60.0, 1e9, 1)};
  auto all = installation(folder.path(), values, 5.0);
  all.targets = {receiver.target("webhook")};
  const auto service = Service::start(std::move(all));
  ASSERT_TRUE(service) << message_of(service.error());
  auto& backend = (*service)->backend();
  {
    const SmallFiles full;
    ASSERT_TRUE(eventually([&] { return !receiver.keys().empty(); }));
    EXPECT_TRUE(backend.status().store.failing);
    EXPECT_TRUE(backend.status().store.disk_full);
    EXPECT_FALSE(backend.readiness().store);
    const auto alarms = backend.alarms({web::AlarmFilter::active, "", 10}).value();
    ASSERT_FALSE(alarms.empty());
    EXPECT_EQ(alarms[0].alarm, "disk");
    EXPECT_EQ(alarms[0].severity, monitoring::Severity::high);
    EXPECT_TRUE(backend.events(alarms[0].id)) << "an alarm that waits to be written is known";
  }
  ASSERT_TRUE(eventually([&] { return !backend.status().store.failing; }));
  EXPECT_TRUE(backend.readiness().store);
  (*service)->stop();
  auto reader = Reader::open((folder.path() / "monitor.sqlite").string()).value();
  const auto stored = reader.alarms(AlarmFilter::all, std::nullopt, 10).value();
  EXPECT_EQ(std::count_if(stored.begin(), stored.end(), [](const auto& a) { return a.alarm == "disk"; }), 1);
  const auto is_raising = [](const std::string& key) { return key.ends_with(":raised"); };
  const auto waiting = reader.outbox_due(std::numeric_limits<std::int64_t>::max(), 10, "webhook").value();
  for (const auto& left : waiting) EXPECT_FALSE(is_raising(left.message.key)) << left.message.key;
  const auto keys = receiver.keys();  // on a slow machine that it was cleared as well
  EXPECT_EQ(std::count_if(keys.begin(), keys.end(), is_raising), 1);
}

TEST(Disk, AFolderThatIsRemovedIsToldEverywhere) {
  const Folder folder;
  const auto data = folder.path() / "data", aside = folder.path() / "aside";
  const std::vector<std::vector<double>> none;
  auto all = installation(data, none, 1.0);
  all.sources.clear();
  const auto service = Service::start(std::move(all));
  ASSERT_TRUE(service) << message_of(service.error());
  auto& backend = (*service)->backend();
  EXPECT_TRUE(backend.readiness().store);
  std::filesystem::rename(data, aside);
  const auto alarms = [&] { return backend.alarms({web::AlarmFilter::active, "", 10}).value(); };
  ASSERT_TRUE(eventually([&] { return !alarms().empty(); }));
  EXPECT_EQ(alarms().front().alarm, "disk");
  EXPECT_NE(alarms().front().text.find("was removed or replaced"), std::string::npos);
  EXPECT_TRUE(backend.status().store.failing);
  EXPECT_FALSE(backend.status().store.disk_full);
  EXPECT_FALSE(backend.readiness().store);
  std::filesystem::rename(aside, data);
  ASSERT_TRUE(eventually([&] { return !backend.status().store.failing; }));
  EXPECT_TRUE(backend.readiness().store);
}

TEST(Disk, AServiceThatEndsWhileTheDiskIsFullStartsAgain) {
  const Folder folder;
  const std::vector<std::vector<double>> values{drive_samples(60.0, 1e9, 1)};
  constexpr std::uintmax_t kIndex = 33'000;  // the index of the log needs 32 768
  const auto file = folder.path() / "monitor.sqlite";
  auto service = Service::start(installation(folder.path(), values, 2.0));
  ASSERT_TRUE(service) << message_of(service.error());
  ASSERT_GT(std::filesystem::file_size(file.string() + "-wal"), kIndex);
  const auto failing = [&] { return (*service)->backend().status().store.failing; };
  {
    const SmallFiles full(kIndex);
    ASSERT_TRUE(eventually(failing));
    (*service)->stop();
    service->reset();
    auto later = installation(folder.path(), values, 2.0);
    later.version = "later";
    service = Service::start(std::move(later));
    ASSERT_TRUE(service) << message_of(service.error());
    ASSERT_TRUE(eventually(failing));
    EXPECT_TRUE((*service)->backend().status().store.disk_full);
  }
  EXPECT_TRUE(eventually([&] { return !failing(); }));
}

}  // namespace
}  // namespace resonid::monitor
