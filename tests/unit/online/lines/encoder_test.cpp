// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <resonid/online/lines/encoder.hpp>
#include <string>

namespace resonid::online {
namespace {

/// The encoder of 4000 counts per turn on a 16-bit counter, at 1 kHz.
EncoderConfig quadrature() {
  EncoderConfig c;
  c.sample_rate_hz = 1000.0;
  c.bits = 16;
  c.counts_per_turn = 4000;
  c.largest_velocity = 500.0;
  return c;
}

EncoderConfig absolute(std::uint64_t counts) {
  EncoderConfig c;
  c.sample_rate_hz = 1000.0;
  c.kind = EncoderKind::absolute_turn;
  c.bits = 20;
  c.counts_per_turn = counts;
  c.largest_velocity = 500.0;
  return c;
}

/// What a counter of `range` values (0: 2^64) shows at a position.
std::uint64_t shown(std::int64_t position, std::uint64_t range) {
  if (range == 0 || range > std::uint64_t{1} << 62U)
    return static_cast<std::uint64_t>(position) & (range - 1);
  const auto r = static_cast<std::int64_t>(range);
  const std::int64_t rest = position % r;
  return static_cast<std::uint64_t>(rest < 0 ? rest + r : rest);
}

TEST(EncoderVelocity, IsExactThroughManyWrapsBothWays) {
  ::setenv("RC_PARAMS", "seed=20260101 max_success=300", 0);
  EXPECT_TRUE(rc::check([] {
    EncoderConfig c = quadrature();
    c.bits = *rc::gen::inRange(8U, 65U);
    c.reversed = *rc::gen::arbitrary<bool>();
    const bool whole_turn = *rc::gen::arbitrary<bool>();
    if (whole_turn) c.kind = EncoderKind::absolute_turn;
    const auto room = c.bits >= 40 ? (std::uint64_t{1} << 40U) : (std::uint64_t{1} << c.bits);
    c.counts_per_turn = *rc::gen::inRange<std::uint64_t>(5, room + 1);
    const std::uint64_t range = whole_turn     ? c.counts_per_turn
                                : c.bits == 64 ? 0
                                               : std::uint64_t{1} << c.bits;
    const std::uint64_t half = range == 0 ? std::uint64_t{1} << 62U : range / 2;
    const auto most = static_cast<std::int64_t>(
        *rc::gen::inRange<std::uint64_t>(1, std::min<std::uint64_t>(half, std::uint64_t{1} << 40U)));
    const double per_count = c.travel_per_turn / static_cast<double>(c.counts_per_turn);
    c.largest_velocity = (static_cast<double>(most) - 0.5) * per_count * c.sample_rate_hz;
    auto encoder = EncoderVelocity<double>::create(c);
    RC_ASSERT(encoder.has_value());

    std::int64_t truth = *rc::gen::arbitrary<std::int32_t>();
    const std::int64_t start = truth;
    const auto first = shown(truth, range);
    encoder->step(first);
    const int steps = *rc::gen::inRange(1, 300);
    std::int64_t gap = 0;  // missing samples since the last one
    std::int64_t seen = truth;
    for (int k = 0; k < steps; ++k) {
      const auto move = *rc::gen::inRange<std::int64_t>(-most, most + 1);
      truth += move;
      const bool fits = static_cast<std::uint64_t>(most * (gap + 2)) < half;
      if (fits && *rc::gen::inRange(0, 4) == 0) {
        encoder->miss(1);
        ++gap;
        continue;
      }
      RC_ASSERT(encoder->step(shown(truth, range)));
      const std::int64_t sign = c.reversed ? -1 : 1;
      const std::int64_t origin = whole_turn ? static_cast<std::int64_t>(first) : 0;
      RC_ASSERT(encoder->position_counts() == sign * (truth - start + origin));
      const double expected = static_cast<double>(sign * (truth - seen)) / static_cast<double>(gap + 1) *
                              per_count * c.sample_rate_hz;
      RC_ASSERT(std::abs(encoder->velocity() - expected) <= 1e-12 * std::abs(expected));
      gap = 0;
      seen = truth;
    }
    RC_ASSERT(encoder->certain());
    RC_ASSERT(encoder->implausible_samples() == 0U);
  }));
}

TEST(EncoderVelocity, ACounterStartsAtZeroAndAnAbsoluteEncoderWhereItIs) {
  auto counter = *EncoderVelocity<double>::create(quadrature());
  counter.step(65530);
  EXPECT_EQ(counter.position_counts(), 0);
  EXPECT_TRUE(std::isnan(counter.velocity()));
  counter.step(4);  // over the end
  EXPECT_EQ(counter.position_counts(), 10);
  EXPECT_DOUBLE_EQ(counter.velocity(), 10.0 / 4000.0 * kTwoPi * 1000.0);
  EXPECT_DOUBLE_EQ(counter.position(), 10.0 / 4000.0 * kTwoPi);

  auto turn = *EncoderVelocity<double>::create(absolute(3600));
  turn.step(3595);
  EXPECT_EQ(turn.position_counts(), 3595);
  turn.step(5);
  EXPECT_EQ(turn.position_counts(), 3605);
  turn.step(3590);
  EXPECT_EQ(turn.position_counts(), 3590);
  EXPECT_LT(turn.velocity(), 0.0);
}

TEST(EncoderVelocity, AGapIsSpreadOverItsSamples) {
  auto e = *EncoderVelocity<double>::create(quadrature());
  e.step(0);
  e.step(7);
  e.miss(3);
  EXPECT_TRUE(std::isnan(e.velocity()));
  EXPECT_DOUBLE_EQ(e.last_velocity(), 7.0 * e.resolution());
  e.step(47);
  EXPECT_DOUBLE_EQ(e.velocity(), 10.0 * e.resolution());
  EXPECT_EQ(e.samples(), 6U);
  EXPECT_EQ(e.skipped_samples(), 3U);
}

TEST(EncoderVelocity, AJumpBeyondTheLargestVelocityIsMissingAndCounted) {
  auto e = *EncoderVelocity<double>::create(quadrature());  // 318.3 counts per sample at 500 rad/s
  e.step(100);
  e.step(110);
  EXPECT_FALSE(e.step(110 ^ 0x1000));  // a bit error
  EXPECT_TRUE(std::isnan(e.velocity()));
  EXPECT_EQ(e.position_counts(), 10);
  EXPECT_TRUE(e.step(130));
  EXPECT_DOUBLE_EQ(e.velocity(), 10.0 * e.resolution());
  EXPECT_EQ(e.position_counts(), 30);
  EXPECT_EQ(e.implausible_samples(), 1U);
  EXPECT_EQ(e.skipped_samples(), 1U);
  EXPECT_TRUE(e.step(130 + 319));
  EXPECT_FALSE(e.step(130 + 319 + 320));
  EXPECT_TRUE(e.certain());
}

TEST(EncoderVelocity, ACounterThatWasSetAnewIsFollowedAtLast) {
  auto e = *EncoderVelocity<double>::create(quadrature());
  e.step(0);
  int refused = 0;
  while (!e.step(10000)) ++refused;
  EXPECT_EQ(refused, 31);  // 32 samples of 319 counts are the first to allow 10000
  EXPECT_EQ(e.position_counts(), 10000);
}

TEST(EncoderVelocity, AGapOfHalfARangeLeavesThePositionUncertain) {
  auto e = *EncoderVelocity<double>::create(quadrature());
  e.step(0);
  e.miss(100);  // 101 * 319 counts < 2^15
  e.step(50);
  EXPECT_TRUE(e.certain());
  e.miss(102);
  e.step(60);
  EXPECT_FALSE(e.certain());
  e.set_position_counts(-5);
  EXPECT_TRUE(e.certain());
  e.step(61);
  EXPECT_EQ(e.position_counts(), -4);
  e.miss(~std::uint64_t{0});
  e.miss(5);
  EXPECT_TRUE(e.step(1000));
  EXPECT_FALSE(e.certain());
}

TEST(EncoderVelocity, FloatKeepsThePositionWithinATurnAfterMillionsOfTurns) {
  auto c = quadrature();
  c.bits = 64;
  auto e = *EncoderVelocity<float>::create(c);
  e.step(0);
  e.set_position_counts(std::int64_t{4000} * 5'000'000'000);
  EXPECT_TRUE(e.step(3));
  EXPECT_EQ(e.position_counts(), std::int64_t{4000} * 5'000'000'000 + 3);
  EXPECT_FLOAT_EQ(e.velocity(), 3.0F * e.resolution());
}

TEST(EncoderVelocity, AnAbsoluteValueOutsideTheTurnIsImplausible) {
  auto e = *EncoderVelocity<float>::create(absolute(3600));
  EXPECT_FALSE(e.step(3600));
  EXPECT_EQ(e.implausible_samples(), 1U);
  EXPECT_TRUE(e.step(3599));
  EXPECT_EQ(e.position_counts(), 3599);
}

TEST(EncoderVelocity, ResetReproduces) {
  auto e = *EncoderVelocity<double>::create(quadrature());
  e.step(5);
  e.step(9);
  e.miss(2);
  e.reset();
  EXPECT_EQ(e.samples() + e.skipped_samples(), 0U);
  e.step(500);
  e.step(499);
  EXPECT_EQ(e.position_counts(), -1);
}

TEST(EncoderVelocity, RefusesWhatCannotBe) {
  const auto field = [](const EncoderConfig& c) {
    const auto e = EncoderVelocity<double>::create(c);
    return std::string(e ? "none" : e.error().field.view());
  };
  auto c = quadrature();
  EXPECT_EQ(field(c), "none");
  c.bits = 7;
  EXPECT_EQ(field(c), "bits");
  c = quadrature();
  c.counts_per_turn = 0;
  EXPECT_EQ(field(c), "counts_per_turn");
  c = absolute((std::uint64_t{1} << 20U) + 1);
  EXPECT_EQ(field(c), "counts_per_turn");
  c = quadrature();
  c.bits = 8;  // 318 counts per sample
  EXPECT_EQ(field(c), "largest_velocity");
  c.largest_velocity = 0.0;
  EXPECT_EQ(field(c), "largest_velocity");
  c = quadrature();
  c.sample_rate_hz = NAN;
  EXPECT_EQ(field(c), "sample_rate_hz");
  c = quadrature();
  c.travel_per_turn = -1.0;
  EXPECT_EQ(field(c), "travel_per_turn");
}

}  // namespace
}  // namespace resonid::online
