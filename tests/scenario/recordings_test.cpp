// SPDX-License-Identifier: MIT
// Real machines: what identify() says of the recordings, against what is known of them (their README).
#include <cstdio>
#include <experiments.hpp>
#include <nlohmann/json.hpp>
#include <recordings.hpp>
#include <resonid/io/record_reader.hpp>
#include <resonid/report/json.hpp>

namespace resonid {
namespace {

using identification::Method;

/// Two equal servo motors on an elastic shaft; multisine with a period of 1 s, all lines 11 ... 250 Hz.
data::Record bench(const std::filesystem::path& path) {
  io::ColumnMapping columns;
  columns.input = "iq_meas_A";
  columns.input_scale = 0.564;
  columns.output = "theta_motor_rad";
  columns.output_quantity = data::OutputQuantity::position;
  return io::read_record(path, columns).value();
}

identification::Options bench_options() {
  identification::Options o;
  o.excitation_type = identification::ExcitationType::multisine;
  o.period_samples = 2500;
  o.drop_periods = 1;
  return o;
}

std::vector<double> every_tenth_line() {
  std::vector<double> lines;
  for (int f = 11; f <= 241; f += 10) lines.push_back(f);
  return lines;
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2),
                   values.end());
  return values[values.size() / 2];
}

TEST(TwoMassBench, DefaultFindsWhatIsKnown) {
  RESONID_RECORDING_OR_SKIP(path, "utokyo_two_mass_bench/multisine.csv");
  const auto result = test::identified(bench(path), bench_options());
  EXPECT_TRUE(result.trusted);
  EXPECT_EQ(result.method, "periodic");
  EXPECT_EQ(result.record.samples, 12500U);
  EXPECT_GT(median(result.response.coherence), 0.999);
  ASSERT_EQ(result.modes.size(), 2U);
  EXPECT_NEAR(result.modes[0].frequency_hz.value, 53.9, 0.5);
  EXPECT_NEAR(result.modes[1].frequency_hz.value, 76.2, 0.5);
  const auto& drive = result.model->drive;
  ASSERT_EQ(drive.structure, fit::Structure::two_mass);
  EXPECT_NEAR(drive.parameters.driven_inertia, 2.69e-3, 0.03 * 2.69e-3);
  EXPECT_NEAR(drive.parameters.load_inertia, 2.69e-3, 0.03 * 2.69e-3);
  EXPECT_NEAR(drive.parameters.stiffness, 310.0, 8.0);
  EXPECT_EQ(result.units.inertia, "kgm2");
  EXPECT_EQ(result.units.stiffness, "Nm/rad");
}

/// The second and third period say what the fourth and fifth say, each parameter within the error bars of the
/// difference.
TEST(TwoMassBench, DisjointHalvesAgree) {
  RESONID_RECORDING_OR_SKIP(path, "utokyo_two_mass_bench/multisine.csv");
  const auto record = bench(path);
  identification::Options options;
  options.period_samples = 2500;
  std::vector<fit::DriveModel> halves;
  for (const std::size_t first : {2500U, 7500U}) {
    const auto result = test::identified(data::part_of(record, first, 5000), options);
    ASSERT_EQ(result.model->drive.structure, fit::Structure::two_mass);
    halves.push_back(result.model->drive);
    const auto& p = halves.back().parameters;
    EXPECT_NEAR(p.load_inertia / p.driven_inertia, 1.0, 0.02);
  }
  for (int i = 0; i < fit::kParameterCount; ++i) {
    const auto parameter = static_cast<fit::Parameter>(i);
    const auto a = halves[0].estimate(parameter), b = halves[1].estimate(parameter);
    EXPECT_EQ(halves[0].estimated[static_cast<std::size_t>(i)],
              halves[1].estimated[static_cast<std::size_t>(i)]);
    EXPECT_LE(std::abs(a.value - b.value), 1.96 * std::hypot(a.std, b.std))
        << fit::kParameterNames[static_cast<std::size_t>(i)];
  }
}

TEST(TwoMassBench, ThirdMassIsTriedAndNotChosen) {
  RESONID_RECORDING_OR_SKIP(path, "utokyo_two_mass_bench/multisine.csv");
  const auto result = test::identified(bench(path), bench_options());
  bool tried = false;
  for (const auto& trial : result.structures) {
    if (trial.name.rfind("three-mass", 0) != 0) continue;
    tried = true;
    EXPECT_FALSE(trial.chosen);
    EXPECT_NE(trial.remark, "");
  }
  EXPECT_TRUE(tried);
  const auto& p = result.model->drive.parameters;
  EXPECT_NEAR(p.load_inertia / p.driven_inertia, 1.0, 0.02);
}

/// Whatever measures the response.
TEST(TwoMassBench, NoMethodMakesItAThreeMassSystem) {
  RESONID_RECORDING_OR_SKIP(path, "utokyo_two_mass_bench/multisine.csv");
  using identification::Method;
  for (const auto method :
       {Method::periodic, Method::welch, Method::local_polynomial, Method::local_rational}) {
    auto options = bench_options();
    options.method = method;
    const auto result = test::identified(bench(path), options);
    ASSERT_TRUE(result.model.has_value()) << result.method;
    EXPECT_EQ(result.model->drive.structure, fit::Structure::two_mass) << result.method;
    EXPECT_NEAR(result.modes.at(1).frequency_hz.value, 76.2, 0.5) << result.method;
  }
}

/// Nothing is told but the columns: the period is found, and the first one, in which the bench still turns
/// up, is left out.
TEST(TwoMassBench, FirstPeriodIsLeftOut) {
  RESONID_RECORDING_OR_SKIP(path, "utokyo_two_mass_bench/multisine.csv");
  const auto result = test::identified(bench(path), {});
  const auto told = test::identified(bench(path), bench_options());
  EXPECT_EQ(result.response.lines(), told.response.lines());
  EXPECT_NEAR(result.modes.at(1).frequency_hz.value, told.modes.at(1).frequency_hz.value, 0.02);
  EXPECT_TRUE(result.trusted);
}

/// Without a word on the excitation the period is found.
TEST(TwoMassBench, PeriodIsFound) {
  RESONID_RECORDING_OR_SKIP(path, "utokyo_two_mass_bench/multisine.csv");
  identification::Options options;
  options.drop_periods = 1;
  const auto result = test::identified(bench(path), options);
  EXPECT_EQ(result.record.samples, 12500U);
  EXPECT_EQ(result.method, "periodic");
  EXPECT_NEAR(result.modes.at(1).frequency_hz.value, 76.2, 0.5);
}

/// Share of the common lines at which two responses differ by more than both 95 % circles together.
double apart(const data::FrequencyResponse& a, const data::FrequencyResponse& b) {
  std::size_t common = 0, apart = 0;
  for (std::size_t i = 0; i < a.lines(); ++i)
    for (std::size_t j = 0; j < b.lines(); ++j) {
      if (std::abs(a.frequency_hz[i] - b.frequency_hz[j]) > 1e-6) continue;
      ++common;
      const double radius = data::confidence_radius(std::hypot(a.std[i], b.std[j]), 0.95);
      if (std::abs(a.value[i] - b.value[j]) > radius) ++apart;
    }
  EXPECT_GE(common, 20U);
  return static_cast<double>(apart) / static_cast<double>(std::max<std::size_t>(common, 1));
}

TEST(TwoMassBench, MethodsAgreeWithinTheirErrorBars) {
  RESONID_RECORDING_OR_SKIP(path, "utokyo_two_mass_bench/multisine.csv");
  const auto record = bench(path);
  auto options = bench_options();
  std::vector<data::FrequencyResponse> responses;
  for (const Method method : {Method::periodic, Method::sliding_dft, Method::welch, Method::kalman}) {
    options.method = method;
    if (method == Method::kalman) options.lines_hz = every_tenth_line();
    const auto result = test::identified(record, options);
    EXPECT_TRUE(result.trusted);
    EXPECT_EQ(result.response.lines(), method == Method::kalman ? 24U : 240U);
    responses.push_back(result.response);
  }
  for (std::size_t i = 0; i < responses.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) EXPECT_LE(apart(responses[i], responses[j]), 0.05) << i << " " << j;
}

/// A fixed gain on 24 lines, two of them 1 Hz apart: these two forget too slowly for 5 s.
TEST(TwoMassBench, LinesThatHaveNotSettledAreSaid) {
  RESONID_RECORDING_OR_SKIP(path, "utokyo_two_mass_bench/multisine.csv");
  auto options = bench_options();
  options.method = Method::kalman;
  options.tracker.lambda = 200.0;
  options.lines_hz = every_tenth_line();
  options.lines_hz.back() = 30.0;
  const auto result = test::identified(bench(path), options);
  EXPECT_EQ(result.response.lines(), 22U);
  EXPECT_EQ(result.response.unsettled_hz, (std::vector<double>{30.0, 31.0}));
  const auto* unsettled = test::finding(result, "unsettled-lines");
  ASSERT_NE(unsettled, nullptr);
  EXPECT_EQ(unsettled->value, 2.0);
  EXPECT_NE(unsettled->meaning.find("2 of 24 lines"), std::string::npos) << unsettled->meaning;
  EXPECT_EQ(report::to_json(result).at("frequency_response").at("unsettled_hz").size(), 2U);
}

/// A flexible robot arm, driven by a voltage and measured by a potentiometer.
TEST(FlexibleArm, AntiresonanceUnitsAndLostCoherence) {
  RESONID_RECORDING_OR_SKIP(path, "ist_flexible_arm/prbs.csv");
  io::ColumnMapping columns;
  columns.input = "u_V";
  columns.output = "theta_motor_V";
  columns.output_quantity = data::OutputQuantity::position;
  identification::Options options;
  options.excitation_type = identification::ExcitationType::prbs;
  const auto result = test::identified(io::read_record(path, columns).value(), options);
  ASSERT_FALSE(result.modes.empty());
  EXPECT_TRUE(result.modes[0].anti);
  EXPECT_NEAR(result.modes[0].frequency_hz.value, 3.43, 0.1);

  const std::string json = report::to_json(result).dump() + report::summary_text(result);
  for (const char* claim : {"kgm2", "Nm", "rad"}) EXPECT_EQ(json.find(claim), std::string::npos) << claim;
  EXPECT_FALSE(result.units.physical);
  EXPECT_EQ(result.units.response, "(V/s)/V");
  const auto* units = test::finding(result, "not-physical-units");
  ASSERT_NE(units, nullptr);
  EXPECT_NE(units->meaning.find("back-EMF"), std::string::npos);

  bool near_eight = false;
  for (const auto& f : result.findings) {
    if (f.id != "low-coherence") continue;
    double low = 0.0, high = 0.0;
    const auto from = f.meaning.find("from ");
    ASSERT_NE(from, std::string::npos) << f.meaning;
    ASSERT_EQ(std::sscanf(f.meaning.c_str() + from, "from %lf to %lf Hz", &low, &high), 2) << f.meaning;
    near_eight = near_eight || (low < 8.2 && 8.2 < high && high < 12.0);
  }
  EXPECT_TRUE(near_eight) << json;
}

}  // namespace
}  // namespace resonid
