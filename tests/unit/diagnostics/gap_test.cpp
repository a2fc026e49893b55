// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <fstream>
#include <nlohmann/json.hpp>
#include <resonid/diagnostics/gap.hpp>
#include <string>
#include <vector>

namespace resonid::diagnostics {
namespace {

using Complex = std::complex<double>;

std::vector<Complex> responses(const nlohmann::json& json) {
  std::vector<Complex> out;
  for (std::size_t i = 0; i < json["re"].size(); ++i)
    out.emplace_back(json["re"][i].get<double>(), json["im"][i].get<double>());
  return out;
}

TEST(ChordalDistance, IsTheChordOfTheRiemannSphere) {
  EXPECT_EQ(chordal_distance({0.3, -2.0}, {0.3, -2.0}), 0.0);
  EXPECT_DOUBLE_EQ(chordal_distance(0.0, 1.0), std::sqrt(0.5));  // from the pole to the equator
  EXPECT_DOUBLE_EQ(chordal_distance(1.0, -1.0), 1.0);            // across the equator
  const Complex g(0.7, -1.9);
  EXPECT_DOUBLE_EQ(chordal_distance(g, -1.0 / std::conj(g)), 1.0);  // antipodes
  EXPECT_DOUBLE_EQ(chordal_distance(0.0, g), std::abs(g) / std::sqrt(1.0 + std::norm(g)));
}

TEST(ChordalDistance, IsSymmetricAndTheSameForInverses) {
  const Complex a(0.7, -1.9), b(-0.2, 0.4);
  EXPECT_DOUBLE_EQ(chordal_distance(a, b), chordal_distance(b, a));
  EXPECT_NEAR(chordal_distance(a, b), chordal_distance(1.0 / a, 1.0 / b), 1e-15);
  EXPECT_NEAR(chordal_distance(1e200, Complex(0.0, 1e-3)), 1.0, 1e-6);
}

TEST(ChordalDistance, IsBlindInTheWrongUnit) {
  const Complex a(0.0, 1.0), b(1.0, 0.0);
  EXPECT_NEAR(chordal_distance(a, b), std::sqrt(2.0) / 2.0, 1e-15);
  EXPECT_LT(chordal_distance(1e-3 * a, 1e-3 * b), 2e-3);
  EXPECT_LT(chordal_distance(1e3 * a, 1e3 * b), 2e-3);
}

TEST(ChordalDistance, AgreesWithTheIndependentImplementation) {
  std::ifstream file(RESONID_GOLDEN_DIR "/c_expected.json");
  const auto golden = nlohmann::json::parse(file);
  const auto a = responses(golden["system_A"]["G_true"]);
  const auto b = responses(golden["system_B"]["G_true"]);
  ASSERT_EQ(a.size(), 8U);
  for (std::size_t i = 0; i < a.size(); ++i)
    EXPECT_NEAR(chordal_distance(a[i], b[i]), golden["chordal_true"][i].get<double>(), 1e-11);
}

}  // namespace
}  // namespace resonid::diagnostics
