// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <limits>
#include <map>
#include <set>

#include "certificate.hpp"
#include "configurations.hpp"

namespace resonid::monitor::test {
namespace {

using Texts = std::vector<std::string>;

/// Whether the only error begins with a place and a field, and goes on with these words.
::testing::AssertionResult is_only(const Texts& errors, const std::string& begin, const std::string& words) {
  if (errors.size() == 1 && errors[0].starts_with(begin) && errors[0].find(words) != std::string::npos)
    return ::testing::AssertionSuccess();
  auto failure = ::testing::AssertionFailure() << "required one: " << begin << " ... " << words << "\nfound:";
  for (const auto& error : errors) failure << "\n  " << error;
  return failure;
}

TEST(Check, TakesTheLeast) {
  const TemporaryFolder folder;
  const auto found = findings_of(folder, "");
  EXPECT_EQ(messages(found.errors), Texts{});
  EXPECT_EQ(messages(found.warnings), Texts{});
  EXPECT_EQ(messages(found.notes), (Texts{"m.toml:5:1: axis.x: no unit in 'u': Nm assumed",
                                          "m.toml:5:1: axis.x: 'y' taken for a velocity in rad/s"}));
  EXPECT_EQ(folder.entries(), 0U) << "nothing is written";
}

TEST(Check, SaysWhatIsWrongWithAnAxis) {
  const TemporaryFolder folder;
  EXPECT_TRUE(is_only(errors_of(folder, "delay_s = 0.2"), "m.toml:10:11: axis.x.delay_s: found 0.2",
                      "must be 0 ... 0.128"));
  EXPECT_EQ(errors_of(folder, "delay_s = 0.128"), Texts{}) << "64 samples";
  EXPECT_TRUE(
      is_only(errors_of(folder, "output_scale = 0"), "m.toml:10:16: axis.x.output_scale", "must not be 0"));
  EXPECT_TRUE(is_only(errors_of(folder, "band_hz = [30, 3]"), "m.toml:10:11: axis.x.band_hz", "ascending"));
  EXPECT_TRUE(
      is_only(errors_of(folder, "lines_hz = [3, 250]"), "m.toml:10:12: axis.x.lines_hz", "half the sample"));
  EXPECT_TRUE(is_only(errors_of(folder, "chirp = [1, 40]"), "m.toml:10:9: axis.x.chirp", "DURATION"));
  EXPECT_TRUE(is_only(errors_of(folder, "alarms.gap.low = 2\nalarms.gap.high = 1"),
                      "m.toml:10:18: axis.x.alarms.gap.low", "must be below high"));
  EXPECT_TRUE(is_only(errors_of(folder, "output_unit = 'mm'"),
                      "m.toml:5:1: [axis.x] has no key 'output_quantity'",
                      "is velocity, and the output 'y' is in mm"));
  EXPECT_TRUE(is_only(errors_of(folder, "method = 'iv'\nexcitation = 'r'"),
                      "m.toml:5:1: [axis.x] has no key 'controller'",
                      "which must be given for method = \"iv\""));
  EXPECT_TRUE(is_only(errors_of(folder, "method = 'arx'\noutput_quantity = 'acceleration'"),
                      "m.toml:10:10: axis.x.method", "needs a velocity or a position"));
  EXPECT_TRUE(
      is_only(errors_of(folder, "method = 'quick'"), "m.toml:10:10: axis.x.method", "required one of auto"));
  EXPECT_TRUE(
      is_only(errors_of(folder, "rate = 500"), "m.toml:10:1: unknown key 'axis.x.rate'", "known here"));
  const auto missing =
      errors_of(folder, "", "[monitor]\ndata = 'd'\n[source.in]\nkind='stdin'\n[axis.x]\nsource='in'");
  ASSERT_EQ(missing.size(), 3U);
  EXPECT_TRUE(
      is_only({missing[0]}, "m.toml:5:1: [axis.x] has no key 'sample_rate_hz'", "must be 0.001 ... 1e+06"));
  EXPECT_TRUE(is_only({missing[1]}, "m.toml:5:1: [axis.x] has no key 'input'", "must be given"));
  EXPECT_TRUE(is_only({missing[2]}, "m.toml:5:1: [axis.x] has no key 'output'", "must be given"));
}

/// A constant was meant for a signal: where none is in its unit, that one is taken for something else.
TEST(Check, RefusesConstantsThatApplyToNoSignal) {
  const TemporaryFolder folder;
  EXPECT_TRUE(is_only(errors_of(folder, "torque_constant = 0.62"), "m.toml:10:19: axis.x.torque_constant",
                      "the input 'u' is taken for Nm; required input_unit = \"A\""));
  EXPECT_TRUE(is_only(errors_of(folder, "torque_constant = 0.62\ninput_scale = 0.1"),
                      "m.toml:10:19: axis.x.torque_constant", "'u' times input_scale is taken for Nm"));
  EXPECT_TRUE(is_only(errors_of(folder, "torque_constant = 0.62\ninput_unit = 'mNm'"),
                      "m.toml:10:19: axis.x.torque_constant", "is taken for Nm"));
  EXPECT_TRUE(is_only(errors_of(folder, "rated_torque = 20\ninput_unit = 'A'"),
                      "m.toml:10:16: axis.x.rated_torque", "required input_unit = \"%\""));
  EXPECT_TRUE(is_only(errors_of(folder, "counts_per_rev = 4096"), "m.toml:10:18: axis.x.counts_per_rev",
                      "the output 'y' is taken for rad/s; required output_unit = \"counts/s\""));
  EXPECT_TRUE(
      is_only(errors_of(folder, "counts_per_rev = 4096\noutput_scale = 2\noutput_quantity = 'position'"),
              "m.toml:10:18: axis.x.counts_per_rev", "required output_unit = \"counts\""));
}

TEST(Check, TakesConstantsThatApply) {
  const TemporaryFolder folder;
  for (const char* more :
       {"torque_constant = 1\ninput_unit = 'A'",
        "torque_constant = 0.62\ninput_unit = 'mA'\ninput_scale = 0.1",
        "torque_constant = 0.62\ninput_unit = 'A'\nmotion = 'linear'\ninput_scale = -1",
        "rated_torque = 100\ninput_unit = '%'", "counts_per_rev = 4096\noutput_unit = 'counts/s'",
        "counts_per_rev = 4096\nposition = 'p_counts'",
        "counts_per_rev = 4096\noutput_unit = 'counts'\noutput_quantity = 'position'"})
    EXPECT_EQ(errors_of(folder, more), Texts{}) << more;
}

/// With columns of these names, and more keys.
Texts errors_of_columns(const TemporaryFolder& folder, const std::string& input, const std::string& output,
                        const std::string& more = "") {
  std::string text(kLeast);
  for (const auto& [old_name, name] : {std::pair("\"u\"", input), std::pair("\"y\"", output)})
    text.replace(text.find(old_name), 3, '"' + name + '"');
  return errors_of(folder, more, text);
}

TEST(Check, RefusesUnitsOfAnotherMotion) {
  const TemporaryFolder folder;
  const std::string linear = "motion = 'linear'";
  EXPECT_TRUE(is_only(errors_of_columns(folder, "u_Nm", "n_rpm", linear),
                      "m.toml:10:10: axis.x.motion: is linear, and the input 'u_Nm' is in Nm and the output "
                      "'n_rpm' is in rpm; required rotary, or units of a linear drive",
                      "N, A or % of the input"));
  EXPECT_TRUE(is_only(errors_of_columns(folder, "u_A", "y_rad_s", linear), "m.toml:10:10: axis.x.motion",
                      "the output 'y_rad_s' is in rad/s; required rotary, or"));
  EXPECT_TRUE(is_only(errors_of_columns(folder, "u_Nm", "v_mm_s", linear), "m.toml:10:10: axis.x.motion",
                      "the input 'u_Nm' is in Nm; required units of a linear drive"));
  EXPECT_TRUE(
      is_only(errors_of(folder, "output_unit = 'mm/s'"), "m.toml:5:1: [axis.x] has no key 'motion'",
              "is rotary, and the output 'y' is in mm/s; required linear, or units of a rotary drive"));
  EXPECT_TRUE(is_only(errors_of(folder, "input_unit = 'N'"), "m.toml:5:1: [axis.x] has no key 'motion'",
                      "the input 'u' is in N"));
  EXPECT_TRUE(is_only(errors_of_columns(folder, "u", "v_m_s", "motion = 'rotary'"),
                      "m.toml:10:10: axis.x.motion", "the output 'v_m_s' is in m/s"));
  EXPECT_TRUE(is_only(errors_of(folder, linear + "\ncounts_per_rev = 4096\noutput_unit = 'counts/s'"),
                      "m.toml:11:18: axis.x.counts_per_rev", "output_scale, m/s per count"));
}

TEST(Check, RefusesUnitsOfAnotherQuantityThanTheNameTells) {
  const TemporaryFolder folder;
  EXPECT_TRUE(is_only(errors_of_columns(folder, "u_Nm", "y", "input_unit = 'A'"),
                      "m.toml:10:14: axis.x.input_unit: found A, required another name of Nm",
                      "or an input_scale that converts it"));
  EXPECT_TRUE(is_only(errors_of_columns(folder, "u", "y_counts", "output_unit = 'rad/s'"),
                      "m.toml:10:15: axis.x.output_unit: found rad/s, required another name of counts",
                      "output_scale"));
}

TEST(Check, TakesUnitsThatFitTheMotion) {
  const TemporaryFolder folder;
  struct Case {
    const char *input, *output, *more;
  };
  for (const auto& [input, output, more] :
       {Case{"u_Nm", "n_rpm", ""}, Case{"u_N", "v_mm_s", "motion = 'linear'"},
        Case{"u_A", "v_m_s", "motion = 'linear'\ntorque_constant = 40"},
        Case{"u", "y", "motion = 'linear'\ninput_unit = '%'\nrated_torque = 900"},
        Case{"u", "y_counts", "motion = 'linear'\noutput_quantity = 'position'"},
        Case{"u_Nm", "n_rpm", "motion = 'linear'\ninput_scale = 628\noutput_scale = 1.7e-4"},
        Case{"u_Nm", "y", "input_unit = 'A'\ninput_scale = 2"}, Case{"u_Nm", "y", "input_unit = 'mNm'"},
        Case{"u_V", "y", "input_unit = 'Nm'"}, Case{"u_V", "y", ""},
        Case{"u_Nm", "n_rpm", "position = 'x_mm'"}})
    EXPECT_EQ(errors_of_columns(folder, input, output, more), Texts{})
        << input << ' ' << output << ' ' << more;
}

TEST(Check, RefusesOneColumnForTwoSignals) {
  const TemporaryFolder folder;
  EXPECT_TRUE(is_only(errors_of_columns(folder, "u", "u"), "m.toml:9:10: axis.x.output",
                      "found 'u', the column of the input; required another one"));
  EXPECT_TRUE(is_only(errors_of(folder, "excitation = 'y'"), "m.toml:10:14: axis.x.excitation",
                      "found 'y', the column of the output; required another one"));
  EXPECT_EQ(errors_of(folder, "excitation = 'u'\nposition = 'y'"), Texts{}) << "open loop";
}

TEST(Check, RefusesKeysOfSignalsThatAreNotThere) {
  const TemporaryFolder folder;
  EXPECT_TRUE(is_only(errors_of(folder, "excitation_scale = 2"), "m.toml:10:20: axis.x.excitation_scale",
                      "needs an excitation"));
  EXPECT_TRUE(is_only(errors_of(folder, "position_scale = 2"), "m.toml:10:18: axis.x.position_scale",
                      "needs a position"));
  EXPECT_TRUE(is_only(errors_of(folder, "method = 'kalman'\ndrift_per_s = 0.1"),
                      "m.toml:11:15: axis.x.drift_per_s", "found \"kalman\""));
  EXPECT_EQ(errors_of(folder, "excitation_scale = 1\nposition_scale = 1\ndrift_per_s = 0.1"), Texts{});
}

TEST(Check, RefusesLimitsThatAreNeverJudged) {
  const TemporaryFolder folder;
  const auto limit = [&](const std::string& key, const std::string& words) {
    return is_only(errors_of(folder, "alarms." + key), "m.toml:10:", words);
  };
  EXPECT_TRUE(
      limit("phase_margin.low = 30", "axis.x.alarms.phase_margin.low: needs an axis with a controller"));
  EXPECT_TRUE(
      limit("modulus_margin.low = 0.5", "axis.x.alarms.modulus_margin.low: needs an axis with a controller"));
  EXPECT_TRUE(limit("gap.high = 0.2", "axis.x.alarms.gap.high: needs an axis with a baseline"));
  for (const std::string& friction : {std::string(), std::string("\nfriction = 'viscous'")})
    EXPECT_TRUE(limit(
        "coulomb_friction.high = 0.5" + friction,
        "axis.x.alarms.coulomb_friction.high: needs an axis with friction = \"dry\" or \"both\": without"));
  for (const std::string& figure : {std::string("stiffness"), std::string("load_torque")})
    EXPECT_TRUE(
        limit(figure + ".low = 0.5\nmethod = 'kalman'",
              "axis.x.alarms." + figure + ".low: needs an axis with method = \"auto\" or \"physical\""));
  EXPECT_TRUE(limit("stiffness.deadband = 5", "axis.x.alarms.stiffness.deadband: needs low or high"));
  EXPECT_TRUE(is_only(errors_of(folder, "[alarms]\nphase_margin.low = 30"),
                      "m.toml:11:20: alarms.phase_margin.low", "needs an axis with a controller"))
      << "no axis at all";
  const std::string baseline =
      "baseline = '" + std::string(RESONID_FIXTURES_DIR) + "/results/identify_prbs.json'\n";
  for (const std::string& more :
       {std::string("controller = 'pi:1,0.1'\nalarms.phase_margin.low = 30\nalarms.modulus_margin.low = 0.5"),
        baseline + "alarms.gap.high = 0.2", std::string("alarms.gap.high = inf\nalarms.gap.deadband = 0"),
        std::string("alarms.coulomb_friction.high = 0.5\nfriction = 'dry'"),
        std::string("alarms.coulomb_friction.high = 0.5\nfriction = 'both'\nmethod = 'arx'"),
        std::string("alarms.coulomb_friction.high = inf\nalarms.load_torque.high = 2"),
        std::string("alarms.load_torque.high = 2\nmethod = 'physical'"),
        std::string("alarms.stiffness.low = 5\nalarms.stiffness.deadband = 1")})
    EXPECT_EQ(errors_of(folder, more), Texts{}) << more;
}

TEST(Check, WarnsOfAlarmsThatNeverCome) {
  const TemporaryFolder folder;
  const auto warned = [&](const std::string& more) { return warnings_of(folder, more); };
  for (const std::string key : {"on_delay_s = 5", "least_change = 0.1", "severity = 'high'"})
    EXPECT_TRUE(is_only(
        warned("alarms.gap." + key),
        "m.toml:10:", "axis.x.alarms.gap: needs an axis with a baseline: without one this alarm never comes"))
        << key;
  EXPECT_TRUE(is_only(warned("[alarms]\nphase_margin.latch = true"),
                      "m.toml:11:", "alarms.phase_margin: needs an axis with a controller"));
  for (const std::string fine :
       {"alarms.gap.enabled = false", "alarms.gap.on_delay_s = 0", "alarms.stiffness.latch = true",
        "controller = 'pi:1,0.1'\nalarms.phase_margin.latch = true"})
    EXPECT_EQ(warned(fine), Texts{}) << fine;
}

/// What holds for every axis is no fault of the one that cannot obey it.
TEST(Check, TakesAlarmsOfAllAxesThatOneCanObey) {
  const TemporaryFolder folder;
  EXPECT_EQ(errors_of(folder,
                      "[alarms]\nphase_margin.low = 30\ncoulomb_friction.high = 0.5\nstiffness.deadband = 5\n"
                      "[axis.y]\nsource = 'in'\nsample_rate_hz = 500\ninput = 'u'\noutput = 'y'\n"
                      "controller = 'pi:1,0.1'\nfriction = 'dry'\nalarms.stiffness.low = 100"),
            Texts{});
}

TEST(Check, RefusesKeysOfPublishingWithoutEffect) {
  const TemporaryFolder folder;
  (void)folder.file("password", "secret\n");
  ::chmod((folder / "password").c_str(), 0600);
  const std::string broker = "address = 'localhost:1883'\n";
  const auto published = [&](const std::string& keys) {
    return errors_of(folder, "[publish.mqtt]\n" + keys);
  };
  EXPECT_TRUE(is_only(published("qos = 9"), "m.toml:11:7: publish.mqtt.qos", "needs topic and address"));
  EXPECT_TRUE(is_only(published("user = 'me'"), "m.toml:11:8: publish.mqtt.user", "needs topic and address"));
  EXPECT_EQ(published("qos = 1\ntopic = ''"), Texts{}) << "as by default";
  EXPECT_TRUE(is_only(published("topic = 'a'"), "m.toml:11:9: publish.mqtt.topic",
                      "must be given together with address"));
  EXPECT_TRUE(is_only(published("address = 'localhost:1883'"), "m.toml:11:11: publish.mqtt.address",
                      "must be given together with topic"));
  EXPECT_TRUE(is_only(published("topic = 'a'\npassword_file = 'password'\n" + broker),
                      "m.toml:12:17: publish.mqtt.password_file", "needs a user"));
  EXPECT_EQ(published("topic = 'a'\nuser = 'me'\npassword_file = 'password'\n" + broker), Texts{});
  EXPECT_TRUE(is_only(
      errors_of(folder, "[source.s]\nkind = 'mqtt'\ntopic = 'a'\npassword_file = 'password'\n" + broker),
      "m.toml:13:17: source.s.password_file", "needs a user"));
  EXPECT_TRUE(is_only(errors_of(folder, "[publish.nats]\nstored = true"), "m.toml:11:10: publish.nats.stored",
                      "needs subject and address"));
  EXPECT_EQ(errors_of(folder, "[publish.nats]\nsubject = 'a'\npassword_file = 'password'\n" + broker),
            Texts{})
      << "a token";
}

TEST(Check, KnowsWhoReadsWhat) {
  const TemporaryFolder folder;
  EXPECT_TRUE(
      is_only(errors_of(folder, "[axis.y]\nsource = 'inn'\nsample_rate_hz = 1\ninput = 'u'\noutput = 'y'"),
              "m.toml:11:10: axis.y.source: found 'inn' (did you mean 'in'?)", "there are: in"));
  EXPECT_TRUE(is_only(errors_of(folder,
                                "[axis.y]\nsource = 'in'\nchannel = 'x'\nsample_rate_hz = 1\ninput = "
                                "'u'\noutput = 'y'"),
                      "m.toml:12:11: axis.y.channel: is 'x' of source 'in', which is axis.x already", ""));
  EXPECT_TRUE(is_only(errors_of(folder, "[axis.y]\nsample_rate_hz = 1\ninput = 'u'\noutput = 'y'"),
                      "m.toml:10:1: [axis.y] has no key 'source'", "must be given"));
  EXPECT_TRUE(is_only(errors_of(folder, "[source.more]\nkind = 'stdin'"),
                      "m.toml:11:8: source.more.kind: is stdin, which source.in reads already", ""));
  EXPECT_TRUE(is_only(errors_of(folder, "", "[monitor]\ndata = 'd'\n"), "m.toml:1:1: has no table [axis]",
                      "[axis.NAME]"));
  EXPECT_TRUE(is_only(errors_of(folder, "[axis.'y/z']\nsource='in'\nsample_rate_hz=1\ninput='u'\noutput='y'"),
                      "m.toml:10:1: axis.y/z: found the name 'y/z'", "1 ... 64 letters"));
  (void)folder.file("m", "");
  EXPECT_EQ(warnings_of(folder,
                        "[source.log]\nkind = 'file'\npath = 'm'\ntopic = 'x'\n[axis.y]\nsource = "
                        "'log'\nsample_rate_hz = 1\ninput = 'u'\noutput = 'y'"),
            Texts{})
      << "it is read, though not all of it is known";
  const auto unread = warnings_of(folder, "[source.f]\nkind = 'demo'");
  EXPECT_EQ(std::count(unread.begin(), unread.end(), "m.toml:10:1: source.f: is read by no axis"), 1);
  EXPECT_TRUE(is_only(errors_of(folder, "", R"([monitor]
data = "data"
[source.in]
kind = "stdin"
columns = ["ru", "u", "speed"]
[axis.x]
source = "in"
sample_rate_hz = 500
input = "u"
output = "sped"
)"),
                      "m.toml:10:10: axis.x.output: found 'sped' (did you mean 'speed'?)", "ru, u, speed"));
}

TEST(Check, RefusesWhatIsUsedTwice) {
  const TemporaryFolder folder;
  EXPECT_TRUE(is_only(errors_of(folder, "[source.t]\nkind = 'tcp'\naddress = '127.0.0.1:8080'"),
                      "m.toml:12:11: source.t.address: is TCP port 8080, which monitor.listen has already",
                      ""));
  EXPECT_EQ(errors_of(folder, "[source.t]\nkind = 'udp'\naddress = '127.0.0.1:8080'"), Texts{})
      << "UDP has ports of its own";
  EXPECT_TRUE(is_only(errors_of(folder,
                                "[source.a]\nkind='mqtt'\naddress='b:1'\ntopic='t'\nclient_id='c'\n"
                                "[source.b]\nkind='mqtt'\naddress='b:1'\ntopic='s'\nclient_id='c'"),
                      "m.toml:19:11: source.b.client_id: is that of source.a", ""));
  EXPECT_TRUE(is_only(
      errors_of(folder, "[source.a]\nkind='hal'\ncolumns=['u']\n[source.b]\nkind='hal'\ncolumns=['u']"),
      "m.toml:13:1: [source.b] has no key 'hal_channel', which is HAL channel 0", "source.a reads"));
}

TEST(Check, RefusesSourcesThatCannotBe) {
  const TemporaryFolder folder;
  const auto source = [&](const std::string& keys) { return errors_of(folder, "[source.s]\n" + keys); };
  EXPECT_TRUE(
      is_only(source("kind = 'tcp'"), "m.toml:10:1: [source.s] has no key 'address'", "must be given"));
  EXPECT_TRUE(is_only(source("kind = 'tcp'\naddress = 'here'"), "m.toml:12:11: source.s.address",
                      "found 'here', required HOST:PORT"));
  EXPECT_EQ(source("kind = 'tcp'\naddress = ':7010'"), Texts{});
  EXPECT_EQ(source("kind = 'tcp'\naddress = 'unix:/run/resonid/samples'"), Texts{});
  EXPECT_TRUE(is_only(source("kind = 'tcp'\naddress = ':8080'"), "m.toml:12:11: source.s.address",
                      "is TCP port 8080, which monitor.listen has already"));
  EXPECT_TRUE(is_only(source("kind = 'udp'\naddress = 'unix:/run/resonid/samples'"),
                      "m.toml:12:11: source.s.address", ":PORT for all interfaces"));
  EXPECT_TRUE(is_only(source("kind = 'file'\npath = ''"), "m.toml:12:8: source.s.path", "must be given"));
  EXPECT_TRUE(is_only(source("kind = 'mqtt'\naddress = 'b:1883'\ntopic = 'a/b#'"),
                      "m.toml:13:9: source.s.topic", "# as the last one"));
  EXPECT_TRUE(is_only(source("kind = 'mqtt'\naddress = 'b:1883'\ntopic = 'a'\nca_file = 'ca'"),
                      "m.toml:14:11: source.s.ca_file", "needs tls = true"));
  EXPECT_TRUE(is_only(source("kind = 'mqtt'\naddress = 'b:1883'\ntopic = 'a'\nqos = 3"),
                      "m.toml:14:7: source.s.qos", "must be 0 ... 1"));
  EXPECT_TRUE(is_only(source("kind = 'mqtt'\naddress = 'b:1883'\ntopic = 'a'\nversion = '4'"),
                      "m.toml:14:11: source.s.version", "required one of 3.1.1"));
  EXPECT_TRUE(is_only(source("kind = 'nats'\naddress = 'b:4222'\nsubject = 'a'\nstream = 's'\n"
                             "pending_messages = 7"),
                      "m.toml:15:20: source.s.pending_messages", "has no meaning with a stream"));
  EXPECT_TRUE(is_only(source("kind = 'nats'\naddress = 'b:4222'\nsubject = 'a'\ndurable = 'd'"),
                      "m.toml:14:11: source.s.durable", "needs a stream"));
  EXPECT_TRUE(is_only(source("kind = 'demo'\nexperiments = ['demoo']"), "m.toml:12:15: source.s.experiments",
                      "(did you mean 'demo'?)"));
  EXPECT_TRUE(is_only(source("kind = 'demo'\nexperiments = ['demo', 'x/bela.toml']"),
                      "m.toml:12:15: source.s.experiments", "required a shipped experiment or a file"));
  EXPECT_TRUE(is_only(source("kind = 'demo'\npath = 'f'"),
                      "m.toml:12:1: unknown key 'source.s.path' with kind = "
                      "'demo'",
                      ""));
  EXPECT_TRUE(is_only(source("kind = 'file'\npath = '.'"), "m.toml:12:8: source.s.path", "a folder"));
}

TEST(Check, LooksAtFiles) {
  const TemporaryFolder folder;
  EXPECT_TRUE(is_only(errors_of(folder, "controller = 'pi.json'"), "m.toml:10:14: axis.x.controller",
                      "none of that name"));
  (void)folder.file("pi.json", "{}");
  EXPECT_TRUE(is_only(errors_of(folder, "controller = 'pi.json'"), "m.toml:10:14: axis.x.controller",
                      "\"numerator\""));
  EXPECT_TRUE(
      is_only(errors_of(folder, "controller = 'pi:1'"), "m.toml:10:14: axis.x.controller", "pi:KP,TI"));
  EXPECT_TRUE(
      is_only(errors_of(folder, "baseline = 'pi.json'"), "m.toml:10:12: axis.x.baseline", "is no result of"));
  EXPECT_TRUE(
      is_only(errors_of(folder, "start = '/dev/stdin'"), "m.toml:10:9: axis.x.start", "none of that name"))
      << "nothing is waited for";
  const auto missing = errors_of(folder, "controller = 'a'\nstart = 'b'\nbaseline = 'c'\nmemory_s = -1");
  ASSERT_EQ(missing.size(), 4U);
  for (const auto& error : missing)
    EXPECT_EQ(error.find("none of that name") == error.npos, error.find("memory_s") != error.npos) << error;
  (void)folder.file("plain", "");
  const std::string service = "[monitor]\ndata = 'plain/data'\ncertificate_file = 'c'\nkey_file = 'plain'\n";
  const auto all = errors_of(folder, "", service + std::string(kLeast.substr(kLeast.find("[source"))));
  ASSERT_EQ(all.size(), 2U);
  EXPECT_TRUE(all[0].starts_with("m.toml:2:8: monitor.data: found")) << all[0];
  EXPECT_TRUE(all[1].starts_with("m.toml:3:20: monitor.certificate_file: found")) << all[1];
}

/// Where even a privileged user can make none.
TEST(Check, RefusesAFolderThatKeepsNoFiles) {
  const TemporaryFolder folder;
  std::string text(kLeast);
  const auto found = findings_of(folder, "", text.replace(text.find("\"data\""), 6, "'/proc/resonid'"));
  EXPECT_TRUE(is_only(messages(found.errors), "m.toml:2:8: monitor.data: found '/proc/resonid'",
                      "required a folder that can be written"));
  EXPECT_EQ(messages(found.warnings), Texts{});
}

/// No error: what a file has now it need not have when the service starts.
TEST(Check, WarnsOfColumnsThatAFileHasNot) {
  const TemporaryFolder folder;
  std::string text(kLeast);
  text.replace(text.find("\"stdin\""), 7, "'file'\npath = 'log.csv'");
  const auto warnings = [&](const std::string& content, const std::string& more = "") {
    (void)folder.file("log.csv", content);
    const auto found = findings_of(folder, more, text);
    EXPECT_EQ(messages(found.errors), Texts{}) << content.substr(0, 100);
    return messages(found.warnings);
  };
  EXPECT_EQ(warnings("ru,u,y\n1,2,3\n", "excitation = 'ru'"), Texts{});
  EXPECT_TRUE(is_only(warnings("ru;u;speed\n1;2;3\n"), "m.toml:10:10: axis.x.output",
                      "required a column of source 'in': ru, u, speed"));
  EXPECT_TRUE(is_only(warnings("ru,u,speed\n"), "m.toml:10:10: axis.x.output", "found 'y'"));
  EXPECT_EQ(warnings("ru,u,speed\n1,2,3\nru,u,y\n1,2,3\n"), Texts{}) << "names come again";
  std::string large = "ru,u,speed\n";
  while (large.size() < 3'000'000) large += "1,2,3\n";
  EXPECT_EQ(warnings(large).size(), 1U);
  EXPECT_EQ(warnings(large + "ru,u,y\n1,2,3\n"), Texts{});
  for (const char* content : {"", "1,2,3\n", "ru,u,sp"}) EXPECT_EQ(warnings(content), Texts{}) << content;
}

/// The first table with further keys.
std::string with_service(const std::string& keys) {
  std::string text(kLeast);
  return text.insert(text.find("[source"), keys + "\n");
}

/// While a service runs, before it stops for another configuration.
TEST(Check, LoadsWhatTheWebServerWould) {
  const TemporaryFolder folder;
  const web::test::Certificate own, other;
  const auto errors = [&](const std::string& first, const std::string& second) {
    return errors_of(folder, "", with_service(first + '\n' + second));
  };
  const auto tls = [&](const std::string& certificate, const std::string& key) {
    return errors("certificate_file = '" + certificate + "'", "key_file = '" + key + "'");
  };
  EXPECT_EQ(tls(own.certificate(), own.key()), Texts{});
  EXPECT_TRUE(is_only(tls(own.certificate(), other.key()),
                      "m.toml:4:12: monitor.key_file: '" + other.key() + "' cannot be used", "mismatch"));
  EXPECT_TRUE(
      is_only(tls(own.certificate(), "none.pem"), "m.toml:4:12: monitor.key_file", "none of that name"));
  for (const char* content : {"", "no certificate\n"}) {
    (void)folder.file("broken.pem", content);
    EXPECT_TRUE(
        is_only(tls("broken.pem", own.key()), "m.toml:3:20: monitor.certificate_file: ", "cannot be used"));
    EXPECT_TRUE(
        is_only(tls(own.certificate(), "broken.pem"), "m.toml:4:12: monitor.key_file: ", "cannot be used"));
  }

  for (const char* name : {"write", "read"}) (void)folder.file(name, "0123456789abcdef\n");
  const std::string write = "write_token_file = 'write'";
  EXPECT_TRUE(is_only(errors(write, "read_token_file = 'read'"),
                      "m.toml:4:19: monitor.read_token_file: ", "must differ from write_token"));
  (void)folder.file("write", "blanks are of no use\n");
  EXPECT_TRUE(is_only(errors(write, ""), "m.toml:3:20: monitor.write_token_file: ", "without spaces"));
}

TEST(Check, KeepsStrangersOut) {
  const TemporaryFolder folder;
  const auto errors = [&](const std::string& keys) { return errors_of(folder, "", with_service(keys)); };
  EXPECT_TRUE(
      is_only(errors("listen = '0.0.0.0:8080'"), "m.toml:3:10: monitor.listen", "required write_token_file"));
  EXPECT_EQ(errors("listen = '0.0.0.0:8080'\ninsecure = true"), Texts{});
  EXPECT_EQ(errors("listen = '[::1]:0'"), Texts{});
  EXPECT_EQ(errors("listen = 'localhost:80'"), Texts{});
  EXPECT_TRUE(is_only(errors("listen = '[::]:80'"), "m.toml:3:10: monitor.listen", "others reach"));
  (void)folder.file("short", "abc\n");
  EXPECT_TRUE(is_only(errors("listen = '0.0.0.0:80'\nwrite_token_file = 'short'"),
                      "m.toml:4:20: monitor.write_token_file",
                      "has 3 characters in its first line, required at least 16"));
  const auto token = folder.file("token", "  0123456789abcdef \nmore\n");
  ::chmod(token.c_str(), 0600);
  EXPECT_EQ(errors("listen = '0.0.0.0:80'\nwrite_token_file = 'token'"), Texts{});
  EXPECT_EQ(read_secret(token, kShortestToken).value_or(""), "0123456789abcdef");
  const auto secrets =
      parse_configuration(with_service("write_token_file = 'token'"), "m.toml", folder.path());
  for (const auto& text : {configuration_text(secrets.configuration), axis_text(secrets.configuration, "x")})
    EXPECT_EQ(text.find("0123456789abcdef"), std::string::npos);

  ::chmod(token.c_str(), 0644);
  const auto warned = messages(findings_of(folder, "", with_service("write_token_file = 'token'")).warnings);
  ASSERT_FALSE(warned.empty());
  EXPECT_NE(warned[0].find("can be read by every user"), std::string::npos) << warned[0];
}

TEST(Check, WarnsOfPromisesThatNobodyCanKeep) {
  const TemporaryFolder folder;
  const auto warned =
      messages(findings_of(folder, "", with_service("false_alarm_interval_s = 1e10")).warnings);
  ASSERT_FALSE(warned.empty());
  EXPECT_TRUE(warned[0].starts_with("m.toml:3:26: monitor.false_alarm_interval_s: is 317 years"))
      << warned[0];
  EXPECT_EQ(messages(findings_of(folder, "", with_service("false_alarm_interval_s = 1e8")).warnings),
            Texts{});
  EXPECT_EQ(
      warnings_of(
          folder,
          "ring_s = 1e6\n[axis.y]\nsource='in'\nsample_rate_hz=1e6\ninput='u'\noutput='y'\nring_s = 1e6")
          .size(),
      1U)
      << "no disk has 16 TB";
}

TEST(Check, TellsAllAtOnce) {
  const TemporaryFolder folder;
  const auto errors = errors_of(folder, "delay_s = 9\n[source.t]\nkind = 'tcp'\n[retention]\nrows_s = 5\n");
  EXPECT_EQ(errors.size(), 3U);
}

/// "10:11" of "m.toml:10:11: ..."
std::set<std::string> places(const Texts& errors) {
  std::set<std::string> all;
  for (const auto& error : errors) {
    const auto begin = error.find(':') + 1;
    all.insert(error.substr(begin, error.find(':', error.find(':', begin) + 1) - begin));
  }
  return all;
}

/// Unknown keys, wrong types, what is out of range and what is missing, in one pass.
TEST(Check, TellsErrorsOfEveryKindAtOnce) {
  const TemporaryFolder folder;
  const auto errors =
      errors_of(folder,
                "delay_s = 'long'\nspring = 1\nring_s = 5\nlines_hz = [1, 'b']\nbaseline_s = 0\n"
                "[source.t]\nkind = 'tcp'\naddress = '127.0.0.1:9000'\nconnections = 0\n"
                "[retention]\nrows_s = 5\nhours_s = 6\nworkers = 2\n"
                "[alarms]\ngap.deadband = -1\nstale.off_delay_s = -1\n"
                "[axis.y]\nsource = 'in'\nsample_rate_hz = 1\n");
  EXPECT_EQ(errors.size(), 13U);
  EXPECT_EQ(places(errors), (std::set<std::string>{"10:11", "11:1", "12:10", "13:16", "14:14", "18:15",
                                                   "20:10", "21:11", "22:1", "24:16", "25:21", "26:1"}))
      << testing::PrintToString(errors) << "; two of axis.y, which is all missing";
}

TEST(Check, TellsNothingThatComesOfAnotherError) {
  const TemporaryFolder folder;
  const std::string rest(kLeast.substr(kLeast.find("[source")));
  const auto with = [](std::string_view old_text, std::string_view new_text) {
    std::string text(kLeast);
    return text.replace(text.find(old_text), old_text.size(), new_text);
  };
  const std::string axis_y =
      "[axis.y]\nsource = 't'\nsample_rate_hz = 1\ninput = 'u'\noutput = 'y'\nchannel = 'a'\n";
  const std::string all[] = {
      std::string(kLeast) + "[source.t]\nkind = 'tpc'\naddress = 3\n" + axis_y,
      std::string(kLeast) + "[source.t]\naddress = 'a:1'\n" + axis_y,
      std::string(kLeast) + "[source.t]\nkind = 'demo'\nexperiments = 'a'\n" + axis_y,
      std::string(kLeast) + "[source.t]\nkind = 'mqtt'\naddress = 'b:1'\ntopic = 5\n",
      std::string(kLeast) + "[publish.mqtt]\ntopic = 't'\naddress = 5\n",
      with("[source", "listen = 8080\n[source") + "[source.t]\nkind = 'tcp'\naddress = '127.0.0.1:8080'\n",
      with("[source", "listen = '0.0.0.0:80'\ninsecure = 'yes'\n[source"),
      with("[source", "listen = '0.0.0.0:80'\nwrite_token_flie = 'none'\n[source"),
      with("output =", "ouput ="),
      with("input = \"u\"", "input = 5"),
      with("rate_hz = 500", "rate_hz = 'fast'") + "chirp = [1, 40, 5]\ndelay_s = 0.1\nlines_hz = [3]\n",
      with("rate_hz = 500", "rate_hz = -1") + "chirp = [1, 40, 5]\ndelay_s = 0.1\nband_hz = [1, 3]\n",
      std::string(kLeast) + "controller = 5\nalarms.phase_margin.low = 30\n",
      std::string(kLeast) + "[alarms]\nstiffness.on_delay_s = -1\n",
      "[monitor.data.x]\n" + rest,
      "axis = 3\n" + std::string(kLeast.substr(0, kLeast.find("[axis")))};
  for (const auto& text : all) {
    const auto errors = errors_of(folder, "", text);
    EXPECT_EQ(errors.size(), 1U) << text << testing::PrintToString(errors);
  }
}

/// What is told elsewhere than in the file is no fault of the file.
TEST(Check, NamesTheOptionThatIsWrong) {
  const TemporaryFolder folder;
  (void)folder.file("plain", "");
  const auto errors = [&](const std::string& listen, const std::string& data, std::string_view more) {
    const auto file = parse_configuration(
        std::string(kLeast) + std::string(more), "m.toml", folder.path(), [&](Configuration& c) {
          c.monitor.listen = listen;
          c.monitor.data = data;
          return ToldElsewhere{{"monitor.listen", "--listen"}, {"monitor.data", "--data"}};
        });
    return messages(file.findings.errors);
  };
  EXPECT_EQ(errors("127.0.0.1:0", "data", ""), Texts{});
  EXPECT_TRUE(is_only(errors("foo", "data", ""), "--listen: found 'foo', required HOST:PORT", ""));
  EXPECT_EQ(errors("foo", "data", "[monitor.listen]\n").size(), 2U) << "the file's own is wrong, too";
  EXPECT_TRUE(is_only(errors("0.0.0.0:80", "data", ""), "--listen: is 0.0.0.0:80, which others reach",
                      "required write_token_file, or insecure = true, in [monitor]"));
  EXPECT_TRUE(is_only(errors("127.0.0.1:0", "plain/data", ""), "--data: found '", "can be written"));
  EXPECT_TRUE(
      is_only(errors("127.0.0.1:9000", "data", "[source.t]\nkind = 'tcp'\naddress = '127.0.0.1:9000'\n"),
              "m.toml:12:11: source.t.address: is TCP port 9000, which --listen has already", ""));
}

TEST(Check, LoadsWhatClientsOfBrokersWould) {
  const TemporaryFolder folder;
  const web::test::Certificate own, other;
  (void)folder.file("broken.pem", "no certificate\n");
  for (const std::string table :
       {"source.s]\nkind = 'mqtt'\ntopic = 't'", "source.s]\nkind = 'nats'\nsubject = 't'",
        "publish.mqtt]\ntopic = 't'", "publish.nats]\nsubject = 't'"}) {
    const std::string path = table.substr(0, table.find(']'));
    const auto errors = [&](const std::string& ca, const std::string& certificate, const std::string& key) {
      return errors_of(folder, "[" + table + "\naddress = 'localhost:1'\ntls = true\nca_file = '" + ca +
                                   "'\ncertificate_file = '" + certificate + "'\nkey_file = '" + key + "'\n");
    };
    EXPECT_EQ(errors(other.certificate(), own.certificate(), own.key()), Texts{}) << table;
    EXPECT_TRUE(is_only(errors("broken.pem", own.certificate(), own.key()), "m.toml:",
                        path + ".ca_file: '" + (folder / "broken.pem").string() +
                            "' cannot be used; required certificates in PEM"));
    EXPECT_TRUE(is_only(errors(own.key(), own.certificate(), own.key()), "m.toml:", path + ".ca_file: "));
    EXPECT_TRUE(is_only(errors(own.certificate(), "broken.pem", own.key()),
                        "m.toml:", path + ".certificate_file: '" + (folder / "broken.pem").string()));
    EXPECT_TRUE(is_only(errors(own.certificate(), own.certificate(), "broken.pem"),
                        "m.toml:", path + ".key_file: '" + (folder / "broken.pem").string()));
    const auto mismatch = errors(own.certificate(), own.certificate(), other.key());
    EXPECT_TRUE(is_only(mismatch, "m.toml:", "mismatch; required the certificate's key in PEM"));
    EXPECT_TRUE(is_only(mismatch, "m.toml:", path + ".key_file: '" + other.key()));
  }
}

TEST(Check, NamesWhatIsNoConfiguration) {
  const TemporaryFolder folder;
  EXPECT_TRUE(is_only(errors_of(folder, "", "[monitor"), "m.toml:1:9:", "is not TOML"));
  EXPECT_TRUE(is_only(messages(read_configuration(folder / "none.toml").findings.errors),
                      (folder / "none.toml").string(), "cannot be opened"));
  const auto misspelt = errors_of(folder, "", "[axes.x]");
  ASSERT_EQ(misspelt.size(), 2U);
  EXPECT_TRUE(is_only({misspelt[0]}, "m.toml:1:2: unknown table 'axes' (did you mean 'axis'?)", ""));
  EXPECT_TRUE(is_only({misspelt[1]}, "m.toml:1:1: has no table [monitor]", "must be given"));
}

/// All keys that are numbers, by where they are.
struct NumberKeys {
  std::vector<std::string>& names;
  template <class Field>
  void operator()(std::string_view name, Field&, std::string_view) const {
    if constexpr (std::is_same_v<Field, double> || std::is_same_v<Field, std::optional<double>>)
      names.emplace_back(name);
  }
};

/// No number but a limit of an alarm may be infinite, and none may be far off.
TEST(Check, RefusesNumbersOutOfRange) {
  const TemporaryFolder folder;
  std::vector<std::string> names;
  AxisConfig axis;
  describe(NumberKeys{names}, axis);
  ASSERT_GT(names.size(), 10U);
  for (const auto& name : names) {
    if (name == "sample_rate_hz") continue;  // stands there already
    for (const char* value : {"inf", "-inf", "nan", "'1'"})
      EXPECT_EQ(errors_of(folder, name + " = " + value).size(), 1U) << name << " = " << value;
    const bool signed_number = name.ends_with("_scale") || name == "torque_constant";
    EXPECT_EQ(
        errors_of(folder, "excitation = 'r'\nposition = 'p'\ninput_unit = 'A'\n" + name + " = -1").size(),
        signed_number ? 0U : 1U)
        << name;
  }
  EXPECT_EQ(errors_of(folder, "alarms.gap.high = inf\nalarms.gap.low = -inf"), Texts{});
  EXPECT_EQ(errors_of(folder, "alarms.gap.on_delay_s = inf").size(), 1U);
}

TEST(Endpoint, IsTakenApart) {
  const auto host = [](const char* text) {
    const auto found = endpoint(text, 0);
    return found ? found->host + " " + std::to_string(found->port) : "refused";
  };
  EXPECT_EQ(host("127.0.0.1:80"), "127.0.0.1 80");
  EXPECT_EQ(host("[fe80::1]:65535"), "fe80::1 65535");
  EXPECT_EQ(host("broker.local:0"), "broker.local 0");
  for (const char* wrong : {"", ":", ":80", "a", "a:", "a:65536", "a:-1", "a:1.5", "::1:80", "[::1]", "u@b:1",
                            "mqtt://b:1883", "a b:1", "[]:1"})
    EXPECT_EQ(host(wrong), "refused") << wrong;
  EXPECT_FALSE(endpoint("a:0").has_value());
}

}  // namespace
}  // namespace resonid::monitor::test
