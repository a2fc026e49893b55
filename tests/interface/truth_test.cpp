// SPDX-License-Identifier: MIT
#include <cmath>
#include <complex>
#include <golden.hpp>
#include <nlohmann/json.hpp>
#include <numbers>

#include "program.hpp"

namespace resonid {
namespace {

using nlohmann::json;
constexpr double kTwoPi = 2.0 * std::numbers::pi;

class Truth : public test::ProgramTest {
 protected:
  [[nodiscard]] json truth_of(const std::string& arguments) const {
    const auto done = run("simulate " + arguments + " --truth -");
    EXPECT_EQ(done.exit_code, 0) << done.error;
    return done.exit_code == 0 ? json::parse(done.out) : json();
  }
  static double parameter(const json& truth, const char* name, const char* unit) {
    const auto& p = truth.at("model").at("parameters").at(name);
    EXPECT_EQ(p.at("unit"), unit) << name;
    return p.at("value").get<double>();
  }
  static std::complex<double> response(const json& truth, std::size_t i) {
    const auto& r = truth.at("frequency_response");
    return {r.at("real")[i].get<double>(), r.at("imag")[i].get<double>()};
  }
  static void expect_close(std::complex<double> found, std::complex<double> expected, double relative) {
    EXPECT_LT(std::abs(found - expected), relative * std::abs(expected)) << found << " " << expected;
  }
  struct Mode {
    const char* kind;
    double frequency_hz, damping_ratio;
  };
  static void expect_modes(const json& truth, std::initializer_list<Mode> modes, double hz, double ratio) {
    ASSERT_EQ(truth.at("resonances").size(), modes.size());
    std::size_t i = 0;
    for (const auto& mode : modes) {
      const auto& found = truth.at("resonances")[i++];
      EXPECT_EQ(found.at("kind"), mode.kind);
      EXPECT_EQ(found.at("source"), "model");
      EXPECT_NEAR(found.at("frequency_hz").get<double>(), mode.frequency_hz, hz);
      EXPECT_NEAR(found.at("damping_ratio").get<double>(), mode.damping_ratio, ratio);
    }
  }
};

// Modes of an independent implementation with the same tensioner (15.09, 78.63 Hz; zeros 10.62, 78.27 Hz).
TEST_F(Truth, ThreeMassesWithATensioner) {
  const json truth = truth_of("three_mass_tensioner");
  EXPECT_EQ(truth.at("model").at("structure"), "three-mass");
  expect_modes(truth,
               {{"antiresonance", 10.62, 0.070},
                {"resonance", 15.09, 0.099},
                {"antiresonance", 78.27, 0.154},
                {"resonance", 78.63, 0.155}},
               0.005, 0.0006);
  EXPECT_NEAR(parameter(truth, "stiffness", "Nm/rad"), 143.75, 1e-9);
  EXPECT_NEAR(parameter(truth, "stiffness_2", "Nm/rad"), 143.75, 1e-9);
  EXPECT_NEAR(parameter(truth, "damping_2", "Nms/rad"), 0.09, 1e-12);
  EXPECT_NEAR(parameter(truth, "bypass_stiffness", "Nm/rad"), 71.875, 1e-9);
  EXPECT_EQ(parameter(truth, "middle_inertia", "kgm2"), 0.0012);
  EXPECT_FALSE(truth.contains("over_time"));
  EXPECT_FALSE(truth.at("model").at("parameters").contains("viscous_friction"));
}

// scipy 1.10: eigh(S, M) for the modes; response from expm of [A B; 0 0] Ts, c (z - Ad)^-1 Bd, with M, S, C
// of the chain's masses, stiffnesses and dampings and 0.01 Nms/rad on the first:
// tests/reference/published_drives.py.
TEST_F(Truth, ChainOfFourMasses) {
  const json truth = truth_of("chain_four_masses --lines 5,26,65,110,300");
  EXPECT_EQ(truth.at("model").at("structure"), "chain");
  const double modes[] = {14.64818389, 26.19891581, 65.17471712, 69.57926053, 105.99069294, 109.85652252};
  ASSERT_EQ(truth.at("resonances").size(), 6U);
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_NEAR(truth.at("resonances")[i].at("frequency_hz").get<double>(), modes[i], 1e-7);
    EXPECT_EQ(truth.at("resonances")[i].at("kind"), i % 2 == 0 ? "antiresonance" : "resonance");
  }
  const std::complex<double> expected[] = {{-0.005721434585013132, -0.6205716827884331},
                                           {9.3840792745182, 6.3144273217166},
                                           {0.04284141964841851, -0.0344801340264898},
                                           {0.08858197256833424, -0.17431454392375224},
                                           {-0.04230053050869037, -0.030941005045382042}};
  for (std::size_t i = 0; i < 5; ++i) expect_close(response(truth, i), expected[i], 1e-9);
  EXPECT_EQ(truth.at("model").at("transfer_function").at("denominator").size(), 8U);
  const auto& parameters = truth.at("model").at("parameters");
  EXPECT_EQ(parameters.at("inertias").size(), 4U);
  EXPECT_EQ(parameters.at("couplings")[1].at("between"), (json{1, 2}));
  EXPECT_EQ(parameters.at("couplings")[1].at("stiffness").at("value"), 600.0);
  EXPECT_EQ(parameter(truth, "load_inertia", "kgm2"), 0.025);
  EXPECT_EQ(parameter(truth, "viscous_friction", "Nms/rad"), 0.01);
}

/// The margins must not depend on polynomials of a high order, whose digits cancel at a fast rate.
TEST_F(Truth, MarginsOfALongChainDoNotDependOnTheRate) {
  const std::string chain =
      "controller = {kind = 'pi', gain = 0.5, integral_time_s = 0.2}\n"
      "drive = {structure = 'chain', inertias = [0.012, 0.004, 0.006, 0.005, 0.004, 0.025],"
      " stiffnesses = [900, 600, 700, 800, 900], dampings = [0.08, 0.06, 0.07, 0.05, 0.05]}\n";
  write("slow.toml", chain + "run = {sample_rate_hz = 4000, duration_s = 0.1}\n");
  write("fast.toml", chain + "run = {sample_rate_hz = 16000, duration_s = 0.1}\n");
  const json slow = truth_of("slow.toml").at("loop");
  const json truth = truth_of("fast.toml");
  EXPECT_FALSE(truth.at("model").contains("transfer_function"));  // it would be far off
  const json& fast = truth.at("loop");
  EXPECT_NEAR(slow.at("crossover_hz").get<double>(), fast.at("crossover_hz").get<double>(), 2e-3);
  EXPECT_NEAR(slow.at("phase_margin_deg").get<double>(), fast.at("phase_margin_deg").get<double>(), 0.1);
  EXPECT_NEAR(slow.at("modulus_margin").get<double>(), fast.at("modulus_margin").get<double>(), 2e-3);
}

TEST_F(Truth, ToothBeltWhereItsCartRests) {
  std::string file = test::text_of(std::string(RESONID_EXPERIMENTS_DIR) + "/v_tooth_chirp_middle.toml");
  const std::string rounded = "specific_stiffness_n = 3.764e5";
  ASSERT_NE(file.find(rounded), std::string::npos);
  write("e.toml", file.replace(file.find(rounded), rounded.size(), "specific_stiffness_n = 376406.25"));
  const json truth = truth_of("e.toml --duration 1 --lines 20:120:5");
  const json golden = test::golden_json("models.json").at("tooth_x0.8");
  EXPECT_EQ(truth.at("model").at("structure"), "two-mass");
  EXPECT_EQ(parameter(truth, "driven_inertia", "kgm2"), 0.0028);
  EXPECT_NEAR(parameter(truth, "load_inertia", "kgm2"), 6.7 * 0.0199 * 0.0199, 1e-15);
  EXPECT_NEAR(parameter(truth, "stiffness", "Nm/rad"), golden.at("K").get<double>() * 0.0199 * 0.0199, 1e-8);
  EXPECT_NEAR(parameter(truth, "damping", "Nms/rad"), golden.at("bs").get<double>() * 0.0199 * 0.0199, 1e-9);
  EXPECT_NEAR(truth.at("resonances")[0].at("frequency_hz").get<double>(), golden.at("fares").get<double>(),
              1e-7);
  EXPECT_NEAR(truth.at("resonances")[1].at("frequency_hz").get<double>(), golden.at("fres").get<double>(),
              1e-7);
  EXPECT_EQ(golden.at("f"), truth.at("frequency_response").at("frequency_hz"));
  const auto expected = test::golden_complex(golden.at("Ts=0.0005").at("G_zoh"));
  for (std::size_t i = 0; i < expected.size(); ++i) expect_close(response(truth, i), expected[i], 1e-9);
}

TEST_F(Truth, ToothBeltOverTime) {
  const json truth = truth_of("v_tooth_multisine");
  const auto time = truth.at("over_time").at("time_s").get<std::vector<double>>();
  const auto resonance = truth.at("over_time").at("resonance_hz").get<std::vector<double>>();
  const auto position = truth.at("over_time").at("position_m").get<std::vector<double>>();
  ASSERT_GT(time.size(), 500U);
  ASSERT_EQ(resonance.size(), time.size());
  ASSERT_EQ(position.size(), time.size());
  EXPECT_EQ(time.front(), 0.0);
  EXPECT_NEAR(time.back(), 4.2, 0.01);
  const json models = test::golden_json("models.json");
  for (const auto& [name, x] :
       {std::pair("tooth_x0.8", 0.8), std::pair("tooth_x1", 1.0), std::pair("tooth_x1.4", 1.4)}) {
    const auto i =
        static_cast<std::size_t>(std::upper_bound(position.begin(), position.end(), x) - position.begin());
    ASSERT_LT(i, position.size());
    const double part = (x - position[i - 1]) / (position[i] - position[i - 1]);
    EXPECT_NEAR(resonance[i - 1] + part * (resonance[i] - resonance[i - 1]),
                models.at(name).at("fres").get<double>(), 2e-3)  // the file's stiffness is rounded to 2e-5
        << name;
  }
}

TEST_F(Truth, LooseningOverTime) {
  const json over_time = truth_of("belt_loosens").at("over_time");
  EXPECT_FALSE(over_time.contains("position_m"));
  const auto time = over_time.at("time_s").get<std::vector<double>>();
  const auto resonance = over_time.at("resonance_hz").get<std::vector<double>>();
  for (std::size_t i = 0; i < time.size(); ++i) {  // 30 % from 10 s on, within 5 s
    const double loose = 0.3 * std::clamp((time[i] - 10.0) / 5.0, 0.0, 1.0);
    EXPECT_NEAR(resonance[i], 15.0856513721 * std::sqrt(1.0 - loose), 1e-8) << time[i];
  }
}

/// J dv/dt = u - b v:  G(z) = (1 - p)/b / (z - p), p = exp(-b Ts/J).
TEST_F(Truth, RigidMachineWithFriction) {
  const json truth = truth_of("rigid --lines 1:40:3");
  EXPECT_EQ(truth.at("model").at("structure"), "rigid");
  EXPECT_TRUE(truth.at("resonances").empty());
  EXPECT_EQ(parameter(truth, "driven_inertia", "kgm2"), 0.064);
  EXPECT_EQ(parameter(truth, "viscous_friction", "Nms/rad"), 0.03);
  EXPECT_EQ(parameter(truth, "coulomb_friction", "Nm"), 0.4);
  EXPECT_FALSE(truth.at("model").at("parameters").contains("load_inertia"));
  const double p = std::exp(-0.03 * 0.002 / 0.064);
  for (std::size_t i = 0; i < 14; ++i) {
    const auto z = std::polar(1.0, kTwoPi * (1.0 + 3.0 * static_cast<double>(i)) * 0.002);
    expect_close(response(truth, i), (1.0 - p) / 0.03 / (z - p), 1e-9);
  }
}

/// Proportional gain K on an integrator: |L| = K Ts/J / (2 sin(w Ts/2)), phase -90 deg - w Ts/2 - w Td for
/// whole samples of delay. A fraction e reads the ramp between two samples, which takes (1 - e) + e/z of the
/// one and the other. A velocity from the differences of an encoder adds half a sample and cos(w Ts/2).
TEST_F(Truth, MarginsHoldTheDelayAndTheEncoder) {
  const std::string file =
      "drive = {structure = 'rigid', driven_inertia = 0.064}\ncontroller = {kind = 'p', gain = 1.0}\n"
      "run = {sample_rate_hz = 500, duration_s = 1}\n";
  const double ts = 0.002;
  const double scale = ts / 0.064;
  write("sensor.toml", file + "measurement = {delay_s = 0.0043}\n");
  const json sensor = truth_of("sensor.toml").at("loop");
  const auto loop = [&](double w) {
    const auto z = std::polar(1.0, w * ts);
    const double e = 0.15;
    return scale / (z - 1.0) * ((1.0 - e) + e / z) / (z * z);
  };
  double low = 1.0;
  double high = 100.0;
  for (int i = 0; i < 60; ++i) (std::abs(loop(0.5 * (low + high))) > 1.0 ? low : high) = 0.5 * (low + high);
  EXPECT_NEAR(sensor.at("crossover_hz").get<double>(), low / kTwoPi, 1e-5);
  EXPECT_NEAR(sensor.at("phase_margin_deg").get<double>(), 180.0 + 360.0 / kTwoPi * std::arg(loop(low)),
              1e-3);

  write("encoder.toml", file + "measurement = {velocity = 'encoder', delay_s = 0.004}\n");
  const json truth = truth_of("encoder.toml --lines 5,50,200");
  const double we = 2.0 / ts * std::atan(0.5 * scale);  // |L| = K Ts/(2 J) / tan(w Ts/2)
  EXPECT_NEAR(truth.at("loop").at("crossover_hz").get<double>(), we / kTwoPi, 1e-5);
  EXPECT_NEAR(truth.at("loop").at("phase_margin_deg").get<double>(),
              90.0 - 360.0 / kTwoPi * we * (ts + 0.004), 1e-3);
  const double lines[] = {5.0, 50.0, 200.0};
  for (std::size_t i = 0; i < 3; ++i) {
    const auto z = std::polar(1.0, kTwoPi * lines[i] * ts);
    expect_close(response(truth, i), 0.5 * scale * (z + 1.0) / (z * (z - 1.0)), 1e-10);
  }
}

TEST_F(Truth, OpenLoopHasNoLoop) {
  const json truth = truth_of("ii_tooth_open_loop_prbs");
  EXPECT_FALSE(truth.contains("loop"));
  EXPECT_FALSE(truth.contains("controller"));
  EXPECT_TRUE(truth.contains("over_time"));
}

TEST_F(Truth, LinearMotionHasLinearUnits) {
  write("e.toml",
        "drive = {motion = 'linear', driven_inertia = 2, load_inertia = 3, stiffness = 1e4, damping = 5, "
        "load_viscous_friction = 0.5}\nrun = {sample_rate_hz = 500, duration_s = 1}\n");
  const json truth = truth_of("e.toml");
  EXPECT_EQ(parameter(truth, "driven_inertia", "kg"), 2.0);
  EXPECT_EQ(parameter(truth, "stiffness", "N/m"), 1e4);
  EXPECT_EQ(parameter(truth, "damping", "Ns/m"), 5.0);
  EXPECT_EQ(parameter(truth, "load_viscous_friction", "Ns/m"), 0.5);
}

}  // namespace
}  // namespace resonid
