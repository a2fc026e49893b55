// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <complex>
#include <cstdint>
#include <random>
#include <resonid/base/constants.hpp>
#include <resonid/online/lines/sliding_dft.hpp>
#include <span>
#include <string>
#include <vector>

namespace resonid::online {
namespace {

constexpr std::size_t kWindow = 400;

// Amplitude of bin k over the last N samples (`newest` is the number of the last one) by the definition, in
// long double; phase referred to sample 0. Hann weights are written in the time domain here.
std::complex<long double> exact_amplitude(const std::vector<long double>& last, std::uint64_t newest,
                                          std::size_t k, bool hann) {
  const auto n = static_cast<std::uint64_t>(last.size());
  const long double pi = 3.141592653589793238462643383279502884L;
  std::complex<long double> sum;
  for (std::uint64_t m = 0; m < n; ++m) {
    const std::uint64_t sample = newest + 1 - n + m;
    const long double angle =
        2.0L * pi * static_cast<long double>(k * (sample % n) % n) / static_cast<long double>(n);
    const long double weight =
        hann ? 1.0L - std::cos(2.0L * pi * static_cast<long double>(m) / static_cast<long double>(n)) : 1.0L;
    sum += weight * last[m] * std::complex<long double>(std::cos(angle), -std::sin(angle));
  }
  return sum * 2.0L / static_cast<long double>(n);
}

// White noise without heap or division: 1e8 samples take well under a second.
struct Noise {
  std::uint64_t state = 0x9e3779b97f4a7c15U;
  float next() {
    state ^= state << 13U;
    state ^= state >> 7U;
    state ^= state << 17U;
    return static_cast<float>(static_cast<std::int32_t>(state >> 32U)) * 0x1p-31F;
  }
};

template <class Scalar>
double error_after(std::uint64_t samples) {
  const std::array<double, 1> line{12.0};
  auto dft = SlidingDft<Scalar, 1, kWindow>::create(
                 {.sample_rate_hz = double(kWindow), .window_samples = kWindow, .frequency_hz = line})
                 .value();
  std::array<Scalar, kWindow> wave{};
  for (std::size_t m = 0; m < kWindow; ++m)
    wave[m] = static_cast<Scalar>(std::cos(kTwoPi * 12.0 * double(m) / double(kWindow)));
  Noise noise;
  std::vector<long double> last(kWindow);
  std::size_t m = 0;
  for (std::uint64_t k = 0; k < samples; ++k) {
    const Scalar x = wave[m] + static_cast<Scalar>(noise.next());
    if (++m == kWindow) m = 0;
    dft.step(x);
    if (k + kWindow >= samples) last[k + kWindow - samples] = x;
  }
  const auto truth = exact_amplitude(last, samples - 1, 12, false);
  const auto value = std::complex<long double>(dft.amplitude(0));
  return static_cast<double>(std::abs(value - truth) / std::abs(truth));
}

// docs/methods/sliding_dft.md: the floors of the sums' rounding.
TEST(SlidingDft, StaysExactOverHundredMillionSamples) {
  EXPECT_LT(error_after<float>(100000123), 1e-6);
  EXPECT_LT(error_after<double>(100000123), 1e-12);
}

TEST(SlidingDft, IsTheDftOfTheLastWindow) {
  const std::array<double, 4> lines{2.0, 5.0, 20.0, 31.0};
  for (const auto window : {DftWindow::rectangular, DftWindow::hann}) {
    auto dft = SlidingDft<double, 4, 64>::create(
                   {.sample_rate_hz = 64.0, .window_samples = 64, .frequency_hz = lines, .window = window})
                   .value();
    std::mt19937_64 generator(3);
    std::normal_distribution<double> normal;
    std::vector<long double> all(64, 0.0L);  // before the first sample there is nothing
    for (std::uint64_t k = 0; k < 300; ++k) {
      const double x = normal(generator);
      all.push_back(x);
      dft.step(x);
      if (k < 63 || k % 37 != 0) continue;
      const std::vector<long double> last(all.end() - 64, all.end());
      for (std::size_t i = 0; i < lines.size(); ++i) {
        const auto truth =
            exact_amplitude(last, k, static_cast<std::size_t>(lines[i]), window == DftWindow::hann);
        EXPECT_LT(std::abs(std::complex<long double>(dft.amplitude(i)) - truth), 1e-14L);
        const auto turn = std::polar(1.0L, 2.0L * 3.14159265358979323846L * lines[i] * k / 64.0L);
        EXPECT_LT(std::abs(std::complex<long double>(dft.phasor(i)) - truth * turn), 1e-13L);
      }
    }
  }
}

// Windows shorter than a block, of whole blocks and of blocks and a rest; before, at and after their ends.
TEST(SlidingDft, HoldsForEveryLengthOfTheWindow) {
  for (const std::size_t window : {3U, 4U, 15U, 16U, 17U, 31U, 33U, 48U, 61U}) {
    const std::array<double, 2> lines{1.0, static_cast<double>((window - 1) / 2)};
    const std::size_t count = window < 5 ? 1 : 2;
    auto dft = SlidingDft<double, 2, 64>::create({.sample_rate_hz = static_cast<double>(window),
                                                  .window_samples = window,
                                                  .frequency_hz = std::span(lines.data(), count)})
                   .value();
    Noise noise;
    std::vector<long double> all(window, 0.0L);
    for (std::uint64_t k = 0; k < 5 * window; ++k) {
      const double x = static_cast<double>(noise.next());
      all.push_back(x);
      dft.step(x);
      const std::vector<long double> last(all.end() - static_cast<std::ptrdiff_t>(window), all.end());
      for (std::size_t i = 0; i < count && k + 1 >= window; ++i) {
        const auto truth = exact_amplitude(last, k, static_cast<std::size_t>(lines[i]), false);
        ASSERT_LT(std::abs(std::complex<long double>(dft.amplitude(i)) - truth), 2e-15L)
            << window << " " << k;
      }
    }
  }
}

TEST(SlidingDft, AmplitudeIsThatOfTheSignal) {
  const std::array<double, 2> lines{12.5, 30.0};  // bins 5 and 12 of 200 samples at 500 Hz
  for (const auto window : {DftWindow::rectangular, DftWindow::hann}) {
    auto dft = SlidingDft<double, 2, 256>::create(
                   {.sample_rate_hz = 500.0, .window_samples = 200, .frequency_hz = lines, .window = window})
                   .value();
    for (int k = 0; k < 777; ++k)
      dft.step(5.0 + 0.7 * std::cos(kTwoPi * 12.5 * k / 500.0 + 1.1) +
               0.2 * std::cos(kTwoPi * 30.0 * k / 500.0));
    EXPECT_LT(std::abs(dft.amplitude(0) - std::polar(0.7, 1.1)), 1e-13);
    EXPECT_LT(std::abs(dft.amplitude(1) - 0.2), 1e-13);
    EXPECT_DOUBLE_EQ(dft.frequency_hz(0), 12.5);
  }
}

TEST(SlidingDft, NoiseGainIsMeasured) {
  const std::array<double, 1> line{10.0};
  for (const auto window : {DftWindow::rectangular, DftWindow::hann}) {
    auto dft = SlidingDft<double, 1, 100>::create(
                   {.sample_rate_hz = 100.0, .window_samples = 100, .frequency_hz = line, .window = window})
                   .value();
    double energy = 0.0;  // of the impulse response, whose square root the gain is
    for (int k = 0; k < 250; ++k) {
      dft.step(k == 0 ? 1.0 : 0.0);
      energy += std::norm(dft.phasor(0));
    }
    EXPECT_NEAR(dft.noise_gain(), std::sqrt(energy), 1e-12);
  }
}

TEST(SlidingDft, RefusesWhatCannotWork) {
  const auto field = [](double rate, std::size_t window, std::vector<double> lines, DftWindow shape) {
    const auto dft = SlidingDft<double, 2, 100>::create(
        {.sample_rate_hz = rate, .window_samples = window, .frequency_hz = lines, .window = shape});
    return dft ? std::string("accepted") : std::string(dft.error().field);
  };
  const auto rectangular = DftWindow::rectangular;
  EXPECT_EQ(field(100.0, 100, {1.0, 49.0}, rectangular), "accepted");
  EXPECT_EQ(field(0.0, 100, {1.0}, rectangular), "sample_rate_hz");
  EXPECT_EQ(field(100.0, 2, {10.0}, rectangular), "window_samples");
  EXPECT_EQ(field(100.0, 101, {10.0}, rectangular), "window_samples");
  EXPECT_EQ(field(100.0, 100, {}, rectangular), "frequency_hz");
  EXPECT_EQ(field(100.0, 100, {1.0, 2.0, 3.0}, rectangular), "frequency_hz");
  EXPECT_EQ(field(100.0, 100, {1.5}, rectangular), "frequency_hz");
  EXPECT_EQ(field(100.0, 100, {0.0}, rectangular), "frequency_hz");
  EXPECT_EQ(field(100.0, 100, {50.0}, rectangular), "frequency_hz");
  EXPECT_EQ(field(100.0, 100, {7.0, 7.0}, rectangular), "frequency_hz");
  EXPECT_EQ(field(100.0, 100, {1.0}, DftWindow::hann), "frequency_hz");
  EXPECT_EQ(field(100.0, 100, {2.0}, DftWindow::hann), "accepted");
}

}  // namespace
}  // namespace resonid::online
