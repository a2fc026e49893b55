// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <algorithm>
#include <allocation_counter.hpp>
#include <cmath>
#include <resonid/base/constants.hpp>
#include <resonid/plant/detail/controller.hpp>
#include <string>
#include <vector>

namespace resonid::plant {
namespace {

constexpr double kRate = 500.0;
constexpr double kStep = 1.0 / kRate;

ControllerConfig pi(double gain, double integral_time_s) {
  ControllerConfig c;
  c.kind = ControllerKind::pi;
  c.gain = gain;
  c.integral_time_s = integral_time_s;
  return c;
}

ControllerConfig pid() {
  auto c = pi(0.8, 0.05);
  c.kind = ControllerKind::pid;
  c.derivative_time_s = 0.004;
  c.derivative_filter_s = 0.003;
  return c;
}

ControllerConfig cascade() {  // of the golden tooth belt (tests/golden/README.md) with feed-forward
  auto c = pi(0.12, 0.2);
  c.kind = ControllerKind::cascade;
  c.position_gain = 5.0;
  c.velocity_feedforward = 0.75;
  return c;
}

ControllerConfig rst() {
  ControllerConfig c;
  c.kind = ControllerKind::rst;
  c.r = {2.0, -2.6, 0.6};  // an integrator
  c.s = {1.5, -1.1};
  c.t = {0.7, -0.2, 0.1};
  return c;
}

ControllerConfig transfer_function() {
  ControllerConfig c;
  c.kind = ControllerKind::transfer_function;
  c.numerator = {0.5, 0.25};
  c.denominator = {1.25, -0.5, 0.1};
  return c;
}

Controller make(const ControllerConfig& config) { return Controller::create(config, kRate).value(); }

double signal(int k) { return std::sin(0.7 * k) + 0.3 * std::cos(2.9 * k * k); }

/// Unlimited output for a velocity error alone, v* = error, y = 0.
std::vector<double> respond(const ControllerConfig& config, const std::vector<double>& error) {
  auto c = make(config);
  std::vector<double> u;
  for (const double e : error) {
    u.push_back(c.command({0.0, e, 0.0}, {0.0, 0.0}));
    c.commit(u.back());
  }
  return u;
}

std::vector<double> signals(int count) {
  std::vector<double> x;
  for (int k = 0; k < count; ++k) x.push_back(signal(k));
  return x;
}

// ---- laws ---------------------------------------------------------------------------------------------

TEST(Controller, ProportionalAndPiByHand) {
  auto p = pi(0.8, 0.0);
  p.kind = ControllerKind::p;
  const auto e = signals(40);
  const auto up = respond(p, e);
  const auto upi = respond(pi(0.8, 0.05), e);
  double integral = 0.0;
  for (std::size_t k = 0; k < e.size(); ++k) {
    integral += kStep / 0.05 * e[k];
    EXPECT_EQ(up[k], 0.8 * e[k]);
    EXPECT_NEAR(upi[k], 0.8 * (e[k] + integral), 1e-14);
  }
}

// Ts,K,Ti,Td,Tf = 0.002,0.8,0.05,0.004,0.003; i = lfilter([Ts/Ti],[1,-1],e)
// d = lfilter([Td/(Tf+Ts),-Td/(Tf+Ts)],[1,-Tf/(Tf+Ts)],e); K*(e+i+d)                      (scipy.signal)
TEST(Controller, PidMatchesScipy) {
  const std::vector<double> e{1, -0.5, 0.25, 2, 0, 0, -1, 0.75, 0, 0, 0, 0.5};
  const std::vector<double> expected{1.472,         -0.96,         0.3584,         2.88864,
                                     -0.471616,     -0.2477696,    -1.58546176,    1.295122944,
                                     -0.0309262336, 0.01344425984, 0.040066555904, 0.7920399335424};
  const auto u = respond(pid(), e);
  for (std::size_t k = 0; k < e.size(); ++k) EXPECT_NEAR(u[k], expected[k], 1e-13) << k;
}

TEST(Controller, PidResponseMatchesItsFormula) {
  const double f = 37.0;
  const auto z = std::polar(1.0, kTwoPi * f * kStep);
  const double width = 0.003 + kStep;
  const auto c = 0.8 * (1.0 + kStep / 0.05 * z / (z - 1.0) + 0.004 / width * (z - 1.0) / (z - 0.003 / width));
  EXPECT_LT(std::abs(make(pid()).feedback()->response(f) - c), 1e-13);
  auto unfiltered = pid();
  unfiltered.derivative_filter_s = 0.0;
  const auto d = 0.8 * (1.0 + kStep / 0.05 * z / (z - 1.0) + 0.004 / kStep * (z - 1.0) / z);
  EXPECT_LT(std::abs(make(unfiltered).feedback()->response(f) - d), 1e-13);
  auto without = pid();
  without.derivative_time_s = 0.0;
  EXPECT_LT(std::abs(make(without).feedback()->response(f) - make(pi(0.8, 0.05)).feedback()->response(f)),
            1e-13);
}

TEST(Controller, TransferFunctionByHand) {
  const auto e = signals(40);
  const auto u = respond(transfer_function(), e);
  double u1 = 0.0;
  double u2 = 0.0;
  for (std::size_t k = 0; k < e.size(); ++k) {
    const double now = (0.5 * e[k] + (k > 0 ? 0.25 * e[k - 1] : 0.0) + 0.5 * u1 - 0.1 * u2) / 1.25;
    EXPECT_NEAR(u[k], now, 1e-14);
    u2 = u1;
    u1 = now;
  }
}

TEST(Controller, RstByHand) {
  auto c = make(rst());
  std::vector<double> u;
  for (int k = 0; k < 60; ++k) {
    const auto r = [k](int i) { return k >= i ? signal(k - i) : 0.0; };
    const auto y = [k](int i) { return k >= i ? signal(3 * (k - i) + 1) : 0.0; };
    const auto past = [&u, k](int i) { return k >= i ? u[static_cast<std::size_t>(k - i)] : 0.0; };
    const double expected =
        (2.6 * past(1) - 0.6 * past(2) + 0.7 * r(0) - 0.2 * r(1) + 0.1 * r(2) - 1.5 * y(0) + 1.1 * y(1)) /
        2.0;
    u.push_back(c.command({0.0, r(0), 0.0}, {0.0, y(0)}));
    EXPECT_NEAR(u.back(), expected, 1e-12);
    c.commit(u.back());
  }
}

// Velocity back with position as its backward-Euler integral: C_pi (1 + Kpc Ts z/(z-1)), as in tests/golden.
TEST(Controller, CascadeFeedbackIsThePiTimesThePositionLoop) {
  const auto y = signals(100);
  auto c = make(cascade());
  const data::TransferFunction law{{0.12 * 1.01 * 1.01, -0.12 * 2.02, 0.12}, {1.0, -2.0, 1.0}, kStep};
  ASSERT_NEAR(5.0 * kStep, 0.01, 1e-16);
  ASSERT_NEAR(kStep / 0.2, 0.01, 1e-16);
  const auto expected = law.simulate(y);
  double position = 0.0;
  for (std::size_t k = 0; k < y.size(); ++k) {
    position += kStep * y[k];
    const double u = c.command({}, {position, y[k]});
    EXPECT_NEAR(-u, expected[k], 1e-12);
    c.commit(u);
  }
  const auto feedback = c.feedback().value();
  const auto z = std::polar(1.0, kTwoPi * 3.0 * kStep);
  const auto q = z / (z - 1.0);
  EXPECT_LT(std::abs(feedback.response(3.0) - 0.12 * (1.0 + 0.01 * q) * (1.0 + 0.01 * q)), 1e-12);
}

TEST(Controller, CascadeFollowsProfileWithFeedForward) {
  auto c = make(cascade());
  double integral = 0.0;
  for (int k = 0; k < 50; ++k) {
    const Setpoint s{signal(k), signal(2 * k), 0.0};
    const Measured m{0.3 * signal(k + 5), signal(3 * k)};
    const double e = 5.0 * (s.position - m.position) + 0.75 * s.velocity - m.velocity;
    integral += kStep / 0.2 * e;
    const double u = c.command(s, m);
    EXPECT_NEAR(u, 0.12 * (e + integral), 1e-13);
    c.commit(u);
  }
}

// Inertia, viscous and dry friction of the profile; no other kind feeds forward, whatever its fields hold.
TEST(Controller, CascadeFeedsTorqueForward) {
  auto config = cascade();
  config.acceleration_feedforward = 0.064;
  config.viscous_feedforward = 0.05;
  config.coulomb_feedforward = 0.4;
  config.reference_delay_s = 0.003;
  const auto c = make(config);
  EXPECT_DOUBLE_EQ(c.torque_feedforward({7.0, 2.0, 10.0}), 0.64 + 0.1 + 0.4);
  EXPECT_DOUBLE_EQ(c.torque_feedforward({7.0, -2.0, 10.0}), 0.64 - 0.1 - 0.4);
  EXPECT_EQ(c.torque_feedforward({7.0, 0.0, 0.0}), 0.0);
  EXPECT_EQ(c.reference_delay_s(), 0.003);
  config.kind = ControllerKind::pi;
  EXPECT_EQ(make(config).torque_feedforward({7.0, 2.0, 10.0}), 0.0);
  EXPECT_EQ(make(config).reference_delay_s(), 0.0);
  // The law itself is the same with and without.
  config.kind = ControllerKind::cascade;
  EXPECT_EQ(respond(config, signals(40)), respond(cascade(), signals(40)));
}

// Any law from measured velocity to -u is what feedback() says, starting at rest.
TEST(Controller, FeedbackIsTheLawFromVelocity) {
  const auto y = signals(80);
  for (const auto& config : {pi(1.036, 0.147), pid(), rst(), transfer_function()}) {
    auto c = make(config);
    const auto feedback = c.feedback().value();
    EXPECT_EQ(feedback.sample_time_s, kStep);
    const auto expected = feedback.simulate(y);
    for (std::size_t k = 0; k < y.size(); ++k) {
      const double u = c.command({}, {0.0, y[k]});
      EXPECT_NEAR(-u, expected[k], 1e-12);
      c.commit(u);
    }
  }
}

TEST(Controller, OpenLoopCommandsNothing) {
  auto c = make({});
  c.settle({1.0, 1.0, 0.0}, {0.0, 0.5}, 2.0);
  EXPECT_EQ(c.command({1.0, 1.0, 0.0}, {0.0, 0.5}), 0.0);
  c.commit(1.0);
  EXPECT_EQ(c.command({1.0, 1.0, 0.0}, {0.0, 0.5}), 0.0);
  EXPECT_FALSE(c.feedback().has_value());
  EXPECT_FALSE(c.integrates());
  EXPECT_EQ(c.imbalance(1.0, 2.0, 3.0), 0.0);
}

// ---- limits -------------------------------------------------------------------------------------------

TEST(Controller, UnsaturatedRecursionIsThatOfTheFilterBitForBit) {
  auto config = transfer_function();
  config.torque_limit = 100.0;
  for (auto law : {config, pi(1.036, 0.147)}) {
    auto c = make(law);
    const auto tf = c.feedback().value();
    auto filter = DiscreteFilter<double, 16>::create(tf.numerator, tf.denominator).value();
    for (int k = 0; k < 300; ++k) {
      const double u = c.command({0.0, 10.0, 0.0}, {0.0, signal(k)});
      EXPECT_EQ(u, filter.step(10.0 - signal(k)));
      EXPECT_EQ(c.limit(u), u);
      c.commit(u);
    }
  }
}

struct Run {
  double overshoot = 0.0;
  int saturated = 0;
};

/// Velocity step of 10 rad/s of a rigid machine of 0.05 kgm2 that gets at most 1 Nm.
template <class Torque>
Run step_up(Torque&& torque) {
  Run run;
  double velocity = 0.0;
  for (int k = 0; k < 2000; ++k) {
    const double u = torque(10.0 - velocity);
    if (std::abs(u) == 1.0) ++run.saturated;
    velocity += kStep / 0.05 * u;
    run.overshoot = std::max(run.overshoot, velocity - 10.0);
  }
  EXPECT_NEAR(velocity, 10.0, 1e-3);
  return run;
}

TEST(Controller, AntiWindupReturnsFromSaturationWithoutOvershoot) {
  const double gain = 1.0;
  const double integral_time = 0.2;
  auto config = pi(gain, integral_time);
  config.torque_limit = 1.0;
  auto c = make(config);
  const auto saturated = step_up([&](double e) {
    const double u = c.limit(c.command({0.0, e, 0.0}, {}));
    c.commit(u);
    return u;
  });
  double integral = 0.0;  // textbook positional form, limited outside only
  const auto wound_up = step_up([&](double e) {
    integral += gain * kStep / integral_time * e;
    return std::clamp(gain * e + integral, -1.0, 1.0);
  });
  EXPECT_GT(saturated.saturated, 100);
  EXPECT_GT(wound_up.overshoot, 5.0);
  EXPECT_LT(saturated.overshoot, 0.1 * wound_up.overshoot);

  double last_u = 0.0;  // textbook clamped velocity form
  double last_e = 0.0;
  auto again = make(config);
  step_up([&](double e) {
    last_u = std::clamp(last_u + gain * (e - last_e + kStep / integral_time * e), -1.0, 1.0);
    last_e = e;
    const double u = again.limit(again.command({0.0, e, 0.0}, {}));
    again.commit(u);
    EXPECT_NEAR(u, last_u, 1e-12);
    return u;
  });
}

// R u = T v* - S y with the past of u as it was realised, excitation taken off.
TEST(Controller, RstGoesOnFromTheRealisedTorque) {
  auto config = rst();
  config.torque_limit = 0.8;
  auto c = make(config);
  double w1 = 0.0;
  double w2 = 0.0;
  int limited = 0;
  for (int k = 0; k < 200; ++k) {
    const auto r = [k](int i) { return k >= i ? signal(k - i) : 0.0; };
    const auto y = [k](int i) { return k >= i ? 0.5 * signal(2 * (k - i)) : 0.0; };
    const double ru = 0.2 * signal(5 * k);
    const double u = c.command({0.0, r(0), 0.0}, {0.0, y(0)});
    const double expected =
        (2.6 * w1 - 0.6 * w2 + 0.7 * r(0) - 0.2 * r(1) + 0.1 * r(2) - 1.5 * y(0) + 1.1 * y(1)) / 2.0;
    EXPECT_NEAR(u, expected, 1e-12);
    const double torque = c.limit(u + ru);
    EXPECT_LE(std::abs(torque), 0.8);
    if (torque != u + ru) ++limited;
    w2 = w1;
    w1 = torque == u + ru ? u : torque - ru;
    c.commit(w1);
  }
  EXPECT_GT(limited, 20);
  EXPECT_LT(limited, 180);
}

TEST(Controller, VelocityLimitBoundsTheReferenceAlone) {
  auto config = pi(2.0, 0.1);
  config.kind = ControllerKind::p;
  config.velocity_limit = 3.0;
  auto p = make(config);
  EXPECT_EQ(p.command({0.0, 5.0, 0.0}, {0.0, 1.0}), 2.0 * (3.0 - 1.0));
  EXPECT_EQ(p.command({0.0, -5.0, 0.0}, {0.0, 1.0}), 2.0 * (-3.0 - 1.0));
  EXPECT_EQ(p.command({0.0, 2.0, 0.0}, {0.0, 7.0}), 2.0 * (2.0 - 7.0));
  auto outer = cascade();
  outer.velocity_limit = 3.0;
  auto c = make(outer);
  // 5 (1 - 0) alone is 5, with 0.75 * (-4) it is 2.
  EXPECT_NEAR(c.command({1.0, 0.0, 0.0}, {0.0, 0.5}), 0.12 * 1.01 * 2.5, 1e-15);
  EXPECT_NEAR(c.command({1.0, -4.0, 0.0}, {0.0, 0.5}), 0.12 * 1.01 * 1.5, 1e-15);
}

TEST(Controller, TakesNoMemoryPerSample) {
  for (auto config : {pid(), cascade(), rst(), transfer_function()}) {
    config.torque_limit = 0.5;
    auto c = make(config);
    const auto before = test::allocations();
    c.settle({0.0, 1.0, 0.0}, {0.0, 1.0}, 0.1);
    for (int k = 0; k < 100; ++k) c.commit(c.limit(c.command({0.0, signal(k), 0.0}, {0.0, 0.0})));
    EXPECT_EQ(test::allocations(), before);
  }
}

// ---- steady state -------------------------------------------------------------------------------------

void expect_rest(Controller c, Setpoint setpoint, Measured measured, double torque) {
  c.settle(setpoint, measured, torque);
  for (int k = 0; k < 200; ++k) {
    const double u = c.command(setpoint, measured);
    ASSERT_NEAR(u, torque, 1e-11);
    c.commit(u);
    setpoint.position += setpoint.velocity * kStep;
    measured.position += measured.velocity * kStep;
  }
}

TEST(Controller, SettlesAtATorque) {
  for (const auto& config : {pi(1.036, 0.147), pid()}) {
    EXPECT_TRUE(make(config).integrates());
    EXPECT_EQ(make(config).imbalance(10.0, 10.0, 0.4), 0.0);
    expect_rest(make(config), {0.0, 10.0, 0.0}, {0.0, 10.0}, 0.4);
  }
}

TEST(Controller, SettlesWithoutAnIntegrator) {
  auto c = make(transfer_function());  // gain 0.75/0.85 at 0 Hz
  EXPECT_FALSE(c.integrates());
  EXPECT_NEAR(c.imbalance(10.0, 8.3, 0.75 / 0.85 * 1.7), 0.0, 1e-14);
  EXPECT_GT(std::abs(c.imbalance(10.0, 8.3, 0.75 / 0.85 * 1.8)), 0.05);
  expect_rest(c, {0.0, 10.0, 0.0}, {0.0, 8.3}, 0.75 / 0.85 * 1.7);
}

TEST(Controller, SettlesAnRst) {
  auto c = make(rst());  // T(1) = 0.6, S(1) = 0.4: it holds 1.5 times the reference
  EXPECT_TRUE(c.integrates());
  EXPECT_NEAR(c.imbalance(10.0, 15.0, 123.0), 0.0, 1e-14);
  expect_rest(c, {0.0, 10.0, 0.0}, {0.0, 15.0}, -0.7);
  auto leaky = rst();
  leaky.r = {2.0, -1.0};
  EXPECT_FALSE(make(leaky).integrates());
  EXPECT_NEAR(make(leaky).imbalance(10.0, 14.0, 0.4), 0.0, 1e-14);
  expect_rest(make(leaky), {0.0, 10.0, 0.0}, {0.0, 14.0}, 0.4);
}

TEST(Controller, CascadeSettlesWithItsFollowingError) {
  const auto c = make(cascade());
  EXPECT_TRUE(c.uses_position());
  EXPECT_TRUE(c.integrates());
  EXPECT_NEAR(c.following_error(0.38), 0.25 * 0.38 / 5.0, 1e-16);
  EXPECT_EQ(make(pid()).following_error(0.38), 0.0);
  EXPECT_FALSE(make(pid()).uses_position());
  expect_rest(c, {0.5, 0.38, 0.0}, {0.5 - c.following_error(0.38), 0.38}, 0.2);
}

// ---- configuration ------------------------------------------------------------------------------------

template <class Change>
std::string refused_field(ControllerConfig config, Change change) {
  change(config);
  const auto result = Controller::create(config, kRate);
  return result ? std::string("accepted") : std::string(result.error().field);
}

TEST(Controller, NamesTheFieldThatIsWrong) {
  EXPECT_EQ(refused_field(pi(0.0, 0.1), [](auto&) {}), "gain");
  EXPECT_EQ(refused_field(pi(INFINITY, 0.1), [](auto&) {}), "gain");
  EXPECT_EQ(refused_field(pi(1.0, 0.0), [](auto&) {}), "integral_time_s");
  EXPECT_EQ(refused_field(pi(1.0, 0.0), [](auto& c) { c.kind = ControllerKind::p; }), "accepted");
  EXPECT_EQ(refused_field(pid(), [](auto& c) { c.derivative_time_s = -1.0; }), "derivative_time_s");
  EXPECT_EQ(refused_field(pid(), [](auto& c) { c.derivative_filter_s = NAN; }), "derivative_filter_s");
  EXPECT_EQ(refused_field(cascade(), [](auto& c) { c.position_gain = 0.0; }), "position_gain");
  EXPECT_EQ(refused_field(cascade(), [](auto& c) { c.velocity_feedforward = 1.1; }), "velocity_feedforward");
  EXPECT_EQ(refused_field(cascade(), [](auto& c) { c.acceleration_feedforward = -1.0; }),
            "acceleration_feedforward");
  EXPECT_EQ(refused_field(cascade(), [](auto& c) { c.viscous_feedforward = NAN; }), "viscous_feedforward");
  EXPECT_EQ(refused_field(cascade(), [](auto& c) { c.coulomb_feedforward = -0.1; }), "coulomb_feedforward");
  EXPECT_EQ(refused_field(cascade(), [](auto& c) { c.reference_delay_s = INFINITY; }), "reference_delay_s");
  EXPECT_EQ(refused_field(pid(), [](auto& c) { c.velocity_limit = -1.0; }), "velocity_limit");
  EXPECT_EQ(refused_field({}, [](auto& c) { c.torque_limit = -1.0; }), "torque_limit");
  EXPECT_EQ(refused_field(rst(), [](auto&) {}), "accepted");
  EXPECT_EQ(refused_field(rst(), [](auto& c) { c.r[0] = 0.0; }), "r");
  EXPECT_EQ(refused_field(rst(), [](auto& c) { c.s.clear(); }), "s");
  EXPECT_EQ(refused_field(rst(), [](auto& c) { c.t.assign(18, 1.0); }), "t");
  EXPECT_EQ(refused_field(transfer_function(), [](auto& c) { c.numerator[0] = NAN; }), "numerator");
  EXPECT_EQ(refused_field(transfer_function(), [](auto& c) { c.denominator[0] = 0.0; }), "denominator");
  EXPECT_EQ(Controller::create(pid(), 0.0).error().field, "sample_rate_hz");
}

TEST(Controller, RefusesUnstableLawsButNoIntegrators) {
  const auto field = [](std::vector<double> denominator) {
    return refused_field(transfer_function(), [&](auto& c) { c.denominator = denominator; });
  };
  EXPECT_EQ(field({1.0, -1.0}), "accepted");
  EXPECT_EQ(field({1.0, -2.0, 1.0}), "accepted");
  EXPECT_EQ(field({1.0, 1.0}), "accepted");
  EXPECT_EQ(field({1.0, -1.001}), "denominator");
  EXPECT_EQ(field({1.0, 0.0, 1.1}), "denominator");
  EXPECT_EQ(field({1e-300, 1e300}), "denominator");
  EXPECT_EQ(refused_field(rst(), [](auto& c) { c.r = {1.0, -1.2}; }), "r");
}

TEST(Controller, DescribesTheFieldsOfEachKind) {
  const auto fields = [](ControllerKind kind) {
    ControllerConfig c;
    c.kind = kind;
    std::string names;
    describe([&names](std::string_view name, auto&, std::string_view) { names.append(name).append(" "); }, c);
    return names;
  };
  const std::string limits = "velocity_limit torque_limit ";
  EXPECT_EQ(fields(ControllerKind::none), "kind torque_limit ");
  EXPECT_EQ(fields(ControllerKind::p), "kind gain " + limits);
  EXPECT_EQ(fields(ControllerKind::pi), "kind gain integral_time_s " + limits);
  EXPECT_EQ(fields(ControllerKind::pid),
            "kind gain integral_time_s derivative_time_s derivative_filter_s " + limits);
  EXPECT_EQ(fields(ControllerKind::cascade),
            "kind gain integral_time_s position_gain velocity_feedforward acceleration_feedforward "
            "viscous_feedforward coulomb_feedforward reference_delay_s " +
                limits);
  EXPECT_EQ(fields(ControllerKind::rst), "kind r s t " + limits);
  EXPECT_EQ(fields(ControllerKind::transfer_function), "kind numerator denominator " + limits);
  EXPECT_EQ(name_of(ControllerKind::transfer_function), "transfer-function");
  EXPECT_EQ(name_of(ControllerKind::cascade), "cascade");
}

}  // namespace
}  // namespace resonid::plant
