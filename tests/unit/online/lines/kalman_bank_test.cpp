// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <golden.hpp>
#include <limits>
#include <resonid/base/constants.hpp>
#include <resonid/online/lines/kalman_bank.hpp>
#include <vector>

namespace resonid::online {
namespace {

constexpr std::array<double, 8> kLines{2.9, 5.9, 8.9, 11.9, 14.9, 17.9, 20.9, 23.9};
using Bank = KalmanBank<double, 8>;

Bank publication_iv() {
  return Bank::create({.sample_rate_hz = 500.0, .frequency_hz = kLines, .lambda = 100.0}).value();
}

TEST(KalmanBank, GainMeetsGolden) {
  const auto expected = test::golden_json("c_expected.json")["bank_gain_lam100"].get<std::vector<double>>();
  const Bank bank = publication_iv();
  EXPECT_NEAR(bank.offset_gain(), expected[0], 1e-12);
  for (std::size_t i = 0; i < kLines.size(); ++i) {
    EXPECT_NEAR(bank.gain(i).real(), expected[1 + 2 * i], 1e-12);
    EXPECT_NEAR(-bank.gain(i).imag(), expected[2 + 2 * i], 1e-12);  // the second state is -Im p
  }
}

// Example of Publication IV, eq. 17: amplitudes relative to the largest line of the signal, since lines that
// the signal does not hold decay towards 0.
// The golden values are one-step predictions: their amplitudes are the filtered ones of the sample before.
TEST(KalmanBank, MeetsGoldenAmplitudesAndOffset) {
  const auto expected = test::golden_json("c_eq17_expected.json");
  std::vector<double> lines;
  for (const double omega : expected["omega_over_pi"]) lines.push_back(omega / 2.0);
  const auto at = expected["k"].get<std::vector<std::size_t>>();
  for (const std::string variant : {"clean", "disturbed", "noisy"}) {
    Bank bank =
        Bank::create({.sample_rate_hz = 1000.0, .frequency_hz = lines, .lambda = expected["lam"]}).value();
    std::size_t next = 0;
    for (const double z : test::golden_column("c_eq17.csv", variant)) {
      bank.step(z);
      if (next == at.size() || bank.samples() != at[next]) continue;
      for (std::size_t i = 0; i < lines.size(); ++i)
        EXPECT_NEAR(std::abs(bank.phasor(i)), expected[variant]["amplitude"][next][i].get<double>(),
                    1e-6 * 1.7);
      EXPECT_NEAR(bank.offset(), expected[variant]["dc"][next].get<double>(), 1e-6 * 2.0);
      ++next;
    }
    EXPECT_EQ(next, at.size());
  }
}

// Times (1 + first z^-1 + second z^-2).
void multiply(std::vector<double>& polynomial, double first, double second) {
  polynomial.resize(polynomial.size() + 2);
  for (std::size_t i = polynomial.size(); i-- > 0;)
    polynomial[i] += (i > 0 ? first * polynomial[i - 1] : 0.0) + (i > 1 ? second * polynomial[i - 2] : 0.0);
}

// The innovation is A/P z with A the polynomial of the lines and P that of the observer poles: the impulse
// response of the innovation times P must be A, and nothing after it.
TEST(KalmanBank, PlacesThePoles) {
  const double radius = 0.95;
  for (const bool offset : {false, true}) {
    Bank bank = Bank::create({.sample_rate_hz = 500.0,
                              .frequency_hz = kLines,
                              .offset = offset,
                              .gain = GainRule::placed_poles,
                              .pole_radius = radius})
                    .value();
    std::vector<double> lines{1.0}, poles{1.0};
    for (const double f : kLines) {
      const double c = std::cos(kTwoPi * f / 500.0);
      multiply(lines, -2.0 * c, 1.0);
      multiply(poles, -2.0 * radius * c, radius * radius);
    }
    if (offset) {
      multiply(lines, -1.0, 0.0);
      multiply(poles, -radius, 0.0);
    }
    std::vector<double> innovation;
    for (std::size_t k = 0; k < 100; ++k) {
      bank.step(k == 0 ? 1.0 : 0.0);
      innovation.push_back(bank.innovation());
      double sum = 0.0;
      for (std::size_t i = 0; i <= std::min(k, poles.size() - 1); ++i) sum += poles[i] * innovation[k - i];
      // the coefficients of P go up to 1e4
      EXPECT_NEAR(sum, k < lines.size() ? lines[k] : 0.0, 1e-9) << k;
    }
  }
}

TEST(KalmanBank, AmplitudeIsThatOfTheSignal) {
  Bank bank = publication_iv();
  std::array<std::complex<double>, 8> amplitude;
  for (std::size_t i = 0; i < 8; ++i) amplitude[i] = std::polar(0.2 + 0.1 * double(i), 0.9 * double(i));
  for (std::size_t k = 0; k < 12000; ++k) {
    double z = -3.0;
    for (std::size_t i = 0; i < 8; ++i)
      z += (amplitude[i] * std::polar(1.0, kTwoPi * kLines[i] * static_cast<double>(k) / 500.0)).real();
    bank.step(z);
  }
  for (std::size_t i = 0; i < 8; ++i) EXPECT_LT(std::abs(bank.amplitude(i) - amplitude[i]), 1e-10);
  EXPECT_NEAR(bank.offset(), -3.0, 1e-10);
  EXPECT_NEAR(bank.innovation(), 0.0, 1e-10);
}

// One oscillator alone: each of its two predicted states has the variance 1/(2 lambda + 1) under white noise
// of variance 1 (solution of P = (A - KH) P (A - KH)' + KK'); filtering takes 1/(1 + lambda) of the newest
// sample into Re p. A single line lags by 2 lambda samples, one less than the predictor.
TEST(KalmanBank, NoiseGainAndLagOfASingleLine) {
  const std::array<double, 1> line{125.0};
  const double lambda = 100.0;
  const auto bank =
      Bank::create({.sample_rate_hz = 500.0, .frequency_hz = line, .offset = false, .lambda = lambda})
          .value();
  const double predicted = 1.0 / (2.0 * lambda + 1.0), weight = 1.0 / (1.0 + lambda);
  const double variance = predicted * (1.0 + (1.0 - weight) * (1.0 - weight)) + weight * weight;
  EXPECT_NEAR(bank.noise_gain(0), std::sqrt(variance), 1e-9);
  EXPECT_NEAR(bank.lag_samples(0), 2.0 * lambda, 1.0);
}

TEST(KalmanBank, SettlesWhenTheStartNoLongerMatters) {
  Bank bank = publication_iv();
  EXPECT_FALSE(bank.ready());
  // The worst history of peak value 1 for line 3: the sign of its response to it. After settling it may
  // matter by 0.01.
  std::vector<double> response;
  bank.step(1.0);
  const std::size_t settling = bank.settling_samples(3);
  for (std::size_t k = 0; k < 2 * settling; ++k) {
    bank.step(0.0);
    response.push_back(std::abs(bank.phasor(3)));
  }
  double rest = 0.0, longer_rest = 0.0;
  for (std::size_t k = settling - 1; k < response.size(); ++k) rest += response[k];
  for (std::size_t k = settling - 100; k < response.size(); ++k) longer_rest += response[k];
  EXPECT_LT(rest, 0.01);
  EXPECT_GT(longer_rest, 0.01);
  EXPECT_TRUE(bank.settled(3));
}

TEST(KalmanBank, SaysWhenItNeverSettles) {
  const std::array<double, 2> close{10.0, 10.0000001};  // beat period of 10^7 s: apart only on paper
  Bank bank = Bank::create({.sample_rate_hz = 500.0, .frequency_hz = close}).value();
  for (int k = 0; k < 100000; ++k) bank.step(1.0);
  EXPECT_EQ(bank.settling_samples(0), kNeverSettles);
  EXPECT_FALSE(bank.settled(0));
}

TEST(KalmanBank, RefusesWhatCannotWork) {
  const auto field = [](const KalmanBankConfig& config) {
    const auto bank = Bank::create(config);
    return bank ? std::string("accepted") : std::string(bank.error().field);
  };
  const std::array<double, 2> good{10.0, 20.0}, twice{10.0, 10.0}, nyquist{10.0, 250.0}, zero{0.0, 10.0};
  const std::array<double, 9> many{1, 2, 3, 4, 5, 6, 7, 8, 9};
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(field({.sample_rate_hz = 500.0, .frequency_hz = good}), "accepted");
  EXPECT_EQ(field({.sample_rate_hz = 0.0, .frequency_hz = good}), "sample_rate_hz");
  EXPECT_EQ(field({.sample_rate_hz = nan, .frequency_hz = good}), "sample_rate_hz");
  EXPECT_EQ(field({.sample_rate_hz = 500.0}), "frequency_hz");
  EXPECT_EQ(field({.sample_rate_hz = 500.0, .frequency_hz = many}), "frequency_hz");
  EXPECT_EQ(field({.sample_rate_hz = 500.0, .frequency_hz = twice}), "frequency_hz");
  EXPECT_EQ(field({.sample_rate_hz = 500.0, .frequency_hz = nyquist}), "frequency_hz");
  EXPECT_EQ(field({.sample_rate_hz = 500.0, .frequency_hz = zero}), "frequency_hz");
  EXPECT_EQ(field({.sample_rate_hz = 500.0, .frequency_hz = good, .lambda = -1.5}), "lambda");
  EXPECT_EQ(field({.sample_rate_hz = 500.0, .frequency_hz = good, .lambda = -1.4}), "accepted");
  EXPECT_EQ(field({.sample_rate_hz = 500.0, .frequency_hz = good, .lambda = nan}), "lambda");
  for (const double radius : {0.0, 1.0, nan})
    EXPECT_EQ(field({.sample_rate_hz = 500.0,
                     .frequency_hz = good,
                     .gain = GainRule::placed_poles,
                     .pole_radius = radius}),
              "pole_radius");
}

}  // namespace
}  // namespace resonid::online
