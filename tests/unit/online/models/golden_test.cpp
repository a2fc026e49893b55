// SPDX-License-Identifier: MIT
// Trajectories of an independent implementation on the tooth belt: tests/golden/README.md, e_expected.json.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <golden.hpp>
#include <resonid/online/models/arx.hpp>
#include <resonid/online/models/closed_loop_output_error.hpp>
#include <resonid/online/models/modes.hpp>
#include <resonid/online/models/output_error.hpp>
#include <string>
#include <vector>

namespace resonid::online {
namespace {

struct Golden {
  nlohmann::json expected = test::golden_json("e_expected.json");
  std::vector<double> ru = test::golden_column("e_tooth.csv", "ru"),
                      u = test::golden_column("e_tooth.csv", "u"),
                      y = test::golden_column("e_tooth.csv", "y");
  std::array<double, 3> b{}, a{};
  std::array<double, 3> numerator{}, denominator{};

  Golden() {
    for (std::size_t i = 0; i < 3; ++i) {
      a[i] = expected.at("theta0")[i].get<double>();
      b[i] = expected.at("theta0")[i + 3].get<double>();
    }
    // PI with an outer position loop.
    const double ts = number("Ts"), kp = number("Kp");
    const std::array<double, 2> pi{kp * (1.0 + ts / number("Ti")), -kp},
        outer{1.0 + number("Kpc") * ts, -1.0};
    numerator = {pi[0] * outer[0], pi[0] * outer[1] + pi[1] * outer[0], pi[1] * outer[1]};
    denominator = {1.0, -2.0, 1.0};
  }
  [[nodiscard]] double number(const char* name) const { return expected.at(name).get<double>(); }

  [[nodiscard]] ModelEstimatorConfig common() const {
    ModelEstimatorConfig c;
    c.sample_rate_hz = 250.0;
    c.delay_samples = 1;
    c.start_b = b;
    c.start_a = a;
    c.adaptation.start_variance = number("p0");
    c.adaptation.factor = number("lam");
    return c;
  }

  template <class Estimator>
  void compare(Estimator estimator, const std::string& name) const {
    const auto& want = expected.at(name);
    std::size_t row = 0;
    for (std::size_t k = 0; k < y.size(); ++k) {
      estimator.step(ru[k], u[k], y[k]);
      if (row == expected.at("k").size() || k != expected.at("k")[row].get<std::size_t>()) continue;
      const auto model = estimator.model();
      const auto& theta = want.at("theta")[row];
      for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_NEAR(model.a[i], theta[i].get<double>(), 1e-6 * std::abs(theta[i].get<double>())) << name << k;
        EXPECT_NEAR(model.b[i], theta[i + 3].get<double>(), 1e-6 * std::abs(theta[i + 3].get<double>()))
            << name << k;
      }
      const double yhat = want.at("yhat")[row].get<double>();
      EXPECT_NEAR(estimator.predicted(), yhat, 1e-6 * std::abs(yhat)) << name << k;
      const double fres = want.at("fres")[row].get<double>();
      EXPECT_NEAR(SampledModes<3>(model, 250.0).resonances()[0].frequency_hz, fres, 1e-6 * fres) << name << k;
      ++row;
    }
    EXPECT_EQ(row, expected.at("k").size());
  }
};

TEST(GoldenTrajectories, Arx) {
  const Golden golden;
  golden.compare(Arx<double, 3>::create({golden.common()}).value(), "arx");
}
TEST(GoldenTrajectories, OutputError) {
  const Golden golden;
  golden.compare(OutputError<double, 3>::create({golden.common()}).value(), "oe");
}
TEST(GoldenTrajectories, ClosedLoopOutputError) {
  const Golden golden;
  ClosedLoopOutputErrorConfig c;
  c.common = golden.common();
  c.controller_numerator = golden.numerator;
  c.controller_denominator = golden.denominator;
  golden.compare(ClosedLoopOutputError<double, 3>::create(c).value(), "cloe");
}

}  // namespace
}  // namespace resonid::online
