// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <golden.hpp>
#include <memory>
#include <random>
#include <resonid/base/approach.hpp>
#include <resonid/online/lines/response_tracker.hpp>
#include <resonid/online/lines/sliding_dft.hpp>
#include <resonid/online/models/detail/response_fit.hpp>
#include <resonid/online/models/modes.hpp>
#include <resonid/online/models/recursive_response_fit.hpp>
#include <vector>

#include "allocation_counter.hpp"

namespace resonid::online {
namespace {

using Complex = std::complex<double>;
using Fit = ResponseFit<double, 3, 21>;

// --- Golden files: an implementation that shares no code with this one (tests/golden/README.md) ----------

struct Instant {
  std::size_t sample = 0;
  std::vector<Complex> y, ru, response;
};

/// The record d_tooth.csv through the sliding DFT, at the instants of the golden file.
struct Golden {
  nlohmann::json expected = test::golden_json("d_expected.json");
  std::vector<double> lines;
  double sample_rate_hz = 0.0;
  std::size_t window = 0;

  Golden() {
    sample_rate_hz = 1.0 / expected.at("Ts").get<double>();
    window = expected.at("N").get<std::size_t>();
    for (const auto& bin : expected.at("bins"))
      lines.push_back(bin.get<double>() * sample_rate_hz / double(window));
  }

  [[nodiscard]] std::vector<Instant> instants(const std::string& y_column) const {
    using Tracker = online::SlidingDft<double, 21, 400>;
    const auto dft = Tracker::create({sample_rate_hz, window, lines}).value();
    std::vector<Complex> controller;
    const double ts = 1.0 / sample_rate_hz;
    const double kp = expected.at("Kp"), ti = expected.at("Ti"), kpc = expected.at("Kpc");
    for (const double f : lines) {
      const Complex sum = 1.0 / (1.0 - std::polar(1.0, -kTwoPi * f * ts));  // z/(z-1)
      controller.push_back(kp * (1.0 + ts / ti * sum) * (1.0 + kpc * ts * sum));
    }
    online::ResponseTrackerConfig config;
    config.known_delay_s = expected.at("delay_samples").get<double>() * ts;
    config.controller_at_line = controller;
    auto tracker = online::ResponseTracker<Tracker>::create(dft, config).value();
    const auto ru = test::golden_column("d_tooth.csv", "ru");
    const auto y = test::golden_column("d_tooth.csv", y_column);
    std::vector<Instant> found;
    for (std::size_t k = 0; k < y.size(); ++k) {
      tracker.step(ru[k], 0.0, y[k]);
      if (k != expected.at("k")[found.size()].get<std::size_t>()) continue;
      Instant now{k, {}, {}, {}};
      for (std::size_t l = 0; l < lines.size(); ++l) {
        now.response.push_back(tracker.response(l, Approach::indirect));
        now.y.push_back(unscaled(tracker.output().amplitude(l)));
        now.ru.push_back(unscaled(tracker.excitation().amplitude(l)));
      }
      found.push_back(std::move(now));
      if (found.size() == expected.at("k").size()) break;
    }
    return found;
  }
  /// As in the file: not scaled. Its phase is that of sample 0 (the fifth instant, which is no whole number
  /// of windows from the start, tells), not that of the window's oldest sample.
  [[nodiscard]] Complex unscaled(Complex amplitude) const { return 0.5 * double(window) * amplitude; }
};

void expect_close(const std::vector<Complex>& found, const nlohmann::json& golden, std::size_t at,
                  double relative) {
  for (std::size_t l = 0; l < found.size(); ++l) {
    const Complex expected(golden.at("re")[at][l].get<double>(), golden.at("im")[at][l].get<double>());
    EXPECT_NEAR(std::abs(found[l] - expected), 0.0, relative * std::abs(expected)) << at << " " << l;
  }
}

TEST(ResponseFitGolden, LinesAreThoseOfTheSlidingDft) {
  const Golden golden;
  const auto instants = golden.instants("y_clean");
  ASSERT_EQ(instants.size(), 5U);
  for (std::size_t i = 0; i < instants.size(); ++i) {
    expect_close(instants[i].y, golden.expected.at("sdft_y_clean"), i, 1e-6);
    expect_close(instants[i].ru, golden.expected.at("sdft_ru"), i, 1e-6);
    expect_close(instants[i].response, golden.expected.at("G_indirect_clean"), i, 1e-6);
  }
}

void expect_models(const std::string& column, const std::string& name, ResponseFitConfig config,
                   double relative) {
  const Golden golden;
  config.sample_rate_hz = golden.sample_rate_hz;
  config.frequency_hz = golden.lines;
  config.warm_start = false;
  auto fit = Fit::create(config).value();
  const auto& expected = golden.expected.at(name);
  const auto instants = golden.instants(column);
  for (std::size_t i = 0; i < instants.size(); ++i) {
    fit.step(instants[i].response);
    const auto model = fit.model();
    for (std::size_t j = 0; j < 3; ++j) {
      const double b = expected.at("b")[i][j + 1], a = expected.at("a")[i][j + 1];
      EXPECT_NEAR(model.b[j], b, relative * std::abs(b)) << name << i;
      EXPECT_NEAR(model.a[j], a, relative * std::abs(a)) << name << i;
    }
  }
}

TEST(ResponseFitGolden, Levy) {
  const ResponseFitConfig levy{.integrator = false, .iterations = 0};
  expect_models("y_clean", "levy_clean", levy, 1e-6);
  expect_models("y_noisy", "levy_noisy", levy, 1e-6);
}

TEST(ResponseFitGolden, SanathananKoerner) {
  for (const int n : {7, 8}) {
    const ResponseFitConfig free{.integrator = false, .iterations = std::size_t(n)};
    expect_models("y_clean", "sk8_clean", free, 1e-5);
    expect_models("y_noisy", "sk8_noisy", free, 1e-5);
    const ResponseFitConfig fixed{.integrator = true, .iterations = std::size_t(n)};
    expect_models("y_clean", "sk8_integrator_clean", fixed, 1e-5);
    expect_models("y_noisy", "sk8_integrator_noisy", fixed, 1e-5);
  }
}

// --- A known machine --------------------------------------------------------------------------------------

constexpr double kRate = 2000.0;

/// 11 lines every 10 Hz around a resonance at 60 and an anti-resonance at 37 Hz, integrator included.
struct Machine {
  DiscreteModel<double, 3> model;
  std::vector<double> lines;
  std::vector<Complex> response;

  explicit Machine(double resonance_hz = 60.0) {
    const auto pair = [](double f, double damping) {
      const auto z = std::exp(kTwoPi * f / kRate * Complex(-damping, std::sqrt(1.0 - damping * damping)));
      return std::array<double, 2>{-2.0 * z.real(), std::norm(z)};
    };
    const auto p = pair(resonance_hz, 0.05), q = pair(37.0, 0.03);
    model.a = {p[0] - 1.0, p[1] - p[0], -p[1]};
    model.b = {0.17, 0.17 * q[0], 0.17 * q[1]};
    for (double f = 20.0; f < 121.0; f += 10.0) {
      lines.push_back(f);
      response.push_back(at(f));
    }
  }
  [[nodiscard]] Complex at(double f) const {
    const Complex q = std::polar(1.0, -kTwoPi * f / kRate);
    return q * (model.b[0] + q * (model.b[1] + q * model.b[2])) /
           (1.0 + q * (model.a[0] + q * (model.a[1] + q * model.a[2])));
  }
};

template <class Real>
double resonance(const DiscreteModel<Real, 3>& model) {
  const auto modes = SampledModes<3>(model, kRate).resonances();
  return modes.empty() ? 0.0 : modes[0].frequency_hz;
}

TEST(ResponseFit, RecoversTheMachine) {
  const Machine machine;
  const double truth = resonance(machine.model);
  for (const bool integrator : {false, true}) {
    for (const std::size_t iterations : {0U, 1U, 4U}) {
      auto fit = Fit::create({.sample_rate_hz = kRate,
                              .frequency_hz = machine.lines,
                              .integrator = integrator,
                              .iterations = iterations})
                     .value();
      EXPECT_FALSE(fit.ready());
      EXPECT_TRUE(std::isinf(fit.covariance()(0, 0)));
      fit.step(machine.response);
      EXPECT_TRUE(fit.ready());
      for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_NEAR(fit.model().a[i], machine.model.a[i], 1e-9);
        EXPECT_NEAR(fit.model().b[i], machine.model.b[i], 1e-9);
      }
      EXPECT_NEAR(resonance(fit.model()), truth, 1e-7);
      EXPECT_LT(fit.misfit(), 1e-8);
    }
  }
  auto single =
      ResponseFit<float, 3, 11>::create({.sample_rate_hz = kRate, .frequency_hz = machine.lines}).value();
  std::vector<std::complex<float>> response(machine.response.begin(), machine.response.end());
  for (int k = 0; k < 5; ++k) single.step(response);
  EXPECT_NEAR(resonance(single.model()), truth, 0.01);
}

TEST(RecursiveResponseFit, RecoversTheMachineLineByLine) {
  const Machine machine;
  for (const bool levy : {false, true}) {
    auto fit = RecursiveResponseFit<double, 3, 11>::create(
                   {.sample_rate_hz = kRate, .frequency_hz = machine.lines, .levy = levy})
                   .value();
    for (int k = 0; k < 50; ++k) {
      EXPECT_EQ(fit.ready(), k >= 11);
      fit.step(machine.response[fit.next_line()]);
    }
    for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(fit.model().a[i], machine.model.a[i], 1e-8);
  }
}

/// Line values with circular noise of this total standard deviation.
std::vector<Complex> noisy(const Machine& machine, double deviation, std::mt19937_64& generator) {
  std::normal_distribution<double> normal(0.0, deviation / std::sqrt(2.0));
  auto response = machine.response;
  for (auto& g : response) g += Complex(normal(generator), normal(generator));
  return response;
}

// 400 seeds: standard deviation of the mean of squares 0.07.
TEST(ResponseFit, DeviationOfTheResonanceIsThatOfItsError) {
  const Machine machine;
  const double truth = resonance(machine.model), sd = 0.02;
  const std::vector<double> known(machine.lines.size(), sd);
  struct Case {
    std::size_t iterations;
    bool told, weigh;
  };
  for (const Case c :
       {Case{0, true, false}, Case{2, true, false}, Case{2, true, true}, Case{2, false, false}}) {
    auto fit = Fit::create({.sample_rate_hz = kRate,
                            .frequency_hz = machine.lines,
                            .iterations = c.iterations,
                            .warm_start = false,
                            .weigh_deviations = c.weigh})
                   .value();
    double sum = 0.0;
    for (std::uint64_t seed = 1; seed <= 400; ++seed) {
      std::mt19937_64 generator(seed);
      const auto response = noisy(machine, sd, generator);
      if (c.told)
        fit.step(response, known);
      else
        fit.step(response);
      const auto mode = SampledModes<3>(fit.model(), kRate).resonances(fit.covariance())[0];
      sum += std::pow((mode.frequency_hz - truth) / mode.std_hz, 2) / 400.0;
    }
    // Not told, the deviation is estimated from 17 degrees of freedom: mean of t^2 17/15.
    EXPECT_NEAR(sum, c.told ? 1.0 : 17.0 / 15.0, 0.28) << c.iterations << c.told << c.weigh;
  }
}

// New noise at every step, memory of 20 turns.
TEST(RecursiveResponseFit, DeviationOfTheResonanceIsThatOfItsError) {
  const Machine machine;
  const double truth = resonance(machine.model);
  double sum = 0.0;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    auto fit = RecursiveResponseFit<double, 3, 11>::create(
                   {.sample_rate_hz = kRate, .frequency_hz = machine.lines, .memory_steps = 220.0})
                   .value();
    std::mt19937_64 generator(seed);
    for (int turn = 0; turn < 100; ++turn)
      for (const auto& g : noisy(machine, 0.02, generator)) fit.step(g);
    const auto mode = SampledModes<3>(fit.model(), kRate).resonances(fit.covariance())[0];
    sum += std::pow((mode.frequency_hz - truth) / mode.std_hz, 2) / 200.0;
  }
  EXPECT_NEAR(sum, 1.0, 0.4);
}

TEST(ResponseFit, LeavesOutLinesThatAreNotFinite) {
  const Machine machine;
  auto fit = Fit::create({.sample_rate_hz = kRate, .frequency_hz = machine.lines}).value();
  auto holed = machine.response;
  std::vector<double> sd(holed.size(), 0.1);
  holed[3] = {std::nan(""), 0.0};
  sd[7] = std::numeric_limits<double>::infinity();
  fit.step(holed, sd);
  EXPECT_TRUE(fit.ready());
  EXPECT_NEAR(resonance(fit.model()), resonance(machine.model), 1e-7);
  const auto before = fit.model();
  for (std::size_t i = 0; i + 2 < holed.size(); ++i) holed[i] = {0.0, std::nan("")};
  fit.step(holed);  // two lines are too few
  EXPECT_EQ(fit.skipped_steps(), 1U);
  EXPECT_EQ(fit.model().a, before.a);
  fit.reset();
  EXPECT_FALSE(fit.ready());

  auto lines =
      RecursiveResponseFit<double, 3, 11>::create({.sample_rate_hz = kRate, .frequency_hz = machine.lines})
          .value();
  for (int k = 0; k < 100; ++k)
    lines.step(k % 3 == 0 ? Complex(std::nan(""), 0.0) : machine.response[lines.next_line()]);
  EXPECT_EQ(lines.skipped_steps(), 34U);
  EXPECT_NEAR(resonance(lines.model()), resonance(machine.model), 1e-6);
}

// The rest of a lag is the tracker's: what the fit knows is the machine's own, 0.7/(zeta w), and its memory.
TEST(ResponseFit, LagFollowsFromTheModel) {
  const Machine machine;
  auto fit = Fit::create({.sample_rate_hz = kRate, .frequency_hz = machine.lines}).value();
  EXPECT_EQ(fit.lag_samples(), 0.0);
  fit.step(machine.response);
  EXPECT_NEAR(fit.lag_samples(), 0.7 * kRate / (0.05 * kTwoPi * 60.0), 1e-6);
  auto lines = RecursiveResponseFit<double, 3, 11>::create(
                   {.sample_rate_hz = kRate, .frequency_hz = machine.lines, .memory_steps = 50.0})
                   .value();
  for (int k = 0; k < 100; ++k) lines.step(machine.response[lines.next_line()]);
  EXPECT_NEAR(lines.lag_samples(), 49.0 + fit.lag_samples(), 1e-4);
}

TEST(ResponseFit, NeedsNoHeapAndResets) {
  const Machine machine;
  auto fit = Fit::create({.sample_rate_hz = kRate, .frequency_hz = machine.lines}).value();
  auto lines =
      RecursiveResponseFit<double, 3, 21>::create({.sample_rate_hz = kRate, .frequency_hz = machine.lines})
          .value();
  std::array<DiscreteModel<double, 3>, 2> first{};
  const std::size_t before = test::allocations();
  double sum = 0.0;
  for (int pass = 0; pass < 2; ++pass) {
    for (int k = 0; k < 50; ++k) {
      fit.step(machine.response);
      lines.step(machine.response[lines.next_line()]);
      sum += fit.covariance()(0, 0) + lines.lag_samples() + fit.misfit();
    }
    if (pass == 0) first = {fit.model(), lines.model()};
    if (pass == 1) {
      EXPECT_EQ(fit.model().a, first[0].a);
      EXPECT_EQ(lines.model().a, first[1].a);
    }
    fit.reset();
    lines.reset();
  }
  EXPECT_EQ(test::allocations(), before);
  EXPECT_GT(sum, 0.0);
}

TEST(ResponseFit, RefusesWhatCannotWork) {
  const Machine machine;
  const auto field = [](const auto& made) { return made ? std::string() : std::string(made.error().field); };
  const std::vector<double> two{20.0, 30.0}, high{20.0, 30.0, 1000.0};
  using Small = ResponseFit<double, 3, 4>;
  EXPECT_EQ(field(Fit::create({.sample_rate_hz = 0.0, .frequency_hz = machine.lines})), "sample_rate_hz");
  EXPECT_EQ(field(Fit::create({.sample_rate_hz = kRate, .frequency_hz = two})), "frequency_hz");
  EXPECT_EQ(field(Fit::create({.sample_rate_hz = kRate, .frequency_hz = high})), "frequency_hz");
  EXPECT_EQ(field(Small::create({.sample_rate_hz = kRate, .frequency_hz = machine.lines})), "frequency_hz");
  using Lines = RecursiveResponseFit<double, 3, 11>;
  EXPECT_EQ(field(Lines::create({.sample_rate_hz = kRate, .frequency_hz = two})), "frequency_hz");
  EXPECT_EQ(
      field(Lines::create({.sample_rate_hz = kRate, .frequency_hz = machine.lines, .memory_steps = 3.0})),
      "memory_steps");
  EXPECT_EQ(field(Lines::create(
                {.sample_rate_hz = kRate, .frequency_hz = machine.lines, .correlated_steps = -1.0})),
            "correlated_steps");
}

}  // namespace
}  // namespace resonid::online
