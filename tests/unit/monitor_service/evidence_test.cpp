// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <fstream>
#include <monitor/service/evidence_files.hpp>
#include <monitor/store/store.hpp>
#include <set>

#include "folder.hpp"

namespace resonid::monitor {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kDay = 86'400'000'000'000, kRaised = 20'000 * kDay;

/// A data folder with the evidence of alarms 1 (closed) and 2 (open).
class Data {
 public:
  Data() {
    fs::create_directories(evidence());
    StoreOptions options;
    options.retention.evidence_s = 10.0 * 86'400;
    store.emplace(Store::open((folder_.path() / "monitor.sqlite").string(), options).value());
    Batch batch;
    for (const std::string id : {"1", "2"}) {
      AlarmRecord alarm;
      alarm.id = id;
      alarm.axis = "x";
      alarm.open = id == "2";
      batch.alarms.push_back(alarm);
      batch.evidence.push_back({id + ".csv", id, "x", 0, 10, kRaised, 3});
      put(id + ".csv");
    }
    EXPECT_TRUE(store->commit(batch));
    reader.emplace(Reader::open((folder_.path() / "monitor.sqlite").string()).value());
  }
  [[nodiscard]] fs::path evidence() const { return folder_.path() / "evidence"; }
  void put(const std::string& name) const { std::ofstream(evidence() / name) << "abc"; }
  [[nodiscard]] std::set<std::string> files() const {
    std::set<std::string> names;
    for (const auto& entry : fs::directory_iterator(evidence()))
      names.insert(entry.path().filename().string());
    return names;
  }
  void keep_up(std::int64_t now_ns) {
    for (auto done = store->upkeep(now_ns); done.value().more;) done = store->upkeep(now_ns);
  }

  std::optional<Store> store;
  std::optional<Reader> reader;

 private:
  Folder folder_;
};

TEST(Evidence, OfClosedAlarmsGoesWithItsReportWhenItIsOldEnough) {
  Data data;
  data.put("1.html");
  data.keep_up(kRaised + 9 * kDay);
  Batch batch;
  remove_evidence(data.evidence(), *data.reader, batch);
  EXPECT_TRUE(batch.evidence_removed.empty());
  EXPECT_TRUE(data.reader->alarm("1").value()->evidence);
  data.keep_up(kRaised + 11 * kDay);
  EXPECT_FALSE(data.reader->alarm("1").value()->evidence);
  EXPECT_TRUE(data.reader->alarm("2").value()->evidence);
  remove_evidence(data.evidence(), *data.reader, batch);
  EXPECT_EQ(batch.evidence_removed, std::vector<std::string>{"1.csv"});
  EXPECT_EQ(data.files(), std::set<std::string>{"2.csv"});
  ASSERT_TRUE(data.store->commit(batch));
  EXPECT_EQ(data.reader->evidence_files().value(), std::vector<std::string>{"2.csv"});
}

TEST(Evidence, CountsForRetentionWithItsReport) {
  Data data;
  data.put("1.html");
  EvidenceSizes counted;
  const auto bytes = [&](const std::string& alarm) {
    return data.reader->evidence(alarm).value().front().bytes;
  };
  const auto count = [&] {
    Batch batch;
    count_evidence(data.evidence(), counted, batch);
    EXPECT_TRUE(data.store->commit(batch));
    return batch.evidence_sizes.size();
  };
  EXPECT_EQ(count(), 2U);  // nothing is known of what a former process counted
  EXPECT_EQ(bytes("1"), 6U);
  EXPECT_EQ(bytes("2"), 3U);
  EXPECT_EQ(count(), 0U);
  data.put("2.html");
  EXPECT_EQ(count(), 1U);
  EXPECT_EQ(bytes("2"), 6U);
  fs::remove(data.evidence() / "1.html");
  EXPECT_EQ(count(), 1U);
  EXPECT_EQ(bytes("1"), 3U);
}

TEST(Evidence, FilesWithoutEntryAndEntriesWithoutFileGoAtTheStart) {
  Data data;
  for (const char* name : {"3.csv", "4.html", "2.html", ".5.csv.123-0.tmp", "notes.txt", "own.csv"})
    data.put(name);
  fs::remove(data.evidence() / "1.csv");
  Batch batch;
  tidy_evidence(data.evidence(), *data.reader, batch);
  EXPECT_EQ(data.files(), (std::set<std::string>{"2.csv", "2.html", "notes.txt", "own.csv"}));
  EXPECT_EQ(batch.evidence_lost, std::vector<std::string>{"1.csv"});
  ASSERT_TRUE(data.store->commit(batch));
  EXPECT_EQ(data.reader->evidence_files().value(), std::vector<std::string>{"2.csv"});
}

}  // namespace
}  // namespace resonid::monitor
