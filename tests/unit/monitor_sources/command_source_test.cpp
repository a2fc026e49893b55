// SPDX-License-Identifier: MIT
#include "monitor/sources/command_source.hpp"

#include "installation.hpp"

namespace resonid::monitor {
namespace {

using test::TemporaryFolder;

std::unique_ptr<Source> started(const std::string& script, Axes& axes) {
  CommandSettings settings;
  settings.command = {"sh", "-c", script};
  settings.format = TextSettings{TextFormat::csv, {"sample", "u", "y"}};
  settings.again_s = 0.01;
  auto source = required(make_command_source(settings, axes));
  source->start();
  return source;
}

TEST(CommandSource, ReadsAsHalsamplerWritesAndCountsWhatTheFifoLost) {
  const TemporaryFolder folder;
  Installation axes(folder.path(), {"x"});
  const auto source = started("printf '0 0 0 \\n1 0.5 -1 \\noverrun\\n4 2 -4 \\n'; exec sleep 100", axes);
  ASSERT_TRUE(eventually([&] { return axes.end("x") == 5; }));
  const auto stored = axes.stored("x");
  EXPECT_EQ(stored.values[4][1], -4.0);
  EXPECT_EQ(axes.intake("x").counters().missing, 2U);
}

TEST(CommandSource, RunsTheCommandAgainAndTellsWhatItSaidLast) {
  const TemporaryFolder folder;
  Installation axes(folder.path(), {"x"});
  const std::string counter = (folder / "counter").string();
  const auto source =
      started("k=$(cat " + counter + " 2>/dev/null || echo 0); echo $((k+1)) > " + counter +
                  "; echo \"$((2*k)) $k $((-2*k))\"; echo first >&2; echo the FIFO is gone >&2; exit 3",
              axes);
  ASSERT_TRUE(eventually([&] { return axes.ring("x").next_sample() >= 5; }));
  ASSERT_TRUE(eventually([&] { return source->status().state == SourceState::waiting; }));
  const std::string text = source->status().text;
  EXPECT_NE(text.find("'sh' ended with code 3, last it said 'the FIFO is gone'"), std::string::npos) << text;
}

TEST(CommandSource, WaitsForACommandThatIsNotThere) {
  const TemporaryFolder folder;
  Installation axes(folder.path(), {"x"});
  const auto source = required(make_command_source({{(folder / "nothing").string()}}, axes));
  source->start();
  ASSERT_TRUE(eventually([&] { return source->status().state == SourceState::waiting; }));
  EXPECT_NE(source->status().text.find("No such file"), std::string::npos) << source->status().text;
}

TEST(CommandSource, EndsTheCommandWithAllThatItStarted) {
  const TemporaryFolder folder;
  Installation axes(folder.path(), {"x"});
  const std::string pid = (folder / "pid").string();
  const auto source =
      started("sleep 100 & echo $! > " + pid + "; echo 0 0 0; trap '' TERM; wait; sleep 100", axes);
  ASSERT_TRUE(eventually([&] { return axes.end("x") == 1; }));
  const auto begin = std::chrono::steady_clock::now();
  source->stop();
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(5));
  const int child = std::stoi(test::contents_of(pid));
  EXPECT_TRUE(eventually([&] {
    const std::string status = test::contents_of("/proc/" + std::to_string(child) + "/stat");
    return status.empty() || status.find(") Z ") != std::string::npos;
  }));
}

TEST(CommandSource, RefusesWhatCannotBeRun) {
  const TemporaryFolder folder;
  Installation axes(folder.path(), {});
  RESONID_EXPECT_MESSAGE(make_command_source({{}}, axes), "command");
  RESONID_EXPECT_MESSAGE(make_command_source({{"true"}, TextSettings{}, 0.0}, axes), "again_s");
}

}  // namespace
}  // namespace resonid::monitor
