// SPDX-License-Identifier: MIT
#include <random>
#include <recordings.hpp>
#include <resonid/base/error_text.hpp>
#include <resonid/io/csv.hpp>
#include <resonid/io/record_reader.hpp>

#include "temporary_folder.hpp"

namespace resonid::io {
namespace {

using test::TemporaryFolder;

TEST(RecordFile, ReadsBackWhatItWrote) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  const auto channel = [&](const char* name, const char* unit) {
    data::Channel result{name, unit, std::vector<double>(200)};
    for (double& sample : result.samples) sample = normal(random);
    return result;
  };
  data::Record record;
  record.sample_rate_hz = 500.0;
  record.start_time_s = 1.5;
  record.input = channel("u", "V");
  record.output = channel("y", "rad/s");
  record.reference = channel("r", "ticks/s");
  record.excitation = channel("ru", "V");
  record.position = channel("position", "m");
  const std::string text = record_csv(record);
  EXPECT_EQ(text.substr(0, text.find('\n')), "time_s,ru_V,u_V,y,r [ticks/s],position_m");
  EXPECT_NE(text.find("\n1.502,"), std::string::npos);

  const TemporaryFolder folder;
  const auto back = read_record(folder.file("record.csv", text), {});
  ASSERT_TRUE(back) << message_of(back.error());
  EXPECT_EQ(back->sample_rate_hz, 500.0);
  EXPECT_EQ(back->start_time_s, 1.5);
  EXPECT_EQ(back->input.samples, record.input.samples);
  EXPECT_EQ(back->input.unit, "V");
  EXPECT_EQ(back->output.samples, record.output.samples);
  EXPECT_EQ(back->output.unit, "rad/s");
  EXPECT_EQ(back->excitation.samples, record.excitation.samples);
  EXPECT_EQ(back->position.samples, record.position.samples);
  EXPECT_EQ(back->position.unit, "m");
  EXPECT_EQ(back->reference.unit, "ticks/s");
}

TEST(ResponseFile, WritesWhatIsKnown) {
  data::FrequencyResponse response;
  response.frequency_hz = {2.0, 2.1};
  response.value = {{0.1, -0.25}, {1e-7, 3.0}};
  EXPECT_EQ(response_csv(response), "frequency_hz,real,imag\n2,0.1,-0.25\n2.1,1e-07,3\n");
  response.std = {0.01, 0.02};
  response.coherence = {0.99, 1.0};
  EXPECT_EQ(response_csv(response),
            "frequency_hz,real,imag,std,coherence\n2,0.1,-0.25,0.01,0.99\n2.1,1e-07,3,0.02,1\n");
  response.coherence.clear();
  const std::vector<double> noise{0.5, 0.25};
  const std::vector<ResponseColumn> further{{"noise_std", noise}};
  EXPECT_EQ(response_csv(response, further),
            "frequency_hz,real,imag,std,noise_std\n2,0.1,-0.25,0.01,0.5\n2.1,1e-07,3,0.02,0.25\n");
}

TEST(Recordings, TwoMassBenchMultisine) {
  RESONID_RECORDING_OR_SKIP(path, "utokyo_two_mass_bench/multisine.csv");
  ColumnMapping mapping;
  mapping.input = "iq_meas_A";
  mapping.input_scale = 0.564;
  mapping.output = "theta_motor_rad";
  mapping.output_quantity = data::OutputQuantity::position;
  const auto record = read_record(path, mapping);
  ASSERT_TRUE(record) << message_of(record.error());
  EXPECT_EQ(record->sample_rate_hz, 2500.0);
  EXPECT_EQ(record->samples(), 15'000U);
  EXPECT_EQ(record->input.unit, "Nm");
  EXPECT_EQ(record->output.unit, "rad");
  EXPECT_EQ(record->sampling.gaps, 0U);
  EXPECT_LT(record->sampling.jitter_max_s, 1e-9);
  EXPECT_DOUBLE_EQ(record->input.samples[0], 10.988 * 0.564);  // first line of the file
  EXPECT_EQ(record->output.samples[1], -7.456135);             // second line
  EXPECT_FALSE(record->excitation.present());
  RESONID_EXPECT_MESSAGE(read_record(path, {}), "2 columns may be the output");
}

TEST(Recordings, FlexibleArmPrbs) {
  RESONID_RECORDING_OR_SKIP(path, "ist_flexible_arm/prbs.csv");
  ColumnMapping mapping;
  mapping.output = "theta_motor_V";
  mapping.output_quantity = data::OutputQuantity::position;
  const auto record = read_record(path, mapping);
  ASSERT_TRUE(record) << message_of(record.error());
  EXPECT_EQ(record->sample_rate_hz, 50.0);
  EXPECT_EQ(record->samples(), 3001U);
  EXPECT_EQ(record->input.name, "u_V");
  EXPECT_EQ(record->input.unit, "V");
  EXPECT_EQ(record->output.unit, "V");
}

}  // namespace
}  // namespace resonid::io
