// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <resonid/online/excitation/excitation.hpp>
#include <string>
#include <type_traits>
#include <vector>

namespace resonid::online {
namespace {

static_assert(std::is_trivially_copyable_v<Prbs> && std::is_trivially_copyable_v<Chirp>);
static_assert(std::is_trivially_copyable_v<Multisine<8>> && std::is_trivially_copyable_v<SteppedSine<8>>);

TEST(Metrics, OfASquareWaveAndOfSilence) {
  const std::vector<double> square{-2.0, 2.0, 2.0, -2.0};
  EXPECT_EQ(measure(square).rms, 2.0);
  EXPECT_EQ(measure(square).peak, 2.0);
  EXPECT_EQ(measure(square).crest_factor, 1.0);
  EXPECT_EQ(measure(std::vector<double>(3, 0.0)).crest_factor, 0.0);
}

ExcitationConfig config_of(Kind kind) {
  ExcitationConfig c;
  c.kind = kind;
  c.amplitude = 0.7;
  c.from_hz = 2.0;
  c.to_hz = 40.0;
  c.duration_s = 3.0;
  c.lines_hz.assign(std::vector{5.0, 10.0, 15.0});
  return c;
}

TEST(Excitation, RunsEveryKindLikeItsGenerator) {
  const double rate = 200.0;
  const std::vector<double> f{5.0, 10.0, 15.0};
  const std::vector<double> amplitude{0.7};
  auto prbs = Prbs::create({rate, 0.7, 10, 1, 1}).value();
  auto multisine = Multisine<3>::create({rate, f, amplitude, Phases::schroeder, {}, 1}).value();
  auto chirp = Chirp::create({rate, 0.7, 2.0, 40.0, 3.0, Sweep::linear, false, 0.0}).value();
  auto stepped = SteppedSine<3>::create({rate, f, 0.7, 5.0, 10.0}).value();
  const auto expect_same = [&](Kind kind, auto& generator, std::size_t length, std::size_t period) {
    auto excitation = Excitation::create(config_of(kind), rate).value();
    for (int k = 0; k < 1000; ++k) ASSERT_EQ(excitation.step(), generator.step());
    EXPECT_EQ(excitation.natural_length_samples(), length);
    EXPECT_EQ(excitation.period_samples(), period);
    EXPECT_EQ(excitation.band().high_hz, generator.band().high_hz);
  };
  expect_same(Kind::prbs, prbs, 1023, 1023);
  expect_same(Kind::multisine, multisine, 40, 40);
  expect_same(Kind::chirp, chirp, 600, 0);
  expect_same(Kind::stepped_sine, stepped, stepped.length_samples(), 0);
}

TEST(Excitation, NoneIsSilentAndEndless) {
  auto none = Excitation::create({}, 100.0).value();
  EXPECT_EQ(none.step(), 0.0);
  EXPECT_EQ(none.natural_length_samples(), 0U);
}

TEST(Excitation, NamesTheFieldThatIsWrong) {
  auto c = config_of(Kind::chirp);
  EXPECT_EQ(Excitation::create(c, 60.0).error().field, "to_hz");
  EXPECT_EQ(Excitation::create(c, 0.0).error().field, "sample_rate_hz");
  c = config_of(Kind::multisine);
  c.phases = Phases::given;
  EXPECT_EQ(Excitation::create(c, 60.0).error().field, "phases_rad");
  c.phases = Phases::zero;
  ASSERT_TRUE(c.phases_rad.assign(std::vector<double>{0.1}));
  EXPECT_EQ(Excitation::create(c, 60.0).error().field, "phases_rad");
  c = config_of(Kind::multisine);
  ASSERT_TRUE(c.line_amplitudes.assign(std::vector<double>(c.lines_hz.count + 1, 1.0)));
  EXPECT_EQ(Excitation::create(c, 60.0).error().field, "line_amplitudes");
  ASSERT_TRUE(c.line_amplitudes.assign(std::vector<double>(c.lines_hz.count, 0.0)));
  EXPECT_EQ(Excitation::create(c, 60.0).error().field, "line_amplitudes");
}

TEST(Excitation, TakesAmplitudeAndPhaseOfEachLine) {
  ExcitationConfig c;
  c.kind = Kind::multisine;
  c.amplitude = 2.0;
  ASSERT_TRUE(c.lines_hz.assign(std::vector<double>{1.0, 3.0}));
  ASSERT_TRUE(c.line_amplitudes.assign(std::vector<double>{0.5, 0.25}));
  c.phases = Phases::given;
  ASSERT_TRUE(c.phases_rad.assign(std::vector<double>{0.3, -1.2}));
  auto multisine = Excitation::create(c, 20.0).value();
  for (int k = 0; k < 40; ++k) {
    const double t = k / 20.0;
    EXPECT_NEAR(multisine.step(), std::cos(kTwoPi * t + 0.3) + 0.5 * std::cos(kTwoPi * 3.0 * t - 1.2), 1e-12);
  }
}

TEST(Excitation, DescribesTheFieldsOfItsKindOnly) {
  const auto fields = [](Kind kind) {
    std::string names;
    auto c = config_of(kind);
    describe([&](std::string_view name, auto&, std::string_view) { (names += name) += ' '; }, c);
    return names;
  };
  EXPECT_EQ(fields(Kind::none), "kind ");
  EXPECT_EQ(fields(Kind::prbs), "kind amplitude register_length clock_divider ");
  EXPECT_EQ(fields(Kind::chirp), "kind amplitude from_hz to_hz duration_s sweep repeat ");
}

}  // namespace
}  // namespace resonid::online
