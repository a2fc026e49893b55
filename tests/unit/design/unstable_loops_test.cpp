// SPDX-License-Identifier: MIT
// Loops that meet every bound on their margins and are unstable (docs/methods/tune.md 4.3): margins never say
// that a loop is stable.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>

#include "design/cascade.hpp"
#include "design/figures.hpp"
#include "design/filter_search.hpp"
#include "design/pid.hpp"
#include "design/response_disks.hpp"
#include "design/robust.hpp"
#include "golden_machines.hpp"

namespace resonid::design {
namespace {

struct Trap {
  const char* plant;
  double sensitivity;
  FilteredPi controller;
};
/// Far beyond all crossings with any ki, at the end of intervals that begin at ki = 0, and with a broad lead
/// on a machine that has the motor of system 2, its anti-resonance and five times its load: there not |S|
/// alone is met, but |T_load| <= 1.3 as well.
const std::vector<Trap>& traps() {
  static const std::vector<Trap> all = {
      {"system2", 1.4, {50.0, 9000.0, {}}}, {"system2", 1.4, {2.0, 2253.0, {}}},
      {"system2", 2.0, {15.6, 97.0, {}}},   {"R2", 2.0, {10.4, 143.0, {}}},
      {"R5", 2.0, {4.8, 129.0, {}}},        {"large load", 1.4, {6.8, 15.0, {{61.0, 1.7, 0.25}}}}};
  return all;
}

Machine machine_of(const nlohmann::json& golden, const std::string& plant) {
  if (plant == "large load") return test::golden_machine({0.032, 0.16, 718.75, 1.5}, 0.002, 0.004);
  for (const auto& c : golden.at("cases"))
    if (c.at("plant") == plant) return test::golden_machines(c).front();
  throw std::out_of_range(plant);
}

/// Torque by the measured velocity, sample by sample.
using Law = std::function<double(double)>;

/// docs/methods/tune.md 16.1: the sum takes this sample's error with it; biquads in transposed form.
Law law_of(const FilteredPi& controller, double step) {
  struct State {
    double sum = 0.0;
    std::vector<Biquad::Coefficients> filters;
    std::vector<std::array<double, 2>> late;
  };
  State state;
  for (const Biquad& b : controller.biquads) state.filters.push_back(b.coefficients(step));
  state.late.resize(state.filters.size());
  return [=, kp = controller.kp, ki = controller.ki](double y) mutable {
    state.sum -= ki * step * y;
    double u = state.sum - kp * y;
    for (std::size_t i = 0; i < state.filters.size(); ++i) {
      const auto& f = state.filters[i];
      auto& s = state.late[i];
      const double out = f.b[0] * u + s[0];
      s = {f.b[1] * u - f.a[1] * out + s[1], f.b[2] * u - f.a[2] * out};
      u = out;
    }
    return u;
  };
}
Law law_of(const Cascade& cascade, double step) {
  return
      [velocity = law_of(cascade.velocity, step), kv = cascade.kv, step, position = 0.0](double y) mutable {
        position += step * y;
        return velocity(y + kv * position);
      };
}
Law law_of(const Pid& pid, double step) {
  const double pole = pid.filter_s > 0.0 ? std::exp(-step / pid.filter_s) : 0.0;
  return [=, sum = 0.0, slope = 0.0, before = 0.0](double y) mutable {
    sum += pid.ki * step * y;
    slope = pole * slope + (1.0 - pole) * (y - before) / step;
    before = y;
    return -(pid.kp * y + sum + pid.kd * slope);
  };
}

/// What an impulse of torque on the load leaves after 20 000 samples, relative to its largest velocity so
/// far; infinite where it has grown beyond measure. Neither poles nor responses are asked.
double left_after_an_impulse(const Machine& machine, Law law) {
  constexpr int kSamples = 20'000, kLast = 1000;
  constexpr double kBeyondMeasure = 1e12;
  const fit::SampledStates& s = machine.states();
  Eigen::VectorXd x = s.load_torque;
  const double first = x.norm();
  double largest = 0.0, last = 0.0;
  for (int k = 0; k < kSamples; ++k) {
    const double u = law(s.measured * x);
    x = (s.a * x + s.command * u).eval();
    const double size = x.norm() / first;
    if (!(size < kBeyondMeasure)) return std::numeric_limits<double>::infinity();
    largest = std::max(largest, size);
    if (k >= kSamples - kLast) last = std::max(last, size);
  }
  return last / largest;
}
constexpr double kSettled = 1e-6;

Bounds only_sensitivity(double bound) {
  Bounds bounds;
  bounds.sensitivity = bound;
  return bounds;
}

TEST(UnstableLoops, MeetTheirMarginsAndAreKnownAsUnstable) {
  const auto golden = test::golden_json("e_tune_pi.json");
  for (const Trap& trap : traps()) {
    SCOPED_TRACE(testing::Message() << trap.plant << " " << trap.controller.kp << " " << trap.controller.ki);
    const Machine machine = machine_of(golden, trap.plant);
    std::vector<double> dense;
    for (int i = 0; i < 20'000; ++i)
      dense.push_back(0.5 / machine.sample_time_s() * std::pow(10.0, -5.0 * i / 20'000));
    for (const auto& v :
         LoopFunctions(machine.response(), trap.controller, machine.sample_time_s()).at(dense)) {
      ASSERT_LE(v.size_of(Transfer::sensitivity), trap.sensitivity);
      if (!trap.controller.biquads.empty()) {
        ASSERT_LE(v.size_of(Transfer::load_transfer), 1.3);
      }
    }
    const auto figures = figures_of(machine, trap.controller);
    EXPECT_FALSE(figures.stable);
    EXPECT_GT(figures.spectral_radius, 1.1);
    EXPECT_FALSE(std::isfinite(load_step_iae(machine, trap.controller)));
    EXPECT_FALSE(
        std::isfinite(left_after_an_impulse(machine, law_of(trap.controller, machine.sample_time_s()))));
  }
}

/// Though they have far more ki than what is.
TEST(UnstableLoops, AreNeverProposed) {
  const auto golden = test::golden_json("e_tune_pi.json");
  for (const Trap& trap : traps()) {
    SCOPED_TRACE(testing::Message() << trap.plant << " " << trap.controller.kp);
    const Machine machine = machine_of(golden, trap.plant);
    const Bounds bounds = only_sensitivity(trap.sensitivity);
    const auto expect_stable = [&](const FilteredPi& found) {
      EXPECT_TRUE(figures_of(machine, found).stable);
      EXPECT_LE(figures_of(machine, found).peak(Transfer::sensitivity).value, trap.sensitivity * 1.0001);
      EXPECT_LT(left_after_an_impulse(machine, law_of(found, machine.sample_time_s())), kSettled);
    };
    const std::vector<Biquad>& filter = trap.controller.biquads;
    Machines alone({machine});
    const auto gains = largest_integral_gain(alone, filter, bounds);
    ASSERT_TRUE(gains);
    expect_stable({gains->kp, gains->ki, filter});

    const Posterior posterior(machine.model(), {fit::kStiffness, fit::kDelay},
                              Eigen::Vector2d(1e-4, 1e-8).asDiagonal());
    const auto confident = confident_design(posterior, {.biquads = 0}, bounds, {.draws = 1000});
    ASSERT_TRUE(confident);
    EXPECT_EQ(confident->check.unstable, 0U);
    expect_stable(confident->design.controller);

    ResponseDisks disks;
    disks.sample_time_s = machine.sample_time_s();
    for (double f = 0.25; f <= 249.0; f *= 1.02) disks.frequencies_hz.push_back(f);
    for (const auto& value : machine.response().at(disks.frequencies_hz)) {
      disks.centres.push_back(value.measured);
      disks.radii.push_back(0.01 * std::abs(value.measured));
    }
    const auto measured = largest_integral_gain(disks, {}, bounds);
    ASSERT_TRUE(measured);
    expect_stable(measured->controller);
  }
}

/// Searches that begin at the trap, with |CS| bounded so widely that the trap is inside.
TEST(UnstableLoops, AreNotWhereSearchesEnd) {
  const auto golden = test::golden_json("e_tune_pi.json");
  for (const Trap& trap : traps()) {
    SCOPED_TRACE(testing::Message() << trap.plant << " " << trap.controller.kp);
    const Machine machine = machine_of(golden, trap.plant);
    const double step = machine.sample_time_s();
    const LoopFunctions loop(machine.response(), trap.controller, step);
    Bounds bounds = only_sensitivity(trap.sensitivity);
    bounds.controller_sensitivity =
        1.01 * loop.largest(Transfer::controller_sensitivity, first_lines_hz(machine.model())).value;
    const Biquad through{30.0, 1.0, 1.0};
    const auto starts =
        trap.controller.biquads.empty() ? std::vector<Biquad>{through} : trap.controller.biquads;

    Machines machines({machine}, 0.5);
    const auto filtered = search_filters(machines, bounds, {.population = 12, .generations = 6}, starts);
    ASSERT_TRUE(filtered);
    EXPECT_LT(left_after_an_impulse(machine, law_of(filtered->controller, step)), kSettled);
    const auto again = search_filters_again(machines, bounds, starts);
    ASSERT_TRUE(again);
    EXPECT_LT(left_after_an_impulse(machine, law_of(again->controller, step)), kSettled);

    const Pid at_trap{trap.controller.kp, trap.controller.ki, 0.5 * step * trap.controller.kp, step};
    const auto pid = search_pid(machines, bounds, {12, 6, 1}, at_trap);
    ASSERT_TRUE(pid);
    EXPECT_LT(left_after_an_impulse(machine, law_of(pid->controller, step)), kSettled);

    // Around the trap as its velocity loop no position gain is stable.
    EXPECT_FALSE(largest_kv(machines, trap.controller, bounds));
  }
}

TEST(UnstableLoops, AreNotWhereACascadeEnds) {
  const auto golden = test::golden_json("e_tune_pi.json");
  for (const char* plant : {"system2", "R5"}) {
    SCOPED_TRACE(plant);
    const Machine machine = machine_of(golden, plant);
    Bounds bounds = default_cascade_bounds();
    bounds.sensitivity = 2.0;
    Machines machines({machine}, 0.3);
    const auto cascade = search_cascade(machines, bounds);
    ASSERT_TRUE(cascade);
    EXPECT_LT(left_after_an_impulse(machine, law_of(cascade->cascade, machine.sample_time_s())), kSettled);
  }
}

/// Friction that falls with the velocity, of which a small gain makes no stable loop: every gain from none on
/// meets |S| <= 1.4, by an interval of ki that begins at none. No bound tells it, only the poles do; what
/// they leave is no proposal.
TEST(UnstableLoops, AreToldByTheirPolesAlone) {
  const Machine machine = test::golden_machine({0.064, -0.5}, 0.002, 0.004);
  Bounds bounds = only_sensitivity(1.4);
  bounds.controller_sensitivity = 1.0;
  const MachineLines lines(machine);
  QuadraticRows rows;
  for (const auto& line : lines.lines()) rows.add(line, 1.0, bounds);
  ASSERT_NEAR(rows.largest_proportional(), 0.5 * (1.0 - 1.0 / 1.4), 1e-3);
  for (const double kp : {0.02, 0.07, 0.12}) {
    const double ki = rows.largest_integral(kp);
    ASSERT_TRUE(ki > 0.0 && std::isfinite(ki)) << kp;
    const FilteredPi trap{kp, 0.5 * ki, {}};
    const auto figures = figures_of(machine, trap);
    EXPECT_LE(figures.peak(Transfer::sensitivity).value, 1.4);
    EXPECT_FALSE(figures.stable);
    EXPECT_FALSE(std::isfinite(left_after_an_impulse(machine, law_of(trap, machine.sample_time_s()))));
    EXPECT_FALSE(std::isfinite(rough_load_step_iae(machine, trap)));
  }
  Machines machines({machine});
  EXPECT_FALSE(largest_proportional_gain(machines, bounds));
  EXPECT_FALSE(largest_integral_gain(machines, {}, bounds));
  EXPECT_FALSE(rough_integral_gain(machines, {}, bounds));
  EXPECT_FALSE(largest_pid_gain(machines, {0.004, 0.004}, bounds));
  EXPECT_FALSE(search_filters(machines, bounds, {.population = 6, .generations = 2}));
  EXPECT_FALSE(search_pid(machines, bounds, {6, 2, 1}));
  EXPECT_FALSE(search_cascade(machines, bounds));
  const Posterior posterior(machine.model(), {fit::kDrivenInertia, fit::kDelay},
                            Eigen::Vector2d(1e-4, 1e-8).asDiagonal());
  EXPECT_FALSE(confident_design(posterior, {.biquads = 0}, bounds, {.draws = 100}));
}

/// The interval of ki that holds the trap meets the bound from its beginning to its end.
TEST(UnstableLoops, MayBeginAtNoIntegralGain) {
  const auto golden = test::golden_json("e_tune_pi.json");
  const Machine machine = machine_of(golden, "R2");
  const MachineLines lines(machine);
  QuadraticRows rows;
  for (const auto& line : lines.lines()) rows.add(line, 1.0, only_sensitivity(2.0));
  EXPECT_GT(rows.largest_integral(10.4), 143.0);
  EXPECT_LT(rows.largest_proportional(), 10.4);  // what keeps the search away from it
}

}  // namespace
}  // namespace resonid::design
