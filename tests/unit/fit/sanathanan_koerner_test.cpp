// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <golden.hpp>
#include <resonid/fit/detail/sanathanan_koerner.hpp>

namespace resonid::fit {
namespace {

TEST(SanathananKoerner, RecoversTheGoldenBeltDrive) {
  const auto model = test::golden_json("models.json").at("belt2");
  data::FrequencyResponse g;
  g.frequency_hz = model.at("f").get<std::vector<double>>();
  g.value = test::golden_complex(model.at("Ts=0.002").at("G_zoh"));
  for (const bool integrator : {false, true}) {
    SanathananKoernerConfig config;
    config.sample_time_s = 0.002;
    config.integrator = integrator;
    const auto fit = fit_sanathanan_koerner(g, config);
    ASSERT_TRUE(fit.has_value());
    const auto poles = pole_modes(fit->transfer_function);
    const auto zeros = zero_modes(fit->transfer_function);
    ASSERT_EQ(poles.size(), 1U);
    ASSERT_EQ(zeros.size(), 1U);
    EXPECT_NEAR(poles[0].frequency_hz, model.at("fres").get<double>(), 1e-4);
    EXPECT_NEAR(poles[0].damping_ratio, 0.0989, 1e-3);
    EXPECT_NEAR(zeros[0].frequency_hz, model.at("fares").get<double>(), 0.1);  // zeros do not map exactly
    EXPECT_LT(fit->misfit, 1e-6);
  }
}

TEST(SanathananKoerner, IterationRemovesLevysBias) {
  const auto model = test::golden_json("models.json").at("belt1");
  data::FrequencyResponse g;
  g.frequency_hz = model.at("f").get<std::vector<double>>();
  g.value = test::golden_complex(model.at("Ts=0.001").at("G_zoh"));
  for (std::size_t i = 0; i < g.lines(); ++i)
    g.value[i] *= 1.0 + 0.02 * std::cos(3.0 * static_cast<double>(i));
  SanathananKoernerConfig levy;
  levy.sample_time_s = 0.001;
  levy.iterations = 1;
  SanathananKoernerConfig iterated = levy;
  iterated.iterations = 12;
  EXPECT_LT(fit_sanathanan_koerner(g, iterated)->misfit, fit_sanathanan_koerner(g, levy)->misfit);
}

TEST(SanathananKoerner, RefusesTooFewLines) {
  const data::FrequencyResponse g{{1.0, 2.0}, {{1, 0}, {0, 1}}, {}, {}, {}};
  SanathananKoernerConfig config;
  config.sample_time_s = 0.01;
  EXPECT_EQ(fit_sanathanan_koerner(g, config).error().field, "response");
}

}  // namespace
}  // namespace resonid::fit
