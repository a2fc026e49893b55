// SPDX-License-Identifier: MIT
// What holds for every estimator and generator alike (docs/realtime.md).
#include <gtest/gtest.h>

#include <algorithm>
#include <allocation_counter.hpp>
#include <cmath>
#include <iterator>
#include <limits>
#include <memory>
#include <mutex>
#include <sanitized.hpp>
#include <vector>

#include "lock_counter.hpp"
#include "subject.hpp"

namespace resonid::test {

namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinite = std::numeric_limits<double>::infinity();

class Contract : public testing::TestWithParam<Case> {
 protected:
  static std::unique_ptr<Subject> fresh() { return GetParam().make(); }

  /// Finite is what would have been without the disturbance.
  static void expect_finite(const Subject& disturbed, const Subject& undisturbed) {
    Answers left, right;
    disturbed.observe(left);
    undisturbed.observe(right);
    ASSERT_EQ(left.all().size(), right.all().size());
    for (std::size_t i = 0; i < right.all().size(); ++i)
      EXPECT_GE(std::isfinite(left.all()[i]), std::isfinite(right.all()[i])) << "answer " << i;
  }
  /// And figures are back.
  static void expect_recovered(const Subject& disturbed, const Subject& undisturbed, double bound) {
    expect_finite(disturbed, undisturbed);
    Answers left, right;
    disturbed.observe(left);
    undisturbed.observe(right);
    double size = 0.0;
    for (const double x : right.figures()) size = std::max(size, std::abs(x));
    for (std::size_t i = 0; i < right.figures().size(); ++i)
      EXPECT_NEAR(left.figures()[i], right.figures()[i], bound * size) << "figure " << i;
  }
};

std::string name_of(const testing::TestParamInfo<Case>& info) { return info.param.name; }
INSTANTIATE_TEST_SUITE_P(All, Contract, testing::ValuesIn(cases()), name_of);

template <class Predicate>
std::vector<Case> cases_that(Predicate&& predicate) {
  std::vector<Case> chosen;
  std::copy_if(cases().begin(), cases().end(), std::back_inserter(chosen), predicate);
  return chosen;
}

/// All but the generators.
class SampleContract : public Contract {};
INSTANTIATE_TEST_SUITE_P(All, SampleContract,
                         testing::ValuesIn(cases_that([](const Case& c) { return c.arguments != 0; })),
                         name_of);

/// Of these, all but a filter without a notion of time and a detector that takes values, not samples.
class MissContract : public Contract {};
INSTANTIATE_TEST_SUITE_P(All, MissContract, testing::ValuesIn(cases_that([](const Case& c) {
                           return c.arguments != 0 && c.family != "DiscreteFilter" &&
                                  c.family != "ChangeDetector";
                         })),
                         name_of);

TEST_P(Contract, IsCreatedWithoutHeap) {
  GetParam().heap_of_create();  // statics of the suite
  EXPECT_EQ(GetParam().heap_of_create(), 0U);
}

TEST_P(Contract, StepsAnswersAndResetsWithoutHeapOrLocks) {
  const auto subject = fresh();
  const auto other = fresh();
  run(*subject, 0, 2);  // statics of the suite
  const std::size_t heap = allocations(), lock = locks();
  run(*subject, 2, 3000);
  subject->miss(5);
  subject->step({kNan, kInfinite, kNan});
  std::ranges::copy(subject->bytes(), other->bytes().begin());
  subject->reset();
  run(*other, 3000, 3200);
  EXPECT_EQ(allocations(), heap);
  EXPECT_EQ(locks(), lock);
}

TEST_P(Contract, ResetReproducesBitForBit) {
  const auto subject = fresh();
  const std::uint64_t first = run(*subject, 0, 2999);
  EXPECT_NE(run(*subject, 0, 2999), first);  // it remembers something
  subject->reset();
  EXPECT_EQ(subject->skipped(), 0U);
  EXPECT_EQ(run(*subject, 0, 2999), first);
}

TEST_P(SampleContract, SamplesThatAreNotFiniteAreSkippedAndCounted) {
  constexpr std::size_t kEnd = 2 * kPeriod;
  const auto undisturbed = fresh();
  run(*undisturbed, 0, kEnd);
  EXPECT_EQ(undisturbed->skipped(), 0U);
  for (std::size_t argument = 0; argument < 3; ++argument) {
    for (const double bad : {kNan, kInfinite, -kInfinite}) {
      SCOPED_TRACE(testing::Message() << "argument " << argument << " is " << bad);
      const auto disturbed = fresh();
      std::uint64_t spoiled = 0;
      for (std::size_t k = 0; k < kEnd; ++k) {
        Sample s = record(k);
        const bool spoil =
            k < 3 || k == 1000 || (k >= 2000 && k < 2050) || (k > 4000 && k < 5000 && k % 7 == 0);
        if (spoil) s[argument] = bad;
        if (spoil && (GetParam().arguments >> argument & 1U) != 0) ++spoiled;
        disturbed->step(s);
      }
      EXPECT_EQ(disturbed->skipped(), spoiled);
      expect_recovered(*disturbed, *undisturbed, GetParam().recovered);
    }
  }
}

TEST_P(SampleContract, RunsOfNothingButMissingSamplesLeaveItFinite) {
  const auto subject = fresh();
  run(*subject, 0, 1000);
  for (int k = 0; k < 3000; ++k) subject->step({kNan, kNan, kNan});
  Answers answers;
  subject->observe(answers);
  for (std::size_t i = 0; i < answers.figures().size(); ++i)
    EXPECT_TRUE(std::isfinite(answers.figures()[i])) << "figure " << i;
}

TEST_P(MissContract, IsAsManySamplesThatAreNotFinite) {
  for (const std::uint64_t count : {std::uint64_t{1}, std::uint64_t{7}, std::uint64_t{700}}) {
    const auto stepped = fresh(), told = fresh();
    run(*stepped, 0, 1500);
    run(*told, 0, 1500);
    ASSERT_TRUE(told->miss(count));
    for (std::uint64_t k = 0; k < count; ++k) stepped->step({kNan, kNan, kNan});
    EXPECT_EQ(told->skipped(), stepped->skipped());
    run(*stepped, 1500 + count, 1500 + kPeriod);
    run(*told, 1500 + count, 1500 + kPeriod);
    expect_recovered(*told, *stepped, std::max(1e-3, GetParam().recovered));
  }
}

TEST_P(SampleContract, ASpikeDoesNotPoisonForEver) {
  const auto undisturbed = fresh();
  run(*undisturbed, 0, 5 * kPeriod);
  for (std::size_t argument = 0; argument < 3; ++argument) {
    SCOPED_TRACE(testing::Message() << "argument " << argument);
    const auto disturbed = fresh();
    run(*disturbed, 0, 1000);
    Sample s = record(1000);
    s[argument] = GetParam().spike;
    disturbed->step(s);
    run(*disturbed, 1001, 5 * kPeriod);
    if (GetParam().forgets)
      expect_recovered(*disturbed, *undisturbed, std::max(0.02, GetParam().recovered));
    else
      expect_finite(*disturbed, *undisturbed);
  }
}

TEST_P(SampleContract, TinySignalsLeaveItFinite) {
  const double tiny = GetParam().single ? 1e-30 : 1e-200;
  const auto subject = fresh();
  for (std::size_t k = 0; k < kPeriod; ++k) {
    Sample s = record(k);
    for (double& x : s) x *= tiny;
    subject->step(s);
  }
  const auto undisturbed = fresh();
  run(*undisturbed, 0, 4 * kPeriod);
  run(*subject, kPeriod, 4 * kPeriod);
  if (GetParam().forgets)
    expect_recovered(*subject, *undisturbed, std::max(0.02, GetParam().recovered));
  else
    expect_finite(*subject, *undisturbed);
}

TEST(ContractSuite, CountsHeapAndLocks) {
  if (RESONID_SANITIZED) GTEST_SKIP() << "the sanitizer's heap and locks";
  std::size_t before = allocations();
  const auto memory = std::make_unique<int>(1);
  EXPECT_GT(allocations(), before);
  before = allocations();
  void* volatile raw = std::malloc(static_cast<std::size_t>(*memory));  // volatile: not to be left out
  std::free(raw);
  EXPECT_GT(allocations(), before);
  before = locks();
  std::mutex mutex;
  const std::lock_guard<std::mutex> guard(mutex);
  EXPECT_GT(locks(), before);
}

}  // namespace
}  // namespace resonid::test
