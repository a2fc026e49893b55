// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <golden.hpp>
#include <memory>
#include <resonid/base/approach.hpp>
#include <resonid/recursive/response_fit.hpp>
#include <resonid/tracking/response_tracker.hpp>
#include <resonid/tracking/sliding_dft.hpp>
#include <vector>

#include "allocation_counter.hpp"

namespace resonid::recursive {
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
    using Tracker = tracking::SlidingDft<double, 21, 400>;
    const auto dft = Tracker::create({sample_rate_hz, window, lines}).value();
    std::vector<Complex> controller;
    const double ts = 1.0 / sample_rate_hz;
    const double kp = expected.at("Kp"), ti = expected.at("Ti"), kpc = expected.at("Kpc");
    for (const double f : lines) {
      const Complex sum = 1.0 / (1.0 - std::polar(1.0, -kTwoPi * f * ts));  // z/(z-1)
      controller.push_back(kp * (1.0 + ts / ti * sum) * (1.0 + kpc * ts * sum));
    }
    tracking::ResponseTrackerConfig config;
    config.known_delay_s = expected.at("delay_samples").get<double>() * ts;
    config.controller_at_line = controller;
    auto tracker = tracking::ResponseTracker<Tracker>::create(dft, config).value();
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

}  // namespace
}  // namespace resonid::recursive
