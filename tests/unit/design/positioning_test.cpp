// SPDX-License-Identifier: MIT
// A published benchmark of robust design, searched from nothing (docs/methods/tune.md 15).
#include "positioning.hpp"

#include <gtest/gtest.h>

#include <cstdio>

#include "design/global_search.hpp"
#include "design/largest_gain.hpp"

namespace resonid::design {
namespace {

constexpr double kDisk = 2.41421356237;  // 2/alpha for 45 deg

struct SearchedPlant {
  test::PositioningPlant plant;
  std::vector<double> omega;
  std::vector<std::complex<double>> response;
};

std::array<double, 5> structure_of(const GlobalSearch::Point& x) {
  return {std::exp(x[0]), std::exp(x[1]), std::exp(x[2]), std::exp(x[3]), std::exp(x[4])};
}

class PositioningSearch {
 public:
  explicit PositioningSearch(const std::vector<test::PositioningPlant>& plants) {
    for (const auto& plant : plants) {
      SearchedPlant one{plant, test::positioning_lines(plant, 90), {}};
      for (const double omega : one.omega) one.response.push_back(plant.at(omega));
      plants_.push_back(std::move(one));
    }
  }

  /// The largest gain that meets |S - T| at every machine: a row in which only kp counts.
  [[nodiscard]] double gain_of(const std::array<double, 5>& structure) const {
    const test::PositioningController unit(structure, 1.0);
    QuadraticRows rows;
    for (const auto& one : plants_)
      for (std::size_t i = 0; i < one.omega.size(); ++i) {
        const auto x = unit.at(one.omega[i]) * one.response[i];
        rows.add({1.0, x, 0.0}, {1.0, -x, 0.0}, kDisk);
      }
    return rows.largest_proportional();
  }

  /// The least crossover that the gain leaves, turned round; poles beyond 1000 rad/s cost.
  [[nodiscard]] double cost(const GlobalSearch::Point& x) const {
    const auto structure = structure_of(x);
    const double gain = gain_of(structure);
    if (!std::isfinite(gain) || !(gain > 0.0)) return 1e9;
    const test::PositioningController controller(structure, gain);
    double least = 1e9;
    for (const auto& one : plants_) {
      std::size_t i = 0;
      double before = 0.0, now = 0.0;
      for (; i < one.omega.size(); ++i) {
        before = now;
        now = std::log(std::abs(controller.at(one.omega[i]) * one.response[i]));
        if (now < 0.0) break;
      }
      if (i == 0 || i == one.omega.size()) return 1e9;
      const double part = before / (before - now);
      least = std::min(least, one.omega[i - 1] * std::pow(one.omega[i] / one.omega[i - 1], part));
    }
    double fastest = 0.0;
    for (const auto* one : {&plants_.front(), &plants_.back()})
      fastest = std::max(fastest, test::positioning_poles(one->plant, controller).cwiseAbs().maxCoeff());
    return 1.0 / least * (1.0 + std::max(0.0, fastest / 990.0 - 1.0));
  }

 private:
  std::vector<SearchedPlant> plants_;
};

/// What this test says of a controller is what the golden file says of its own two.
TEST(Positioning, FiguresOverTheBoxAreTheGoldenOnes) {
  const test::PositioningBox box;
  for (const char* name : {"robust", "nominal"}) {
    SCOPED_TRACE(name);
    const auto& golden = box.golden.at(name).at("over_the_box");
    const auto figures =
        test::positioning_figures(box.plants(13), test::PositioningController(box.golden.at(name)));
    EXPECT_NEAR(figures.fastest_pole, golden.at("pole_max").get<double>(), 0.01 * figures.fastest_pole);
    EXPECT_NEAR(figures.least_crossover, golden.at("wc_min").get<double>(), 0.01 * figures.least_crossover);
    EXPECT_EQ(figures.unstable > 0, golden.at("unstable") > 0);
    if (figures.unstable > 0) continue;
    EXPECT_NEAR(figures.worst_disk, golden.at("worst_disk").get<double>(), 1e-3 * figures.worst_disk);
    EXPECT_NEAR(figures.disk_margin_deg(), golden.at("disk_margin_deg").get<double>(), 0.03);
  }
}

/// 29 machines to search with, 351 to check.
TEST(Positioning, IsAsGoodAsTheGoldenSearch) {
  const test::PositioningBox box;
  std::vector<test::PositioningPlant> some;
  const auto five = box.plants(5);
  for (int i = 0; i < static_cast<int>(five.size()); ++i) {
    const int stiffness = i / 27, damping = i % 27;
    const bool corner = damping % 3 != 1 && damping / 3 % 3 != 1 && damping / 9 != 1;
    const bool nominal = damping == 13;
    if ((corner && stiffness % 2 == 0) || nominal) some.push_back(five[static_cast<std::size_t>(i)]);
  }
  ASSERT_EQ(some.size(), 29U);
  PositioningSearch search(some);
  const auto log_range = [](double low, double high) {
    return GlobalSearch::Range{std::log(low), std::log(high)};
  };
  GlobalSearch global({log_range(0.2, 60.0), log_range(60.0, 5000.0), log_range(300.0, 900.0),
                       log_range(1e-3, 1.0), log_range(0.05, 2.0)},
                      [&](const auto& x) { return search.cost(x); }, {40, 80, 1});
  const auto x = global.run({});
  const auto structure = structure_of(x);
  const auto golden =
      test::positioning_figures(box.plants(13), test::PositioningController(box.golden.at("robust")));
  // Lines and machines between those of the search take a little more.
  double gain = search.gain_of(structure);
  test::PositioningFigures figures;
  for (int i = 0; i < 20; ++i, gain *= 0.998) {
    figures = test::positioning_figures(box.plants(13), {structure, gain});
    if (figures.disk_margin_deg() >= golden.disk_margin_deg()) break;
  }
  std::printf(
      "zero %.9g pole %.9g notch %.9g zeta %.9g %.9g gain %.9g: crossover %.2f ... %.2f rad/s, disk margin "
      "%.2f deg, poles up to %.0f rad/s\n",
      structure[0], structure[1], structure[2], structure[3], structure[4], gain, figures.least_crossover,
      figures.largest_crossover, figures.disk_margin_deg(), figures.fastest_pole);
  EXPECT_GE(figures.least_crossover, golden.least_crossover);
  EXPECT_GE(figures.disk_margin_deg(), golden.disk_margin_deg());
  EXPECT_EQ(figures.unstable, 0);
  EXPECT_LT(figures.fastest_pole, 1000.0);
}

}  // namespace
}  // namespace resonid::design
