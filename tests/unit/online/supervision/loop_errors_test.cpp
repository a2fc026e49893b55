// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <allocation_counter.hpp>
#include <array>
#include <cmath>
#include <complex>
#include <limits>
#include <resonid/online/supervision/detail/loop_errors.hpp>
#include <vector>

namespace resonid::online {
namespace {

using Complex = std::complex<double>;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// A belt drive in a cascade; numbers of loop_errors_reference.py, run without arguments.
constexpr double kRate = 500.0, kDelay = 0.002;
const TwoMassPoint<double> kDrive{0.0028, 0.0027, 415.0, 0.075, 0.02};
const DiscreteModel<double, 3> kModel{{0.628452075079757, -0.846385084619993, 0.591113664171473},
                                      {-1.85316445421238, 1.74452687094935, -0.883898803644233}};

Complex controller(double hz) {
  constexpr double kGain = 0.12, kProportional = kGain * (1.0 + 1.0 / kRate / 0.2),
                   kOuter = 1.0 + 5.0 / kRate;
  const Complex z = std::polar(1.0, -kTwoPi * hz / kRate);
  return (kProportional * kOuter - (kProportional + kGain * kOuter) * z + kGain * z * z) /
         ((1.0 - z) * (1.0 - z));
}
Complex plant(double hz) {
  const Complex z = std::polar(1.0, -kTwoPi * hz / kRate);
  const auto& [b, a] = kModel;
  return z * (b[0] + z * (b[1] + z * b[2])) / (1.0 + z * (a[0] + z * (a[1] + z * a[2])));
}
Complex loop(double hz) { return plant(hz) * controller(hz) * std::polar(1.0, -kTwoPi * hz * kDelay); }

LoopMargins<double> found() {
  MarginScan<double> scan;
  for (double hz = 0.5; hz < 249.0; hz *= 1.0001) scan.step(hz, loop(hz));
  return scan.margins();
}

TEST(LoopErrors, MarginsOfADiscreteModel) {
  Eigen::Matrix<double, 6, 1> v, w;
  v << 0.01, -0.02, 0.015, 0.004, -0.006, 0.003;
  w << 0.02, 0.01, -0.01, -0.002, 0.003, 0.001;
  Eigen::Matrix<double, 6, 6> p = 0.2 * v * v.transpose() + 0.1 * w * w.transpose();
  p.diagonal() += (Eigen::Matrix<double, 6, 1>() << 1e-4, 1e-4, 1e-4, 1e-6, 1e-6, 1e-6).finished();
  const auto margins = found();
  EXPECT_NEAR(margins.crossover_hz, 3.6237527540655816, 1e-3);
  EXPECT_NEAR(margins.phase_margin_deg, 70.49532037019247, 1e-2);
  EXPECT_NEAR(margins.modulus_margin, 0.7678215216965792, 1e-4);
  const auto before = test::allocations();
  const auto s = margin_stds(
      margins, [&](double hz) { return relative_error(kModel, p, hz, kRate); }, loop);
  EXPECT_EQ(test::allocations(), before);
  EXPECT_NEAR(s.crossover_hz, 0.16847121027549616, 2e-4);
  EXPECT_NEAR(s.phase_margin_deg, 2.380516035694091, 3e-3);
  EXPECT_NEAR(s.modulus_margin, 0.009465088496642588, 2e-5);
}

TEST(LoopErrors, MarginsOfAPhysicalModel) {
  TwoMassResponse::Covariance p = TwoMassResponse::Covariance::Zero();
  p.diagonal() << 4e-4, 9e-4, 4e-4, 4e-2, 1e-4;
  p(0, 1) = p(1, 0) = 1e-4;
  p(1, 2) = p(2, 1) = 2e-4;
  const TwoMassResponse drive(kDrive, kRate);
  const auto s = margin_stds(
      found(), [&](double hz) { return drive.relative_error_at(hz, p); }, loop);
  EXPECT_NEAR(s.crossover_hz, 0.07637012977661176, 1e-4);
  EXPECT_NEAR(s.phase_margin_deg, 4.340281939918079, 5e-3);
  // Beyond the first order: what lies across 1 + L adds 0.2 %.
  EXPECT_NEAR(s.modulus_margin, 0.031679525896476234, 1e-4);
}

TEST(LoopErrors, ResponseOfAPhysicalModelWithItsGradient) {
  const auto before = test::allocations();
  const auto at = TwoMassResponse(kDrive, kRate).at(40.0);
  EXPECT_EQ(test::allocations(), before);
  const std::array<Complex, 5> slope{Complex(-0.4132979151557969, -0.009770619626177795),
                                     {-0.9940226141138017, 0.030862924513064653},
                                     {0.405415433807588, -0.049584954112641896},
                                     {0.0022352746871900733, 0.018308516350558246},
                                     {-0.016509089820373544, 0.5092055343972625}};
  EXPECT_LT(std::abs(at.value - Complex(-0.12457464507925958, -0.5501332399974784)), 1e-9);
  for (std::size_t i = 0; i < slope.size(); ++i)
    EXPECT_LT(std::abs(at.relative_gradient[i] - slope[i]), 1e-7) << i;
}

/// Margins of lines, and of the same lines each moved a little: the variance that independent circular errors
/// make, by brute force.
TEST(LoopErrors, MarginsOfLinesAgainstLinesThatAreMoved) {
  std::vector<double> hz, std;
  std::vector<Complex> value;
  for (double f = 1.0; f < 240.0; f *= 1.25) {
    hz.push_back(f);
    value.push_back(loop(f));
    std.push_back((0.01 + 0.002 * std::sqrt(f)) * std::abs(value.back()));
  }
  MarginScan<double> scan;
  for (std::size_t i = 0; i < hz.size(); ++i) scan.step(hz[i], value[i], std[i]);
  const auto m = scan.margins();
  double crossover = 0.0, phase = 0.0, modulus = 0.0;
  for (std::size_t i = 0; i < hz.size(); ++i)
    for (const Complex unit : {Complex(1.0, 0.0), Complex(0.0, 1.0)}) {
      constexpr double kPart = 1e-5;
      auto moved = value;
      moved[i] += kPart * std[i] * unit;
      const auto other = loop_margins<double>(hz, moved);
      crossover += 0.5 * std::pow((other.crossover_hz - m.crossover_hz) / kPart, 2);
      phase += 0.5 * std::pow((other.phase_margin_deg - m.phase_margin_deg) / kPart, 2);
      modulus += 0.5 * std::pow((other.modulus_margin - m.modulus_margin) / kPart, 2);
    }
  EXPECT_NEAR(m.crossover_std_hz, std::sqrt(crossover), 1e-3 * m.crossover_std_hz);
  EXPECT_NEAR(m.phase_margin_std_deg, std::sqrt(phase), 1e-3 * m.phase_margin_std_deg);
  EXPECT_NEAR(m.modulus_margin_std, std::sqrt(modulus), 1e-3 * m.modulus_margin_std);
}

TEST(LoopErrors, MarginsWithoutErrorsOfTheLinesHaveNone) {
  EXPECT_TRUE(std::isnan(found().crossover_std_hz));
  EXPECT_TRUE(std::isnan(found().modulus_margin_std));
  const auto s = margin_stds(
      LoopMargins<double>{}, [](double) { return RelativeError{}; }, loop);
  EXPECT_TRUE(std::isnan(s.crossover_hz));
  EXPECT_TRUE(std::isnan(s.phase_margin_deg));
  EXPECT_TRUE(std::isnan(s.modulus_margin));
}

TEST(LoopErrors, GapByHandAndAgainstValuesThatAreMoved) {
  // |1 - 2|/sqrt(2 * 5)
  EXPECT_NEAR(chordal<double>(1.0, 2.0), 1.0 / std::sqrt(10.0), 1e-15);
  const Complex x(-0.7, -1.9), reference(-0.4, -2.4);
  // Errors of 1 and 2 % along two oblique directions.
  const std::array<Complex, 2> direction{Complex(0.01, 0.003), Complex(-0.004, 0.02)};
  RelativeError e{0.0, 0.0, 0.0};
  double variance = 0.0;
  for (const Complex d : direction) {
    e.real += d.real() * d.real();
    e.imag += d.imag() * d.imag();
    e.cross += d.real() * d.imag();
    const double slope =
        (chordal(x * (1.0 + 1e-5 * d), reference) - chordal(x * (1.0 - 1e-5 * d), reference)) / 2e-5;
    variance += slope * slope;
  }
  // What lies across adds 3 s^4/(4 d^2): below 1 % here.
  EXPECT_NEAR(gap_std(x, reference, e), std::sqrt(variance), 0.01 * std::sqrt(variance));
}

TEST(LoopErrors, AGapOfNothingHasTheWholeErrorOfItsValue) {
  const Complex x(0.6, -0.8);  // |x| = 1
  const double std = 0.03;
  EXPECT_NEAR(gap_std(x, x, relative_error(x, std)), 0.5 * std, 1e-12);
}

TEST(LoopErrors, TheGapIsTheLargestDistanceAndLeavesOutWhatIsNotFinite) {
  GapScan scan;
  EXPECT_TRUE(std::isnan(scan.gap()));
  const auto before = test::allocations();
  scan.step(1.0, 1.0, 1.1, 0.01);
  scan.step(2.0, 1.0, 2.0, 0.02);
  scan.step(3.0, Complex(kNan, 0.0), 9.0, 0.01);
  scan.step(4.0, 1.0, kNan, 0.01);
  scan.step(5.0, 1.0, 1.2, 0.01);
  EXPECT_EQ(test::allocations(), before);
  EXPECT_EQ(scan.gap_hz(), 2.0);
  EXPECT_EQ(scan.gap(), chordal<double>(1.0, 2.0));
  EXPECT_EQ(scan.gap_std(), gap_std(1.0, 2.0, relative_error(1.0, 0.02)));
  scan.reset();
  EXPECT_TRUE(std::isnan(scan.gap()));
}

}  // namespace
}  // namespace resonid::online
