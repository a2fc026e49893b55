// SPDX-License-Identifier: MIT
#include "monitor/sources/demo_source.hpp"

#include <resonid/io/shipped_experiments.hpp>

#include "installation.hpp"

namespace resonid::monitor {
namespace {

using test::TemporaryFolder;

const ColumnNames kDemoColumns = {"ru", "u", "y", "position"};

std::unique_ptr<Source> started(std::vector<DemoMachine> machines, double speed, Axes& axes) {
  auto source = required(make_demo_source({std::move(machines), speed}, axes));
  source->start();
  return source;
}

TEST(DemoSource, GivesTheSamplesOfASimulation) {
  const TemporaryFolder folder;
  Installation axes(folder.path(), {"belt"}, 1U << 16U, kDemoColumns, 500.0);
  DemoMachine belt{"belt", io::shipped_experiment("belt_loosens")};
  const auto simulation = required(plant::simulate_closed_loop(belt.experiment));
  const auto source = started({belt}, 100.0, axes);
  // One run of 25 s, and the first samples of the next.
  ASSERT_TRUE(eventually([&] { return axes.end("belt") > 12'510; }));
  source->stop();
  const auto stored = axes.stored("belt");
  for (std::size_t k = 0; k < 12'500; ++k) {
    ASSERT_EQ(stored.sample[k], k);
    ASSERT_EQ(stored.values[k][0], simulation.record.excitation.samples[k]) << k;
    ASSERT_EQ(stored.values[k][1], simulation.record.input.samples[k]) << k;
    ASSERT_EQ(stored.values[k][2], simulation.record.output.samples[k]) << k;
  }
  EXPECT_NEAR(stored.values[12'500][3], stored.values[0][3], 1e-9) << "it begins again";
}

TEST(DemoSource, KeepsTheTime) {
  const TemporaryFolder folder;
  Installation axes(folder.path(), {"belt"}, 1U << 16U, kDemoColumns, 500.0);
  const auto begin = std::chrono::steady_clock::now();
  const auto source = started({{"belt", io::shipped_experiment("belt_loosens")}}, 2.0, axes);
  ASSERT_TRUE(eventually([&] { return axes.end("belt") >= 1000; }));
  EXPECT_GT(std::chrono::steady_clock::now() - begin, std::chrono::milliseconds(950));
}

TEST(DemoSource, PausesTheExcitation) {
  const TemporaryFolder folder;
  Installation axes(folder.path(), {"belt"}, 1U << 16U, kDemoColumns, 500.0);
  const auto source = started({{"belt", io::shipped_experiment("belt_loosens"), 2.0, 1.0}}, 100.0, axes);
  ASSERT_TRUE(eventually([&] { return axes.end("belt") >= 3000; }));
  source->stop();
  const auto stored = axes.stored("belt");
  for (std::size_t k = 0; k < 3000; ++k) ASSERT_EQ(stored.values[k][0] == 0.0, k % 1500 >= 1000) << k;
}

TEST(DemoSource, GoesOnAfterAGapWhenItIsStartedAgain) {
  const TemporaryFolder folder;
  Installation axes(folder.path(), {"belt"}, 1U << 16U, kDemoColumns, 500.0);
  const std::vector<DemoMachine> machines{{"belt", io::shipped_experiment("belt_loosens")}};
  auto source = started(machines, 100.0, axes);
  ASSERT_TRUE(eventually([&] { return axes.end("belt") >= 1000; }));
  source->stop();
  const std::uint64_t end = axes.end("belt"), next = axes.ring("belt").next_sample();
  source = started(machines, 100.0, axes);
  ASSERT_TRUE(eventually([&] { return axes.end("belt") >= end + 100; }));
  source->stop();
  EXPECT_EQ(axes.stored("belt").sample[end], next + 1000);
  EXPECT_EQ(axes.intake("belt").faults().count(Fault::restart), 0U);
}

TEST(DemoSource, RunsItsOwnMachines) {
  const TemporaryFolder folder;
  const std::vector<DemoMachine> machines = demo_machines();
  ASSERT_EQ(machines.size(), 4U);
  const auto source = required(make_demo_source(
      {machines, 20.0}, *std::make_unique<Installation>(folder.path(), std::vector<std::string>{})));
  for (const DemoMachine& machine : machines) {
    EXPECT_LE(machine.experiment.run.sample_rate_hz, 2000.0);
    Installation axes(folder.path(), {machine.axis}, 1U << 18U, kDemoColumns,
                      machine.experiment.run.sample_rate_hz);
    const auto one = started({machine}, 20.0, axes);
    ASSERT_TRUE(eventually([&] { return axes.end(machine.axis) >= 4000; })) << one->status().text;
    one->stop();
    EXPECT_EQ(axes.intake(machine.axis).faults().total(), 0U) << machine.axis;
    EXPECT_EQ(axes.intake(machine.axis).counters().missing, 0U) << machine.axis;
  }
}

TEST(DemoSource, RefusesWhatCannotRun) {
  const TemporaryFolder folder;
  Installation axes(folder.path(), {});
  RESONID_EXPECT_MESSAGE(make_demo_source({}, axes), "machines");
  RESONID_EXPECT_MESSAGE(make_demo_source({demo_machines(), 0.0}, axes), "speed");
  auto machines = demo_machines();
  machines[0].experiment.controller.gain = 100.0;
  RESONID_EXPECT_MESSAGE(make_demo_source({machines}, axes), "controller");
  machines = demo_machines();
  machines[1].paused_s = -1.0;
  RESONID_EXPECT_MESSAGE(make_demo_source({machines}, axes), "paused_s");
}

}  // namespace
}  // namespace resonid::monitor
