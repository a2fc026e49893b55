// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <resonid/base/constants.hpp>
#include <resonid/data/record.hpp>
#include <resonid/report/json.hpp>
#include <string>

#include "results.hpp"

namespace resonid::report {
namespace {

using nlohmann::json;

constexpr double kRateHz = 500.0;
constexpr std::size_t kSamples = 4096;

/// Lines at 5 and 20 Hz in the input, 5 Hz alone in the output.
data::Record recording() {
  data::Record record;
  record.sample_rate_hz = kRateHz;
  record.input.name = "u";
  record.input.unit = "Nm";
  record.output.name = "y";
  record.output.unit = "rad/s";
  for (std::size_t k = 0; k < kSamples; ++k) {
    const double t = static_cast<double>(k) / kRateHz;
    record.input.samples.push_back(std::sin(kTwoPi * 5.0 * t) + std::sin(kTwoPi * 20.0 * t));
    record.output.samples.push_back(3.0 * std::cos(kTwoPi * 5.0 * t));
  }
  return record;
}

/// L = w0^2 / (s (s + 2 d w0)): T is a plain second-order system.
data::FrequencyResponse loop_of(double damping, double natural_hz) {
  data::FrequencyResponse loop;
  for (double f = 0.02 * natural_hz; f < 50.0 * natural_hz; f *= 1.002) {
    const std::complex<double> s(0.0, f / natural_hz);
    loop.frequency_hz.push_back(f);
    loop.value.push_back(1.0 / (s * (s + 2.0 * damping)));
  }
  return loop;
}

json page_of(identification::Result result) {
  result.record.samples = kSamples;
  return page_json(result, recording()).at("page");
}

/// Beside the loop that ran.
TEST(PageCharts, HoldThePlannedLoop) {
  auto result = test::full();
  EXPECT_FALSE(page_of(result).contains("planned_curve"));
  result.planned_loop = result.loop;
  result.planned_loop->curve = loop_of(0.3, 8.0);
  const json page = page_of(result);
  EXPECT_EQ(page.at("planned_curve").at("real").size(), result.planned_loop->curve.lines());
  EXPECT_FALSE(page.at("planned_curve").contains("std"));
  EXPECT_FALSE(page.contains("planned_crossings"));
  result.planned_loop->crossings = {{{9.3, 70.0}, true}, {{44.0, 9.5}, false, 3.0}};
  const json crossings = page_of(result).at("planned_crossings");
  ASSERT_EQ(crossings.size(), 2U);
  EXPECT_FALSE(crossings[0].contains("phase_margin_std_deg"));
  EXPECT_EQ(crossings[1].at("phase_margin_deg"), 9.5);
  EXPECT_EQ(crossings[1].at("phase_margin_std_deg"), 3.0);
  EXPECT_EQ(crossings[1].at("falling"), false);
  const auto summary_with = [&](const char* id) {
    auto told = result;
    told.findings.push_back({id, diagnostics::Severity::warning, {}, {}, "Told."});
    return page_of(told).at("summary").dump();
  };
  EXPECT_NE(summary_with("planned-small-margins").find("smallest phase margin"), std::string::npos);
  EXPECT_NE(summary_with("planned-may-be-unstable").find("MAY BE UNSTABLE"), std::string::npos);
  EXPECT_NE(summary_with("planned-not-judged").find("are not known"), std::string::npos);
  EXPECT_EQ(summary_with("planned-not-judged").find("smallest phase margin"), std::string::npos);
}

/// With a = 4 d^2, |S|^2 = x (x + a) / (x^2 + (a - 2) x + 1) over x = (w/w0)^2 is largest where 2 x^2 - 2 x -
/// a = 0; |T| is 1/(2 d sqrt(1 - d^2)) at most.
TEST(PageCharts, PeaksOfSensitivityAreTheAnalyticOnes) {
  for (const double d : {0.2, 0.5}) {
    auto result = test::full();
    result.loop->curve = loop_of(d, 8.0);
    result.loop->margins = diagnostics::loop_margins(result.loop->curve);
    const double a = 4.0 * d * d, x = 0.5 * (1.0 + std::sqrt(1.0 + 2.0 * a));
    const double ms = std::sqrt(x * (x + a) / (x * x + (a - 2.0) * x + 1.0));
    const double mt = 1.0 / (2.0 * d * std::sqrt(1.0 - d * d));
    const json page = page_of(result);
    EXPECT_NEAR(page.at("peaks").at("ms").get<double>(), ms, 1e-4 * ms);
    EXPECT_NEAR(page.at("peaks").at("ms_hz").get<double>(), 8.0 * std::sqrt(x), 0.02 * 8.0);
    EXPECT_NEAR(page.at("peaks").at("mt").get<double>(), mt, 1e-4 * mt);
    EXPECT_NEAR(page.at("peaks").at("mt_hz").get<double>(), 8.0 * std::sqrt(1.0 - 2.0 * d * d), 0.02 * 8.0);
    const json& curves = page.at("sensitivity").at("curves");
    for (const auto& [curve, peak] : {std::pair{curves.at(0), ms}, {curves.at(1), mt}}) {
      const auto levels = curve.at("y").get<std::vector<double>>();
      EXPECT_NEAR(*std::max_element(levels.begin(), levels.end()), 20.0 * std::log10(peak), 1e-3);
    }
  }
}

TEST(PageCharts, SimulatedIsMeasuredLessTheResidual) {
  auto result = test::full();
  result.residual.assign(kSamples - 100, 0.25);
  result.residual_start = 100;
  const json overlay = page_of(result).at("overlay");
  const auto& measured = overlay.at("curves").at(0);
  const auto& simulated = overlay.at("curves").at(1);
  ASSERT_EQ(measured.at("y").size(), kSamples - 100);  // every sample: it can be zoomed into
  EXPECT_EQ(measured.at("x").at(0), 100.0 / kRateHz);
  EXPECT_NEAR(measured.at("y").at(7).get<double>(), recording().output.samples[107], 1e-12);
  EXPECT_NEAR(simulated.at("y").at(7).get<double>(), recording().output.samples[107] - 0.25, 1e-12);
  EXPECT_EQ(overlay.at("y_label"), "y in rad/s");
  EXPECT_FALSE(page_of(test::bare()).contains("overlay"));
}

/// Power of the curve's highest point in a band.
double highest(const json& curve, double low_hz, double high_hz) {
  double best = -1e9;
  for (std::size_t i = 0; i < curve.at("x").size(); ++i)
    if (const double f = curve.at("x").at(i); f >= low_hz && f <= high_hz)
      best = std::max(best, curve.at("y").at(i).get<double>());
  return best;
}

TEST(PageCharts, SpectraShowTheLinesAndMarkThoseOfTheResponse) {
  auto result = test::full();
  result.response.frequency_hz = {5.0, 20.0, 60.0};
  const json spectra = page_of(result).at("spectra");
  ASSERT_EQ(spectra.size(), 2U);
  const json& input = spectra.at(0).at("curves");
  EXPECT_GT(highest(input.at(0), 4.0, 6.0), highest(input.at(0), 55.0, 65.0) + 60.0);
  EXPECT_GT(highest(input.at(0), 19.0, 21.0), highest(input.at(0), 55.0, 65.0) + 60.0);
  const json& output = spectra.at(1).at("curves").at(0);
  EXPECT_GT(highest(output, 4.0, 6.0), highest(output, 19.0, 21.0) + 60.0);
  EXPECT_EQ(input.at(1).at("x"), json({5.0, 20.0, 60.0}));
  EXPECT_GT(input.at(1).at("y").at(1).get<double>(), input.at(1).at("y").at(2).get<double>() + 40.0);
  EXPECT_EQ(spectra.at(0).at("y_label"), "Power in dB of (Nm)^2 per line");
}

TEST(PageCharts, ManyLinesAreABandInTheSpectra) {
  auto result = test::full();
  result.response = {};
  for (int i = 1; i <= 400; ++i) {
    result.response.frequency_hz.push_back(0.1 * i);
    result.response.value.emplace_back(1.0, 0.0);
  }
  const json input = page_of(result).at("spectra").at(0);
  EXPECT_EQ(input.at("curves").size(), 1U);
  EXPECT_NEAR(input.at("shapes").at(0).at("x").get<double>(), 0.1, 1e-12);
  EXPECT_NEAR(input.at("shapes").at(0).at("x_end").get<double>(), 40.0, 1e-12);
}

/// var(r) = r^2 (var_L/L^2 + var_M/M^2 - 2 cov/(L M)).
TEST(PageCharts, InertiaRatioHasItsErrorBar) {
  auto result = test::full();
  auto& drive = result.model->drive;
  drive.set(fit::kDrivenInertia, 0.02);
  drive.set(fit::kLoadInertia, 0.05);
  drive.covariance.setZero();
  drive.covariance(fit::kDrivenInertia, fit::kDrivenInertia) = 4e-8;
  drive.covariance(fit::kLoadInertia, fit::kLoadInertia) = 25e-8;
  const json alone = page_of(result).at("inertia_ratio");
  EXPECT_NEAR(alone.at("value").get<double>(), 2.5, 1e-12);
  EXPECT_NEAR(alone.at("std").get<double>(), 2.5 * std::sqrt(2e-4), 1e-9);
  // Errors that go together cancel in the ratio.
  drive.covariance(fit::kLoadInertia, fit::kDrivenInertia) = 9.9e-8;
  drive.covariance(fit::kDrivenInertia, fit::kLoadInertia) = 9.9e-8;
  EXPECT_NEAR(page_of(result).at("inertia_ratio").at("std").get<double>(), 2.5 * std::sqrt(2e-6), 1e-9);
  drive.structure = fit::Structure::rigid;
  EXPECT_FALSE(page_of(result).contains("inertia_ratio"));
}

}  // namespace
}  // namespace resonid::report
