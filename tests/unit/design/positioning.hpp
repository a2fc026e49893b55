// SPDX-License-Identifier: MIT
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <golden.hpp>
#include <resonid/base/constants.hpp>
#include <span>
#include <vector>

#include "design/maxima.hpp"
#include "design/polynomial.hpp"
#include "linalg/decompositions.hpp"

// The published benchmark "Robust Tuning of Positioning System" (tests/golden/e_tune_positioning.json): two
// inertias, the load's position measured, everything continuous; stiffness +-25 %, dampings +-50 %. Angular
// frequencies, in rad/s, as the benchmark has them.
namespace resonid::test {

/// One machine of the box.
struct PositioningPlant {
  double j1 = 0.0, j2 = 0.0, k = 0.0, b1 = 0.0, b2 = 0.0, b12 = 0.0;

  /// Torque to the load's position.
  [[nodiscard]] std::complex<double> at(double omega) const {
    const std::complex<double> s(0.0, omega), shaft = b12 * s + k;
    return shaft / ((s * (j1 * s + b1) + shaft) * (s * (j2 * s + b2) + shaft) - shaft * shaft);
  }
  [[nodiscard]] double resonance() const { return std::sqrt(k * (1.0 / j1 + 1.0 / j2)); }
};

/// gain (s/zero + 1)/(s/pole + 1) (s^2 + 2 z1 wn s + wn^2)/(s^2 + 2 z2 wn s + wn^2)
struct PositioningController {
  double zero = 0.0, pole = 0.0, notch = 0.0, upper = 0.0, lower = 0.0, gain = 0.0;

  explicit PositioningController(const nlohmann::json& g)
      : zero(g.at("zero")),
        pole(g.at("pole")),
        notch(g.at("notch_wn")),
        upper(g.at("zeta1")),
        lower(g.at("zeta2")),
        gain(g.at("gain")) {}
  PositioningController(std::span<const double> five, double gain_)
      : zero(five[0]), pole(five[1]), notch(five[2]), upper(five[3]), lower(five[4]), gain(gain_) {}

  [[nodiscard]] std::complex<double> at(double omega) const {
    const std::complex<double> s(0.0, omega), n(0.0, omega / notch);
    return gain * (s / zero + 1.0) / (s / pole + 1.0) * (n * n + 2.0 * upper * n + 1.0) /
           (n * n + 2.0 * lower * n + 1.0);
  }
};

struct PositioningBox {
  nlohmann::json golden = golden_json("e_tune_positioning.json");

  /// Stiffness in `steps` values over its range, each damping at its least, nominal and largest.
  [[nodiscard]] std::vector<PositioningPlant> plants(int steps) const {
    const auto& p = golden.at("parameters");
    const double wide = p.at("relative").at("k"), loose = p.at("relative").at("b");
    std::vector<PositioningPlant> all;
    for (int i = 0; i < steps; ++i)
      for (int j = 0; j < 27; ++j) {
        const auto damped = [&](int digit) { return 1.0 + loose * (digit % 3 - 1); };
        all.push_back({p.at("J1"), p.at("J2"),
                       p.at("k").get<double>() * (1.0 + wide * (2.0 * i / (steps - 1.0) - 1.0)),
                       p.at("b1").get<double>() * damped(j), p.at("b2").get<double>() * damped(j / 3),
                       p.at("b12").get<double>() * damped(j / 9)});
      }
    return all;
  }
};

/// Over 0.5 ... 5000 rad/s, and dense around a resonance.
inline std::vector<double> positioning_lines(const PositioningPlant& plant, int count) {
  std::vector<double> lines;
  for (int i = 0; i < count; ++i) lines.push_back(0.5 * std::pow(10.0, 4.0 * i / (count - 1.0)));
  for (int i = -count / 3; i <= count / 3; ++i) {
    const double x = 3.0 * i / count;
    lines.push_back(plant.resonance() * (1.0 + 0.3 * x * std::abs(x)));
  }
  std::sort(lines.begin(), lines.end());
  return lines;
}

struct PositioningFigures {
  double worst_disk = 0.0;  ///< |S - T|
  double least_crossover = 1e9, largest_crossover = 0.0, fastest_pole = 0.0;
  int unstable = 0;

  [[nodiscard]] double disk_margin_deg() const { return 2.0 * std::atan(1.0 / worst_disk) * 180.0 / kPi; }
};

/// Closed-loop poles, by the characteristic polynomial in s/100 with falling powers.
inline Eigen::VectorXcd positioning_poles(const PositioningPlant& p, const PositioningController& c) {
  using Row = std::vector<double>;
  constexpr double kUnit = 100.0;
  const Row first = {p.j1 * kUnit * kUnit, (p.b1 + p.b12) * kUnit, p.k};
  const Row second = {p.j2 * kUnit * kUnit, (p.b2 + p.b12) * kUnit, p.k};
  const Row shaft = {p.b12 * kUnit, p.k};
  Row plant = design::polynomial_product(first, second);
  const Row square = design::polynomial_product(shaft, shaft);
  for (std::size_t i = 0; i < square.size(); ++i) plant[plant.size() - square.size() + i] -= square[i];
  plant.back() = 0.0;  // k k - k k: the position integrates
  const double n = kUnit / c.notch;
  Row below = design::polynomial_product(design::polynomial_product(plant, Row{kUnit / c.pole, 1.0}),
                                         Row{n * n, 2.0 * c.lower * n, 1.0});
  const Row above = design::polynomial_product(design::polynomial_product(shaft, Row{kUnit / c.zero, 1.0}),
                                               Row{n * n, 2.0 * c.upper * n, 1.0});
  for (std::size_t i = 0; i < above.size(); ++i) below[below.size() - above.size() + i] += c.gain * above[i];
  const auto order = static_cast<Eigen::Index>(below.size()) - 1;
  Eigen::MatrixXd companion = Eigen::MatrixXd::Zero(order, order);
  for (Eigen::Index i = 0; i < order; ++i) {
    companion(0, i) = -below[static_cast<std::size_t>(i) + 1] / below[0];
    if (i + 1 < order) companion(i + 1, i) = 1.0;
  }
  return linalg::eigenvalues(companion) * kUnit;
}

/// The worst over machines.
inline PositioningFigures positioning_figures(const std::vector<PositioningPlant>& plants,
                                              const PositioningController& controller) {
  PositioningFigures f;
  for (const auto& plant : plants) {
    const auto lines = positioning_lines(plant, 600);
    const auto loop = [&](double omega) { return controller.at(omega) * plant.at(omega); };
    const design::SizesAt sizes_at = [&](std::span<const double> at, std::span<double> sizes) {
      for (std::size_t i = 0; i < at.size(); ++i)
        sizes[i] = std::abs((1.0 - loop(at[i])) / (1.0 + loop(at[i])));
    };
    std::vector<double> sizes(lines.size());
    sizes_at(lines, sizes);
    f.worst_disk = std::max(f.worst_disk, design::largest_between(lines, sizes, sizes_at).value);
    std::size_t i = 0;
    while (i < lines.size() && std::abs(loop(lines[i])) >= 1.0) ++i;
    if (i == 0 || i == lines.size()) return {};
    double low = lines[i - 1], high = lines[i];
    for (int k = 0; k < 50; ++k) {
      const double middle = 0.5 * (low + high);
      (std::abs(loop(middle)) >= 1.0 ? low : high) = middle;
    }
    f.least_crossover = std::min(f.least_crossover, low);
    f.largest_crossover = std::max(f.largest_crossover, low);
    const Eigen::VectorXcd poles = positioning_poles(plant, controller);
    f.fastest_pole = std::max(f.fastest_pole, poles.cwiseAbs().maxCoeff());
    if (poles.real().maxCoeff() >= 0.0) ++f.unstable;
  }
  return f;
}

}  // namespace resonid::test
