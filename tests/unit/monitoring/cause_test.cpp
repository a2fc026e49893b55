// SPDX-License-Identifier: MIT
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <monitoring/cause.hpp>
#include <random>
#include <string>
#include <utility>

#include "changed_machine.hpp"

namespace resonid::monitoring {
namespace {

using test::Tracker;
using test::TrueMachine;
using Counts = std::array<std::array<int, kCauses>, kCauses>;  // [truth][first]

constexpr int kSeeds = 400;

struct Tally {
  Counts sure{}, first{};
  int cases = 0, right = 0, sure_right = 0, sure_wrong = 0;

  void add(Cause truth, const LikelyCause& found) {
    const Cause named = found.first().cause;
    const auto t = static_cast<std::size_t>(truth), n = static_cast<std::size_t>(named);
    ++cases;
    ++first[t][n];
    right += named == truth ? 1 : 0;
    if (!found.sure()) return;
    ++sure[t][n];
    ++(named == truth ? sure_right : sure_wrong);
  }
  [[nodiscard]] double share(int count) const { return static_cast<double>(count) / cases; }
  [[nodiscard]] std::string text() const {
    std::string out =
        fmt::format("{} cases: first right {:.3f}, sure and right {:.3f}, sure and wrong {:.4f}\n", cases,
                    share(right), share(sure_right), share(sure_wrong));
    for (std::size_t t = 0; t < kCauses; ++t) {
      out += fmt::format("{:>17}:", name_of(static_cast<Cause>(t)));
      for (std::size_t n = 0; n < kCauses; ++n) out += fmt::format(" {:4d}/{:<4d}", sure[t][n], first[t][n]);
      out += "\n";
    }
    return out;
  }
};

/// Changes of every cause, of sizes that are just seen up to `largest`.
Tally tally(double quality, double scale_error, double least, double largest) {
  Tally out;
  std::mt19937_64 random(17);
  Tracker baseline(0.3 * quality, 0.3 * scale_error, random), now(quality, scale_error, random);
  for (int seed = 0; seed < kSeeds; ++seed)
    for (std::size_t c = 1; c < kCauses; ++c) {
      const TrueMachine before = test::any_machine(random);
      const auto cause = static_cast<Cause>(c);
      const double size = test::uniform(random, least, largest);
      out.add(cause, likely_cause(test::shifts_between(before, test::changed(before, cause, size, random),
                                                       baseline, now)));
    }
  return out;
}

TEST(LikelyCause, IsRightWhereItIsSure) {
  struct Case {
    const char* name;
    double quality, scale_error, least, largest, sure_right;
  };
  for (const Case& c :
       {Case{"clear", 1.0, 0.005, 0.05, 0.3, 0.75}, Case{"small", 1.0, 0.005, 0.02, 0.06, 0.3},
        Case{"noisy", 4.0, 0.02, 0.05, 0.3, 0.3}, Case{"large", 0.3, 0.002, 0.3, 0.7, 0.85}}) {
    const Tally t = tally(c.quality, c.scale_error, c.least, c.largest);
    RecordProperty(c.name, t.text());
    EXPECT_LT(t.sure_wrong, 0.02 * (t.sure_wrong + t.sure_right)) << c.name << "\n" << t.text();
    EXPECT_GT(t.share(t.sure_right), c.sure_right) << c.name << "\n" << t.text();
  }
}

TEST(LikelyCause, IsNotSureWhereNothingChanged) {
  std::mt19937_64 random(5);
  Tracker baseline(0.5, 0.003, random), now(1.0, 0.005, random);
  int sure = 0;
  for (int seed = 0; seed < kSeeds; ++seed) {
    const TrueMachine m = test::any_machine(random);
    sure += likely_cause(test::shifts_between(m, m, baseline, now)).sure() ? 1 : 0;
  }
  EXPECT_LE(sure, kSeeds / 100);
}

TEST(LikelyCause, NamesNoThirdOneForTwoAtOnce) {
  std::mt19937_64 random(6);
  Tracker baseline(0.3, 0.002, random), now(1.0, 0.005, random);
  int cases = 0, third = 0, unknown = 0;
  for (int seed = 0; seed < kSeeds; ++seed)
    for (const auto& [a, b] : {std::pair{Cause::coupling_looser, Cause::load_heavier},
                               std::pair{Cause::coupling_looser, Cause::friction_rose},
                               std::pair{Cause::load_lighter, Cause::input_scale},
                               std::pair{Cause::motor_inertia, Cause::coupling_stiffer},
                               std::pair{Cause::load_torque, Cause::delay_or_gains}}) {
      const TrueMachine before = test::any_machine(random);
      TrueMachine after = test::changed(before, a, test::uniform(random, 0.05, 0.3), random);
      after = test::changed(after, b, test::uniform(random, 0.05, 0.3), random);
      const LikelyCause found = likely_cause(test::shifts_between(before, after, baseline, now));
      ++cases;
      third += found.sure() && found.first().cause != a && found.first().cause != b ? 1 : 0;
      unknown += found.first().cause == Cause::unknown ? 1 : 0;
    }
  RecordProperty("third", fmt::format("{} of {} sure of a third, {} unknown", third, cases, unknown));
  EXPECT_LT(third, cases / 50) << "of " << cases << ", unknown " << unknown;
  EXPECT_GT(unknown, cases / 2);
}

/// Standard deviations that are told too small make it say less, not more that is wrong.
TEST(LikelyCause, BearsErrorBarsThatAreTooSmall) {
  std::mt19937_64 random(7);
  Tracker baseline(0.3, 0.002, random), now(1.5, 0.007, random);
  Tally t;
  for (int seed = 0; seed < kSeeds; ++seed)
    for (std::size_t c = 1; c < kCauses; ++c) {
      const TrueMachine before = test::any_machine(random);
      const auto cause = static_cast<Cause>(c);
      auto shifts = test::shifts_between(
          before, test::changed(before, cause, test::uniform(random, 0.05, 0.3), random), baseline, now);
      for (FigureShift& s : shifts) s.after.std /= 1.5;
      t.add(cause, likely_cause(shifts));
    }
  RecordProperty("overconfident", t.text());
  EXPECT_LT(t.sure_wrong, 0.02 * (t.sure_wrong + t.sure_right)) << t.text();
}

/// Methods without a physical model know frequencies only.
TEST(LikelyCause, GoesByFrequenciesAlone) {
  std::array<FigureShift, kWatched> shifts{};
  const auto put = [&](Watched w, double before, double after) {
    shifts[static_cast<std::size_t>(w)] = {{before, 0.001 * before}, {after, 0.001 * after}};
  };
  put(Watched::resonance, 20.0, 19.0);
  put(Watched::antiresonance, 12.0, 11.4);  // in the same ratio
  EXPECT_EQ(likely_cause(shifts).first().cause, Cause::coupling_looser);
  EXPECT_TRUE(likely_cause(shifts).sure());
  put(Watched::resonance, 20.0, 19.7);
  EXPECT_EQ(likely_cause(shifts).first().cause, Cause::load_heavier);
  put(Watched::resonance, 20.0, 19.0);
  put(Watched::antiresonance, 12.0, 12.0);
  EXPECT_EQ(likely_cause(shifts).first().cause, Cause::motor_inertia);
}

TEST(LikelyCause, IsUnknownWithoutFigures) {
  std::array<FigureShift, kWatched> shifts{};
  const auto sum = [](const LikelyCause& c) {
    double total = 0.0;
    for (const auto& r : c.ranked) total += r.weight;
    return total;
  };
  EXPECT_EQ(likely_cause(shifts).first().cause, Cause::unknown);
  EXPECT_NEAR(sum(likely_cause(shifts)), 1.0, 1e-12);
  // Figures without use: infinite, negative, of no known deviation.
  const double inf = std::numeric_limits<double>::infinity(), nan = std::nan("");
  shifts[0] = {{inf, 1.0}, {20.0, 1.0}};
  shifts[1] = {{-3.0, 0.1}, {20.0, 1.0}};
  shifts[2] = {{3.0, nan}, {20.0, 1.0}};
  shifts[7] = {{0.0, 0.0}, {inf, 1.0}};
  shifts[9] = {{40.0, inf}, {20.0, 1.0}};
  EXPECT_EQ(likely_cause(shifts).first().cause, Cause::unknown);
  // So much that every likelihood underflows.
  for (FigureShift& s : shifts) s = {{1.0, 1e-9}, {1e9, 1e-3}};
  EXPECT_NEAR(sum(likely_cause(shifts)), 1.0, 1e-12);
}

TEST(LikelyCause, HasWordsForEach) {
  for (std::size_t c = 0; c < kCauses; ++c) {
    const auto cause = static_cast<Cause>(c);
    EXPECT_FALSE(cause_words(cause).empty());
    EXPECT_EQ(from_name<Cause>(name_of(cause)), cause);
  }
}

}  // namespace
}  // namespace resonid::monitoring
