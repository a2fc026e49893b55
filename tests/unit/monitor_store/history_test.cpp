// SPDX-License-Identifier: MIT
#include "store_folder.hpp"

namespace resonid::monitor::test {
namespace {

using monitoring::Watched;

constexpr std::int64_t kDay = 24 * kHour;

/// Rows at 1 Hz of a machine whose stiffness falls from 300 to 285 at `change`.
class LoosenedMachine {
 public:
  LoosenedMachine(int seconds, int change, double fall = 15.0) : store_(opened(folder_.file())) {
    Batch batch;
    batch.axes = {{"x", 0.0}};
    std::normal_distribution<double> normal;
    for (int i = 0; i < seconds; ++i) {
      auto row = some_row(static_cast<std::uint64_t>(i));
      row[Watched::stiffness] = {300.0 - (i < change ? 0.0 : fall) + normal(random_), 1.0};
      batch.rows.push_back(record_of("x", kStart + i * kSecond, row));
      if (batch.rows.size() == 20'000) flush(batch, i);
    }
    flush(batch, seconds);
    keep_up(store_, kStart + (seconds + 300) * kSecond);
  }
  Reader reader() { return reader_of(folder_.file()); }
  Store& store() { return store_; }

 private:
  void flush(Batch& batch, int second) {
    value(store_.commit(batch));
    batch = {};
    keep_up(store_, kStart + second * kSecond);
  }
  const Folder folder_;
  std::mt19937_64 random_{11};
  Store store_;
};

TEST(History, EveryRowWhereThereIsRoom) {
  LoosenedMachine machine(100, 50);
  auto reader = machine.reader();
  const auto history = value(reader.history({"x",
                                             {Watched::stiffness, Watched::resonance, Watched::gap},
                                             kStart,
                                             kStart + 100 * kSecond,
                                             100,
                                             {}}));
  EXPECT_EQ(history.resolution, Resolution::row);
  ASSERT_EQ(history.time_ns.size(), 100U);
  EXPECT_EQ(history.time_ns[17], kStart + 17 * kSecond);
  const auto rows = value(reader.rows("x", kStart, kStart + kHour, 1000));
  EXPECT_EQ(history.figures[0][17].mean, rows[17].row[Watched::stiffness].value);
  EXPECT_EQ(history.figures[0][17].std, 1.0);
  EXPECT_EQ(history.figures[1][17].mean, 50.0);
  EXPECT_EQ(history.figures[2][17].rows, 0U);  // none there
}

TEST(History, LongTimesShowWhatHasJustBegun) {
  LoosenedMachine machine(1800, 1'000'000);
  auto reader = machine.reader();
  const auto history = value(reader.history({"x", {Watched::stiffness}, 0, kStart + 3 * kDay, 1000, {}}));
  ASSERT_EQ(history.time_ns.size(), 1U);
  EXPECT_EQ(history.figures[0][0].rows, 1800U);
  EXPECT_NEAR(static_cast<double>(history.time_ns[0] - kStart), 900e9, 1e9)
      << "not the middle of an hour in progress";
}

TEST(History, PointsHaveTheExtremesAndMeansOfTheirRows) {
  LoosenedMachine machine(5000, 2500);
  auto reader = machine.reader();
  const auto history =
      value(reader.history({"x", {Watched::stiffness}, kStart, kStart + 5000 * kSecond, 10, {}}));
  ASSERT_EQ(history.time_ns.size(), 10U);
  const auto rows = value(reader.rows("x", kStart, kStart + 2 * kHour, 10'000));
  ASSERT_EQ(rows.size(), 5000U);
  for (std::size_t p = 0; p < 10; ++p) {
    double sum = 0.0, min = 1e9, max = -1e9;
    for (std::size_t i = 500 * p; i < 500 * (p + 1); ++i) {
      const double value = rows[i].row[Watched::stiffness].value;
      sum += value;
      min = std::min(min, value);
      max = std::max(max, value);
    }
    EXPECT_NEAR(history.figures[0][p].mean, sum / 500, 1e-9);
    EXPECT_EQ(history.figures[0][p].min, min);
    EXPECT_EQ(history.figures[0][p].max, max);
    EXPECT_GE(history.figures[0][p].std, 1.0 / std::sqrt(500.0));
    EXPECT_LE(history.figures[0][p].std, 3.0 / std::sqrt(500.0));
    EXPECT_EQ(history.time_ns[p],
              kStart + (500 * static_cast<std::int64_t>(p)) * kSecond + 499 * kSecond / 2);
  }
}

TEST(History, TakesTheResolutionThatReaches) {
  LoosenedMachine machine(30 * 3600, 1000);
  auto reader = machine.reader();
  const auto resolution_of = [&](std::int64_t from, std::int64_t to, std::size_t points) {
    return value(reader.history({"x", {Watched::stiffness}, from, to, points, {}})).resolution;
  };
  EXPECT_EQ(resolution_of(kStart, kStart + 2 * kDay, 1000), Resolution::row);
  EXPECT_EQ(resolution_of(kStart - 5 * kDay, kStart + 2 * kDay, 1000), Resolution::five_minutes);
  EXPECT_EQ(resolution_of(kStart - 5 * kDay, kStart + 2 * kDay, 100), Resolution::hour);  // as fine as asked
  EXPECT_EQ(resolution_of(kStart - 28 * kDay, kStart + 2 * kDay, 2000), Resolution::five_minutes);
  EXPECT_EQ(resolution_of(kStart - 300 * kDay, kStart + 65 * kDay, 1000), Resolution::hour);
  EXPECT_EQ(resolution_of(kStart - 300 * kDay, kStart + 65 * kDay, 100'000), Resolution::hour);
  EXPECT_EQ(resolution_of(kStart - 3000 * kDay, kStart + 650 * kDay, 1000), Resolution::day);
  Retention short_one;
  short_one.rows_s = 5 * 3600;
  machine.store().set_retention(short_one);
  keep_up(machine.store(), kStart + 31 * kHour);
  EXPECT_EQ(resolution_of(kStart, kStart + 2 * kDay, 1000), Resolution::five_minutes);
  EXPECT_EQ(resolution_of(kStart + 27 * kHour, kStart + 2 * kDay, 1000), Resolution::row);
  short_one.five_minutes_s = 5 * 3600;
  machine.store().set_retention(short_one);
  keep_up(machine.store(), kStart + 36 * kHour);
  EXPECT_EQ(resolution_of(kStart, kStart + 2 * kDay, 1000), Resolution::hour);
  EXPECT_EQ(value(reader.history({"nothing", {Watched::gap}, kStart, kStart + kDay, 10, {}})).time_ns.size(),
            0U);
}

TEST(History, HoursInProgressAreThere) {
  LoosenedMachine machine(3 * 3600 + 1200, 1'000'000);
  auto reader = machine.reader();
  const auto hours =
      value(reader.history({"x", {Watched::stiffness}, kStart, kStart + kDay, 100, Resolution::hour}));
  ASSERT_EQ(hours.time_ns.size(), 4U);
  EXPECT_EQ(hours.figures[0][2].rows, 3600U);
  EXPECT_EQ(hours.figures[0][3].rows, 1200U);
  EXPECT_NEAR(hours.figures[0][3].mean, 300.0, 0.2);
  const auto pairs =
      value(reader.history({"x", {Watched::stiffness}, kStart, kStart + 4 * kHour, 2, Resolution::hour}));
  ASSERT_EQ(pairs.time_ns.size(), 2U);
  EXPECT_EQ(pairs.figures[0][0].rows, 7200U);
  EXPECT_EQ(pairs.time_ns[0], kStart + kHour);
}

TEST(History, FiveMinutesAreThereWhetherTheirHourHasEndedOrNot) {
  LoosenedMachine machine(3 * 3600 + 1200, 10'650);
  auto reader = machine.reader();
  const auto parts = value(
      reader.history({"x", {Watched::stiffness}, kStart, kStart + kDay, 1000, Resolution::five_minutes}));
  ASSERT_EQ(parts.time_ns.size(), 40U);
  const auto rows = value(reader.rows("x", kStart, kStart + kDay, 99'999));
  for (const std::size_t p : {0U, 35U, 39U}) {  // 35: of an hour that is settled, with the fall; 39: of now
    FigureGatherer own;
    for (std::size_t i = 300 * p; i < 300 * (p + 1); ++i)
      own.add(rows[i].time_ns, rows[i].row[Watched::stiffness], true);
    const auto expected = own.summary(0.0);
    EXPECT_EQ(parts.time_ns[p], kStart + static_cast<std::int64_t>(300 * p + 150) * kSecond);
    EXPECT_DOUBLE_EQ(parts.figures[0][p].mean, expected.mean);
    EXPECT_DOUBLE_EQ(parts.figures[0][p].std, expected.std);
    EXPECT_EQ(parts.figures[0][p].min, expected.min);
    EXPECT_EQ(parts.figures[0][p].trusted, 300U);
  }
  EXPECT_NEAR(parts.figures[0][35].mean, 292.5, 0.5);  // half before the fall, half after it
}

TEST(History, RefusesWhatItCannotAnswer) {
  LoosenedMachine machine(10, 5);
  auto reader = machine.reader();
  constexpr auto kMost = std::numeric_limits<std::int64_t>::max();
  for (const auto& query :
       {HistoryQuery{"x", {Watched::gap}, kStart, kStart + 1, 0, {}},
        HistoryQuery{"x", {}, kStart, kStart + 1, 1'000'000, {}},
        HistoryQuery{"x", {Watched::gap}, kStart, kStart, 10, {}},
        HistoryQuery{"x", {Watched::gap}, kStart, kStart + 32 * kDay, 10, Resolution::row},
        HistoryQuery{"x", {Watched::gap}, -kMost, kMost, 10, {}}}) {
    const auto refused = reader.history(query);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().fault, StoreFault::invalid);
  }
  EXPECT_FALSE(reader.compare("x", kMost, kStart));
}

TEST(Compare, FindsTheFallAndHowSureItIs) {
  LoosenedMachine machine(4000, 2000);
  auto reader = machine.reader();
  const auto differences = value(reader.compare("x", kStart + 1000 * kSecond, kStart + 3000 * kSecond));
  ASSERT_EQ(differences.size(), 2U);  // resonance and stiffness are all there is
  const auto& fall = differences[1];
  EXPECT_EQ(fall.figure, Watched::stiffness);
  ASSERT_TRUE(fall.a && fall.b);
  EXPECT_EQ(fall.a->summary.trusted, 600U);
  EXPECT_EQ(fall.a->resolution, Resolution::row);
  EXPECT_NEAR(fall.difference, -15.0, 0.3);
  EXPECT_GE(fall.std, std::sqrt(2.0 / 600.0));
  EXPECT_LE(fall.std, 3.0 * std::sqrt(2.0 / 600.0));
  EXPECT_GT(fall.sigma, 100.0);
  EXPECT_LT(fall.chance, 1e-9);
}

TEST(Compare, TakesLessOfTimesThatAreClose) {
  LoosenedMachine machine(4000, 2000);
  auto reader = machine.reader();
  const auto differences = value(reader.compare("x", kStart + 1900 * kSecond, kStart + 2100 * kSecond));
  ASSERT_EQ(differences.size(), 2U);
  const auto& fall = differences[1];
  ASSERT_TRUE(fall.a && fall.b);
  EXPECT_NEAR(static_cast<double>(fall.a->summary.trusted), 200.0, 1.0);
  EXPECT_LE(fall.a->to_ns, fall.b->from_ns);
  EXPECT_NEAR(fall.difference, -15.0, 0.5);
  // So close that only the hour of both is left.
  EXPECT_TRUE(value(reader.compare("x", kStart + 1000 * kSecond, kStart + 1020 * kSecond)).empty());
}

TEST(Compare, TakesTheNearestStretchThatIsTrusted) {
  LoosenedMachine machine(4 * 3600, 1'000'000);
  auto reader = machine.reader();
  const auto differences = value(reader.compare("x", kStart + 1800 * kSecond, kStart + 2 * kDay));
  const auto& later = differences[1].b;
  ASSERT_TRUE(later);
  EXPECT_EQ(later->resolution, Resolution::hour);
  EXPECT_EQ(later->from_ns, kStart + 3 * kHour);
  const auto never = value(reader.compare("x", kStart + 1800 * kSecond, kStart + 30 * kDay));
  EXPECT_FALSE(never[1].b);
  EXPECT_TRUE(std::isnan(never[1].sigma));
}

TEST(Compare, LeavesOutFiguresThatAreOfAnotherTime) {
  const Folder folder;
  Store store = opened(folder.file());
  Batch batch;
  batch.axes = {{"x", 0.0}};
  for (int i = 0; i < 4 * 3600; ++i) {
    auto row = some_row(static_cast<std::uint64_t>(i));
    if (i < 2 * 3600) row[Watched::phase_margin] = {40.0, 1.0};  // then the controller changes
    batch.rows.push_back(record_of("x", kStart + i * kSecond, row));
  }
  value(store.commit(batch));
  keep_up(store, kStart + 4 * kHour + 300 * kSecond);
  auto reader = reader_of(folder.file());
  const auto differences = value(reader.compare("x", kStart + 1800 * kSecond, kStart + 3 * kHour));
  ASSERT_EQ(differences.size(), 3U);
  EXPECT_EQ(differences[2].figure, Watched::phase_margin);
  EXPECT_TRUE(differences[2].a);
  EXPECT_FALSE(differences[2].b) << "of an hour before";
  for (const auto& d : differences) {
    EXPECT_EQ(d.a->from_ns, differences[0].a->from_ns);
    EXPECT_EQ(d.b.has_value(), d.figure != Watched::phase_margin);
  }
  // Where no rows are, the nearest hour of all figures' counts.
  const auto later = value(reader.compare("x", kStart + 1800 * kSecond, kStart + kDay));
  ASSERT_EQ(later.size(), 3U);
  EXPECT_EQ(later[0].b->from_ns, kStart + 3 * kHour);
  EXPECT_FALSE(later[2].b);
}

TEST(Compare, TheChanceIsThatOfTheDifferenceWhereNothingChanged) {
  // 120 pairs of stretches of one machine: about 5 % lie beyond 1.96 standard deviations.
  LoosenedMachine machine(1200 * 61, 1'000'000);
  auto reader = machine.reader();
  int beyond = 0;
  for (int i = 0; i < 120; ++i) {
    const auto time = kStart + (300 + 600 * i) * kSecond;
    const auto differences = value(reader.compare("x", time, time + 600 * kSecond));
    beyond += differences[1].chance < 0.05 ? 1 : 0;
  }
  EXPECT_LE(beyond, 12);
}

}  // namespace
}  // namespace resonid::monitor::test
