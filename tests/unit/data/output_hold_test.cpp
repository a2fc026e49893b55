// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <resonid/base/constants.hpp>
#include <resonid/data/detail/output_hold.hpp>

namespace resonid::data {
namespace {

std::vector<double> wave(std::size_t samples) {
  std::vector<double> y;
  for (std::size_t k = 0; k < samples; ++k) y.push_back(std::sin(0.013 * static_cast<double>(k)));
  return y;
}

std::vector<double> held(const std::vector<double>& y, std::size_t n, std::size_t first) {
  std::vector<double> result;
  for (std::size_t k = 0; k < y.size(); ++k) result.push_back(y[k < first ? 0 : k - (k - first) % n]);
  return result;
}

TEST(OutputHold, IsFoundWithItsPhase) {
  for (const std::size_t n : {2, 3, 4, 10, 64})
    for (const std::size_t first : {std::size_t{0}, n / 2, n - 1}) {
      const auto hold = output_hold(held(wave(4000), n, first));
      EXPECT_EQ(hold.samples, n);
      EXPECT_EQ(hold.first, first);
      EXPECT_TRUE(hold.is_new(first) && hold.is_new(first + n));
      EXPECT_FALSE(hold.is_new(first + 1));
      EXPECT_TRUE(hold.stale(n + 1)[first == 0 ? 1 : 0]);
    }
}

TEST(OutputHold, IsNotFoundWhereValuesStayForAnotherReason) {
  EXPECT_EQ(output_hold(wave(4000)).samples, 1U);
  EXPECT_EQ(output_hold(std::vector<double>(4000, 1.0)).samples, 1U);  // stands
  EXPECT_TRUE(output_hold(wave(4000)).stale(10).empty());
  auto counts = wave(4000);  // a coarse encoder's
  for (double& y : counts) y = std::round(30.0 * y) / 30.0;
  EXPECT_EQ(output_hold(counts).samples, 1U);
  auto uneven = held(wave(4000), 4, 0);  // new a sample too late now and then
  for (std::size_t k = 40; k < uneven.size(); k += 40) uneven[k] = uneven[k - 1];
  EXPECT_EQ(output_hold(uneven).samples, 1U);
}

TEST(OutputHold, ItsResponseIsThatOfTheHeldWave) {
  // A line through the hold, by its Fourier coefficient over whole periods of both.
  constexpr std::size_t kSamples = 1200;
  constexpr double kCycles = 50.0, kStep = 0.001;
  for (const std::size_t n : {2, 3, 4}) {
    std::vector<double> y;
    for (std::size_t k = 0; k < kSamples; ++k)
      y.push_back(std::cos(kTwoPi * kCycles * static_cast<double>(k) / kSamples));
    const auto through = held(y, n, 0);
    std::complex<double> coefficient = 0.0;
    for (std::size_t k = 0; k < kSamples; ++k)
      coefficient += 2.0 / kSamples * through[k] *
                     std::polar(1.0, -kTwoPi * kCycles * static_cast<double>(k) / kSamples);
    const auto expected = OutputHold{n, 0}.response(kCycles / (kSamples * kStep), kStep);
    EXPECT_LT(std::abs(coefficient - expected), 1e-12);
  }
}

}  // namespace
}  // namespace resonid::data
