// SPDX-License-Identifier: MIT
// What stands between two lines, against the analytic response of a mode.
#include "design/between_lines.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <resonid/base/constants.hpp>

namespace resonid::design {
namespace {

using Complex = std::complex<double>;

/// A mode at 50 Hz, 1 Hz wide to 3 dB, and a delay.
Complex mode(double f, double delay_s = 0.0) {
  constexpr double kHalfWidth_hz = 0.5;
  return 1.0 / Complex(1.0, (f - 50.0) / kHalfWidth_hz) * std::polar(1.0, -kTwoPi * f * delay_s);
}

FilledLines filled(const std::vector<double>& frequencies_hz, const std::function<Complex(double)>& response,
                   double known_delay_s = 0.0, double relative_radius = 0.0) {
  std::vector<Complex> values;
  std::vector<double> radii;
  for (const double f : frequencies_hz) {
    values.push_back(response(f));
    radii.push_back(relative_radius * std::abs(values.back()));
  }
  return between_lines(frequencies_hz, values, radii, known_delay_s);
}

double largest(const FilledLines& lines) {
  double most = 0.0;
  for (const auto& value : lines.values) most = std::max(most, std::abs(value));
  return most;
}

TEST(BetweenLines, GoAlongTheModeWhosePhaseFalls) {
  const std::vector<double> f{10.0, 20.0, 30.0, 40.0, 49.6, 50.05, 60.0, 70.0, 80.0, 90.0};
  const auto lines = filled(f, [](double x) { return mode(x); });
  ASSERT_GT(lines.values.size(), f.size());
  for (std::size_t i = 0; i < lines.values.size(); ++i) {
    if (lines.frequencies_hz[i] < f[4] || lines.frequencies_hz[i] > f[5]) continue;  // it falls by 45 deg
    EXPECT_NEAR(std::abs(lines.values[i] - mode(lines.frequencies_hz[i])), 0.0, 1e-9);
  }
}

TEST(BetweenLines, TellTheHeightOfAPeakThatNoLineStandsAt) {
  const auto height = [](const std::vector<double>& f, double delay_s, bool known) {
    return largest(filled(
        f, [&](double x) { return mode(x, delay_s); }, known ? delay_s : 0.0));
  };
  for (const double delay_s : {0.0, 4e-3, 12e-3})
    for (const double beside : {47.0, 48.5, 49.3}) {  // 41, 20 and 10 deg are left of half a turn
      const std::vector<double> f{30.0, 38.0, beside, 100.5 - beside, 62.0, 70.0, 78.0};
      EXPECT_GT(height(f, delay_s, false), 0.9) << beside << " " << delay_s;
      EXPECT_GT(height(f, delay_s, true), 0.9) << beside << " " << delay_s;
      EXPECT_LT(height(f, delay_s, true), 3.0) << beside << " " << delay_s;
    }
}

/// Lines far below the mode turn by a lag, more than it turns there.
TEST(BetweenLines, TakeNoLagOffAFall) {
  constexpr double kLag_s = 0.012;
  const auto lagging = [](double f) { return mode(f) / Complex(1.0, kTwoPi * f * kLag_s); };
  std::vector<double> f{48.4, 51.6};
  for (double x = 1.0; x < 40.0; x *= 1.1) f.push_back(x);
  std::sort(f.begin(), f.end());
  EXPECT_GT(largest(filled(f, lagging)), 0.9 * std::abs(lagging(50.0)));
}

TEST(BetweenLines, PassNearZeroWhereThePhaseRises) {
  const auto anti = [](double f) { return 1.0 / mode(f); };
  const auto lines = filled({30.0, 40.0, 47.0, 53.5, 60.0, 70.0}, anti);
  double least = 1e9;
  for (std::size_t i = 0; i < lines.values.size(); ++i) {
    least = std::min(least, std::abs(lines.values[i]));
    EXPECT_NEAR(std::abs(lines.values[i] - anti(lines.frequencies_hz[i])), 0.0, 1e-9);  // it is a chord
  }
  EXPECT_LT(least, 2.0);
}

TEST(BetweenLines, LeaveDelaysInertiasAndNoiseAsTheyAre) {
  std::vector<double> f;
  for (double x = 1.0; x < 200.0; x *= 1.1) f.push_back(x);
  const auto late = [](double x) { return std::polar(1.0 / x, -0.5 * kPi - kTwoPi * x * 4e-3); };
  EXPECT_EQ(filled(f, late, 4e-3).values.size(), f.size());
  const auto lines = filled(f, late);  // 1.44 deg/Hz
  for (std::size_t i = 0; i < lines.values.size(); ++i)
    EXPECT_NEAR(lines.frequencies_hz[i] * std::abs(lines.values[i]), 1.0, 0.05);
  const auto wild = filled(
      {1.0, 2.0, 3.0, 4.0}, [](double x) { return std::polar(1.0, 2.5 * x * x); }, 0.0, 2.0);
  EXPECT_LE(largest(wild), 1.0 + 1e-9);  // chords
}

}  // namespace
}  // namespace resonid::design
