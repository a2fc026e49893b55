// SPDX-License-Identifier: MIT
// The largest gain of a P against its definition: the sampled two-mass response of this file, every bound at
// 20 000 frequencies, and every gain from 0 on.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <resonid/base/constants.hpp>
#include <vector>

#include "design/closed_loop.hpp"
#include "design/figures.hpp"
#include "design/largest_gain.hpp"
#include "golden_machines.hpp"

namespace resonid::design {
namespace {

using Complex = std::complex<double>;

/// Two masses with friction on the motor, their delay whole samples.
struct TwoMasses {
  double driven, load, stiffness, damping, friction = 0.0;
  double sample_time_s = 0.002;
  int delay = 2;

  [[nodiscard]] Machine machine() const {
    fit::DriveModel m;
    m.sample_time_s = sample_time_s;
    m.known_delay_s = delay * sample_time_s;
    m.parameters.driven_inertia = driven;
    m.parameters.load_inertia = load;
    m.parameters.stiffness = stiffness;
    m.parameters.damping = damping;
    m.parameters.viscous_friction = friction;
    return Machine(m);
  }
};

/// A pole of the continuous machine, and what of both velocities it makes.
struct Term {
  Complex pole, measured, load;
};

/// By partial fractions over roots that are polished here: behind a hold each term r/(s - p) becomes
/// r (exp(p Ts) - 1)/p / (z - exp(p Ts)), with Ts in place of (exp(p Ts) - 1)/p where p is 0.
std::vector<Term> terms_of(const TwoMasses& m) {
  // D(s) = (J1 s^2 + (b + d) s + k)(J2 s + d + k/s) - ... , multiplied out: c3 s^3 + c2 s^2 + c1 s + c0.
  const double c3 = m.driven * m.load, c2 = m.damping * (m.driven + m.load) + m.friction * m.load,
               c1 = m.stiffness * (m.driven + m.load) + m.friction * m.damping, c0 = m.friction * m.stiffness;
  const auto value = [&](Complex s) { return ((c3 * s + c2) * s + c1) * s + c0; };
  const auto slope = [&](Complex s) { return (3.0 * c3 * s + 2.0 * c2) * s + c1; };
  const double omega = std::sqrt(c1 / c3), decay = 0.5 * c2 / c3;
  std::vector<Complex> poles = {Complex(-c0 / c1), Complex(-decay, omega)};
  for (Complex& p : poles)
    for (int i = 0; i < 60; ++i) p -= value(p) / slope(p);
  poles.push_back(std::conj(poles[1]));
  std::vector<Term> terms;
  for (const Complex& p : poles)
    terms.push_back({p, (m.load * p * p + m.damping * p + m.stiffness) / slope(p),
                     (m.damping * p + m.stiffness) / slope(p)});
  return terms;
}

struct At {
  Complex measured, load;
};

/// On 20 000 frequencies up to the Nyquist frequency, half of them around the resonance.
std::vector<At> responses_of(const TwoMasses& m) {
  const auto terms = terms_of(m);
  const double nyquist = 0.5 / m.sample_time_s, resonance = std::abs(terms[1].pole) / kTwoPi;
  std::vector<double> lines;
  constexpr int kHalf = 10'000;
  for (int i = 0; i < kHalf; ++i) {
    lines.push_back(nyquist * std::pow(10.0, -5.0 * i / kHalf));
    lines.push_back(std::min(nyquist, resonance * std::pow(2.0, 2.0 * i / kHalf - 1.0)));
  }
  std::vector<At> all;
  for (const double f : lines) {
    const Complex z = std::polar(1.0, kTwoPi * f * m.sample_time_s);
    At at{0.0, 0.0};
    for (const Term& t : terms) {
      const Complex moved = std::exp(t.pole * m.sample_time_s);
      const Complex step =
          (std::abs(t.pole) > 1e-9 ? (moved - 1.0) / t.pole : Complex(m.sample_time_s)) / (z - moved);
      at.measured += t.measured * step;
      at.load += t.load * step;
    }
    at.measured *= std::pow(z, -m.delay);
    all.push_back(at);
  }
  return all;
}

bool is_met(const std::vector<At>& all, double kp, const Bounds& bounds) {
  return std::all_of(all.begin(), all.end(), [&](const At& at) {
    const double returned = std::abs(1.0 + kp * at.measured);
    const auto within = [&](const std::optional<double>& bound, double size) {
      return !bound || size <= *bound * returned;
    };
    return within(bounds.sensitivity, 1.0) && within(bounds.complementary, kp * std::abs(at.measured)) &&
           within(bounds.load_transfer, kp * std::abs(at.load)) && within(bounds.controller_sensitivity, kp);
  });
}

/// From 0 on in 400 steps to the first that is not met, and there by halving.
double by_definition(const std::vector<TwoMasses>& machines, const Bounds& bounds, double most) {
  std::vector<At> all;
  for (const auto& m : machines) {
    const auto here = responses_of(m);
    all.insert(all.end(), here.begin(), here.end());
  }
  constexpr int kSteps = 400, kHalvings = 40;
  int first = 1;
  while (first < kSteps && is_met(all, most * first / kSteps, bounds)) ++first;
  double low = most * (first - 1) / kSteps, high = most * first / kSteps;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = 0.5 * (low + high);
    (is_met(all, middle, bounds) ? low : high) = middle;
  }
  return low;
}

Bounds bounds_of(double sensitivity, std::optional<double> load_transfer = {}) {
  Bounds bounds;
  bounds.sensitivity = sensitivity;
  bounds.load_transfer = load_transfer;
  return bounds;
}

double found_for(const std::vector<TwoMasses>& machines, const Bounds& bounds, double share = 1.0) {
  std::vector<Machine> list;
  for (const auto& m : machines) list.push_back(m.machine());
  Machines all(list, share);
  const auto found = largest_proportional_gain(all, bounds);
  EXPECT_TRUE(found);
  if (!found) return 0.0;
  EXPECT_EQ(found->ki, 0.0);
  EXPECT_LE(found->exceeded, 1e-9);
  for (const auto& machine : list) EXPECT_TRUE(figures_of(machine, FilteredPi{found->kp, 0.0, {}}).stable);
  return found->kp;
}

const TwoMasses kSystem2{0.032, 0.032, 143.75, 0.3};
/// What 20 000 frequencies leave unseen.
constexpr double kSeen = 1e-4;

void expect_alike(const std::vector<TwoMasses>& machines, const Bounds& bounds) {
  const double found = found_for(machines, bounds), wanted = by_definition(machines, bounds, 4.0 * found);
  EXPECT_LE(found, wanted * (1.0 + 1e-7));
  EXPECT_GT(found, wanted * (1.0 - kSeen));
}

TEST(LargestProportionalGain, TheResponseOfThisFileIsTheMachines) {
  for (const TwoMasses& m : {kSystem2, TwoMasses{0.02, 0.1, 60.0, 0.05, 0.2}}) {
    const auto machine = m.machine();
    const auto here = responses_of(m);
    const double nyquist = 0.5 / m.sample_time_s;
    for (int i = 0; i < 5000; i += 500) {
      const double f = nyquist * std::pow(10.0, -5.0 * i / 10'000);
      const auto there = machine.response().at(std::array{f}).front();
      const auto& at = here[static_cast<std::size_t>(2 * i)];
      EXPECT_LT(std::abs(at.measured - there.measured), 1e-6 * std::abs(there.measured)) << f;
      EXPECT_LT(std::abs(at.load - there.load), 1e-6 * std::abs(there.load)) << f;
    }
  }
}

TEST(LargestProportionalGain, IsTheOneOfTheDefinition) {
  // A rigid pole at 1, as without friction, is left by every gain above 0.
  expect_alike({kSystem2}, bounds_of(1.4, 1.3));
  expect_alike({kSystem2}, bounds_of(2.0));
  const TwoMasses braked{0.02, 0.1, 60.0, 0.05, 0.2};  // |T_load| is below 1 at standstill
  expect_alike({braked}, bounds_of(1.4, 1.3));
  auto others = bounds_of(1.6);
  others.complementary = 1.2;
  expect_alike({braked}, others);
  others.controller_sensitivity = 0.1;
  expect_alike({kSystem2}, others);
}

TEST(LargestProportionalGain, SuitsEveryMachine) {
  const TwoMasses heavy{0.032, 0.16, 143.75, 0.3}, soft{0.032, 0.032, 60.0, 0.2};
  expect_alike({kSystem2, heavy, soft}, bounds_of(1.4, 1.3));
  const double all = found_for({kSystem2, heavy, soft}, bounds_of(1.4, 1.3));
  for (const auto& one : {kSystem2, heavy, soft})
    EXPECT_LE(all, found_for({one}, bounds_of(1.4, 1.3)) * (1.0 + 1e-7));
}

/// Few lines see little; what is exceeded between them is added.
TEST(LargestProportionalGain, MeetsBoundsBetweenLines) {
  for (const auto& bounds : {bounds_of(1.4, 1.3), bounds_of(2.0)}) {
    const double exact = found_for({kSystem2}, bounds), coarse = found_for({kSystem2}, bounds, 0.3);
    EXPECT_NEAR(coarse, exact, 1e-6 * exact);
  }
  Machines few({kSystem2.machine()}, 0.3);
  QuadraticRows rows;
  for (const auto& line : few.lines.front().lines()) rows.add(line, 1.0, bounds_of(1.4, 1.3));
  EXPECT_GT(rows.largest_proportional(), found_for({kSystem2}, bounds_of(1.4, 1.3)) * (1.0 + 1e-4));
}

/// Between a row's roots a bound is exceeded, beyond them it is met again.
TEST(LargestProportionalGain, EndsWhereTheFirstIntervalEnds) {
  // |S|: |1 - kp|/1 at a line whose response is -1, 1 <= 2 |1 - kp|: met up to 0.5, and from 1.5 on.
  QuadraticRows rows;
  rows.add({Complex(1.0), Complex(-1.0), Complex(0.0)}, {Complex(1.0), Complex(0.0), Complex(0.0)}, 2.0);
  EXPECT_NEAR(rows.largest_proportional(), 0.5, 1e-12);
  // A machine whose bound of |S| is met again at gains with an unstable loop.
  const auto bounds = bounds_of(2.0);
  const double found = found_for({kSystem2}, bounds);
  const auto all = responses_of(kSystem2);
  double beyond = found;
  while (beyond < 1e4 * found && (beyond < 1.01 * found || !is_met(all, beyond, bounds))) beyond *= 1.01;
  ASSERT_LT(beyond, 1e4 * found);
  EXPECT_FALSE(figures_of(kSystem2.machine(), FilteredPi{beyond, 0.0, {}}).stable);
}

TEST(LargestProportionalGain, HasNoPoleOnTheCircle) {
  const FilteredPi p{1.5, 0.0, {}};
  const auto c = p.transfer_function(0.002);
  EXPECT_EQ(c.numerator, std::vector<double>{1.5});
  EXPECT_EQ(c.denominator, std::vector<double>{1.0});
  EXPECT_EQ(states_of(p, 0.002).a.rows(), 0);
  // Behind filters as without them.
  const FilteredPi filtered{1.5, 0.0, {{20.0, 0.3, 0.8}}};
  EXPECT_EQ(states_of(filtered, 0.002).a.rows(), 2);
  const auto values = LinearController(filtered, 0.002).at(std::array{7.0});
  EXPECT_LT(std::abs(values.front() - filtered.transfer_function(0.002).response(7.0)), 1e-12);
  EXPECT_LT(
      closed_loop(kSystem2.machine().states(), states_of(FilteredPi{0.3, 0.0, {}}, 0.002)).spectral_radius(),
      1.0);
}

TEST(LargestProportionalGain, IsNothingWhereNoGainIs) {
  Machines machines({kSystem2.machine()});
  auto bounds = bounds_of(0.9);  // |S| is 1 without a controller
  EXPECT_FALSE(largest_proportional_gain(machines, bounds));
}

}  // namespace
}  // namespace resonid::design
