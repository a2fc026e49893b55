// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <resonid/online/excitation/stepped_sine.hpp>
#include <vector>

namespace resonid::online {
namespace {

TEST(SteppedSine, SettlesThenMeasuresEachFrequency) {
  const std::vector<double> f{50.0, 10.0};
  auto stepped = SteppedSine<4>::create({1000.0, f, 2.0, 1.5, 3.0}).value();
  ASSERT_EQ(stepped.length_samples(), 30U + 60U + 150U + 300U);
  std::vector<std::size_t> measured(2, 0);
  for (std::size_t k = 0; k < stepped.length_samples(); ++k) {
    stepped.step();
    EXPECT_EQ(stepped.line(), k < 90 ? 0U : 1U) << "sample " << k;
    if (stepped.measuring()) ++measured[stepped.line()];
    EXPECT_EQ(stepped.measuring(), (k >= 30 && k < 90) || k >= 240) << "sample " << k;
    EXPECT_FALSE(stepped.done());
  }
  EXPECT_EQ(measured, (std::vector<std::size_t>{60, 300}));
  EXPECT_EQ(stepped.step(), 0.0);
  EXPECT_TRUE(stepped.done());
  EXPECT_FALSE(stepped.measuring());
}

TEST(SteppedSine, PhaseContinuesOverTheChange) {
  const std::vector<double> f{31.0, 17.0, 47.0};
  auto stepped = SteppedSine<3>::create({1000.0, f, 1.0, 0.3, 1.0}).value();
  double cycles = 0.0;
  while (true) {
    const double value = stepped.step();
    if (stepped.done()) break;
    ASSERT_NEAR(value, std::cos(kTwoPi * cycles), 1e-12);
    cycles += f[stepped.line()] / 1000.0;
  }
  stepped.reset();
  EXPECT_EQ(stepped.step(), 1.0);
  EXPECT_EQ(stepped.line(), 0U);
}

TEST(SteppedSine, RefusesWhatItCannotDo) {
  const auto field = [](const std::vector<double>& f, double settle, double measure) {
    return SteppedSine<2>::create({100.0, f, 1.0, settle, measure}).error().field;
  };
  EXPECT_EQ(field({}, 1.0, 1.0), "lines_hz");
  EXPECT_EQ(field({1.0, 2.0, 3.0}, 1.0, 1.0), "lines_hz");
  EXPECT_EQ(field({50.0}, 1.0, 1.0), "lines_hz");
  EXPECT_EQ(field({1e-300}, 1.0, 1.0), "lines_hz");
  EXPECT_EQ(field({1.0}, -1.0, 1.0), "settle_periods");
  EXPECT_EQ(field({1.0}, 1.0, 0.5), "measure_periods");
}

}  // namespace
}  // namespace resonid::online
