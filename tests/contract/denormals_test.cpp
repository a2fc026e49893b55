// SPDX-License-Identifier: MIT
// With FlushDenormals no subnormal number is computed with, however long the silence after an excitation.
#include <gtest/gtest.h>

#include <limits>
#include <memory>
#include <resonid/base/flush_denormals.hpp>
#include <string>

#include "subject.hpp"

namespace resonid::test {
namespace {

float halved(float x) {
  volatile float operand = x;  // so that the processor does it, and now
  volatile float result = operand * 0.5F;
  return result;
}

TEST(FlushDenormals, LastsAsLongAsItLives) {
  constexpr float kSmallest = std::numeric_limits<float>::min();
  EXPECT_GT(halved(kSmallest), 0.0F);
  {
    const FlushDenormals flush;
#if defined(__SSE2__) || defined(__arm__) || defined(__aarch64__)
    EXPECT_EQ(halved(kSmallest), 0.0F);
#endif
  }
  EXPECT_GT(halved(kSmallest), 0.0F);
}

#if defined(__SSE2__)
constexpr unsigned kFlags = 0x3FU, kSubnormalOperand = 0x02U, kZeroForOperands = 0x40U;

/// Steps with nothing; whether any operand was subnormal.
bool meets_subnormals(Subject& subject, int samples) {
  _mm_setcsr(_mm_getcsr() & ~kFlags);
  for (int k = 0; k < samples; ++k) subject.step({0.0, 0.0, 0.0});
  return (_mm_getcsr() & kSubnormalOperand) != 0;
}

std::string name_of(const testing::TestParamInfo<Case>& info) { return info.param.name; }
class Denormals : public testing::TestWithParam<Case> {};
INSTANTIATE_TEST_SUITE_P(All, Denormals, testing::ValuesIn(cases()), name_of);

TEST_P(Denormals, AreNotMetInLongSilence) {
  // Physical trackers take a microsecond and more.
  const int samples = GetParam().family.starts_with("Physical") ? 100000 : 1000000;
  const auto subject = GetParam().make();
  const FlushDenormals flush;
  run(*subject, 0, 3000);
  // Operands as they are, so that the flag tells of any that results, memory or constants bring along.
  _mm_setcsr(_mm_getcsr() & ~kZeroForOperands);
  EXPECT_FALSE(meets_subnormals(*subject, samples));
}

TEST(DenormalsSuite, WouldMeetThemWithoutFlushing) {
  for (const Case& c : cases()) {
    if (c.name != "KalmanBankFloat" && c.name != "DiscreteFilterFloat") continue;
    const auto subject = c.make();
    run(*subject, 0, 3000);
    EXPECT_TRUE(meets_subnormals(*subject, 20000)) << c.name;
  }
}
#endif

}  // namespace
}  // namespace resonid::test
