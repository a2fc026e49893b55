// SPDX-License-Identifier: MIT
#include "monitor/sources/file_source.hpp"

#include <fmt/core.h>

#include <fstream>

#include "installation.hpp"

namespace resonid::monitor {
namespace {

namespace fs = std::filesystem;
using test::TemporaryFolder;

class FileSourceTest : public ::testing::Test {
 protected:
  std::unique_ptr<Source> started(Axes& axes, Format format = {}) {
    auto source = required(make_file_source({path_, std::move(format), 0.002}, axes));
    source->start();
    return source;
  }
  void append(std::string_view text, const fs::path& path) const {
    std::ofstream(path, std::ios::binary | std::ios::app) << text;
  }
  void append(std::string_view text) const { append(text, path_); }
  /// A birth is known to a few milliseconds only.
  static void later() { pause_ms(20); }

  const TemporaryFolder folder_;
  const fs::path path_ = folder_ / "x.csv";
};

TEST_F(FileSourceTest, FollowsAFileThatGrowsByHalfLines) {
  Installation axes(folder_.path(), {"x"});
  const auto source = started(axes);
  ASSERT_TRUE(eventually([&] { return source->status().state == SourceState::waiting; }));
  EXPECT_NE(source->status().text.find("No such file"), std::string::npos) << source->status().text;
  append("u,y\n0,0\n0.");
  ASSERT_TRUE(eventually([&] { return axes.end("x") == 1; }));
  append("5,-1\n1,-");
  ASSERT_TRUE(eventually([&] { return axes.end("x") == 2; }));
  append("2\n");
  ASSERT_TRUE(eventually([&] { return axes.end("x") == 3; }));
  axes.expect_exactly("x", 3);
  EXPECT_EQ(source->status().state, SourceState::running);
}

TEST_F(FileSourceTest, TellsThatItsFileIsGone) {
  append("u,y\n0,0\n");
  Installation axes(folder_.path(), {"x"});
  const auto source = started(axes);
  ASSERT_TRUE(eventually([&] { return axes.end("x") == 1; }));
  EXPECT_EQ(source->status().state, SourceState::running);
  std::ofstream writer(path_, std::ios::binary | std::ios::app);
  fs::remove(path_);
  ASSERT_TRUE(eventually([&] { return source->status().state == SourceState::waiting; }));
  EXPECT_NE(source->status().text.find("No such file"), std::string::npos) << source->status().text;
  writer << line_of(1) << std::flush;  // what its writer still adds is taken
  ASSERT_TRUE(eventually([&] { return axes.end("x") == 2; }));
  later();
  append("u,y\n" + line_of(2));
  ASSERT_TRUE(eventually([&] { return axes.end("x") == 3; }));
  axes.expect_exactly("x", 3);
  EXPECT_EQ(source->status().state, SourceState::running);
}

TEST_F(FileSourceTest, GoesOnWhereTheRingStandsWithTheNamesOfTheFirstLine) {
  append("# a comment\ny,u\n");
  for (int k = 0; k < 20'000; ++k) append(std::to_string(-k) + "," + std::to_string(0.5 * k) + "\n");
  {
    Installation axes(folder_.path(), {"x"});
    const auto source = started(axes);
    ASSERT_TRUE(eventually([&] { return axes.end("x") == 20'000; }));
  }
  append("-20000,10000\n-20001,1000");
  Installation axes(folder_.path(), {"x"});
  const auto source = started(axes);
  ASSERT_TRUE(eventually([&] { return axes.end("x") == 20'001; }));
  append("0.5\n");
  ASSERT_TRUE(eventually([&] { return axes.end("x") == 20'002; }));
  axes.expect_exactly("x", 20'002);
  EXPECT_LT(source->status().bytes, 1000U);
}

TEST_F(FileSourceTest, ALoggerThatWritesNamesOnceIsUnderstoodAfterRotationAndRestart) {
  append("y,u\n");
  const auto reversed = [](std::uint64_t first, std::uint64_t count) {
    std::string lines;
    for (std::uint64_t k = first; k < first + count; ++k)
      lines += fmt::format("{},{}\n", -static_cast<double>(k), 0.5 * static_cast<double>(k));
    return lines;
  };
  append(reversed(0, 10));
  {
    Installation axes(folder_.path(), {"x"});
    const auto source = started(axes);
    ASSERT_TRUE(eventually([&] { return axes.end("x") == 10; }));
    fs::rename(path_, folder_ / "x.csv.1");
    later();
    append(reversed(10, 10));
    ASSERT_TRUE(eventually([&] { return axes.end("x") == 20; }));
  }
  append(reversed(20, 10));
  {
    Installation axes(folder_.path(), {"x"});
    const auto source = started(axes);
    ASSERT_TRUE(eventually([&] { return axes.end("x") == 30; }));
    EXPECT_EQ(axes.intake("x").faults().total(), 0U);
  }
  fs::rename(path_, folder_ / "x.csv.0");  // and now while nobody looks: the new file is known to nobody
  later();
  append(reversed(30, 10));
  Installation axes(folder_.path(), {"x"});
  const auto source = started(axes);
  ASSERT_TRUE(eventually([&] { return axes.end("x") == 40; }));
  EXPECT_EQ(axes.intake("x").faults().total(), 0U);
  axes.expect_exactly("x", 40);
}

TEST_F(FileSourceTest, TheNewestNamesBeforeThePlaceCountAfterARestart) {
  append("y,u\n0,0\nu,y\n" + lines_of(1, 200'000));  // several megabytes
  append("y,temperature,u\n-200001,20,100000.5\n");
  const auto read_to = [&](std::uint64_t end) {
    Installation axes(folder_.path(), {"x"}, 1U << 19U);
    const auto source = started(axes);
    ASSERT_TRUE(eventually([&] { return axes.end("x") == end; })) << axes.end("x");
    axes.expect_exactly("x", end);
  };
  read_to(200'002);
  append("-200002,21,100001\n");
  read_to(200'003);
}

TEST_F(FileSourceTest, LinesThatLackNamesAreReadAgainOnceTheyCanBe) {
  append(lines_of(0, 10));
  {
    Installation axes(folder_.path(), {"x"});
    const auto source = started(axes);
    ASSERT_TRUE(eventually([&] { return axes.intake("x").faults().count(Fault::columns) == 10; }));
    pause_ms(20);
    EXPECT_EQ(axes.intake("x").position().word[3], 0U);
  }
  Installation axes(folder_.path(), {"x"});
  const auto source = started(axes, Format{SampleFormat::csv, {"u", "y"}});
  ASSERT_TRUE(eventually([&] { return axes.end("x") == 10; }));
  axes.expect_exactly("x", 10);
}

TEST_F(FileSourceTest, FromTheEndReadsWhatIsAppendedAndGoesOnThereAfterARestart) {
  append("u,y\n7,7\n8,8\n");
  const auto from_end = [&](Axes& axes) {
    auto source = required(make_file_source({path_, Format{}, 0.002, false}, axes));
    source->start();
    return source;
  };
  {
    Installation axes(folder_.path(), {"x"});
    const auto source = from_end(axes);
    ASSERT_TRUE(eventually([&] { return axes.intake("x").position().told(); }));
    append(lines_of(0, 10));
    ASSERT_TRUE(eventually([&] { return axes.end("x") == 10; }));
  }
  append(lines_of(10, 10));  // while nobody looks
  Installation axes(folder_.path(), {"x"});
  const auto source = from_end(axes);
  ASSERT_TRUE(eventually([&] { return axes.end("x") == 20; }));
  axes.expect_exactly("x", 20);
}

TEST_F(FileSourceTest, AFileThatComesLaterIsReadFromItsBeginning) {
  Installation axes(folder_.path(), {"x"});
  const auto source = required(make_file_source({path_, Format{}, 0.002, false}, axes));
  source->start();
  ASSERT_TRUE(eventually([&] { return source->status().state == SourceState::waiting; }));
  append("u,y\n" + lines_of(0, 10));
  ASSERT_TRUE(eventually([&] { return axes.end("x") == 10; }));
  axes.expect_exactly("x", 10);
}

TEST_F(FileSourceTest, ReadsARenamedFileToItsEndBeforeTheNext) {
  Installation axes(folder_.path(), {"x"});
  append("u,y\n" + lines_of(0, 10));
  const auto source = started(axes);
  ASSERT_TRUE(eventually([&] { return axes.end("x") == 10; }));
  fs::rename(path_, folder_ / "x.csv.1");
  append("");  // made for the writer, who still writes the other one
  later();
  append(lines_of(10, 5), folder_ / "x.csv.1");
  ASSERT_TRUE(eventually([&] { return axes.end("x") == 15; }));
  append(lines_of(15, 5), folder_ / "x.csv.1");
  append(lines_of(20, 5));
  ASSERT_TRUE(eventually([&] { return axes.end("x") == 25; }));
  append("u,y\n" + lines_of(25, 5));
  ASSERT_TRUE(eventually([&] { return axes.end("x") == 30; }));
  axes.expect_exactly("x", 30);
}

TEST_F(FileSourceTest, ReadsEveryFileThatWasRenamedWhileNobodyLooked) {
  append("u,y\n" + lines_of(0, 100), folder_ / "x.csv.7");  // of long ago, and known to nobody
  later();
  append("u,y\n" + lines_of(0, 10));
  {
    Installation axes(folder_.path(), {"x"});
    const auto source = started(axes);
    ASSERT_TRUE(eventually([&] { return axes.end("x") == 10; }));
  }
  append(lines_of(10, 10));
  fs::rename(path_, folder_ / "x.csv.2");
  later();
  append("u,y\n" + lines_of(20, 10));
  fs::rename(path_, folder_ / "x.csv.1");
  later();
  append("u,y\n" + lines_of(30, 10));
  append("a copy by hand\n", folder_ / "x.csv.bak");
  Installation axes(folder_.path(), {"x"});
  const auto source = started(axes);
  ASSERT_TRUE(eventually([&] { return axes.end("x") == 40; }));
  axes.expect_exactly("x", 40);
}

TEST_F(FileSourceTest, BeginsAnewAfterTruncationWhetherItLooksOrNot) {
  Installation axes(folder_.path(), {"x"});
  append("u,y\n" + lines_of(0, 10) + "77,7");
  {
    const auto source = started(axes);
    ASSERT_TRUE(eventually([&] { return axes.end("x") == 10; }));
    fs::resize_file(path_, 0);
    later();
    append("u,y\n" + lines_of(10, 3));
    ASSERT_TRUE(eventually([&] { return axes.end("x") == 13; }));
    append(lines_of(13, 7));
    ASSERT_TRUE(eventually([&] { return axes.end("x") == 20; }));
  }
  fs::resize_file(path_, 0);
  append("u,y\n" + lines_of(20, 2));
  const auto source = started(axes);
  ASSERT_TRUE(eventually([&] { return axes.end("x") == 22; }));
  append(lines_of(22, 20));
  ASSERT_TRUE(eventually([&] { return axes.end("x") == 42; }));
  axes.expect_exactly("x", 42);
}

TEST_F(FileSourceTest, GivesEachOfSeveralAxesWhatItLacks) {
  const Format format{SampleFormat::csv, {"axis", "u", "y"}};
  const auto line = [](const char* axis, std::uint64_t k) { return std::string(axis) + "," + line_of(k); };
  append(line("a", 0) + line("b", 0) + line("a", 1));
  {
    Installation axes(folder_.path(), {"a", "b"});
    const auto source = started(axes, format);
    ASSERT_TRUE(eventually([&] { return axes.end("a") == 2 && axes.end("b") == 1; }));
    fs::rename(path_, folder_ / "x.csv.1");
    later();
    append(line("a", 2));
    ASSERT_TRUE(eventually([&] { return axes.end("a") == 3; }));
  }
  append(line("b", 1) + line("a", 3));
  Installation axes(folder_.path(), {"a", "b"});
  const auto source = started(axes, format);
  ASSERT_TRUE(eventually([&] { return axes.end("a") == 4 && axes.end("b") == 2; }));
  axes.expect_exactly("a", 4);
  axes.expect_exactly("b", 2);
}

TEST_F(FileSourceTest, AnAxisThatWasLeftBehindMissesNothingOfLaterFiles) {
  const Format format{SampleFormat::csv, {"axis", "u", "y"}};
  const auto line = [](const char* axis, std::uint64_t k) { return std::string(axis) + "," + line_of(k); };
  append(line("a", 0) + line("b", 0));
  {
    Installation axes(folder_.path(), {"a", "b"});
    const auto source = started(axes, format);
    ASSERT_TRUE(eventually([&] { return axes.end("a") == 1 && axes.end("b") == 1; }));
  }
  append(line("b", 1));
  fs::rename(path_, folder_ / "x.csv.1");
  later();
  append(line("b", 2) + line("a", 1) + line("b", 3));
  {
    Installation axes(folder_.path(), {"a"});
    const auto source = started(axes, format);
    ASSERT_TRUE(eventually([&] { return axes.end("a") == 2; }));
  }
  Installation axes(folder_.path(), {"a", "b"});
  const auto source = started(axes, format);
  ASSERT_TRUE(eventually([&] { return axes.end("b") == 4; })) << axes.end("b");
  append(line("a", 2));
  ASSERT_TRUE(eventually([&] { return axes.end("a") == 3; }));
  axes.expect_exactly("a", 3);
  axes.expect_exactly("b", 4);
}

TEST_F(FileSourceTest, AnOlderFileThatIsConfiguredInsteadIsReadToo) {
  const fs::path older = folder_ / "old.csv";
  append("u,y\n" + lines_of(10, 10), older);
  later();
  append("u,y\n" + lines_of(0, 10));
  {
    Installation axes(folder_.path(), {"x"});
    const auto source = started(axes);
    ASSERT_TRUE(eventually([&] { return axes.end("x") == 10; }));
  }
  Installation axes(folder_.path(), {"x"});
  const auto source = required(make_file_source({older, Format{}, 0.002}, axes));
  source->start();
  ASSERT_TRUE(eventually([&] { return axes.end("x") == 20; })) << axes.end("x");
  axes.expect_exactly("x", 20);
}

TEST_F(FileSourceTest, WhatAnAxisThatIsAheadHasAlreadyIsCounted) {
  const Format format{SampleFormat::csv, {"axis", "u", "y"}};
  const auto line = [](const char* axis, std::uint64_t k) { return std::string(axis) + "," + line_of(k); };
  append(line("a", 0) + line("b", 0));
  {
    Installation axes(folder_.path(), {"a", "b"});
    const auto source = started(axes, format);
    ASSERT_TRUE(eventually([&] { return axes.end("a") == 1 && axes.end("b") == 1; }));
  }
  append(line("a", 1) + line("b", 1));
  fs::rename(path_, folder_ / "x.csv.1");
  later();
  append(line("a", 2) + line("b", 2));
  {
    Installation axes(folder_.path(), {"a"});
    const auto source = started(axes, format);
    ASSERT_TRUE(eventually([&] { return axes.end("a") == 3; }));
  }
  Installation axes(folder_.path(), {"a", "b"});
  const auto source = started(axes, format);
  ASSERT_TRUE(eventually([&] { return axes.end("b") == 3; }));
  EXPECT_EQ(axes.intake("a").counters().duplicate, 2U);  // one in each file
  axes.expect_exactly("a", 3);
  axes.expect_exactly("b", 3);
}

/// As after a reboot with btrfs, or where NFS was mounted again.
TEST_F(FileSourceTest, GoesOnWhereTheDeviceHasAnotherNumber) {
  const Format format{SampleFormat::csv, {"axis", "u", "y"}};
  const auto line = [](const char* axis, std::uint64_t k) { return std::string(axis) + "," + line_of(k); };
  append(line("a", 0) + line("b", 0) + line("a", 1));
  {
    Installation axes(folder_.path(), {"a", "b"});
    const auto source = started(axes, format);
    ASSERT_TRUE(eventually([&] { return axes.end("a") == 2 && axes.end("b") == 1; }));
  }
  append(line("b", 1) + line("b", 2));
  {
    Installation axes(folder_.path(), {"b"});
    const auto source = started(axes, format);
    ASSERT_TRUE(eventually([&] { return axes.end("b") == 3; }));
  }
  append(line("a", 2));
  Installation axes(folder_.path(), {"a", "b"});
  for (Intake* intake : axes.all()) {
    SourcePosition position = intake->position();
    ++position.word[0];
    intake->reached(position);
  }
  const auto source = started(axes, format);
  ASSERT_TRUE(eventually([&] { return axes.end("a") == 3; }));
  source->stop();
  axes.expect_exactly("a", 3);
  axes.expect_exactly("b", 3);
}

TEST_F(FileSourceTest, AnAxisOfWhichNothingComesGoesOnWithTheOthers) {
  append("axis,u,y\n");
  {
    Installation axes(folder_.path(), {"a", "b"});
    const auto source = started(axes);
    ASSERT_TRUE(eventually([&] { return axes.intake("b").position().told(); }));  // before anything is read
    append("a,0,0\n");
    ASSERT_TRUE(eventually([&] { return axes.end("a") == 1; }));
    EXPECT_TRUE(eventually([&] { return axes.intake("b").position() == axes.intake("a").position(); }));
    EXPECT_EQ(axes.end("b"), 0U);
  }
  append("a,0.5,-1\n");
  Installation axes(folder_.path(), {"a", "b"});
  const auto source = started(axes);
  ASSERT_TRUE(eventually([&] { return axes.end("a") == 2; }));
  EXPECT_EQ(source->status().bytes, std::string_view("a,0.5,-1\n").size());
}

TEST_F(FileSourceTest, GoesOnAmongFramesAndBehindGarbage) {
  append(frame_of("x", 0, 10) + "RSN1 is no frame" + frame_of("x", 10, 5));
  {
    Installation axes(folder_.path(), {"x"});
    const auto source = started(axes, Format{SampleFormat::frame});
    ASSERT_TRUE(eventually([&] { return axes.end("x") == 15; }));
    EXPECT_EQ(axes.intake("x").faults().count(Fault::format), 1U);
  }
  const std::string frame = frame_of("x", 15, 5);
  append(frame.substr(0, 50));
  Installation axes(folder_.path(), {"x"});
  const auto source = started(axes, Format{SampleFormat::frame});
  pause_ms(20);
  append(frame.substr(50));
  ASSERT_TRUE(eventually([&] { return axes.end("x") == 20; }));
  axes.expect_exactly("x", 20);
  EXPECT_EQ(axes.intake("x").counters().duplicate, 0U);
  EXPECT_EQ(source->status().bytes, frame.size());
}

/// Of an object's samples each ends at a byte of its line, but only the line can be read again.
TEST_F(FileSourceTest, ReadsALineAgainOfWhichTheRingHasSomeSamples) {
  append("{\"u\":[0,0.5,1],\"y\":[0,-1,-2]}\n{\"u\":[1.5,2,2.5],\"y\":[-3,-4,-5]}\n");
  SourcePosition end;
  {
    Installation axes(folder_.path(), {"x"});
    const auto source = started(axes, Format{SampleFormat::json});
    ASSERT_TRUE(eventually([&] { return axes.end("x") == 6; }));
    end = axes.intake("x").position();
  }
  const TemporaryFolder other;
  Installation axes(other.path(), {"x"});
  const std::string_view columns[] = {"u", "y"};
  const double values[] = {0.0, 0.0, 0.5, -1.0, 1.0, -2.0, 1.5, -3.0};
  Arrival first;
  first.columns = columns;
  first.values = values;
  end.word[3] = 31;  // the second line begins at byte 30
  ASSERT_EQ(axes.intake("x").add(first, end), Intake::Outcome::taken);
  const auto source = started(axes, Format{SampleFormat::json});
  ASSERT_TRUE(eventually([&] { return axes.end("x") == 6; }));
  axes.expect_exactly("x", 6);
}

TEST_F(FileSourceTest, WaitsForAFileWhereThereIsAFolder) {
  fs::create_directory(path_);
  Installation axes(folder_.path(), {"x"});
  const auto source = started(axes);
  ASSERT_TRUE(eventually([&] { return source->status().state == SourceState::waiting; }));
  EXPECT_NE(source->status().text.find("a regular file is required"), std::string::npos)
      << source->status().text;
  fs::remove(path_);
  append("u,y\n" + lines_of(0, 1));
  ASSERT_TRUE(eventually([&] { return axes.end("x") == 1; }));
}

TEST_F(FileSourceTest, RefusesSettingsThatCannotBe) {
  Installation axes(folder_.path(), {});
  RESONID_EXPECT_MESSAGE(make_file_source({}, axes), "path");
  RESONID_EXPECT_MESSAGE(make_file_source({path_, Format{}, 0.0}, axes), "poll_s");
}

}  // namespace
}  // namespace resonid::monitor
