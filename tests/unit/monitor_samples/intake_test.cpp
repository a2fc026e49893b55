// SPDX-License-Identifier: MIT
#include "monitor/samples/intake.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <limits>
#include <memory>
#include <resonid/base/error_text.hpp>
#include <stdexcept>

#include "../io/temporary_folder.hpp"

namespace resonid::monitor {
namespace {

using Outcome = Intake::Outcome;

const ColumnNames kNames = {"ru", "", "y", ""};
constexpr std::int64_t kStart_ns = 1'790'000'000'000'000'000;
constexpr std::int64_t kInterval_ns = 1'000'000;
constexpr std::uint64_t kRate_hz = 1000;

/// A sample that was stored.
struct Stored {
  std::uint64_t sample = 0;
  double excitation = 0.0, output = 0.0;
  std::int64_t time_ns = 0;
};

class IntakeTest : public ::testing::Test {
 protected:
  IntakeTest() { open(); }

  void open() {
    intake_.reset();
    ring_.reset();
    auto ring = Ring::open(folder_ / "x.ring", {"x", ring_channels(kNames), kRate_hz, 100'000});
    if (!ring) throw std::runtime_error(message_of(ring.error()));
    ring_ = std::move(*ring);
    ring_->set_read(ring_->end());
    intake_ = std::make_unique<Intake>(*ring_, kNames);
  }

  /// `count` samples whose output is `first`, `first` + 1 ...
  Outcome add(std::optional<std::uint64_t> first, std::size_t count, std::optional<std::int64_t> time_ns = {},
              const SourcePosition& position = {}) {
    std::vector<double> values;
    for (std::size_t k = 0; k < count; ++k) {
      const double y = static_cast<double>(first.value_or(counted_) + k);
      values.insert(values.end(), {y, -1.0, 2.0 * y});
    }
    counted_ += count;
    return add(values, first, time_ns, position);
  }
  Outcome add(const std::vector<double>& values, std::optional<std::uint64_t> first = {},
              std::optional<std::int64_t> time_ns = {}, const SourcePosition& position = {}) {
    static constexpr std::string_view kColumns[] = {"y", "temperature", "ru"};
    Arrival arrival{"x", first, time_ns, 0.0, kColumns, values, {}};
    arrival.sample_rate_hz = told_rate_hz_;
    arrival.ends = ends_;
    return intake_->add(arrival, position);
  }

  [[nodiscard]] std::vector<Stored> stored() const {
    std::vector<Stored> all;
    for (std::uint64_t position = ring_->begin(); position < ring_->end();) {
      const Piece piece = ring_->piece(position);
      for (std::size_t k = 0; k < piece.samples; ++k)
        all.push_back({piece.first_sample + k, piece.values[2 * k], piece.values[2 * k + 1],
                       piece.time_ns.value_or(0) + std::llround(piece.interval_ns * static_cast<double>(k))});
      position += piece.samples;
    }
    return all;
  }
  /// Every stored sample has its own value or is missing; their indices ascend.
  void expect_right(std::size_t missing = 0) const {
    std::size_t nans = 0;
    std::uint64_t next = 0;
    for (const Stored& s : stored()) {
      EXPECT_GE(s.sample, next);
      next = s.sample + 1;
      nans += std::isnan(s.output) ? 1U : 0U;
      if (std::isnan(s.output)) continue;
      EXPECT_EQ(s.output, static_cast<double>(s.sample));
      EXPECT_EQ(s.excitation, 2.0 * s.output);
    }
    EXPECT_EQ(nans, missing);
  }
  [[nodiscard]] std::uint64_t faults(Fault kind) const { return intake_->faults().count(kind); }
  [[nodiscard]] const SampleCounters& counters() const { return intake_->counters(); }
  static std::int64_t time_of(std::uint64_t sample) {
    return kStart_ns + static_cast<std::int64_t>(sample) * kInterval_ns;
  }

  test::TemporaryFolder folder_;
  std::unique_ptr<Ring> ring_;
  std::unique_ptr<Intake> intake_;
  double told_rate_hz_ = 0.0;
  std::vector<std::uint64_t> ends_;
  std::uint64_t counted_ = 0;
};

TEST_F(IntakeTest, MapsColumnsByNameAndIgnoresOthers) {
  EXPECT_EQ(ring_channels(kNames), (std::vector<std::string>{"excitation", "output"}));
  EXPECT_EQ(add({1.0, 2.0, 3.0, 4.0, 5.0, 6.0}), Outcome::taken);
  const auto all = stored();
  ASSERT_EQ(all.size(), 2U);
  EXPECT_EQ(all[0].excitation, 3.0);
  EXPECT_EQ(all[0].output, 1.0);
  EXPECT_EQ(all[1].excitation, 6.0);
  EXPECT_EQ(intake_->faults().total(), 0U);
}

TEST_F(IntakeTest, AMissingColumnAndAWrongRateAreNamedAndRefused) {
  const std::vector<double> values = {1.0, 2.0};
  const std::string_view columns[] = {"y", "speed"};
  EXPECT_EQ(intake_->add({"x", {}, {}, 0.0, columns, values, {}}), Outcome::refused);
  EXPECT_EQ(faults(Fault::columns), 1U);
  EXPECT_NE(intake_->faults().example(Fault::columns).find("no column 'ru'"), std::string::npos);
  told_rate_hz_ = 1002.0;
  EXPECT_EQ(add(0, 10), Outcome::refused);
  EXPECT_EQ(faults(Fault::rate), 1U);
  told_rate_hz_ = 1000.5;
  EXPECT_EQ(add(0, 10), Outcome::taken);
  told_rate_hz_ = std::nan("");
  EXPECT_EQ(add(10, 10), Outcome::refused);
  EXPECT_EQ(counters().lost, 21U);
  EXPECT_EQ(counters().samples, 10U);
}

TEST_F(IntakeTest, AColumnThatStandsTwiceIsRefused) {
  const std::string_view columns[] = {"ru", "y", "ru"};
  const double values[] = {1, 2, 3};
  EXPECT_EQ(intake_->add({"x", {}, {}, 0.0, columns, values, {}}), Outcome::refused);
  EXPECT_NE(intake_->refusal().find("several columns have the name 'ru'"), std::string::npos);
  told_rate_hz_ = 900.0;
  EXPECT_EQ(add(0, 10), Outcome::refused);
  EXPECT_NE(intake_->refusal().find("900 Hz"), std::string::npos);
  told_rate_hz_ = 0.0;
  EXPECT_EQ(add(0, 10), Outcome::taken);
  EXPECT_EQ(intake_->refusal(), "");
}

TEST_F(IntakeTest, WhatComesTwiceIsTakenOnce) {
  add(0, 100);
  EXPECT_EQ(add(0, 100), Outcome::duplicate);
  EXPECT_EQ(add(50, 100), Outcome::taken);  // half of it
  EXPECT_EQ(add(150, 10), Outcome::taken);
  EXPECT_EQ(counters().duplicate, 150U);
  EXPECT_EQ(counters().missing, 0U);
  EXPECT_EQ(faults(Fault::order), 0U);
  EXPECT_EQ(ring_->next_sample(), 160U);
  expect_right();
}

TEST_F(IntakeTest, GoesOnInARingThatWasMadeAnew) {
  EXPECT_EQ(add(0, 100), Outcome::taken);
  intake_.reset();
  ring_.reset();
  bool renewed = false;
  auto ring =
      Ring::open_or_renew(folder_ / "x.ring", {"x", ring_channels(kNames), kRate_hz, 50'000}, renewed);
  ASSERT_TRUE(ring && renewed);
  ring_ = std::move(*ring);
  intake_ = std::make_unique<Intake>(*ring_, kNames);
  EXPECT_EQ(add(50, 20), Outcome::duplicate);
  EXPECT_EQ(add(90, 30), Outcome::taken);
  EXPECT_EQ(counters().duplicate, 30U);
  EXPECT_EQ(ring_->next_sample(), 120U);
  EXPECT_EQ(stored().front().sample, 100U);
  expect_right();
}

TEST_F(IntakeTest, ShortGapsAreFilledAndLongOnesSkipped) {
  add(0, 100);
  add(1100, 10);  // a second
  EXPECT_EQ(ring_->end(), 1110U);
  add(2111, 10);  // more than a second
  EXPECT_EQ(ring_->end(), 1120U);
  EXPECT_EQ(ring_->next_sample(), 2121U);
  EXPECT_EQ(counters().missing, 2001U);
  EXPECT_EQ(counters().samples, 120U);
  expect_right(1000);
}

TEST_F(IntakeTest, ReversedMessagesAreLateNotDuplicate) {
  add(0, 10);
  add(20, 10);
  EXPECT_EQ(add(10, 10), Outcome::duplicate);
  EXPECT_EQ(add(5, 10), Outcome::duplicate);  // of which 5 are there
  EXPECT_EQ(counters().late, 15U);
  EXPECT_EQ(counters().duplicate, 5U);
  EXPECT_EQ(faults(Fault::order), 2U);
  add(30, 1);
  expect_right(10);
}

TEST_F(IntakeTest, ASenderMayBeginAnywhere) {
  add(1'000'000, 10, time_of(0));
  EXPECT_EQ(ring_->end(), 10U);
  EXPECT_EQ(counters().missing, 0U);
  EXPECT_EQ(intake_->next_for_sender(), 1'000'010U);
  EXPECT_EQ(stored()[3].time_ns, time_of(3));
  expect_right();
  EXPECT_EQ(add(std::uint64_t{1} << 63U, 1), Outcome::refused);
  EXPECT_EQ(faults(Fault::order), 1U);
}

TEST_F(IntakeTest, ASenderThatCountsFromTheBeginningGoesOnMonotonically) {
  for (std::uint64_t k = 0; k < 5000; k += 100) add(k, 100, time_of(k));
  EXPECT_EQ(add(0, 100, time_of(8000)), Outcome::taken);
  EXPECT_EQ(add(100, 100, time_of(8100)), Outcome::taken);
  EXPECT_EQ(faults(Fault::restart), 1U);
  EXPECT_EQ(faults(Fault::clock), 0U);
  EXPECT_EQ(ring_->next_sample(), 8200U);
  EXPECT_EQ(intake_->next_for_sender(), 200U);
  EXPECT_EQ(counters().missing, 3000U);
  EXPECT_EQ(stored()[5050].sample, 8050U);
  EXPECT_EQ(stored()[5050].output, 50.0);
  EXPECT_EQ(stored()[5050].time_ns, time_of(8050));
  open();  // the process ended, and knows how the sender counts
  EXPECT_EQ(add(150, 100, time_of(8150)), Outcome::taken);
  EXPECT_EQ(faults(Fault::restart), 0U);
  EXPECT_EQ(ring_->next_sample(), 8250U);
}

TEST_F(IntakeTest, ARestartOfASenderWithAnotherClockIsOne) {
  for (std::uint64_t k = 0; k < 5000; k += 100) add(k, 100, time_of(k));
  EXPECT_EQ(add(0, 100, 1'000'000'000), Outcome::taken);  // 1970: it has no battery
  EXPECT_EQ(faults(Fault::restart), 1U);
  EXPECT_GT(ring_->next_sample(), 6000U);
  const auto all = stored();
  for (std::size_t k = 1; k < all.size(); ++k) ASSERT_GT(all[k].time_ns, all[k - 1].time_ns) << k;
}

TEST_F(IntakeTest, ALongRepetitionIsNoRestart) {
  for (std::uint64_t k = 0; k < 30'000; k += 100) add(k, 100, time_of(k));
  for (std::uint64_t k = 0; k < 30'000; k += 100) EXPECT_EQ(add(k, 100, time_of(k)), Outcome::duplicate);
  EXPECT_EQ(faults(Fault::restart), 0U);
  EXPECT_EQ(counters().duplicate, 30'000U);
  EXPECT_EQ(add(30'000, 100, time_of(30'000)), Outcome::taken);
}

TEST_F(IntakeTest, WithoutTimesARestartIsNoticedAfterTenSeconds) {
  for (std::uint64_t k = 0; k < 20'000; k += 100) add(k, 100);
  std::uint64_t k = 0;
  while (add(k, 100) == Outcome::duplicate) k += 100;
  EXPECT_EQ(k, 10'000U);
  EXPECT_EQ(faults(Fault::restart), 1U);
  EXPECT_EQ(add(k + 100, 100), Outcome::taken);
  EXPECT_EQ(intake_->next_for_sender(), k + 200);
}

TEST_F(IntakeTest, ARestartInAFileOrStreamIsNoticedAfterTenSecondsOfNewMessages) {
  std::uint64_t place = 0;
  const auto send = [&](std::uint64_t k, std::uint64_t at) { return add(k, 100, {}, {{1, 2, 0, at}}); };
  for (std::uint64_t k = 0; k < 20'000; k += 100) send(k, ++place);
  open();  // killed, and all of it is given again
  for (std::uint64_t k = 0; k < 20'000; k += 100) EXPECT_EQ(send(k, k / 100 + 1), Outcome::duplicate);
  EXPECT_EQ(faults(Fault::restart), 0U);
  for (std::uint64_t k = 0; k < 5000; k += 100)  // written twice by the sender
    EXPECT_EQ(send(15'000 + k, ++place), Outcome::duplicate);
  EXPECT_EQ(send(20'000, ++place), Outcome::taken);
  EXPECT_EQ(faults(Fault::restart), 0U);
  std::uint64_t k = 0;
  while (k < 20'000 && send(k, ++place) == Outcome::duplicate) k += 100;
  EXPECT_EQ(k, 10'000U);
  EXPECT_EQ(faults(Fault::restart), 1U);
  EXPECT_EQ(send(k + 100, ++place), Outcome::taken);
  open();
  EXPECT_EQ(send(k + 100, place), Outcome::duplicate);
  EXPECT_EQ(send(k + 200, ++place), Outcome::taken);
  EXPECT_EQ(intake_->next_for_sender(), k + 300);
  EXPECT_EQ(faults(Fault::restart), 0U);
}

TEST_F(IntakeTest, OneWrongIndexIsLeftOutAndWhatFollowsIsTaken) {
  for (const bool timed : {false, true}) {
    const std::uint64_t begin = ring_->next_sample(), lost = counters().lost;
    const auto send = [&](std::uint64_t index, std::uint64_t due) {
      return add(index, 100, timed ? std::optional(time_of(due)) : std::nullopt);
    };
    for (std::uint64_t k = begin; k < begin + 2000; k += 100) {
      EXPECT_EQ(send(k, k), Outcome::taken);
      if (k % 400 == 0) {
        EXPECT_EQ(send(k + 1'000'000'000, k + 100), Outcome::refused);
      }
    }
    EXPECT_EQ(counters().lost - lost, 500U);
  }
  EXPECT_EQ(faults(Fault::order), 10U);
  EXPECT_NE(intake_->faults().example(Fault::order).find("where 3700 is due"), std::string::npos)
      << intake_->faults().example(Fault::order);
  EXPECT_EQ(counters().late + counters().missing + faults(Fault::restart), 0U);
  EXPECT_EQ(ring_->next_sample(), 4000U);
  expect_right();
}

TEST_F(IntakeTest, ALongGapIsBelievedWhereASecondMessageGoesOnFromIt) {
  add(0, 100);
  EXPECT_EQ(add(7'200'000, 100), Outcome::refused);
  EXPECT_EQ(add(7'200'120, 100), Outcome::taken);
  EXPECT_EQ(counters().missing, 7'199'920U);
  EXPECT_EQ(counters().lost, 0U);
  EXPECT_EQ(ring_->next_sample(), 7'200'220U);
  const std::uint64_t far = 100'000'000;  // a sender that waits until a message is taken
  EXPECT_EQ(add(far, 100), Outcome::refused);
  EXPECT_EQ(add(far, 100), Outcome::taken);
  EXPECT_EQ(add(far + 100, 100), Outcome::taken);
  EXPECT_EQ(add(2 * far, 100), Outcome::refused);
  EXPECT_EQ(add(3 * far, 100), Outcome::refused);  // two wrong ones do not confirm each other
  EXPECT_EQ(counters().lost, 100U);
  EXPECT_EQ(add(far + 200, 100), Outcome::taken);
  EXPECT_EQ(counters().lost, 200U);
  EXPECT_EQ(counters().duplicate, 0U);
  expect_right(20);
}

TEST_F(IntakeTest, ABacklogWithLongGapsLosesNothing) {
  std::uint64_t place = 0, samples = 0;
  const auto send = [&](std::uint64_t first) { return add(first, 100, {}, {{1, 2, 0, ++place}}); };
  for (std::uint64_t hour = 0; hour < 5; ++hour)
    for (std::uint64_t k = 0; k < 1000; k += 100, samples += 100)
      EXPECT_EQ(send(3'600'000 * hour + k), hour > 0 && k == 0 ? Outcome::refused : Outcome::taken);
  EXPECT_EQ(ring_->end(), samples);
  EXPECT_EQ(counters().samples, samples);
  EXPECT_EQ(counters().lost + counters().duplicate, 0U);
  EXPECT_EQ(ring_->source().word[3], place);
  expect_right();
}

TEST_F(IntakeTest, AMessageThatWaitsForAnotherIsGivenAgainAfterAKill) {
  const SourcePosition before{{1, 2, 0, 1}}, far{{1, 2, 0, 2}}, after{{1, 2, 0, 3}};
  EXPECT_EQ(add(0, 100, {}, before), Outcome::taken);
  EXPECT_EQ(add(7'200'000, 100, {}, far), Outcome::refused);
  intake_->reached(after);
  EXPECT_EQ(intake_->position(), before);
  open();
  EXPECT_EQ(add(7'200'000, 100, {}, far), Outcome::taken);
  EXPECT_EQ(intake_->position(), far);
  intake_->reached(after);
  EXPECT_EQ(intake_->position(), after);
  EXPECT_EQ(ring_->end(), 200U);
  expect_right();
}

/// As of a broker, which takes it for taken.
TEST_F(IntakeTest, AMessageThatWaitsForAnotherIsThereAfterAKillThoughItDoesNotComeAgain) {
  EXPECT_EQ(add(0, 100), Outcome::taken);
  EXPECT_EQ(add(7'200'000, 100), Outcome::refused);
  open();
  EXPECT_EQ(add(7'200'100, 100), Outcome::taken);
  EXPECT_EQ(ring_->end(), 300U);
  open();
  EXPECT_EQ(add(7'200'200, 100), Outcome::taken);
  EXPECT_EQ(ring_->end(), 400U);
  EXPECT_EQ(counters().lost, 0U);
  expect_right();
}

TEST_F(IntakeTest, OneWrongIndexBeforeAKillIsLeftOut) {
  EXPECT_EQ(add(0, 100), Outcome::taken);
  EXPECT_EQ(add(1'000'000'000, 100), Outcome::refused);
  open();
  EXPECT_EQ(add(100, 100), Outcome::taken);
  EXPECT_EQ(counters().lost, 100U);
  open();
  EXPECT_EQ(add(200, 100), Outcome::taken);
  EXPECT_EQ(counters().lost, 0U);
  EXPECT_EQ(ring_->end(), 300U);
  expect_right();
}

/// As from a file, which gives the line again.
TEST_F(IntakeTest, AWrongIndexThatIsGivenAgainAfterAKillDoesNotConfirmItself) {
  const SourcePosition before{{1, 2, 0, 1}}, far{{1, 2, 0, 2}}, after{{1, 2, 0, 3}};
  EXPECT_EQ(add(0, 100, time_of(0), before), Outcome::taken);
  EXPECT_EQ(add(1'000'000'000, 100, time_of(100), far), Outcome::refused);
  open();
  EXPECT_EQ(add(1'000'000'000, 100, time_of(100), far), Outcome::refused);
  EXPECT_EQ(add(200, 100, time_of(200), after), Outcome::taken);
  EXPECT_EQ(counters().lost, 100U);
  EXPECT_EQ(intake_->position(), after);
}

TEST_F(IntakeTest, WhatAClientSendsAgainSinceItWasRefusedIsTakenOnce) {
  add(0, 100);
  EXPECT_EQ(add(7'200'000, 100), Outcome::refused);
  EXPECT_EQ(intake_->next_for_sender(), 100U);  // the answer: it is to be sent again
  EXPECT_EQ(add(7'200'100, 100), Outcome::taken);
  EXPECT_EQ(add(7'200'000, 100), Outcome::duplicate);
  EXPECT_EQ(add(7'200'100, 100), Outcome::duplicate);
  EXPECT_EQ(intake_->next_for_sender(), 7'200'200U);
  EXPECT_EQ(counters().samples, 300U);
  EXPECT_EQ(counters().lost, 0U);
  expect_right();
}

TEST_F(IntakeTest, AMessageThatWaitsForAnotherKeepsItsColumns) {
  add(0, 100);
  EXPECT_EQ(add(7'200'000, 100), Outcome::refused);
  const std::string_view columns[] = {"ru", "y"};
  const double values[] = {14'400'200.0, 7'200'100.0};
  EXPECT_EQ(intake_->add({"x", std::uint64_t{7'200'100}, {}, 0.0, columns, values, {}}), Outcome::taken);
  EXPECT_EQ(ring_->end(), 201U);
  expect_right();
}

TEST_F(IntakeTest, AMessageThatWaitsForAnotherWaitsForRoomToo) {
  std::uint64_t k = 0;
  for (; ring_->room(1000 + 2 * kRate_hz, 1); k += 1000) ASSERT_EQ(add(k, 1000), Outcome::taken);
  EXPECT_EQ(add(7'200'000, 1000), Outcome::refused);
  EXPECT_EQ(add(7'201'000, 1000), Outcome::full);  // there is room for one of the two
  EXPECT_EQ(counters().samples, k + 1000);
  ring_->set_read(ring_->end());
  EXPECT_EQ(add(7'201'000, 1000), Outcome::taken);
  EXPECT_EQ(counters().samples, k + 2000);
  EXPECT_EQ(counters().lost + counters().duplicate, 0U);
}

TEST_F(IntakeTest, TheClockIsPutForwardAndNeverBack) {
  std::uint64_t k = 0;
  const auto go = [&](std::uint64_t samples, std::int64_t ahead_ns) {
    for (const std::uint64_t end = k + samples; k < end; k += 50)
      ASSERT_EQ(add(k, 50, time_of(k) + ahead_ns), Outcome::taken);
  };
  go(3000, 0);
  go(3000, 5'000'000'000);
  EXPECT_EQ(faults(Fault::clock), 1U);
  EXPECT_EQ(stored().back().time_ns, time_of(k - 1) + 5'000'000'000);
  go(3000, 2'000'000'000);
  EXPECT_EQ(faults(Fault::clock), 2U);
  go(30'000, 2'000'000'000);
  EXPECT_EQ(faults(Fault::clock), 2U);
  EXPECT_NEAR(static_cast<double>(stored().back().time_ns - time_of(k - 1)), 2e9,
              2e7);  // it has fallen into step
  const auto all = stored();
  for (std::size_t i = 1; i < all.size(); ++i) ASSERT_GT(all[i].time_ns, all[i - 1].time_ns) << i;
  EXPECT_EQ(counters().missing, 0U);
  expect_right();
}

TEST_F(IntakeTest, AClockThatFallsIntoStepGoesOnSoInTheNextProcess) {
  std::uint64_t k = 0;
  const auto go = [&](std::uint64_t samples, std::int64_t ahead_ns) {
    for (const std::uint64_t end = k + samples; k < end; k += 50)
      ASSERT_EQ(add(k, 50, time_of(k) + ahead_ns), Outcome::taken);
  };
  go(12'000, 3'000'000'000);  // more than the ten seconds after which it is planned anew
  go(3000, 0);
  const double slewing_ns = ring_->interval_ns();
  EXPECT_LT(slewing_ns, 0.8e6);
  open();
  go(3000, 0);
  EXPECT_EQ(ring_->interval_ns(), slewing_ns);
}

constexpr std::int64_t kHour_ns = 3'600'000'000'000, kYears_ns = 87'600 * kHour_ns;

TEST_F(IntakeTest, OneWrongTimeAmongGoodOnesChangesNothing) {
  for (const std::int64_t off_ns : {kYears_ns, kHour_ns, -kHour_ns, -kYears_ns, -60'000'000'000}) {
    const std::uint64_t begin = ring_->next_sample();
    const std::uint64_t told = faults(Fault::clock);
    for (std::uint64_t k = begin; k < begin + 8000; k += 50)
      ASSERT_EQ(add(k, 50, time_of(k) + (k == begin + 2000 ? off_ns : 0)), Outcome::taken);
    EXPECT_EQ(ring_->next_time_ns(), time_of(begin + 8000)) << off_ns;
    EXPECT_GT(faults(Fault::clock), told);
    open();  // and the next process knows nothing of it
  }
  const auto all = stored();
  for (const Stored& s : all) ASSERT_EQ(s.time_ns, time_of(s.sample)) << s.sample;
}

TEST_F(IntakeTest, AWrongTimeOfASenderThatCountsAnewMakesNoGapOfYears) {
  for (std::uint64_t k = 0; k < 5000; k += 100) add(k, 100, time_of(k));
  EXPECT_EQ(add(0, 100, time_of(5000) + kYears_ns), Outcome::taken);
  EXPECT_EQ(faults(Fault::restart), 1U);
  EXPECT_EQ(faults(Fault::clock), 1U);
  EXPECT_EQ(ring_->next_sample(), 5000U + 1001U + 100U);
  EXPECT_EQ(ring_->next_time_ns(), time_of(5000 + 1001 + 100));
}

TEST_F(IntakeTest, AJumpCountsOnceMessagesOfThreeSecondsConfirmIt) {
  std::uint64_t k = 0;
  for (; k < 2000; k += 50) add(k, 50, time_of(k));
  for (; k < 4950; k += 50) add(k, 50, time_of(k) + kHour_ns);
  EXPECT_EQ(ring_->next_time_ns(), time_of(k));
  for (; k < 6000; k += 50) add(k, 50, time_of(k) + kHour_ns);
  EXPECT_EQ(ring_->next_time_ns(), time_of(k) + kHour_ns);
  EXPECT_EQ(faults(Fault::clock), 1U);
  EXPECT_EQ(counters().missing, 0U);
}

TEST_F(IntakeTest, APauseUntilNowCountsAtOnce) {
  const auto now = std::chrono::duration_cast<std::chrono::nanoseconds>(
                       std::chrono::system_clock::now().time_since_epoch())
                       .count();
  for (std::uint64_t k = 0; k < 2000; k += 100)
    add({}, 100, now - 2 * kHour_ns + static_cast<std::int64_t>(k) * kInterval_ns);
  add({}, 100, now);
  EXPECT_EQ(stored().back().time_ns, now + 99 * kInterval_ns);
}

TEST_F(IntakeTest, ACountedGapCountsAtOnce) {
  for (std::uint64_t k = 0; k < 2000; k += 100) add(k, 100, time_of(k));
  const std::uint64_t later = 2000 + 7200 * kRate_hz;
  add(later, 100, time_of(later) + 6'000'000'000);  // within the tolerance of the rate
  EXPECT_EQ(stored().back().time_ns, time_of(later + 99) + 6'000'000'000);
}

TEST_F(IntakeTest, AClockThatWasFarAheadBeginsAnewPastAGap) {
  for (const std::int64_t ahead_ns : {kHour_ns, kYears_ns}) {
    const std::uint64_t begin = intake_->next_for_sender();
    std::uint64_t k = begin;
    for (; k < begin + 6000; k += 50) add(k, 50, time_of(k) + ahead_ns);
    EXPECT_EQ(ring_->next_time_ns(), time_of(k) + ahead_ns);
    open();
    const std::uint64_t before = ring_->next_sample();
    for (; k < begin + 12'000; k += 50) ASSERT_EQ(add(k, 50, time_of(k)), Outcome::taken);
    EXPECT_EQ(ring_->next_time_ns(), time_of(k));
    EXPECT_EQ(ring_->interval_ns(), 1e6);
    EXPECT_EQ(counters().missing, 1001U);
    EXPECT_EQ(ring_->next_sample(), before + 6000 + 1001);
    EXPECT_EQ(intake_->next_for_sender(), k);
    EXPECT_NE(intake_->faults().example(Fault::clock).find("begins anew"), std::string::npos);
  }
  // Among samples that follow one another it did not turn back.
  const auto all = stored();
  std::size_t back = 0;
  for (std::size_t i = 1; i < all.size(); ++i) {
    if (all[i].time_ns > all[i - 1].time_ns) continue;
    ++back;
    EXPECT_GT(all[i].sample, all[i - 1].sample + 1000);
  }
  EXPECT_EQ(back, 2U);
}

TEST_F(IntakeTest, ASenderThatHasLostItsClockDoesNotTakeTheTimeWithIt) {
  std::uint64_t k = 0;
  for (; k < 2000; k += 100) add(k, 100, time_of(k));
  for (; k < 20'000; k += 100) add(k, 100, static_cast<std::int64_t>(k) * kInterval_ns);  // 1970
  EXPECT_EQ(ring_->next_time_ns(), time_of(k));
  EXPECT_EQ(faults(Fault::clock), 1U);
}

TEST_F(IntakeTest, ADriftingClockIsFollowedWithoutAFault) {
  for (const double drift : {5e-4, -5e-4}) {
    const std::uint64_t begin = ring_->next_sample();
    const std::int64_t start = begin == 0 ? kStart_ns : *ring_->next_time_ns();
    std::uint64_t k = 0;
    for (; k < 600'000; k += 100) {
      const std::int64_t told = start + std::llround(static_cast<double>(k) * 1e6 * (1.0 + drift));
      ASSERT_EQ(add(begin + k, 100, told), Outcome::taken);
      ASSERT_NEAR(static_cast<double>(*ring_->next_time_ns() - told), 1e8, 1.1e8) << k;
      ring_->set_read(ring_->end());
    }
  }
  EXPECT_EQ(faults(Fault::clock), 0U);
}

TEST_F(IntakeTest, AWrongRateShowsInTheTimes) {
  for (std::uint64_t k = 0; k < 3000; k += 500)
    add(k, 500, kStart_ns + static_cast<std::int64_t>(k) * 2'000'000);
  EXPECT_GT(faults(Fault::clock), 0U);
  EXPECT_NE(intake_->faults().example(Fault::clock).find("its times tell 500 Hz, the axis has 1000 Hz"),
            std::string::npos)
      << intake_->faults().example(Fault::clock);
}

TEST_F(IntakeTest, ImpossibleTimesAreAFaultAndIgnored) {
  add(0, 10, time_of(0));
  for (const std::int64_t time : {std::numeric_limits<std::int64_t>::max(), std::int64_t{-5},
                                  std::numeric_limits<std::int64_t>::min() + 1})
    EXPECT_EQ(add(ring_->next_sample(), 10, time), Outcome::taken);
  EXPECT_EQ(faults(Fault::clock), 3U);
  EXPECT_EQ(stored().back().time_ns, time_of(39));
}

TEST_F(IntakeTest, ARateOnePerCentOffIsToldAfterAMinute) {
  const auto second = [&](std::int64_t k, double length) {
    add(static_cast<std::uint64_t>(1000 * k), 1000,
        kStart_ns + static_cast<std::int64_t>(1e9 * length * static_cast<double>(k)));
    ring_->set_read(ring_->end());
  };
  for (std::int64_t k = 0; k < 150; ++k) second(k, 1.0);
  EXPECT_EQ(faults(Fault::rate), 0U);
  for (std::int64_t k = 150; k < 300; ++k) second(k, 1.01);
  EXPECT_GE(faults(Fault::rate), 1U);
  EXPECT_NE(intake_->faults().example(Fault::rate).find("sample_rate_hz: the sender's times tell 990"),
            std::string::npos)
      << intake_->faults().example(Fault::rate);
}

TEST_F(IntakeTest, ValuesThatAreNotFiniteAreMissing) {
  const double nan = std::nan(""), inf = std::numeric_limits<double>::infinity();
  add({0, nan, 0, nan, 0, 2, inf, 0, 4, 3, 0, 6, 4, 0, -inf});  // y, temperature, ru
  EXPECT_EQ(counters().missing, 3U);
  EXPECT_EQ(counters().samples, 5U);
  EXPECT_EQ(faults(Fault::value), 2U);  // runs
  const auto all = stored();
  EXPECT_EQ(all[0].output, 0.0);  // the temperature is no channel
  EXPECT_TRUE(std::isnan(all[1].output) && all[1].excitation == 2.0);
  EXPECT_TRUE(std::isnan(all[2].output));
  EXPECT_TRUE(std::isnan(all[4].excitation) && all[4].output == 4.0);
}

TEST_F(IntakeTest, SamplesWithoutIndexAreConsecutiveAndTakenOncePerPosition) {
  EXPECT_EQ(add({}, 10, {}, {{1, 2, 5, 0}}), Outcome::taken);
  EXPECT_EQ(add({}, 10, {}, {{1, 2, 5, 0}}), Outcome::duplicate);
  EXPECT_EQ(add({}, 10, {}, {{1, 2, 4, 9}}), Outcome::duplicate);
  counted_ = 10;
  EXPECT_EQ(add({}, 10, {}, {{1, 2, 6, 0}}), Outcome::taken);
  open();
  EXPECT_EQ(add({}, 10, {}, {{1, 2, 6, 0}}), Outcome::duplicate);
  counted_ = 20;
  EXPECT_EQ(add({}, 10, {}, {{1, 3, 1, 0}}), Outcome::taken);  // another stream
  counted_ = 30;
  ends_ = {10, 20, 30, 40};
  EXPECT_EQ(add({}, 4, {}, {{9, 9, 0, 0}}), Outcome::taken);
  EXPECT_EQ(ring_->source(), (SourcePosition{{9, 9, 0, 40}}));
  ends_ = {30, 40, 50, 60};
  counted_ = 32;
  EXPECT_EQ(add({}, 4, {}, {{9, 9, 0, 0}}), Outcome::taken);  // two of them
  EXPECT_EQ(ring_->end(), 36U);
  expect_right();
}

TEST_F(IntakeTest, NothingIsCountedWhileTheRingIsFull) {
  std::uint64_t k = 0;
  while (add(k, 1000, time_of(k)) == Outcome::taken) k += 1000;
  EXPECT_EQ(k, 74'000U);
  EXPECT_EQ(add(0, 1000, time_of(90'000)), Outcome::full);
  EXPECT_EQ(counters().samples, 74'000U);
  EXPECT_EQ(intake_->faults().total(), 0U);
  ring_->set_read(2000);
  EXPECT_EQ(add(k, 1000, time_of(k)), Outcome::taken);
  EXPECT_EQ(add({}, 25'001), Outcome::refused);
  EXPECT_EQ(faults(Fault::size), 1U);
}

}  // namespace
}  // namespace resonid::monitor
