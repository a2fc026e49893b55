// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <monitor/service/log.hpp>
#include <monitor/service/watch.hpp>

#include "folder.hpp"

namespace resonid::monitor {
namespace {

/// The level of the log for the length of a test.
class Level {
 public:
  explicit Level(LogLevel level) : before_(log_level()) { set_log_level(level); }
  ~Level() { set_log_level(before_); }
  Level(const Level&) = delete;
  Level& operator=(const Level&) = delete;

 private:
  LogLevel before_;
};

class FakeSource : public Source {
 public:
  void start() override {}
  void stop() override {}
  [[nodiscard]] SourceStatus status() const override { return now; }
  [[nodiscard]] std::string_view promise() const noexcept override { return ""; }
  SourceStatus now;
};

TEST(Log, LinesHaveTimeAndLevelOrThePriorityForTheJournal) {
  constexpr std::int64_t kTime = 1'767'225'600'123'456'789;  // 2026-01-01
  EXPECT_EQ(log_line(LogLevel::warning, "a\nb", kTime, false), "2026-01-01T00:00:00.123Z warning a?b\n");
  EXPECT_EQ(log_line(LogLevel::error, "x", kTime, true), "<3>x\n");
  EXPECT_EQ(log_line(LogLevel::warning, "x", kTime, true), "<4>x\n");
  EXPECT_EQ(log_line(LogLevel::info, "x", kTime, true), "<6>x\n");
  EXPECT_EQ(log_line(LogLevel::debug, "x", kTime, true), "<7>x\n");
}

TEST(Log, SaysNothingBeyondItsLevel) {
  const Level level(LogLevel::warning);
  testing::internal::CaptureStderr();
  say(LogLevel::info, "quiet {}", 1);
  say(LogLevel::warning, "loud {}", 2);
  const std::string said = testing::internal::GetCapturedStderr();
  EXPECT_EQ(said.find("quiet"), std::string::npos);
  EXPECT_NE(said.find(" warning loud 2\n"), std::string::npos);
}

TEST(Log, TellsWhatBecomesOfSourcesOnceEach) {
  const Level level(LogLevel::info);
  FakeSource source;
  Watch watch;
  watch.add("line", source);
  std::uint64_t second = 0;
  const auto look = [&](SourceState state, const std::string& text) {
    source.now.state = state;
    source.now.text = text;
    testing::internal::CaptureStderr();
    watch.look(second++);
    return testing::internal::GetCapturedStderr();
  };
  EXPECT_NE(look(SourceState::running, "").find("info source line is running\n"), std::string::npos);
  EXPECT_EQ(look(SourceState::running, "a fault of the data"), "");
  EXPECT_NE(look(SourceState::waiting, "refused").find("warning source line is waiting: refused\n"),
            std::string::npos);
  EXPECT_EQ(look(SourceState::waiting, "refused"), "");
  EXPECT_NE(look(SourceState::waiting, "no route").find("no route"), std::string::npos);
  EXPECT_NE(look(SourceState::failed, "gone").find("error source line is failed: gone\n"), std::string::npos);
}

/// A topic that is misspelt.
TEST(Log, TellsEachAxisThatNobodyConfiguredOnce) {
  const Level level(LogLevel::warning);
  FakeSource source;
  Watch watch;
  watch.add("line", source);
  const auto look = [&] {
    testing::internal::CaptureStderr();
    watch.look(0);
    return testing::internal::GetCapturedStderr();
  };
  source.now.state = SourceState::running;
  EXPECT_EQ(look(), "");
  source.now.first_unknown = {"samples of 'gantri'; a configured axis is required"};
  EXPECT_NE(look().find("warning source line: samples of 'gantri'; a configured axis is required\n"),
            std::string::npos);
  EXPECT_EQ(look(), "");
  source.now.first_unknown.resize(kMostFirstUnknown, "another one");
  const std::string said = look();
  EXPECT_EQ(said.find("gantri"), std::string::npos);
  EXPECT_NE(said.find("another one; further ones are only counted\n"), std::string::npos);
  EXPECT_EQ(look(), "");
}

TEST(Log, TellsWhatSamplesLackAtMostOnceAMinute) {
  const Level level(LogLevel::info);
  const Folder folder;
  const ColumnNames columns{"ru", "u", "y", ""};
  RingSettings settings{"x", ring_channels(columns), 250.0, 1024};
  const auto ring = Ring::open(folder.path() / "x.ring", settings).value();
  Intake intake(*ring, columns);
  Watch watch;
  watch.add("x", intake);
  const auto look = [&](std::uint64_t second) {
    testing::internal::CaptureStderr();
    watch.look(second);
    return testing::internal::GetCapturedStderr();
  };
  EXPECT_EQ(look(0), "");
  intake.lost(5);
  EXPECT_NE(look(1).find("axis x: 0 samples missing, 0 late, 0 double, 5 lost"), std::string::npos);
  intake.lost(2);
  EXPECT_EQ(look(2), "");
  EXPECT_EQ(look(60), "");
  EXPECT_NE(look(61).find("2 lost"), std::string::npos);
  EXPECT_EQ(look(200), "");
}

}  // namespace
}  // namespace resonid::monitor
