// SPDX-License-Identifier: MIT
#include "monitor/sources/command_source.hpp"

#include "installation.hpp"

namespace resonid::monitor {
namespace {

using test::TemporaryFolder;

std::unique_ptr<Source> started(const std::string& script, Axes& axes) {
  CommandSettings settings;
  settings.command = {"sh", "-c", script};
  settings.format = Format{SampleFormat::csv, {"sample", "u", "y"}};
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

/// As halsampler -t writes the sample's number: 32 bits with a sign.
std::unique_ptr<Source> started_wrapping(const std::string& lines, Axes& axes) {
  CommandSettings settings;
  settings.command = {"sh", "-c", "printf -- '" + lines + "'; exec sleep 100"};
  settings.format = Format{SampleFormat::csv, {"sample", "u", "y"}, {}, true};
  auto source = required(make_command_source(settings, axes));
  source->start();
  return source;
}

TEST(CommandSource, NumbersOf32BitsGoOnWhereTheyTurnAndOverARestart) {
  const TemporaryFolder folder;
  constexpr std::uint64_t kHalf = std::uint64_t{1} << 31U;
  const auto run = [&](const std::string& lines, std::uint64_t end) {
    Installation axes(folder.path(), {"x"});
    const auto source = started_wrapping(lines, axes);
    EXPECT_TRUE(eventually([&] { return axes.end("x") == end; })) << axes.end("x");
    EXPECT_EQ(axes.intake("x").faults().total(), 0U);
    return axes.ring("x").next_sample();
  };
  EXPECT_EQ(run("2147483646 1 1 \n2147483647 1 2 \n-2147483648 1 3 \n-2147483647 1 4 \n", 4), kHalf + 2);
  EXPECT_EQ(run("-2147483646 1 5 \n-2147483645 1 6 \n", 6), kHalf + 4);
  std::filesystem::remove(folder / "x.ring");
  EXPECT_EQ(run("-2 1 1 \n-1 1 2 \n0 1 3 \n1 1 4 \n", 4), 2 * kHalf + 2);
  EXPECT_EQ(run("2 1 5 \n3 1 6 \n", 6), 2 * kHalf + 4);
}

TEST(CommandSource, UnwrapsNumbersNearTheOneThatIsDue) {
  constexpr std::uint64_t kTurn = std::uint64_t{1} << 32U;
  EXPECT_EQ(unwrapped(5, 0), 5U);
  EXPECT_EQ(unwrapped(kTurn - 5, 0), kTurn - 5);  // it had run for long
  EXPECT_EQ(unwrapped(10, 10), 10U);
  EXPECT_EQ(unwrapped(7, 10), 7U);
  EXPECT_EQ(unwrapped(7, 3 * kTurn + 10), 3 * kTurn + 7);
  EXPECT_EQ(unwrapped(kTurn - 1, 3 * kTurn + 10), 3 * kTurn - 1);
  EXPECT_EQ(unwrapped(1'000'000, 3 * kTurn - 1'000'000), 3 * kTurn + 1'000'000);  // a gap over the turn
  EXPECT_EQ(unwrapped(2'000'000'000, kTurn + 1'000'000'000), kTurn + 2'000'000'000);
  EXPECT_EQ(unwrapped(0, kTurn + 3'000'000'000), kTurn);  // counts anew
  EXPECT_EQ(unwrapped(100, 3'000'000'000), 100U);
}

TEST(CommandSource, HalfALineOfACommandThatEndsIsAFaultAndNoSample) {
  const TemporaryFolder folder;
  Installation axes(folder.path(), {"x"});
  const std::string mark = (folder / "mark").string();
  const auto source = started("test -e " + mark + " && { printf '20 10 -20\n'; exec sleep 100; }; touch " +
                                  mark + "; printf '19 9.5 -19\n20 10 -2'",
                              axes);
  ASSERT_TRUE(eventually([&] { return axes.end("x") == 2; }));
  EXPECT_EQ(axes.stored("x").values[1][1], -20.0);
  EXPECT_EQ(axes.intake("x").faults().count(Fault::format), 1U);
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
  RESONID_EXPECT_MESSAGE(make_command_source({{"true"}, Format{}, 0.0}, axes), "again_s");
}

}  // namespace
}  // namespace resonid::monitor
