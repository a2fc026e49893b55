// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <golden.hpp>
#include <limits>
#include <resonid/base/constants.hpp>
#include <resonid/data/transfer_function.hpp>
#include <resonid/online/lines/chirp_tracker.hpp>
#include <resonid/online/lines/response_tracker.hpp>
#include <string>
#include <vector>

namespace resonid::online {
namespace {

using Complex = std::complex<double>;
using Tracker = ChirpTracker<double>;

// 35 -> 1.5 Hz in 17 s at 500 Hz: the experiment of Publication VI and of the golden files.
ChirpTrackerConfig publication_vi(GainRule gain = GainRule::fixed) {
  return {.sample_rate_hz = 500.0, .from_hz = 35.0, .to_hz = 1.5, .duration_s = 17.0, .gain = gain};
}

TEST(ChirpTracker, MeetsGoldenPhasors) {
  const auto expected = test::golden_json("b_expected.json");
  for (const std::string signal : {"ru", "u_clean", "y_clean", "y_noisy"}) {
    for (const GainRule gain : {GainRule::fixed, GainRule::placed_poles}) {
      const auto& golden = expected[(gain == GainRule::fixed ? "phasor_lam8_" : "phasor_poles.98_") + signal];
      const auto value = test::golden_complex(golden);
      const auto at = golden["k"].get<std::vector<std::size_t>>();
      Tracker tracker = Tracker::create(publication_vi(gain)).value();
      std::size_t next = 0;
      for (const double z : test::golden_column("b_chirp_sys2.csv", signal)) {
        tracker.step(z);
        if (next == at.size() || tracker.samples() != at[next] + 1) continue;
        EXPECT_LE(std::abs(tracker.phasor() - value[next]), 1e-6 * std::abs(value[next]))
            << signal << at[next];
        ++next;
      }
      EXPECT_EQ(next, at.size());
    }
  }
}

// The golden responses on 2 ... 33 Hz: amplitudes of u, y (ru) linear in time between the samples around the
// time at which the chirp (plus `label` samples) is at the frequency.
std::vector<Complex> on_grid(const ChirpTrackerConfig& config, const std::string& variant, double label,
                             bool indirect) {
  const auto ru = test::golden_column("b_chirp_sys2.csv", "ru");
  const auto u = test::golden_column("b_chirp_sys2.csv", "u_" + variant);
  const auto y = test::golden_column("b_chirp_sys2.csv", "y_" + variant);
  const auto expected = test::golden_json("b_expected.json");
  const auto pi = data::pi_controller(expected["Kp"], expected["Ti"], 0.002);
  Tracker input = Tracker::create(config).value(), output = input;
  std::vector<Complex> in, out;
  for (std::size_t k = 0; k < u.size(); ++k) {
    input.step(indirect ? ru[k] : u[k]);
    output.step(y[k]);
    in.push_back(input.amplitude());
    out.push_back(output.amplitude());
  }
  std::vector<Complex> response;
  for (const double f : expected["f"]) {
    const double time =
        (f - config.from_hz) / (config.to_hz - config.from_hz) * config.duration_s * 500.0 + label;
    const auto k = static_cast<std::size_t>(time);
    const double part = time - static_cast<double>(k);
    Complex g = ((1.0 - part) * out[k] + part * out[k + 1]) / ((1.0 - part) * in[k] + part * in[k + 1]);
    if (indirect) g = g / (1.0 - pi.response(f) * g);
    response.push_back(g * std::polar(1.0, kTwoPi * f * 0.004));
  }
  return response;
}

TEST(ChirpTracker, MeetsGoldenResponses) {
  const auto expected = test::golden_json("b_expected.json");
  const auto compare = [&](const std::string& name, GainRule gain, double label, bool indirect) {
    for (const std::string variant : {"clean", "noisy"}) {
      const auto golden = test::golden_complex(expected[name][variant]);
      const auto response = on_grid(publication_vi(gain), variant, label, indirect);
      ASSERT_EQ(response.size(), golden.size());
      for (std::size_t i = 0; i < golden.size(); ++i)
        EXPECT_LE(std::abs(response[i] - golden[i]), 1e-6 * std::abs(golden[i])) << name << variant << i;
    }
  };
  compare("lam8_direct", GainRule::fixed, 0.0, false);
  compare("lam8_indirect", GainRule::fixed, 0.0, true);
  compare("poles98_direct_label49_5", GainRule::placed_poles, 49.5, false);
}

double chirp(const ChirpTrackerConfig& c, double t) {
  const double q = std::log(c.to_hz / c.from_hz);
  const double cycles = c.sweep == Sweep::linear
                            ? t * (c.from_hz + 0.5 * (c.to_hz - c.from_hz) / c.duration_s * t)
                            : c.from_hz * c.duration_s / q * std::expm1(q * t / c.duration_s);
  return std::cos(kTwoPi * cycles + 0.5);
}

// A chirp of constant amplitude through a settled tracker: only the sweep's own second-order effect is left,
// of the size (sweep rate in rad/sample^2) * (lag in samples)^2.
TEST(ChirpTracker, FollowsAChirp) {
  for (const Sweep sweep : {Sweep::linear, Sweep::logarithmic}) {
    for (const bool offset : {false, true}) {
      const ChirpTrackerConfig config{.sample_rate_hz = 1000.0,
                                      .from_hz = 20.0,
                                      .to_hz = 80.0,
                                      .duration_s = 20.0,
                                      .sweep = sweep,
                                      .offset = offset,
                                      .gain = GainRule::placed_poles,
                                      .pole_radius = 0.95};
      Tracker tracker = Tracker::create(config).value();
      for (int k = 0; k < 15000; ++k) tracker.step(chirp(config, k * 0.001) + (offset ? 4.0 : 0.0));
      const double rate = sweep == Sweep::linear ? 3.0 : std::log(4.0) / 20.0 * 20.0 * std::pow(4.0, 0.75);
      const double bound = kTwoPi * rate * 1e-6 * 20.0 * 20.0;
      EXPECT_LT(std::abs(tracker.amplitude() - std::polar(1.0, 0.5)), bound);
      EXPECT_NEAR(tracker.offset(), offset ? 4.0 : 0.0, bound);
      const double f = sweep == Sweep::linear ? 20.0 + 3.0 * 14.999 : 20.0 * std::pow(4.0, 14.999 / 20.0);
      EXPECT_NEAR(tracker.frequency_hz(), f, 1e-9);
    }
  }
}

TEST(ChirpTracker, StaysAtTheLastFrequency) {
  for (const Sweep sweep : {Sweep::linear, Sweep::logarithmic}) {
    const ChirpTrackerConfig config{.sample_rate_hz = 1000.0,
                                    .from_hz = 80.0,
                                    .to_hz = 20.0,
                                    .duration_s = 1.2345,
                                    .sweep = sweep,
                                    .lambda = 20.0};
    Tracker tracker = Tracker::create(config).value();
    const double end = config.duration_s;
    for (int k = 0; k < 6000; ++k) {
      const double t = k * 0.001;
      const double cycles =
          SweepLaw{80.0, 20.0, end, sweep}.cycles(std::min(t, end)) + 20.0 * std::max(0.0, t - end);
      tracker.step(std::cos(kTwoPi * cycles));
    }
    EXPECT_DOUBLE_EQ(tracker.frequency_hz(), 20.0);
    EXPECT_LT(std::abs(tracker.amplitude() - 1.0), 1e-9);
  }
}

// The rotation that is itself rotated must not wander off: compared with one of cosines at every sample.
TEST(ChirpTracker, RotationStaysExact) {
  ChirpTrackerConfig config = publication_vi();
  config.duration_s = 2000.0;
  Tracker exact = Tracker::create(config).value();
  auto single = ChirpTracker<float>::create(config).value();
  double worst = 0.0, worst_single = 0.0;
  for (int k = 0; k < 1000000; ++k) {
    exact.step(0.0);
    single.step(0.0F);
    if (k % 97 != 0) continue;
    const auto truth = std::polar(1.0, kTwoPi * (35.0 - 33.5 * k / 1e6) / 500.0);
    worst = std::max(worst, std::abs(exact.rotation() - truth));
    worst_single = std::max(worst_single, std::abs(Complex(single.rotation()) - truth));
  }
  EXPECT_LT(worst, 1e-13);
  EXPECT_LT(worst_single, 5e-6);
}

TEST(ChirpTracker, ChannelsAreTrackersThatShareARotation) {
  for (const GainRule gain : {GainRule::fixed, GainRule::placed_poles}) {
    ChirpTrackerConfig config = publication_vi(gain);
    config.offset = gain == GainRule::placed_poles;
    const Tracker fresh = Tracker::create(config).value();
    std::array<Tracker, 3> single{fresh, fresh, fresh};
    auto together = ChirpTracker<double, 3>::create(config).value();
    const double nan = std::numeric_limits<double>::quiet_NaN();
    for (int k = 0; k < 9000; ++k) {  // beyond the end of the sweep
      std::array<double, 3> z{std::sin(0.3 * k), 0.7 + std::cos(0.1 * k), 0.01 * (k % 7)};
      if (k == 4000) z[1] = nan;
      together.step(z);
      for (std::size_t i = 0; i < 3; ++i) single[i].step(k == 4000 ? nan : z[i]);  // missing for all
      for (std::size_t i = 0; i < 3; ++i) {
        ASSERT_EQ(together.phasor(0, i), single[i].phasor()) << k;
        ASSERT_EQ(together.offset(i), single[i].offset()) << k;
      }
    }
    EXPECT_EQ(together.amplitude(0, 2), single[2].amplitude());
    EXPECT_EQ(together.skipped_samples(), 1U);
  }
}

TEST(ChirpTracker, LagIsThatOfTheSource) {
  Tracker fixed = Tracker::create(publication_vi()).value();
  Tracker placed = Tracker::create(publication_vi(GainRule::placed_poles)).value();
  EXPECT_NEAR(fixed.lag_samples(), 17.0, 1.0);  // independent implementation: group delay
  EXPECT_NEAR(placed.lag_samples(), 49.5, 0.5);
}

TEST(ChirpTracker, RefusesWhatCannotWork) {
  const auto field = [](auto change) {
    ChirpTrackerConfig config = publication_vi();
    change(config);
    const auto tracker = Tracker::create(config);
    return tracker ? std::string("accepted") : std::string(tracker.error().field);
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(field([](auto&) {}), "accepted");
  EXPECT_EQ(field([](auto& c) { c.sample_rate_hz = -1.0; }), "sample_rate_hz");
  EXPECT_EQ(field([](auto& c) { c.from_hz = 0.0; }), "from_hz");
  EXPECT_EQ(field([](auto& c) { c.to_hz = 250.0; }), "to_hz");
  EXPECT_EQ(field([&](auto& c) { c.to_hz = nan; }), "to_hz");
  EXPECT_EQ(field([](auto& c) { c.duration_s = 0.0; }), "duration_s");
  EXPECT_EQ(field([](auto& c) { c.lambda = -0.5; }), "lambda");
  EXPECT_EQ(field([](auto& c) { c.gain = GainRule::placed_poles, c.pole_radius = 1.0; }), "pole_radius");
}

}  // namespace
}  // namespace resonid::online
