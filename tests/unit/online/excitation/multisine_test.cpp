// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <complex>
#include <golden.hpp>
#include <resonid/online/excitation/multisine.hpp>
#include <vector>

namespace resonid::online {
namespace {

std::vector<double> lines(double first, double step, std::size_t count) {
  std::vector<double> f(count);
  for (std::size_t i = 0; i < count; ++i) f[i] = first + step * static_cast<double>(i);
  return f;
}

double crest_factor(const MultisineConfig& config, std::size_t samples) {
  auto multisine = Multisine<32>::create(config).value();
  std::vector<double> x(samples);
  multisine.fill(x);
  return measure(x).crest_factor;
}

// The record's phases are random; they are measured over 5000 samples (whole periods of all lines) and the
// generator must then give all 7500 samples to the nine digits of the file.
TEST(Multisine, ReproducesTheGoldenRecord) {
  const auto ru = test::golden_column("c_multisine_A.csv", "ru");
  const auto f = lines(2.9, 3.0, 8);
  std::vector<double> phases;
  for (const double line : f) {
    std::complex<double> sum = 0.0;
    for (std::size_t k = 0; k < 5000; ++k)
      sum += ru[k] * std::polar(1.0, -kTwoPi * line * 0.002 * static_cast<double>(k));
    phases.push_back(std::arg(sum));
  }
  const std::vector<double> amplitude{1.0};
  auto multisine = Multisine<8>::create({500.0, f, amplitude, Phases::given, phases, 1}).value();
  EXPECT_EQ(multisine.period_samples(), 5000U);
  for (std::size_t k = 0; k < ru.size(); ++k) ASSERT_NEAR(multisine.step(), ru[k], 1e-8) << "sample " << k;
}

// By an independent implementation (tests/golden/README.md): Schroeder k(k-1) 1.823, the printed linear
// phase -pi k/kmax 6.371, both at Ts = 0.5 ms.
TEST(Multisine, SchroederPhasesHaveALowCrestFactor) {
  const auto f = lines(20.0, 5.0, 21);
  const std::vector<double> amplitude{0.3};
  EXPECT_NEAR(crest_factor({2000.0, f, amplitude, Phases::schroeder, {}, 1, 0.0}, 400), 1.823, 5e-4);
  for (const double rate : {800.0, 1000.0, 2000.0, 2500.0, 10000.0, 100000.0})
    EXPECT_LT(
        crest_factor({rate, f, amplitude, Phases::schroeder, {}, 1}, static_cast<std::size_t>(rate / 5.0)),
        1.79)
        << rate << " Hz";
  std::vector<double> printed(21);
  for (std::size_t i = 0; i < 21; ++i) printed[i] = -kPi * static_cast<double>(i + 1) / 21.0;
  EXPECT_NEAR(crest_factor({2000.0, f, amplitude, Phases::given, printed, 1}, 400), 6.371, 5e-4);
}

TEST(Multisine, SchroederPhasesForUnequalPowers) {
  const auto f = lines(1.0, 1.0, 3);
  const std::vector<double> amplitude{1.0, 2.0, 1.0};
  std::vector<double> p(3);
  multisine_phases({100.0, f, amplitude, Phases::schroeder, {}, 1, 0.0}, p);
  EXPECT_NEAR(std::remainder(p[0], kTwoPi), 0.0, 1e-14);
  EXPECT_NEAR(std::remainder(p[1] + kTwoPi * (1.0 / 6.0), kTwoPi), 0.0, 1e-14);
  EXPECT_NEAR(std::remainder(p[2] + kTwoPi * (2.0 / 6.0 + 4.0 / 6.0), kTwoPi), 0.0, 1e-14);
}

// First outputs of SplitMix64 with seed 1234567: its author's test vector.
TEST(Multisine, RandomPhasesDependOnTheSeedAlone) {
  const auto f = lines(1.0, 1.0, 2);
  const std::vector<double> amplitude{1.0};
  std::vector<double> p(2);
  multisine_phases({100.0, f, amplitude, Phases::random, {}, 1234567}, p);
  EXPECT_NEAR(p[0], kTwoPi * 6457827717110365317.0 / 0x1p64, 1e-14);
  EXPECT_NEAR(p[1], kTwoPi * 3203168211198807973.0 / 0x1p64, 1e-14);
}

TEST(Multisine, RepeatsBitForBit) {
  const auto f = lines(20.0, 5.0, 21);
  const std::vector<double> amplitude{0.3};
  auto multisine = Multisine<21>::create({2000.0, f, amplitude, Phases::random, {}, 7}).value();
  ASSERT_EQ(multisine.period_samples(), 400U);
  std::vector<double> first(400);
  multisine.fill(first);
  for (int period = 0; period < 50; ++period)
    for (std::size_t k = 0; k < 400; ++k) ASSERT_EQ(multisine.step(), first[k]);
}

constexpr std::size_t kPeriodOf21 = 400;

Multisine<21> with_realisations(std::uint64_t seed, std::uint64_t periods) {
  const auto f = lines(20.0, 5.0, 21);
  const std::vector<double> amplitude{0.3};
  MultisineConfig c{2000.0, f, amplitude, Phases::random, {}, seed};
  c.periods_per_realisation = periods;
  return Multisine<21>::create(c).value();
}

TEST(Multisine, DrawsNewPhasesEveryFewPeriods) {
  auto multisine = with_realisations(7, 3);
  std::vector<std::vector<double>> first_periods;
  for (int realisation = 0; realisation < 4; ++realisation) {
    EXPECT_EQ(multisine.realisation(), static_cast<std::uint64_t>(realisation));
    std::vector<double> first(kPeriodOf21);
    multisine.fill(first);
    for (int repeat = 0; repeat < 2; ++repeat)
      for (std::size_t k = 0; k < kPeriodOf21; ++k) ASSERT_EQ(multisine.step(), first[k]);
    first_periods.push_back(std::move(first));
  }
  // The first is that of the constant phases; all have the same power and are no repetitions.
  auto constant = with_realisations(7, 0);
  for (const double x : first_periods[0]) ASSERT_EQ(constant.step(), x);
  const double energy = kPeriodOf21 * 21.0 * 0.3 * 0.3 / 2.0;
  for (std::size_t a = 0; a < 4; ++a)
    for (std::size_t b = a; b < 4; ++b) {
      double product = 0.0;
      for (std::size_t k = 0; k < kPeriodOf21; ++k) product += first_periods[a][k] * first_periods[b][k];
      if (a == b) EXPECT_NEAR(product / energy, 1.0, 1e-9);
      // mean of 21 cosines of random angles: standard deviation 1/sqrt(42)
      else
        EXPECT_LT(std::abs(product / energy), 4.0 / std::sqrt(42.0));
    }
}

TEST(Multisine, PhasesOfARealisationComeFromSeedAndItsNumber) {
  auto multisine = with_realisations(1234567, 1);
  for (std::size_t k = 0; k < kPeriodOf21; ++k) multisine.step();
  // The 22nd number of the seed's stream: each realisation takes one of its 21 numbers per line.
  SplitMix64 stream(1234567);
  for (int i = 0; i < 21; ++i) stream.next();
  for (std::size_t i = 0; i < 21; ++i) EXPECT_EQ(multisine.phase_rad(i), kTwoPi * stream.uniform());
}

TEST(Multisine, ResetRepeatsAllRealisationsBitForBit) {
  auto multisine = with_realisations(3, 2);
  std::vector<double> once(5 * 2 * kPeriodOf21 + 17);
  multisine.fill(once);
  multisine.reset();
  for (const double x : once) ASSERT_EQ(multisine.step(), x);
}

TEST(Multisine, RefusesRealisationsOfOtherThanRandomPhases) {
  const auto f = lines(20.0, 5.0, 3);
  const std::vector<double> amplitude{1.0};
  MultisineConfig c{2000.0, f, amplitude, Phases::schroeder, {}, 1};
  c.periods_per_realisation = 4;
  EXPECT_EQ(Multisine<4>::create(c).error().field, "periods_per_realisation");
  c.phases = Phases::random;
  EXPECT_TRUE(Multisine<4>::create(c));
  const std::vector<double> irrational{10.0 * std::sqrt(2.0)};
  c.frequency_hz = irrational;
  EXPECT_EQ(Multisine<4>::create(c).error().field, "periods_per_realisation");
}

// Without a common period the phase must still be exact after long runs: checked against the cosine of an
// exactly reduced argument, with a frequency of irrational ratio to the sample rate.
TEST(Multisine, DoesNotDriftWithoutACommonPeriod) {
  const double ratio = 0.1 * std::sqrt(2.0);
  const std::vector<double> f{1000.0 * ratio};
  const std::vector<double> amplitude{1.0};
  auto multisine = Multisine<1>::create({1000.0, f, amplitude, Phases::zero, {}, 1}).value();
  ASSERT_EQ(multisine.period_samples(), 0U);
  const std::uint64_t count = 3'000'000;
  double worst = 0.0;
  for (std::uint64_t k = 0; k < count; ++k) {
    const double value = multisine.step();
    if (k % 9973 != 0) continue;
    const long double cycles = static_cast<long double>(f[0] / 1000.0) * static_cast<long double>(k);
    const auto angle = static_cast<double>(cycles - std::floor(cycles)) * kTwoPi;
    worst = std::max(worst, std::abs(value - std::cos(angle)));
  }
  EXPECT_LT(worst, 1e-10);
}

TEST(Multisine, RefusesWhatItCannotDo) {
  const std::vector<double> one{1.0};
  const auto field = [&](const std::vector<double>& f, const std::vector<double>& amplitude) {
    return Multisine<4>::create({100.0, f, amplitude, Phases::zero, {}, 1}).error().field;
  };
  EXPECT_EQ(field({}, one), "lines_hz");
  EXPECT_EQ(field({50.0}, one), "lines_hz");
  EXPECT_EQ(field({2.0, 1.0}, one), "lines_hz");
  EXPECT_EQ(field({1.0, 2.0, 3.0, 4.0, 5.0}, one), "lines_hz");
  EXPECT_EQ(field({1.0, 2.0, 3.0}, {1.0, 2.0}), "amplitude");
  EXPECT_EQ(field({1.0}, {-1.0}), "amplitude");
  EXPECT_EQ(Multisine<4>::create({100.0, one, one, Phases::given, {}, 1}).error().field, "phase_rad");
}

}  // namespace
}  // namespace resonid::online
