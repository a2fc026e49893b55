// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <golden.hpp>
#include <resonid/online/excitation/prbs.hpp>
#include <string>

namespace resonid::online {
namespace {

std::string signs(std::size_t cells, std::size_t count) {
  auto prbs = Prbs::create({500.0, 2.1, cells, 1, 1}).value();
  std::string text;
  for (std::size_t k = 0; k < count; ++k) text += prbs.step() > 0.0 ? '+' : '-';
  return text;
}

TEST(Prbs, ReproducesTheGoldenBits) {
  const auto golden = test::golden_json("f_expected.json");
  EXPECT_EQ(signs(7, 127), golden.at("prbs7").get<std::string>());
  EXPECT_EQ(signs(17, 200), golden.at("prbs17_first200").get<std::string>());
}

TEST(Prbs, ReproducesTheGoldenRecord) {
  const auto ru = test::golden_column("f_prbs_sys2.csv", "ru");
  std::uint32_t start = 0;  // the last cell comes out first
  for (std::size_t k = 0; k < 17; ++k) start = (start << 1) | (ru[k] > 0.0 ? 1U : 0U);
  auto prbs = Prbs::create({500.0, 2.1, 17, 1, start}).value();
  for (std::size_t k = 0; k < ru.size(); ++k) ASSERT_EQ(prbs.step(), ru[k]) << "sample " << k;
}

TEST(Prbs, GoldenTapsAndSum) {
  const auto golden = test::golden_json("f_expected.json");
  for (const std::size_t n : {std::size_t{7}, std::size_t{17}}) {
    std::uint32_t mask = 0;
    for (const auto& cell : golden.at("taps" + std::to_string(n))) mask |= 1U << (cell.get<unsigned>() - 1U);
    EXPECT_EQ(Prbs::taps(n), mask);
  }
  auto prbs = Prbs::create({500.0, 1.0, 17, 1, 1}).value();
  EXPECT_EQ(prbs.period_samples(), 131071U);
  double sum = 0.0;
  for (std::size_t k = 0; k < prbs.period_samples(); ++k) sum += prbs.step();
  EXPECT_EQ(sum, golden.at("prbs17_sum").get<double>());
}

// A maximum-length sequence passes through every register state but 0: any n successive bits that equal the
// first n mark the period.
TEST(Prbs, EveryRegisterLengthHasTheFullPeriod) {
  for (std::size_t n = Prbs::kMinRegister; n <= Prbs::kMaxRegister; ++n) {
    auto prbs = Prbs::create({1.0, 1.0, n, 1, 1}).value();
    const std::uint32_t all = (1U << n) - 1U;
    std::uint32_t window = 0;
    std::size_t repeats_at = 0;
    std::int64_t sum = 0;
    for (std::size_t k = 0; repeats_at == 0 && k < 2 * (std::size_t{1} << n); ++k) {
      const bool plus = prbs.step() > 0.0;
      window = ((window << 1) | (plus ? 1U : 0U)) & all;
      if (k < all) sum += plus ? 1 : -1;
      if (k >= n && window == 1U) repeats_at = k + 1 - n;  // the first n bits are 0 ... 0 1
    }
    EXPECT_EQ(repeats_at, all) << n << " cells";
    EXPECT_EQ(sum, 1) << n << " cells";
  }
}

TEST(Prbs, HoldsBitsForTheClockDivider) {
  auto fast = Prbs::create({500.0, 1.5, 5, 1, 1}).value();
  auto slow = Prbs::create({500.0, 1.5, 5, 3, 1}).value();
  EXPECT_EQ(slow.period_samples(), 93U);
  for (int bit = 0; bit < 62; ++bit) {
    const double value = fast.step();
    for (int i = 0; i < 3; ++i) ASSERT_EQ(slow.step(), value);
  }
  fast.step();
  fast.reset();
  EXPECT_EQ(fast.step(), -1.5);
}

TEST(Prbs, HalfThePowerIsLeftAtTheUpperBandLimit) {
  const auto prbs = Prbs::create({1000.0, 1.0, 10, 4, 1}).value();
  const double x = 3.14159265358979 * prbs.band().high_hz * 4.0 / 1000.0;
  EXPECT_NEAR(std::pow(std::sin(x) / x, 2), 0.5, 1e-5);
  EXPECT_NEAR(prbs.band().low_hz, 1000.0 / (4.0 * 1023.0), 1e-12);
}

TEST(Prbs, RefusesWhatItCannotDo) {
  EXPECT_EQ(Prbs::create({500.0, 1.0, 25, 1, 1}).error().field, "register_length");
  EXPECT_EQ(Prbs::create({500.0, 1.0, 1, 1, 1}).error().field, "register_length");
  EXPECT_EQ(Prbs::create({500.0, 1.0, 7, 0, 1}).error().field, "clock_divider");
  EXPECT_EQ(Prbs::create({500.0, 0.0, 7, 1, 1}).error().field, "amplitude");
  EXPECT_EQ(Prbs::create({500.0, 1.0, 7, 1, 0}).error().field, "start_state");
  EXPECT_EQ(Prbs::create({500.0, 1.0, 7, 1, 128}).error().field, "start_state");
  EXPECT_EQ(Prbs::create({0.0, 1.0, 7, 1, 1}).error().field, "sample_rate_hz");
}

}  // namespace
}  // namespace resonid::online
