// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <resonid/base/constants.hpp>
#include <response/spectra/fft.hpp>

namespace resonid::response {
namespace {

/// The defining sum, in long double.
std::complex<double> bin_of(const std::vector<double>& x, std::size_t k) {
  std::complex<long double> sum = 0.0L;
  for (std::size_t n = 0; n < x.size(); ++n) {
    const auto turns = static_cast<long double>(n * k % x.size()) / static_cast<long double>(x.size());
    sum += static_cast<long double>(x[n]) * std::polar(1.0L, -2.0L * std::numbers::pi_v<long double> * turns);
  }
  return {static_cast<double>(sum.real()), static_cast<double>(sum.imag())};
}

TEST(HalfSpectrum, AgreesWithItsDefinitionForAnyLength) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  for (const std::size_t length : {2U, 3U, 17U, 127U, 500U, 1000U, 2047U, 8191U}) {
    std::vector<double> x(length);
    for (auto& value : x) value = normal(random);
    const auto bins = half_spectrum(x);
    ASSERT_EQ(bins.size(), length / 2 + 1);
    const double scale = std::sqrt(static_cast<double>(length));
    for (std::size_t k = 0; k < bins.size(); k += 1 + bins.size() / 7)
      EXPECT_LT(std::abs(bins[k] - bin_of(x, k)), 1e-12 * scale) << "length " << length << ", bin " << k;
  }
}

/// One a million times as large as the other: neither leaves a trace in the other.
TEST(HalfSpectra, AreThoseOfEachSignal) {
  std::mt19937_64 random(2);
  std::normal_distribution<double> normal;
  for (const std::size_t length : {4U, 6U, 30U, 31U, 254U, 500U, 4096U}) {
    std::vector<double> a(length), b(length);
    for (auto& value : a) value = normal(random);
    for (auto& value : b) value = 1e6 * normal(random);
    const auto both = half_spectra(a, b);
    const double scale = std::sqrt(static_cast<double>(length));
    for (std::size_t k = 0; k <= length / 2; k += 1 + (length / 2 + 1) / 7) {
      EXPECT_LT(std::abs(both[0].at(k) - bin_of(a, k)), 1e-12 * scale)
          << "length " << length << ", bin " << k;
      EXPECT_LT(std::abs(both[1].at(k) - bin_of(b, k)), 1e-6 * scale) << "length " << length << ", bin " << k;
    }
    EXPECT_LT(std::abs(both[0].back() - bin_of(a, length / 2)), 1e-12 * scale) << length;
  }
}

TEST(HalfSpectrum, LongPrimePeriodOfAPrbsIsFast) {  // takes minutes when the length is taken as it is
  std::vector<double> x(131071, 0.0);
  x[1] = 1.0;
  const auto bins = half_spectrum(x);
  const double angle = -kTwoPi * 1000.0 / 131071.0;
  EXPECT_LT(std::abs(bins[1000] - std::polar(1.0, angle)), 1e-11);
}

TEST(FastLength, LosesFewSamples) {
  EXPECT_EQ(fast_length(8501), 8500U);
  EXPECT_EQ(fast_length(4096), 4096U);
}

}  // namespace
}  // namespace resonid::response
