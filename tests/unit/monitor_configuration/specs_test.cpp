// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "configurations.hpp"
#include "monitor/service/axis_spec_of.hpp"

namespace resonid::monitor::test {
namespace {

expected<std::vector<monitoring::AxisSpec>> specs_of(const TemporaryFolder& folder, const std::string& more) {
  const auto file = parse_configuration(std::string(kLeast) + more, "m.toml", folder.path());
  if (!file.usable()) return unexpected(file.findings.errors.front());
  return axis_specs(file.configuration);
}

TEST(AxisSpecs, HoldWhatTheFileSays) {
  const TemporaryFolder folder;
  const auto specs = specs_of(folder, R"(excitation = "ru"
controller = "pi:2,0.5"
delay_s = 0.004
chirp = [1, 40, 20]
lines_hz = "2:8:2"
period_samples = 1000
band_hz = [1, 60]
method = "physical"
memory_s = 3
drift_per_s = 0.01
friction = "both"
excitation_type = "multisine"
baseline_s = 90
alarms.stiffness.low = 100
[alarms]
stiffness.high = 400
[axis.b]
source = "in"
sample_rate_hz = 1000
motion = "linear"
output_quantity = "position"
input = "i"
input_scale = 40
excitation = "e"
excitation_scale = -0.5
output = "x"
position = "x"
position_scale = -1
)");
  ASSERT_TRUE(specs.has_value()) << message_of(specs.error());
  ASSERT_EQ(specs->size(), 2U);
  const auto& b = specs->front();
  EXPECT_EQ(b.name, "b");
  EXPECT_EQ(b.motion, data::Motion::linear);
  EXPECT_EQ(b.output_quantity, data::OutputQuantity::position);
  EXPECT_TRUE(b.has_excitation);
  EXPECT_TRUE(b.has_position);
  EXPECT_EQ(b.input_scale, 40.0);
  EXPECT_EQ(b.excitation_scale, -0.5);
  EXPECT_EQ(b.position_scale, -1.0);
  EXPECT_EQ(b.alarms[monitoring::Watched::stiffness].high, 400.0);
  const auto& x = specs->back();
  EXPECT_EQ(x.sample_rate_hz, 500.0);
  EXPECT_TRUE(x.has_excitation);
  EXPECT_FALSE(x.has_position);
  EXPECT_EQ(x.baseline_s, 90.0);
  EXPECT_EQ(x.row_every_s, 0.1);
  EXPECT_EQ(x.alarms[monitoring::Watched::stiffness].low, 100.0);
  EXPECT_EQ(x.alarms[monitoring::Watched::stiffness].high, 400.0);
  const auto& o = x.track.common;
  ASSERT_TRUE(o.controller.has_value());
  // KP (1 + Ts/TI z/(z - 1)) with Ts/TI = 1/250
  ASSERT_EQ(o.controller->numerator.size(), 2U);
  EXPECT_NEAR(o.controller->numerator[0], 2.0 * (1.0 + 1.0 / 250.0), 1e-12);
  EXPECT_NEAR(o.controller->numerator[1], -2.0, 1e-12);
  EXPECT_EQ(o.delay_s, 0.004);
  ASSERT_TRUE(o.chirp.has_value());
  EXPECT_EQ(o.chirp->to_hz, 40.0);
  EXPECT_EQ(o.chirp->duration_s, 20.0);
  EXPECT_EQ(o.lines_hz, (std::vector<double>{2.0, 4.0, 6.0, 8.0}));
  EXPECT_EQ(o.period_samples, 1000U);
  EXPECT_EQ(o.band_hz, (std::pair<double, double>{1.0, 60.0}));
  EXPECT_EQ(o.friction, identification::Friction::both);
  EXPECT_EQ(o.excitation_type, identification::ExcitationType::multisine);
  EXPECT_EQ(x.track.method, identification::TrackMethod::physical);
  EXPECT_EQ(x.track.memory_s, 3.0);
  EXPECT_EQ(x.track.drift_per_s, 0.01);
}

/// Units of names and keys become SI, as those of recordings do.
TEST(AxisSpecs, ConvertUnits) {
  const TemporaryFolder folder;
  const auto specs = specs_of(folder, R"([axis.y]
source = "in"
sample_rate_hz = 1000
input = "iq_A"
torque_constant = 0.5
output = "speed_rpm"
output_scale = -1
position = "x_mm"
[axis.z]
source = "in"
sample_rate_hz = 1000
input = "load"
input_unit = "%"
rated_torque = 20
output = "n"
output_scale = 0.1
output_unit = "deg/s"
)");
  ASSERT_TRUE(specs.has_value()) << message_of(specs.error());
  const auto& y = (*specs)[1];
  EXPECT_EQ(y.input_scale, 0.5);
  EXPECT_EQ(y.input_unit, "");
  EXPECT_NEAR(y.output_scale, -2.0 * std::numbers::pi / 60.0, 1e-15);
  EXPECT_NEAR(y.position_scale, 1e-3, 1e-18);
  const auto& z = (*specs)[2];
  EXPECT_NEAR(z.input_scale, 0.2, 1e-15);
  EXPECT_NEAR(z.output_scale, 0.1 * std::numbers::pi / 180.0, 1e-15);
  EXPECT_EQ(z.output_unit, "");
  const auto current = specs_of(folder, "[axis.y]\nsource='in'\nsample_rate_hz=1\ninput='iq_A'\noutput='y'");
  ASSERT_TRUE(current.has_value());
  EXPECT_EQ(current->back().input_unit, "A");
}

TEST(AxisSpecs, TellTheUnitsOfTheFigures) {
  const TemporaryFolder folder;
  const auto units_of = [&](const std::string& more) {
    const auto specs = specs_of(folder, "[axis.y]\nsource='in'\nsample_rate_hz=1\n" + more);
    EXPECT_TRUE(specs.has_value()) << message_of(specs.error());
    return specs ? monitoring::figure_units(specs->back()) : identification::Units{};
  };
  const auto amperes = units_of("input='iq_A'\noutput='y_rad_s'");
  EXPECT_FALSE(amperes.physical);
  EXPECT_EQ(amperes.stiffness, "A/rad");
  EXPECT_EQ(amperes.inertia, "A s2/rad");
  EXPECT_EQ(amperes.damping, "A s/rad");
  EXPECT_EQ(amperes.torque, "A");
  EXPECT_EQ(units_of("input='iq_mA'\ninput_unit='mA'\noutput='y_rpm'").stiffness, "A/rad") << "converted";
  EXPECT_EQ(units_of("input='iq_A'\noutput='v_mm_s'\nmotion='linear'").inertia, "A s2/m");
  EXPECT_EQ(units_of("input='load'\ninput_unit='%'\noutput='y_rad_s'").stiffness, "%/rad");
  EXPECT_EQ(units_of("input='iq_A'\ntorque_constant=0.5\noutput='y_rad_s'").stiffness, "Nm/rad");
  EXPECT_EQ(units_of("input='load'\ninput_unit='%'\nrated_torque=20\noutput='y_rad_s'").torque, "Nm");
  EXPECT_EQ(units_of("input='f_N'\noutput='v_mm_s'\nmotion='linear'").inertia, "kg");
}

TEST(AxisSpecs, NoteUnitsThatAreNotTorques) {
  const TemporaryFolder folder;
  const auto notes_of = [&](const std::string& more) {
    const auto file = parse_configuration(
        std::string(kLeast) + "[axis.y]\nsource='in'\nsample_rate_hz=1\noutput='y_rad_s'\n" + more, "m.toml",
        folder.path());
    std::vector<std::string> notes;
    EXPECT_TRUE(file.usable());
    for (const auto& [name, axis] : file.configuration.axes.tables) {
      if (name != "y") continue;
      EXPECT_TRUE(axis_spec_of(file.configuration, name, axis, 1.0, notes).has_value());
    }
    return notes;
  };
  EXPECT_EQ(
      notes_of("input='iq_A'"),
      (std::vector<std::string>{"'iq_A' is a current: give torque_constant for Nm",
                                "figures and their limits are in A/rad (stiffness), A s2/rad (inertia), "
                                "A s/rad (damping) and A (friction, load)"}));
  EXPECT_EQ(notes_of("input='u_Nm'"), std::vector<std::string>{});
}

TEST(AxisSpecs, ReadResults) {
  const TemporaryFolder folder;
  const std::string fixture = std::string(RESONID_FIXTURES_DIR) + "/results/";
  const auto specs = specs_of(folder, "start = '" + fixture + "identify_prbs.json'\nbaseline = '" + fixture +
                                          "identify_prbs.json'\n");
  ASSERT_TRUE(specs.has_value()) << message_of(specs.error());
  const auto& track = specs->front().track;
  ASSERT_TRUE(track.start.has_value() && track.start_units.has_value() && track.baseline.has_value());
  EXPECT_EQ(track.start->structure, fit::Structure::two_mass);
  EXPECT_EQ(track.start_units->input, "Nm");
  EXPECT_FALSE(track.baseline->response.frequency_hz.empty());
  const auto none = specs_of(folder, "start = '" + fixture + "identify_none.json'");
  ASSERT_FALSE(none.has_value());
  EXPECT_NE(message_of(none.error()).find("holds no model"), std::string::npos) << message_of(none.error());
}

/// Rates of false alarms add up to what the installation was promised.
TEST(AxisSpecs, DivideTheRateOfFalseAlarms) {
  const TemporaryFolder folder;
  const auto rate_of = [](const std::vector<monitoring::AxisSpec>& specs, std::vector<int> detectors) {
    double rate = 0.0;
    for (std::size_t i = 0; i < specs.size(); ++i) rate += detectors[i] / specs[i].false_alarm_interval_s;
    return rate;
  };
  // 11 figures, load torque's changes off
  const auto one = specs_of(folder, "");
  ASSERT_TRUE(one.has_value());
  EXPECT_NEAR(one->front().false_alarm_interval_s, 3.6e7, 1e-3);
  const auto two = specs_of(folder, R"([alarms]
load_torque.changes = true
gap.enabled = false
[axis.y]
source = "in"
sample_rate_hz = 100
input = "u"
output = "y"
alarms.stiffness.changes = false
alarms.resonance.enabled = false
)");
  ASSERT_TRUE(two.has_value()) << message_of(two.error());
  EXPECT_NEAR(1.0 / rate_of(*two, {10, 8}), 3.6e6, 1e-3);
  const auto silent =
      specs_of(folder,
               "[alarms]\nresonance.changes=false\nantiresonance.changes=false\n"
               "stiffness.changes=false\ndriven_inertia.changes=false\nload_inertia.changes=false\n"
               "damping.changes=false\ncoulomb_friction.changes=false\n"
               "modulus_margin.changes=false\nphase_margin.changes=false\ngap.changes=false");
  ASSERT_TRUE(silent.has_value());
  EXPECT_EQ(detectors_of(AxisConfig{}), 10U);
}

}  // namespace
}  // namespace resonid::monitor::test
