// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <golden.hpp>
#include <resonid/base/constants.hpp>
#include <resonid/online/excitation/chirp.hpp>

namespace resonid::online {
namespace {

TEST(Chirp, ReproducesTheGoldenRecord) {
  const auto ru = test::golden_column("b_chirp_sys2.csv", "ru");
  auto chirp = Chirp::create({500.0, 1.0, 35.0, 1.5, 17.0, Sweep::linear, false, 0.0}).value();
  ASSERT_EQ(chirp.length_samples(), ru.size());
  for (std::size_t k = 0; k < ru.size(); ++k) ASSERT_NEAR(chirp.step(), ru[k], 1e-8) << "sample " << k;
  EXPECT_EQ(chirp.step(), 0.0);
  EXPECT_EQ(chirp.frequency_hz(8.5), 18.25);
}

// The cycles between two times are the integral of the instantaneous frequency; here by Simpson's rule.
TEST(Chirp, PhaseIsTheIntegralOfTheFrequency) {
  for (const auto sweep : {Sweep::linear, Sweep::logarithmic})
    for (const auto& [from, to] : {std::pair{2.0, 80.0}, std::pair{80.0, 2.0}}) {
      auto chirp = Chirp::create({1000.0, 1.0, from, to, 5.0, sweep, false, 0.0}).value();
      double cycles = 0.0;
      for (int k = 0; k < 5000; ++k) {
        ASSERT_NEAR(chirp.step(), std::cos(kTwoPi * cycles), 1e-9) << "sample " << k;
        const double t = k * 1e-3;
        cycles +=
            1e-3 / 6.0 *
            (chirp.frequency_hz(t) + 4.0 * chirp.frequency_hz(t + 0.5e-3) + chirp.frequency_hz(t + 1e-3));
      }
      EXPECT_NEAR(chirp.frequency_hz(5.0), to, 1e-12);
      EXPECT_EQ(chirp.band().low_hz, 2.0);
      EXPECT_EQ(chirp.band().high_hz, 80.0);
    }
}

TEST(Chirp, RepeatsWhenAskedTo) {
  auto chirp = Chirp::create({100.0, 2.0, 1.0, 10.0, 1.0, Sweep::linear, true, 0.5}).value();
  std::vector<double> first(100);
  chirp.fill(first);
  EXPECT_DOUBLE_EQ(first[0], 2.0 * std::cos(0.5));
  for (int k = 0; k < 250; ++k) ASSERT_EQ(chirp.step(), first[static_cast<std::size_t>(k % 100)]);
  chirp.reset();
  EXPECT_EQ(chirp.step(), first[0]);
}

TEST(Chirp, RefusesWhatItCannotDo) {
  const auto field = [](double from, double to, double duration) {
    return Chirp::create({500.0, 1.0, from, to, duration, Sweep::linear, false, 0.0}).error().field;
  };
  EXPECT_EQ(field(250.0, 1.0, 1.0), "from_hz");
  EXPECT_EQ(field(1.0, 300.0, 1.0), "to_hz");
  EXPECT_EQ(field(-1.0, 30.0, 1.0), "from_hz");
  EXPECT_EQ(field(30.0, 30.0, 1.0), "to_hz");
  EXPECT_EQ(field(1.0, 30.0, 0.001), "duration_s");
}

}  // namespace
}  // namespace resonid::online
