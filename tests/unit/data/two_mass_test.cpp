// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <golden.hpp>
#include <resonid/base/constants.hpp>
#include <resonid/data/two_mass.hpp>

namespace resonid {
namespace {

data::TwoMassParameters belt_system(const nlohmann::json& p) {
  const double r2 = 0.05 * 0.05;
  return {p.at("J1"), p.at("J2"), p.at("K").get<double>() * r2, p.at("D").get<double>() * r2, 0.0};
}

TEST(TwoMass, ResonancesAgreeWithTheGoldenModels) {
  const auto models = test::golden_json("models.json");
  for (const char* name : {"belt1", "belt2"}) {
    const auto& model = models.at(name);
    const auto p = belt_system(model.at("params"));
    EXPECT_NEAR(data::resonance_hz(p), model.at("fres").get<double>(), 1e-9);
    EXPECT_NEAR(data::antiresonance_hz(p), model.at("fares").get<double>(), 1e-9);
  }
}

TEST(TwoMass, SampledResponseAgreesWithTheGoldenModels) {
  const auto models = test::golden_json("models.json");
  for (const char* name : {"belt1", "belt2"}) {
    const auto& model = models.at(name);
    const auto f = model.at("f").get<std::vector<double>>();
    for (const double step : {0.001, 0.002}) {
      const auto& golden = model.at(step == 0.001 ? "Ts=0.001" : "Ts=0.002");
      const auto expected = test::golden_complex(golden.at("G_zoh"));
      const auto system = zero_order_hold(data::continuous_system(belt_system(model.at("params"))), step);
      for (std::size_t i = 0; i < f.size(); ++i) {
        const auto z = std::polar(1.0, kTwoPi * f[i] * step);
        const Eigen::Matrix3cd m = z * Eigen::Matrix3cd::Identity() - system.a.cast<std::complex<double>>();
        const std::complex<double> g =
            (system.c.cast<std::complex<double>>() * m.inverse() * system.b.cast<std::complex<double>>())(0);
        EXPECT_LT(std::abs(g - expected[i]), 1e-9 * std::abs(expected[i])) << name << " at " << f[i] << " Hz";
      }
    }
  }
}

}  // namespace
}  // namespace resonid
