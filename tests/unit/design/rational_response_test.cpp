// SPDX-License-Identifier: MIT
// Quick responses against those of the model, and maxima between lines against functions whose maxima are
// known.
#include "design/rational_response.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <resonid/base/constants.hpp>

#include "design/maxima.hpp"
#include "golden_machines.hpp"

namespace resonid::design {
namespace {

void expect_same(const fit::DriveModel& model) {
  const RationalResponse quick(fit::sampled_states(model));
  const double nyquist_hz = 0.5 / model.sample_time_s;
  std::vector<double> lines;
  for (int i = 0; i < 60; ++i) lines.push_back(nyquist_hz * std::pow(10.0, -4.0 * (59 - i) / 59.0));
  const auto exact = fit::SampledResponse(model).at(lines);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const auto z = std::polar(1.0, kTwoPi * lines[i] * model.sample_time_s);
    const auto found = quick.at(z - 1.0);
    EXPECT_LT(std::abs(found.measured / exact[i].measured - 1.0), 1e-8) << lines[i];
    EXPECT_LT(std::abs(found.load / exact[i].load - 1.0), 1e-8) << lines[i];
  }
}

TEST(RationalResponse, IsThatOfEveryModel) {
  for (const std::vector<double>& plant :
       {std::vector<double>{0.064, 0.01}, std::vector<double>{0.032, 0.04, 144.0, 0.3},
        std::vector<double>{0.032, 0.02, 0.04, 144.0, 400.0, 0.3, 0.2}})
    for (const double delay_s : {0.0, 0.0013, 0.004, 0.0331})
      for (const bool lag : {false, true})
        for (const bool filter : {false, true})
          for (const bool ground : {false, true})
            for (const auto velocity : {fit::Velocity::sampled, fit::Velocity::differences}) {
              auto model = test::golden_machine(plant, 0.002, delay_s).model();
              if (lag) model.torque_lag_s = 0.0007;
              if (filter) model.output_filter_s = 0.003;
              if (ground) model.set(fit::kMotorGroundStiffness, 20.0);
              model.velocity = velocity;
              SCOPED_TRACE(testing::Message() << plant.size() << " " << delay_s << lag << filter << ground);
              expect_same(model);
            }
}

TEST(Maxima, AreFoundBetweenLines) {
  // A resonance's square: its maximum at sqrt(1 - 2 zeta^2), of 1/(2 zeta sqrt(1 - zeta^2)).
  for (const double zeta : {0.01, 0.1, 0.5}) {
    const SizesAt sizes_at = [&](std::span<const double> f, std::span<double> sizes) {
      for (std::size_t i = 0; i < f.size(); ++i)
        sizes[i] = 1.0 / std::hypot(1.0 - f[i] * f[i], 2.0 * zeta * f[i]);
    };
    std::vector<double> lines;
    for (double f = 0.05; f < 3.0; f *= 1.07) lines.push_back(f);
    std::vector<double> sizes(lines.size());
    sizes_at(lines, sizes);
    const auto top = largest_between(lines, sizes, sizes_at);
    const double expected = 1.0 / (2.0 * zeta * std::sqrt(1.0 - zeta * zeta));
    EXPECT_NEAR(top.value, expected, 1e-11 * expected);
    EXPECT_NEAR(top.frequency_hz, std::sqrt(1.0 - 2.0 * zeta * zeta), 1e-5);
  }
}

/// As rows at their bound on both sides of a maximum make them.
TEST(Maxima, AreFoundBetweenLevelLines) {
  const SizesAt sizes_at = [](std::span<const double> f, std::span<double> s) {
    for (std::size_t i = 0; i < f.size(); ++i) s[i] = 2.0 - 1e-6 * (f[i] - 1.5) * (f[i] - 1.5);
  };
  const std::vector<double> lines = {1.0 - 1e-9, 1.0, 2.0};
  std::vector<double> sizes(lines.size());
  sizes_at(lines, sizes);
  EXPECT_NEAR(largest_between(lines, sizes, sizes_at).value, 2.0, 1e-11);
}

TEST(Maxima, MayStandAtAnEndOrHaveACorner) {
  const std::vector<double> lines = {1.0, 2.0, 3.0, 4.0};
  const auto largest = [&](const SizesAt& sizes_at) {
    std::vector<double> sizes(lines.size());
    sizes_at(lines, sizes);
    return largest_between(lines, sizes, sizes_at);
  };
  const auto rising = largest([](std::span<const double> f, std::span<double> s) {
    for (std::size_t i = 0; i < f.size(); ++i) s[i] = f[i] * f[i];
  });
  EXPECT_EQ(rising.value, 16.0);
  const auto corner = largest([](std::span<const double> f, std::span<double> s) {
    for (std::size_t i = 0; i < f.size(); ++i) s[i] = 5.0 - std::abs(f[i] - 2.3);
  });
  EXPECT_NEAR(corner.value, 5.0, 1e-7);
}

}  // namespace
}  // namespace resonid::design
