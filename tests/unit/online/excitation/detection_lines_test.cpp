// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <resonid/online/excitation/excitation.hpp>
#include <set>
#include <vector>

namespace resonid::online {
namespace {

constexpr double kRateHz = 500.0;

std::vector<double> half_hertz(int first, int last) {
  std::vector<double> f;
  for (int k = first; k <= last; ++k) f.push_back(0.5 * k);
  return f;
}

/// Multiples of 0.5 Hz that stay.
std::vector<int> kept(const std::vector<double>& lines, DetectionLines detection_lines,
                      std::uint64_t group = 4, std::uint64_t seed = 1) {
  std::array<bool, 512> room{};
  const auto marks = std::span(room).first(lines.size());
  EXPECT_TRUE(mark_kept_lines({kRateHz, lines, detection_lines, group, seed}, marks));
  std::vector<int> stay;
  for (std::size_t i = 0; i < lines.size(); ++i)
    if (marks[i]) stay.push_back(static_cast<int>(std::lround(2.0 * lines[i])));
  return stay;
}

TEST(LeftOutLines, EvenMultiplesGo) {
  EXPECT_EQ(kept(half_hertz(3, 9), DetectionLines::nothing), (std::vector<int>{3, 4, 5, 6, 7, 8, 9}));
  EXPECT_EQ(kept(half_hertz(3, 9), DetectionLines::even), (std::vector<int>{3, 5, 7, 9}));
}

TEST(LeftOutLines, OneOfEveryGroupOfOddLinesGoes) {
  std::set<std::vector<int>> seen;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const auto stay = kept(half_hertz(1, 80), DetectionLines::odd_random, 4, seed);  // 40 odd lines
    ASSERT_EQ(stay.size(), 30U);
    for (int group = 0; group < 10; ++group)
      EXPECT_EQ(std::count_if(stay.begin(), stay.end(), [&](int k) { return (k - 1) / 8 == group; }), 3);
    EXPECT_TRUE(std::all_of(stay.begin(), stay.end(), [](int k) { return k % 2 == 1; }));
    seen.insert(stay);
    EXPECT_EQ(stay, kept(half_hertz(1, 80), DetectionLines::odd_random, 4, seed));
  }
  EXPECT_EQ(seen.size(), 20U);
  // A group that is not whole keeps all of its lines.
  const auto last = kept(half_hertz(1, 11), DetectionLines::odd_random, 4);
  EXPECT_EQ(last.size(), 5U);
  EXPECT_EQ(last[3], 9);
  EXPECT_EQ(last[4], 11);
}

TEST(LeftOutLines, AmplitudesAndPhasesGoWithTheirLines) {
  ExcitationConfig c;
  c.kind = Kind::multisine;
  c.phases = Phases::given;
  c.detection_lines = DetectionLines::even;
  c.lines_hz.assign(half_hertz(1, 4));
  c.line_amplitudes.assign(std::vector<double>{1.0, 2.0, 3.0, 4.0});
  c.phases_rad.assign(std::vector<double>{0.1, 0.2, 0.3, 0.4});
  const auto left = with_kept_lines(c, kRateHz).value();
  EXPECT_EQ(std::vector<double>(left.line_amplitudes.values().begin(), left.line_amplitudes.values().end()),
            (std::vector<double>{1.0, 3.0}));
  auto made = Excitation::create(c, kRateHz).value();
  std::vector<double> x(4000);
  made.fill(x);
  for (std::size_t k = 0; k < x.size(); ++k) {
    const double t = static_cast<double>(k) / kRateHz;
    ASSERT_NEAR(x[k], std::cos(kTwoPi * 0.5 * t + 0.1) + 3.0 * std::cos(kTwoPi * 1.5 * t + 0.3), 1e-11);
  }
}

TEST(LeftOutLines, RefusesWhatItCannotDo) {
  std::array<bool, 8> room{};
  const auto field = [&](const std::vector<double>& f, std::uint64_t group) {
    return std::string(
        mark_kept_lines({kRateHz, f, DetectionLines::odd_random, group, 1}, std::span(room).first(f.size()))
            .error()
            .field);
  };
  EXPECT_EQ(field({1.0, 2.0}, 1), "group");
  EXPECT_EQ(field({1.0, 2.0 * std::sqrt(2.0)}, 4), "leave_out");
  // 8, 16 and 24 Hz repeat after 125 samples: multiples 2, 4 and 6 of 4 Hz.
  EXPECT_EQ(field({8.0, 16.0, 24.0}, 4), "leave_out");
  ExcitationConfig c;
  c.kind = Kind::multisine;
  c.detection_lines = DetectionLines::even;
  EXPECT_EQ(Excitation::create(c, kRateHz).error().field, "lines_hz");
}

}  // namespace
}  // namespace resonid::online
