// SPDX-License-Identifier: MIT
#include <cmath>
#include <numbers>
#include <random>
#include <resonid/base/error_text.hpp>
#include <resonid/io/detail/own_units.hpp>
#include <resonid/io/record_reader.hpp>

#include "temporary_folder.hpp"

namespace resonid::io {
namespace {

using Column = std::vector<double>;
using Names = std::vector<std::string>;

/// Column c of row i holds 100 c + i, except that times rise by `step_s`.
Table table_of(const Names& names, std::size_t rows = 20, double step_s = 0.001) {
  Table table;
  table.source = "record.csv";
  table.names = names;
  table.line_runs = {{0, 2}};
  for (std::size_t c = 0; c < names.size(); ++c) {
    Column column(rows);
    const bool time = std::string("tTZ").find(names[c][0]) != std::string::npos &&
                      names[c].substr(0, 3) != "tor" && names[c].substr(0, 3) != "Tor" &&
                      names[c] != "TORQUE" && names[c] != "theta_rad" && names[c] != "trq";
    for (std::size_t i = 0; i < rows; ++i)
      column[i] =
          time ? step_s * static_cast<double>(i) : 100.0 * static_cast<double>(c) + static_cast<double>(i);
    table.columns.push_back(column);
  }
  return table;
}

data::Record record_of(const Table& table, const ColumnMapping& mapping = {}) {
  auto record = to_record(table, mapping);
  EXPECT_TRUE(record) << message_of(record.error());
  return record ? *record : data::Record();
}

TEST(RecordReader, FindsColumnsUnderTheirUsualNames) {
  const auto record = record_of(table_of({"time_s", "ru", "u", "y", "r", "position"}));
  EXPECT_EQ(record.sampling.time_name, "time_s");
  EXPECT_EQ(record.excitation.samples.front(), 100.0);
  EXPECT_EQ(record.input.samples.front(), 200.0);
  EXPECT_EQ(record.output.samples.front(), 300.0);
  EXPECT_EQ(record.reference.samples.front(), 400.0);
  EXPECT_EQ(record.position.samples.front(), 500.0);
  for (const Names& names : {Names{"T", "U", "Y"}, Names{"Time [s]", "Torque (Nm)", "Velocity_rad_s"},
                             Names{"t_s", "input_current_A", "output"}, Names{"time", "u_V", "y_rpm"}}) {
    const auto other = record_of(table_of(names));
    EXPECT_EQ(other.input.name, names[1]);
    EXPECT_EQ(other.output.name, names[2]);
    EXPECT_FALSE(other.excitation.present());
  }
}

TEST(RecordReader, TakesNamedColumnsFirst) {
  ColumnMapping mapping;
  mapping.input = "torque_set";
  mapping.output = "u";
  const auto record = record_of(table_of({"t", "u", "torque_set", "excitation_Nm"}), mapping);
  EXPECT_EQ(record.input.name, "torque_set");
  EXPECT_EQ(record.output.name, "u");
  EXPECT_EQ(record.excitation.name, "excitation_Nm");
}

TEST(RecordReader, TheMeasuredQuantityDecidesWhatIsAnOutput) {
  const auto table = table_of({"t", "u", "position", "velocity"});
  EXPECT_EQ(record_of(table).output.name, "velocity");
  EXPECT_EQ(record_of(table).position.name, "position");
  ColumnMapping mapping;
  mapping.output_quantity = data::OutputQuantity::position;
  EXPECT_EQ(record_of(table, mapping).output.name, "position");
  EXPECT_FALSE(record_of(table, mapping).position.present());
}

TEST(RecordReader, RefusesToChooseBetweenCandidates) {
  RESONID_EXPECT_MESSAGE(to_record(table_of({"t", "u", "torque_Nm", "y"}), {}),
                         "2 columns may be the input (u, torque_Nm); choose one with .input");
  RESONID_EXPECT_MESSAGE(to_record(table_of({"t", "time_s", "u", "y"}), {}),
                         "2 columns may be the time (t, time_s)");
}

TEST(RecordReader, NamesWhatIsThereWhenAColumnIsNot) {
  ColumnMapping mapping;
  mapping.input = "iq_mess_A";
  RESONID_EXPECT_MESSAGE(
      to_record(table_of({"t_s", "iq_ref_A", "iq_meas_A", "y"}), mapping),
      "record.csv: there is no column 'iq_mess_A' (.input); did you mean 'iq_meas_A'?; columns: "
      "t_s, iq_ref_A, iq_meas_A, y");
  RESONID_EXPECT_MESSAGE(
      to_record(table_of({"t_s", "a", "y"}), {}),
      "no column is called like an input ('u', 'input...', 'torque...'); name it with .input; "
      "columns: t_s, a, y");
  RESONID_EXPECT_MESSAGE(to_record(table_of({"u", "y"}), {}), "give .time or .sample_rate_hz");
}

struct UnitCase {
  const char* input;
  const char* output;
  data::Motion motion;
  data::OutputQuantity quantity;
  double input_scale;
  double output_scale;
  const char* input_unit;
  const char* output_unit;
  double input_factor = 1.0;  // of the unit
  double output_factor = 1.0;
};
constexpr double kPi = std::numbers::pi;

TEST(RecordReader, TellsUnitsFromNamesScalesAndMotion) {
  using data::Motion;
  using data::OutputQuantity;
  const std::vector<UnitCase> cases = {
      {"u", "y", Motion::rotary, OutputQuantity::velocity, 1, 1, "Nm", "rad/s"},
      {"u", "y", Motion::linear, OutputQuantity::position, 1, 1, "N", "m"},
      {"u", "y", Motion::linear, OutputQuantity::acceleration, 1, 1, "N", "m/s2"},
      {"u_A", "y_rad", Motion::rotary, OutputQuantity::position, 1, -1, "A", "rad"},
      {"u_A", "y_rad", Motion::rotary, OutputQuantity::position, 0.564, 1, "Nm", "rad"},
      {"u_V", "y_V", Motion::rotary, OutputQuantity::position, -1, 1, "V", "V"},
      {"u_nm", "y_rpm", Motion::rotary, OutputQuantity::velocity, 1, 1, "Nm", "rad/s", 1, kPi / 30},
      {"u", "y_rpm", Motion::rotary, OutputQuantity::velocity, 1, 0.1047, "Nm", "rad/s"},
      {"u_N", "y_m_s", Motion::linear, OutputQuantity::velocity, 1, 1, "N", "m/s"},
      {"u [mA]", "y_deg", Motion::rotary, OutputQuantity::position, 1, 1, "A", "rad", 1e-3, kPi / 180},
      {"u", "output_m", Motion::rotary, OutputQuantity::velocity, 1, 1, "Nm", "rad/s"},
  };
  for (const auto& c : cases) {
    ColumnMapping mapping;
    mapping.motion = c.motion;
    mapping.output_quantity = c.quantity;
    mapping.input_scale = c.input_scale;
    mapping.output_scale = c.output_scale;
    const auto record = record_of(table_of({"t", c.input, c.output}), mapping);
    EXPECT_EQ(record.input.unit, c.input_unit) << c.input << " " << c.output;
    EXPECT_EQ(record.output.unit, c.output_unit) << c.input << " " << c.output;
    EXPECT_DOUBLE_EQ(record.input.samples[3], 103.0 * c.input_scale * c.input_factor);
    EXPECT_DOUBLE_EQ(record.output.samples[3], 203.0 * c.output_scale * c.output_factor);
    mapping.input_unit = "kN";
    const auto told = record_of(table_of({"t", c.input, c.output}), mapping);
    EXPECT_EQ(told.input.unit, "N");
    EXPECT_DOUBLE_EQ(told.input.samples[3], 103e3 * c.input_scale);
  }
}

TEST(RecordReader, ScalesTheExcitationLikeTheInput) {
  ColumnMapping mapping;
  mapping.input_scale = 0.5;
  const auto current = record_of(table_of({"t", "ru_A", "u_A", "y"}), mapping);
  EXPECT_EQ(current.excitation.samples[1], 0.5 * 101.0);
  EXPECT_EQ(current.excitation.unit, "Nm");
  const auto torque = record_of(table_of({"t", "ru_Nm", "u_A", "y"}), mapping);
  EXPECT_EQ(torque.excitation.samples[1], 101.0);
  EXPECT_EQ(torque.excitation.unit, "Nm");
  const auto bare = record_of(table_of({"t", "ru", "u_V", "y"}));
  EXPECT_EQ(bare.excitation.unit, "V");
}

TEST(RecordReader, AddsColumns) {
  const auto table = table_of({"t", "u", "a_V", "b_V", "a-b", "a"});
  ColumnMapping mapping;
  mapping.output = "34.18*a_V - b_V * 2e-1 + a";
  const auto sum = record_of(table, mapping);
  EXPECT_DOUBLE_EQ(sum.output.samples[3], 34.18 * 203.0 - 0.2 * 303.0 + 503.0);
  EXPECT_EQ(sum.output.name, "(34.18*a_V - b_V * 2e-1 + a)");
  EXPECT_EQ(sum.output.unit, "rad/s");  // a factor makes it the SI unit, as a scale does
  mapping.output = "a-b";               // a column of that name comes before the difference
  EXPECT_EQ(record_of(table, mapping).output.samples[0], 400.0);
  mapping.output = "2*a-b";
  EXPECT_EQ(record_of(table, mapping).output.samples[0], 800.0);
  mapping.output = "-b_V + a_V";
  EXPECT_EQ(record_of(table, mapping).output.samples[0], -100.0);
  EXPECT_EQ(record_of(table, mapping).output.unit, "V");
  mapping.output_unit = "deg/s";
  EXPECT_EQ(record_of(table, mapping).output.unit, "rad/s");
  EXPECT_DOUBLE_EQ(record_of(table, mapping).output.samples[0], -100.0 * kPi / 180.0);
}

TEST(RecordReader, RefusesWhatIsNoSum) {
  const auto table = table_of({"t", "u", "a", "b"});
  for (const auto& [text, found] :
       std::vector<std::pair<const char*, const char*>>{{"2*a + 3*c", "found 'c'"},
                                                        {"2*a 3*b", "found '3*b'"},
                                                        {"2*", "found the end"},
                                                        {"2*3", "found '3'"}}) {
    ColumnMapping mapping;
    mapping.output = text;
    RESONID_EXPECT_MESSAGE(to_record(table, mapping), found);
    RESONID_EXPECT_MESSAGE(to_record(table, mapping), ".output");
  }
  ColumnMapping mapping;
  mapping.output = "a-c";
  RESONID_EXPECT_MESSAGE(to_record(table, mapping), "there is no column 'a-c' (.output)");
}

TEST(RecordReader, DifferentiatesAPosition) {
  auto table = table_of({"t", "u", "y_deg", "r"});
  for (std::size_t k = 0; k < 20; ++k) table.columns[2][k] = 0.5 * static_cast<double>(k * k);
  ColumnMapping mapping;
  mapping.output_quantity = data::OutputQuantity::position;
  mapping.differentiate = true;
  const auto record = record_of(table, mapping);
  EXPECT_EQ(record.output_quantity, data::OutputQuantity::velocity);
  EXPECT_EQ(record.output.unit, "rad/s");
  ASSERT_EQ(record.samples(), 19U);
  EXPECT_EQ(record.input.samples.size(), 19U);
  EXPECT_EQ(record.input.samples[0], 101.0);
  EXPECT_NEAR(record.start_time_s, 0.001, 1e-12);
  EXPECT_NEAR(record.output.samples[4], 1000.0 * 4.5 * kPi / 180.0,
              1e-6);  // from sample 4 to 5: the mean, half a sample late
  EXPECT_NEAR(record.reference.samples[4], 1000.0 * kPi / 180.0, 1e-6);
  mapping.output_quantity = data::OutputQuantity::velocity;
  RESONID_EXPECT_MESSAGE(to_record(table, mapping), ".output_quantity position is required");
}

TEST(RecordReader, MeasuresRateAndJitter) {
  auto table = table_of({"t_s", "u", "y"}, 5000, 0.0004);
  auto record = record_of(table);
  EXPECT_EQ(record.sample_rate_hz, 2500.0);
  EXPECT_TRUE(record.sampling.measured);
  EXPECT_LT(record.sampling.jitter_max_s, 1e-12);
  EXPECT_EQ(record.sampling.gaps, 0U);

  std::mt19937 random(3);
  std::normal_distribution<double> normal(0.0, 4e-5);
  double squares = 0.0;
  double largest = 0.0;
  for (double& t : table.columns[0]) {
    const double jitter = std::clamp(normal(random), -1.2e-4, 1.2e-4);
    t += jitter;
    squares += jitter * jitter;
    largest = std::max(largest, std::abs(jitter));
  }
  record = record_of(table);
  EXPECT_NEAR(record.sample_rate_hz, 2500.0, 1e-3);
  EXPECT_NEAR(record.sampling.jitter_rms_s, std::sqrt(squares / 5000.0), 1e-7);
  EXPECT_NEAR(record.sampling.jitter_max_s, largest, 5e-6);
  EXPECT_EQ(record.sampling.gaps, 0U);
}

TEST(RecordReader, FindsTheRateBehindCoarseStamps) {
  auto table = table_of({"t", "u", "y"}, 4000, 1.0 / 3000.0);
  for (double& t : table.columns[0]) t = std::round(t * 1e4) / 1e4;  // intervals of 0.3 and 0.4 ms
  const auto record = record_of(table);
  EXPECT_NEAR(record.sample_rate_hz, 3000.0, 1e-6 * 3000.0);
  EXPECT_EQ(record.sampling.gaps, 0U);
  EXPECT_NEAR(record.sampling.jitter_max_s, 1e-4 / 3.0, 1e-7);
}

TEST(RecordReader, CountsGapsAndRefusesTooMany) {
  auto table = table_of({"t", "u", "y"}, 1000);
  const auto shift = [&](std::size_t from, double by) {
    for (std::size_t i = from; i < 1000; ++i) table.columns[0][i] += by;
  };
  shift(400, 0.001);
  shift(600, 0.030);
  auto record = record_of(table);
  EXPECT_NEAR(record.sample_rate_hz, 1000.0, 1e-6);
  EXPECT_EQ(record.sampling.gaps, 2U);
  EXPECT_NEAR(record.sampling.first_gap_at_s, 0.399, 1e-12);
  EXPECT_NEAR(record.sampling.largest_gap_s, 0.031, 1e-12);
  EXPECT_LT(record.sampling.jitter_max_s, 1e-9);
  EXPECT_EQ(record.samples(), 1000U);
  shift(800, 0.030);
  RESONID_EXPECT_MESSAGE(to_record(table, {}),
                         "61 of 1061 samples are missing (5.7 %, in 3 gaps, the first after");
  ColumnMapping part;
  part.to_s = 0.8;
  EXPECT_EQ(record_of(table, part).sampling.gaps, 2U);
}

TEST(RecordReader, RefusesAGapBeyondCounting) {
  for (const double stamp : {1e30, 1e122, 1e150}) {
    auto table = table_of({"t", "u", "y"}, 1000);
    table.columns[0].back() = stamp;
    RESONID_EXPECT_MESSAGE(to_record(table, {}), "samples are missing (100.0 %, in 1 gaps, the first after");
  }
}

TEST(RecordReader, RefusesStampsThatAreNoTime) {
  for (const double factor : {1e307, 1e-308}) {
    auto table = table_of({"t", "u", "y"}, 1000);
    for (double& t : table.columns[0]) t *= factor;
    RESONID_EXPECT_MESSAGE(to_record(table, {}), "gives a sample rate of");
    RESONID_EXPECT_MESSAGE(to_record(table, {.time_unit = TimeUnit::seconds}),
                           "give no sample rate; they must be the time in seconds");
  }
  auto table = table_of({"t", "u", "y"}, 1000);
  table.columns[0].back() = 1e308;
  RESONID_EXPECT_MESSAGE(to_record(table, {}), "give no sample rate; they must be the time in seconds");
}

TEST(RecordReader, ALateStampIsJitterAndNoGap) {
  auto table = table_of({"t", "u", "y"}, 100);
  table.columns[0][50] += 0.0006;
  const auto record = record_of(table);
  EXPECT_EQ(record.sampling.gaps, 0U);
  EXPECT_NEAR(record.sampling.jitter_max_s, 0.0006, 1e-5);
}

TEST(RecordReader, RefusesTimeThatDoesNotRise) {
  auto table = table_of({"t", "u", "y"});
  std::swap(table.columns[0][6], table.columns[0][7]);
  RESONID_EXPECT_MESSAGE(
      to_record(table, {}),
      "line 9, column 't': the time 0.006 comes after the later 0.007 of the sample before it");
  table.columns[0][7] = table.columns[0][6];
  RESONID_EXPECT_MESSAGE(to_record(table, {}), "line 9, column 't': the time 0.007 repeats the 0.007");
}

TEST(RecordReader, ASampleRateMustAgreeWithTheTimeColumn) {
  const auto table = table_of({"t", "u", "y"});
  ColumnMapping mapping;
  mapping.sample_rate_hz = 1005.0;
  EXPECT_EQ(record_of(table, mapping).sample_rate_hz, 1005.0);
  mapping.sample_rate_hz = 500.0;
  RESONID_EXPECT_MESSAGE(to_record(table, mapping),
                         ".sample_rate_hz 500 contradicts the time column 't', which says 1000 Hz");
  mapping.time = "none";
  const auto record = record_of(table, mapping);
  EXPECT_EQ(record.sample_rate_hz, 500.0);
  EXPECT_FALSE(record.sampling.measured);
  EXPECT_EQ(record.sampling.time_name, "");
}

bool says(const data::Record& record, const std::string& phrase) {
  return std::any_of(record.reading.begin(), record.reading.end(),
                     [&](const std::string& note) { return note.find(phrase) != note.npos; });
}

TEST(RecordReader, SaysWhatItAssumesAndConverts) {
  const auto bare = record_of(table_of({"t", "u", "y"}));
  EXPECT_TRUE(says(bare, "no unit in 'u': Nm assumed"));
  EXPECT_TRUE(says(bare, "no unit in 'y': rad/s assumed"));
  EXPECT_TRUE(bare.input.unit_assumed && bare.output.unit_assumed);
  const auto called =
      record_of(table_of({"t", "u", "y"}), {.output_quantity = data::OutputQuantity::velocity});
  EXPECT_TRUE(says(called, "'y' taken for a velocity in rad/s"));
  EXPECT_FALSE(called.output.unit_assumed);
  EXPECT_FALSE(record_of(table_of({"t", "u", "y"}), {.output_unit = "rad/s"}).output.unit_assumed);
  EXPECT_FALSE(record_of(table_of({"t", "u", "y"}), {.output_scale = 2.0}).output.unit_assumed);
  const auto told = record_of(table_of({"t_s", "u_Nm", "y_rad_s"}));
  EXPECT_TRUE(told.reading.empty());
  EXPECT_FALSE(told.input.unit_assumed || told.output.unit_assumed);
  EXPECT_TRUE(
      says(record_of(table_of({"t_s", "u_Nm", "y_rpm"})), "'y_rpm': rpm converted to rad/s (x 0.10472)"));
  EXPECT_TRUE(says(record_of(table_of({"t_s", "u_A", "y_rad_s"})), "give .torque_constant for Nm"));
  auto row = table_of({"t", "u", "y"});
  row.units = {"ms", "mNm", "1/min"};
  const auto record = record_of(row);
  EXPECT_NEAR(record.sample_rate_hz, 1e6, 1e-3);
  EXPECT_DOUBLE_EQ(record.input.samples[1], 0.101);
  EXPECT_DOUBLE_EQ(record.output.samples[1], 201.0 * kPi / 30.0);
}

TEST(RecordReader, ConvertsToTorqueAndAngleWithWhatTheUserTells) {
  ColumnMapping mapping;
  mapping.torque_constant = 0.5;
  mapping.rated_torque = 8.0;
  mapping.counts_per_rev = 4096.0;
  EXPECT_DOUBLE_EQ(record_of(table_of({"t", "u_mA", "y"}), mapping).input.samples[2], 102.0 * 0.5e-3);
  EXPECT_DOUBLE_EQ(record_of(table_of({"t", "u [%]", "y"}), mapping).input.samples[2], 1.02 * 8.0);
  const auto permille = record_of(table_of({"t", "u [\u2030]", "y_counts"}), mapping);
  EXPECT_DOUBLE_EQ(permille.input.samples[2], 0.102 * 8.0);
  EXPECT_EQ(permille.input.unit, "Nm");
  EXPECT_DOUBLE_EQ(permille.output.samples[2], 202.0 * 2.0 * kPi / 4096.0);
  EXPECT_EQ(permille.output.unit, "rad");
  EXPECT_EQ(permille.output_quantity, data::OutputQuantity::position);
  mapping.counts_per_rev = -1.0;
  RESONID_EXPECT_MESSAGE(to_record(table_of({"t", "u", "y"}), mapping), "counts_per_rev: found -1");
}

/// What own_units.hpp tells of a recording must give its numbers back.
TEST(RecordReader, TellsWhatTheNumbersWereMeasuredIn) {
  const struct {
    std::vector<std::string> names, units;
    ColumnMapping mapping;
    std::string input, velocity;
    double input_factor, velocity_factor;
  } cases[] = {
      {{"t", "u_Nm", "y_rad_s"}, {}, {}, "Nm", "rad/s", 1.0, 1.0},
      {{"t", "iq_mA", "y_rpm"}, {}, {.torque_constant = 0.5}, "mA", "rpm", 0.5e-3, kPi / 30.0},
      {{"t", "u", "y"}, {"ms", "mNm", "1/min"}, {}, "mNm", "1/min", 1e-3, kPi / 30.0},
      {{"t", "u [%]", "y_deg"}, {}, {.rated_torque = 8.0}, "%", "deg/s", 0.08, kPi / 180.0},
      {{"t", "u", "y_counts"}, {}, {.counts_per_rev = 4096.0}, "Nm", "counts/s", 1.0, 2.0 * kPi / 4096.0},
      {{"t", "u_V", "y_mm_s"}, {}, {}, "V", "mm/s", 1.0, 1e-3},
      {{"t", "u_N", "y_mm"}, {}, {.differentiate = true}, "N", "mm/s", 1.0, 1e-3},
      {{"t", "u_A", "y_rpm"},
       {},
       {.input_scale = 0.564, .output_scale = -kPi / 30.0},
       "A",
       "rpm",
       0.564,
       -kPi / 30.0},
      {{"t", "u", "y"}, {}, {.input_scale = 0.564, .output_scale = 2.0}, "", "", 0.564, 2.0},
      {{"t", "u", "omega_m"}, {}, {.input_unit = "mNm"}, "mNm", "rad/s", 1e-3, 1.0}};
  for (const auto& one : cases) {
    SCOPED_TRACE(one.names[1] + ", " + one.names[2]);
    auto table = table_of(one.names);
    table.units = one.units;
    const auto record = record_of(table, one.mapping);
    const auto input =
        own_input_unit({record.input.name, record.input.unit, record.reading, record.motion}, one.mapping);
    EXPECT_EQ(input.unit, one.input);
    EXPECT_NEAR(input.factor, one.input_factor, 1e-12 * std::abs(one.input_factor));
    const auto output =
        own_velocity_unit({record.output.name, record.output.unit, record.reading, record.motion},
                          one.mapping, record.output_quantity);
    EXPECT_EQ(output.unit, one.velocity);
    EXPECT_NEAR(output.factor, one.velocity_factor, 1e-12 * std::abs(one.velocity_factor));
  }
}

TEST(RecordReader, FindsTheNamesOfDrives) {
  const struct {
    Names names;
    const char *input, *output;
    data::OutputQuantity quantity;
  } cases[] = {
      {{"Zeit", "Sollmoment", "Istdrehzahl"}, "Sollmoment", "Istdrehzahl", data::OutputQuantity::velocity},
      {{"t", "n_ref", "n_act", "M_act"}, "M_act", "n_act", data::OutputQuantity::velocity},
      {{"t_s", "trq", "theta_rad"}, "trq", "theta_rad", data::OutputQuantity::position},
      {{"t_s", "Iq", "speed"}, "Iq", "speed", data::OutputQuantity::velocity},
      {{"time", "POSITION", "VELOCITY", "TORQUE"}, "TORQUE", "VELOCITY", data::OutputQuantity::velocity},
      {{"t", "MOT.M [mNm]", "MOT.W [rad/s]"}, "MOT.M [mNm]", "MOT.W [rad/s]", data::OutputQuantity::velocity},
      {{"Time (s)", "01.01 Motor speed used (rpm)", "01.10 Motor torque (%)"},
       "01.10 Motor torque (%)",
       "01.01 Motor speed used (rpm)",
       data::OutputQuantity::velocity},
      {{"t", "torque_set", "torque_act", "angle"}, "torque_act", "angle", data::OutputQuantity::position},
  };
  for (const auto& c : cases) {
    const auto record = record_of(table_of(c.names));
    EXPECT_EQ(record.input.name, c.input);
    EXPECT_EQ(record.output.name, c.output);
    EXPECT_EQ(record.output_quantity, c.quantity) << c.output;
  }
  RESONID_EXPECT_MESSAGE(to_record(table_of({"t", "torque_set", "torque_load", "y"}), {}),
                         "2 columns may be the input");
}

TEST(RecordReader, TakesALetterAtTheEndForWhatItMeans) {
  const auto motor = record_of(table_of({"t", "u", "theta_m"}));
  EXPECT_EQ(motor.output.unit, "rad");
  EXPECT_EQ(motor.motion, data::Motion::rotary);
  EXPECT_EQ(record_of(table_of({"t", "force_N", "position_m"})).output.unit, "m");
  const auto shaft = record_of(table_of({"t", "torque_m", "omega_m"}));
  EXPECT_EQ(shaft.output.unit, "rad/s");
  RESONID_EXPECT_MESSAGE(to_record(table_of({"t", "torque_m", "torque_s", "omega_m"}), {}),
                         "2 columns may be the input");
}

TEST(RecordReader, DoesNotTakeASetPointOrALimitForASignal) {
  const struct {
    Names names;
    const char *input, *output;
  } cases[] = {
      {{"t", "torque_Nm", "velocity_setpoint_rad_s", "motor_speed_rad_s"}, "torque_Nm", "motor_speed_rad_s"},
      {{"t", "torque_Nm", "velocity_error_rad_s", "motor_speed_rad_s"}, "torque_Nm", "motor_speed_rad_s"},
      {{"t", "torque_limit_max_Nm", "Motor torque [Nm]", "speed"}, "Motor torque [Nm]", "speed"},
      {{"t", "Input voltage [V]", "iq_A", "speed"}, "iq_A", "speed"},
      {{"t", "torque_Nm", "Output current [A]", "Motor speed [rad/s]"}, "torque_Nm", "Motor speed [rad/s]"},
  };
  for (const auto& c : cases) {
    const auto record = record_of(table_of(c.names));
    EXPECT_EQ(record.input.name, c.input);
    EXPECT_EQ(record.output.name, c.output);
  }
  RESONID_EXPECT_MESSAGE(to_record(table_of({"t", "u", "velocity_load_rad_s", "motor_speed_rad_s"}), {}),
                         "2 columns may be the output (velocity_load_rad_s, motor_speed_rad_s)");
}

TEST(RecordReader, TakesTimesInOtherUnits) {
  const auto rate = [](const char* name, double step, ColumnMapping mapping = {}) {
    return record_of(table_of({name, "u", "y"}, 50, step), mapping).sample_rate_hz;
  };
  EXPECT_NEAR(rate("t_ms", 2.0), 500.0, 1e-6);
  EXPECT_NEAR(rate("time [us]", 250.0), 4000.0, 1e-6);
  EXPECT_NEAR(rate("t", 2.0, {.time_unit = TimeUnit::milliseconds}), 500.0, 1e-6);
  EXPECT_NEAR(rate("t", 1.0, {.time_unit = TimeUnit::samples, .sample_rate_hz = 250.0}), 250.0, 1e-6);
  EXPECT_NEAR(rate("t", 2.0, {.time_unit = TimeUnit::seconds}), 0.5, 1e-9);
  for (const double ms : {2.0, 0.1, 0.0625, 0.05})  // 500 Hz ... 20 kHz in ms
    RESONID_EXPECT_MESSAGE(to_record(table_of({"t", "u", "y"}, 50, ms), {}), "give .time_unit ms, us");
  EXPECT_TRUE(says(record_of(table_of({"t", "u", "y"})), "no unit in 't': s assumed"));
  auto filetime = table_of({"timestamp", "u", "y"}, 50);
  for (std::size_t k = 0; k < 50; ++k) filetime.columns[0][k] = 133535826e9 + 2e4 * static_cast<double>(k);
  EXPECT_NEAR(record_of(filetime).sample_rate_hz, 500.0, 1e-3);
  auto numbers = table_of({"sample", "u", "y"}, 50);
  for (std::size_t k = 0; k < 50; ++k) numbers.columns[0][k] = static_cast<double>(k);
  RESONID_EXPECT_MESSAGE(to_record(numbers, {}),
                         "holds sample numbers, which tell no time; give .sample_rate_hz");
  EXPECT_EQ(record_of(numbers, {.sample_rate_hz = 250.0}).sample_rate_hz, 250.0);
}

/// A smooth signal with samples that are missing, by rows that are not there or cells that are empty.
TEST(RecordReader, PutsMissingSamplesBack) {
  const auto smooth = [](std::size_t k) { return std::sin(0.05 * static_cast<double>(k)); };
  auto table = table_of({"t", "u", "y"}, 1000);
  for (std::size_t k = 0; k < 1000; ++k) table.columns[2][k] = smooth(k);
  for (const std::size_t k : {100U, 500U, 501U, 900U})
    for (auto& column : table.columns) column.erase(column.begin() + k - (k > 100) - (k > 500) - (k > 501));
  table.columns[2][300] = std::nan("");  // place 301
  const auto record = record_of(table);
  ASSERT_EQ(record.samples(), 1000U);
  EXPECT_EQ(record.sampling.filled, (std::vector<std::size_t>{100, 301, 500, 501, 900}));
  EXPECT_EQ(record.sampling.gaps, 0U);
  for (std::size_t k = 0; k < 1000; ++k) {
    EXPECT_NEAR(record.output.samples[k], smooth(k), 1e-5) << k;
    EXPECT_NEAR(record.input.samples[k], 100.0 + static_cast<double>(k), 1e-9) << k;
  }
  EXPECT_TRUE(says(record, "5 of 1000 samples (0.5 %) were missing and are interpolated"));
  RESONID_EXPECT_MESSAGE(to_record(table, {.missing = MissingSamples::refuse}),
                         ".missing refuse allows none");
}

TEST(RecordReader, LeavesOutWhatIsMissingInLongRuns) {
  auto table = table_of({"t", "u", "y"}, 1000);
  for (std::size_t k = 400; k < 410; ++k) table.columns[1][k] = std::nan("");
  for (std::size_t k = 0; k < 5; ++k) table.columns[2][k] = std::nan("");
  const auto record = record_of(table);
  EXPECT_EQ(record.samples(), 985U);
  EXPECT_EQ(record.sampling.gaps, 1U);
  EXPECT_NEAR(record.sampling.first_gap_at_s, 0.399, 1e-9);
  for (std::size_t k = 0; k < 1000; k += 2) table.columns[2][k] = std::nan("");
  RESONID_EXPECT_MESSAGE(to_record(table, {}), "samples are missing");
}

TEST(RecordReader, UndoesTheWrapAroundOfACounter) {
  auto table = table_of({"t", "u", "y_counts"}, 1000);
  for (std::size_t k = 0; k < 1000; ++k) {
    const double position = 310.0 * static_cast<double>(k) + 40.0 * std::sin(0.3 * static_cast<double>(k));
    table.columns[2][k] = std::fmod(position + 65536.0, 65536.0) - 32768.0;
  }
  const auto record = record_of(table, {.counts_per_rev = 65536.0});
  EXPECT_TRUE(says(record, "wrap-around at 65536 counts undone (4 times)") ||
              says(record, "undone (5 times)"));
  for (std::size_t k = 1; k < 1000; ++k)
    ASSERT_LT(std::abs(record.output.samples[k] - record.output.samples[k - 1]), 400.0 * 2.0 * kPi / 65536.0)
        << k;
}

TEST(RecordReader, UndoesTheWrapAroundBesideAMissingSample) {
  auto table = table_of({"t", "u", "theta"}, 1000);
  for (std::size_t k = 0; k < 1000; ++k)
    table.columns[2][k] = std::fmod(0.05 * static_cast<double>(k), 2.0 * kPi);
  table.columns[2][126] = std::nan("");  // the first sample after a wrap
  const auto record = record_of(table);
  EXPECT_TRUE(says(record, "wrap-around at 6.28319 rad undone (7 times)"));
  for (std::size_t k = 0; k < 1000; ++k)
    ASSERT_NEAR(record.output.samples[k], 0.05 * static_cast<double>(k), 1e-6) << k;
}

/// A position that turns at a changing rate, in counts of `per_turn`.
Table counter_of(double modulus, double lowest = 0.0, const char* name = "y_counts") {
  auto table = table_of({"t", "u", name}, 2000);
  for (std::size_t k = 0; k < 2000; ++k) {
    const auto n = static_cast<double>(k);
    const double position = modulus * (0.011 * n + 0.1 * std::sin(0.05 * n));
    table.columns[2][k] = std::floor(position - modulus * std::floor(position / modulus)) + lowest;
  }
  return table;
}

TEST(RecordReader, FindsTheRangeOfACounterFromItsJumps) {
  for (const double modulus : {360.0, 1000.0, 3600.0, 4000.0, 4096.0, 8000.0, 10000.0, 16384.0})
    for (const double lowest : {0.0, -modulus / 2.0}) {
      const auto table = counter_of(modulus, lowest);
      const auto record = record_of(table);
      EXPECT_TRUE(says(record, "'y_counts': wrap-around at " + std::to_string(static_cast<int>(modulus))))
          << modulus << ' ' << (record.reading.empty() ? "" : record.reading.back());
      for (std::size_t k = 1; k < 2000; ++k)
        ASSERT_LT(std::abs(record.output.samples[k] - record.output.samples[k - 1]), 0.05 * modulus)
            << modulus << ' ' << k;
    }
  // No round number, but the one that the jumps agree in; a name without a unit; millimetres of a conveyor.
  EXPECT_TRUE(
      says(record_of(counter_of(1237.0)), "wrap-around at 1237 counts, found from the jumps, undone"));
  // Whole numbers without a unit are no rad, nor are 360 of anything.
  const auto counted = record_of(counter_of(4000.0, 0.0, "position"));
  EXPECT_TRUE(says(counted, "no unit in 'position': counts assumed, as it wraps around at 4000"));
  EXPECT_TRUE(says(counted, "'position': wrap-around at 4000 counts, found from the jumps, undone"));
  EXPECT_EQ(counted.output.unit, "counts");
  EXPECT_EQ(record_of(counter_of(4000.0, 0.0, "position"), {.counts_per_rev = 4000.0}).output.unit, "rad");
  const auto degrees = record_of(counter_of(360.0, 0.0, "position"));
  EXPECT_TRUE(says(degrees, "no unit in 'position': deg assumed, as it wraps around at 360"));
  EXPECT_NEAR(degrees.output.samples[1] - degrees.output.samples[0], 2.0 * kPi * 6.0 / 360.0, 0.03);
  EXPECT_TRUE(says(record_of(counter_of(2500.0, 0.0, "position_mm")), "wrap-around at 2500 mm, found from"));
}

TEST(RecordReader, LeavesJumpsThatDoNotAgree) {
  auto table = counter_of(4000.0);
  std::size_t jumps = 0;
  for (std::size_t k = 1; k < 2000; ++k) {
    if (std::abs(table.columns[2][k] - table.columns[2][k - 1]) < 2000.0) continue;
    if (++jumps == 4)
      for (std::size_t i = k; i < 2000; ++i) table.columns[2][i] += 150.0;
  }
  ASSERT_GT(jumps, 10U);
  EXPECT_FALSE(says(record_of(table), "undone"));
  // A reference that steps to and fro, and a position that does.
  auto steps = table_of({"t", "u", "position_rad"}, 2000);
  for (std::size_t k = 0; k < 2000; ++k) steps.columns[2][k] = (k / 100) % 2 == 0 ? 0.0 : 40.0;
  EXPECT_FALSE(says(record_of(steps), "undone"));
  // One jump of a size that is no usual one tells nothing.
  auto one = table_of({"t", "u", "y_counts"}, 2000);
  for (std::size_t k = 0; k < 2000; ++k) one.columns[2][k] = std::fmod(3.0 * static_cast<double>(k), 4000.0);
  EXPECT_FALSE(says(record_of(one), "undone"));
}

/// 16 samples a turn, and a reference that wraps where the position does.
TEST(RecordReader, UndoesTheWrapAroundOfAFastTurningPositionAndOfItsReference) {
  auto table = table_of({"t", "u", "y_counts", "r"}, 2000);
  for (std::size_t k = 0; k < 2000; ++k)
    for (const std::size_t c : {2, 3})
      table.columns[c][k] = std::fmod(250.0 * static_cast<double>(k), 4000.0);
  table.names[3] = "reference_counts";
  const auto record = record_of(table);
  EXPECT_TRUE(
      says(record, "'y_counts': wrap-around at 4000 counts, found from the jumps, undone (124 times)"));
  EXPECT_TRUE(says(record, "'reference_counts': wrap-around at 4000 counts undone (124 times)"));
}

TEST(RecordReader, LeavesOutAHalfEmptySignalThatNobodyNamed) {
  const auto with_empty = [](std::size_t first, std::size_t every) {
    auto table = table_of({"t", "u", "y", "ru", "r", "position"}, 1000);
    for (const std::size_t c : {3, 4, 5})
      for (std::size_t k = first; k < 1000; k += every) table.columns[c][k] = std::nan("");
    return table;
  };
  const auto half = with_empty(1, 2);
  const auto record = record_of(half);
  EXPECT_EQ(record.samples(), 1000U);
  EXPECT_EQ(record.sampling.gaps, 0U);
  EXPECT_FALSE(record.excitation.present() || record.reference.present() || record.position.present());
  EXPECT_TRUE(says(record, "'ru' left out: 500 of its 1000 cells are empty"));
  EXPECT_TRUE(says(record, "'r' left out: 500 of its 1000 cells are empty"));
  EXPECT_TRUE(says(record, "'position' left out: 500 of its 1000 cells are empty"));
  EXPECT_TRUE(says(record_of(with_empty(400, 1)), "'ru' left out: 600 of its 1000 cells are empty"));
  // What is named is required; few empty cells are filled; signals that stop early end the recording.
  RESONID_EXPECT_MESSAGE(to_record(half, {.excitation = "ru"}), "samples are missing");
  RESONID_EXPECT_MESSAGE(to_record(half, {.reference = "r"}), "samples are missing");
  EXPECT_TRUE(record_of(with_empty(100, 200)).excitation.present());
  EXPECT_EQ(record_of(with_empty(700, 1)).samples(), 700U);
  // Cut to where it is there, it stays.
  EXPECT_TRUE(record_of(with_empty(400, 1), {.to_s = 0.39}).excitation.present());
  auto required = table_of({"t", "u", "y"}, 1000);
  for (std::size_t k = 1; k < 1000; k += 2) required.columns[1][k] = std::nan("");
  RESONID_EXPECT_MESSAGE(to_record(required, {}), "samples are missing");
}

/// With a time of its own, it takes that with it.
TEST(RecordReader, LeavesOutAHalfEmptySignalWithItsTime) {
  auto table = table_of({"t", "u", "time2", "y", "time3", "r"}, 1000);
  for (std::size_t k = 0; k < 1000; k += 2) table.columns[4][k] = table.columns[5][k] = std::nan("");
  const auto record = record_of(table);
  EXPECT_EQ(record.samples(), 1000U);
  EXPECT_FALSE(record.reference.present());
  EXPECT_TRUE(says(record, "'r' left out: 500 of its 1000 cells are empty"));
}

TEST(RecordReader, TakesOnceWhatStandsTwice) {
  auto table = table_of({"t", "u", "y"}, 100);
  for (auto& column : table.columns) column.insert(column.begin() + 40, column[40]);
  const auto record = record_of(table);
  EXPECT_EQ(record.samples(), 100U);
  EXPECT_TRUE(says(record, "1 row that stands twice left out"));
}

TEST(RecordReader, ComparesTheTimesOfSignals) {
  auto table = table_of({"time", "torque", "time#2", "velocity"}, 100);
  table.columns[2] = table.columns[0];
  EXPECT_EQ(record_of(table).samples(), 100U);
  for (double& t : table.columns[2]) t += 0.0002;
  EXPECT_TRUE(says(record_of(table), "'velocity' was sampled up to 0.0002 s apart"));
  for (double& t : table.columns[2]) t *= 2.0;
  RESONID_EXPECT_MESSAGE(to_record(table, {}), "export all signals with one sample time");
}

TEST(RecordReader, CutsFromInclusiveToExclusive) {
  auto table = table_of({"t", "u", "y"}, 100);
  for (double& t : table.columns[0]) t += 5.0;
  ColumnMapping mapping;
  mapping.from_s = 5.01;
  mapping.to_s = 5.06;
  const auto record = record_of(table, mapping);
  EXPECT_EQ(record.samples(), 50U);
  EXPECT_EQ(record.input.samples.front(), 110.0);
  EXPECT_EQ(record.input.samples.back(), 159.0);
  EXPECT_NEAR(record.start_time_s, 5.01, 1e-12);

  ColumnMapping by_rate;
  by_rate.sample_rate_hz = 10.0;
  by_rate.from_s = 0.3;
  by_rate.to_s = 2.0;
  EXPECT_EQ(record_of(table_of({"u", "y"}), by_rate).samples(), 17U);

  mapping.from_s = 7.0;
  mapping.to_s.reset();
  RESONID_EXPECT_MESSAGE(
      to_record(table, mapping),
      "no sample lies in the part chosen with .from_s 7; the recording spans 5 ... 5.099 s");
  mapping.from_s = 5.09;
  RESONID_EXPECT_MESSAGE(to_record(table, mapping),
                         "has 10 samples in the part chosen with .from_s and .to_s; at least 16");
  RESONID_EXPECT_MESSAGE(to_record(table_of({"t", "u", "y"}, 15), {}),
                         "has 15 samples; at least 16 are required");
}

TEST(RecordReader, ReadsASecondOutput) {
  auto table = table_of({"t", "u", "y", "load_mrad"}, 100);
  ColumnMapping mapping;
  mapping.second_output = "load_mrad";
  mapping.second_output_kind = data::SecondOutput::load_encoder;
  auto record = record_of(table, mapping);
  EXPECT_EQ(record.second_output.unit, "rad");
  EXPECT_EQ(record.second_output_kind, data::SecondOutput::load_encoder);
  EXPECT_EQ(record.second_output.samples[7], 1e-3 * table.columns[3][7]);
  mapping.second_output_scale = 1e-3;
  mapping.from_s = table.columns[0][10];
  record = record_of(table, mapping);
  EXPECT_EQ(record.second_output.unit, "rad");
  EXPECT_EQ(record.second_output.samples.front(), 1e-3 * table.columns[3][10]);
  EXPECT_EQ(record.second_output.samples.size(), record.samples());
  mapping.second_output_kind = data::SecondOutput::load_accelerometer;
  mapping.second_output_unit = "g";
  EXPECT_EQ(record_of(table, mapping).second_output.unit, "m/s2");
  EXPECT_FALSE(record_of(table, {}).second_output.present());
}

TEST(RecordReader, RefusesASecondOutputThatIsNone) {
  const auto table = table_of({"t", "u", "y", "z"});
  ColumnMapping mapping;
  mapping.second_output = "z";
  RESONID_EXPECT_MESSAGE(to_record(table, mapping),
                         "second_output_kind: is required with .second_output: what that column measures, "
                         "load-encoder or load-accelerometer");
  mapping.second_output_kind = data::SecondOutput::load_encoder;
  mapping.second_output_scale = 0.0;
  RESONID_EXPECT_MESSAGE(to_record(table, mapping), "second_output_scale: found 0, must be a finite number");
  mapping.second_output_scale = 1.0;
  mapping.second_output = "w";
  RESONID_EXPECT_MESSAGE(to_record(table, mapping), "there is no column 'w' (.second_output)");
  mapping.second_output = "y";
  RESONID_EXPECT_MESSAGE(to_record(table, mapping),
                         "'y' is the only column that is called like an output, and .second_output too");
  mapping.output = "y";
  RESONID_EXPECT_MESSAGE(to_record(table, mapping), ".output and .second_output are the same column 'y'");
  mapping.second_output.reset();
  RESONID_EXPECT_MESSAGE(to_record(table, mapping),
                         "second_output: names the column that .second_output_kind is of");
}

TEST(RecordReader, RefusesOptionsOutOfRange) {
  const auto table = table_of({"t", "u", "y"});
  ColumnMapping mapping;
  mapping.input_scale = 0.0;
  RESONID_EXPECT_MESSAGE(to_record(table, mapping),
                         "input_scale: found 0, must be a finite number other than 0");
  mapping = {};
  mapping.output_scale = std::nan("");
  RESONID_EXPECT_MESSAGE(to_record(table, mapping), "output_scale: must be a finite number");
  mapping = {};
  mapping.sample_rate_hz = -1.0;
  RESONID_EXPECT_MESSAGE(to_record(table, mapping),
                         "sample_rate_hz: found -1, must be a number of Hz above 0");
  mapping = {};
  mapping.from_s = 2.0;
  mapping.to_s = 1.0;
  RESONID_EXPECT_MESSAGE(to_record(table, mapping), "from_s: found 2, must be before .to_s 1");
}

}  // namespace
}  // namespace resonid::io
