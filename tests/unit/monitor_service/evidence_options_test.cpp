// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <CLI/App.hpp>
#include <fstream>
#include <monitor/service/evidence_report.hpp>
#include <monitor/service/raw_csv.hpp>

#include "cli/record_options.hpp"
#include "drive.hpp"
#include "folder.hpp"

namespace resonid::monitor {
namespace {

/// What `identify` reads out of a command.
struct Read {
  cli::RecordOptions record;
  cli::MethodOptions method;

  explicit Read(const std::string& options) {
    CLI::App verb("", "identify");
    cli::add_record_options(verb, record);
    cli::add_excitation_options(verb, method);
    cli::add_loop_options(verb, method);
    cli::add_result_options(verb, method);
    cli::add_model_options(verb, method);
    verb.parse("evidence.csv " + options);
  }
};

void expect_same(const InstalledAxis& axis) {
  const Read read(identify_options(axis));
  const auto columns = evidence_columns(axis);
  const auto& told = read.record.columns;
  EXPECT_EQ(told.input_scale, columns.input_scale);
  EXPECT_EQ(told.output_scale, columns.output_scale);
  EXPECT_EQ(told.input_unit, columns.input_unit);
  EXPECT_EQ(told.output_unit, columns.output_unit);
  EXPECT_EQ(told.motion, columns.motion);
  EXPECT_EQ(told.output_quantity, columns.output_quantity);
  const auto& common = axis.spec.track.common;
  const auto& options = read.method.options;
  EXPECT_EQ(options.excitation_type, common.excitation_type);
  ASSERT_EQ(options.chirp.has_value(), common.chirp.has_value());
  if (common.chirp) {
    EXPECT_EQ(options.chirp->from_hz, common.chirp->from_hz);
    EXPECT_EQ(options.chirp->to_hz, common.chirp->to_hz);
    EXPECT_EQ(options.chirp->duration_s, common.chirp->duration_s);
  }
  EXPECT_EQ(options.lines_hz, common.lines_hz);
  EXPECT_EQ(options.period_samples, common.period_samples);
  EXPECT_EQ(options.band_hz, common.band_hz);
  EXPECT_EQ(options.friction, common.friction);
  EXPECT_EQ(options.delay_s, common.delay_s);
  EXPECT_EQ(read.method.controller, axis.controller);
}

TEST(EvidenceOptions, AreWhatTheReportIsMadeWith) {
  InstalledAxis axis;
  expect_same(axis);
  EXPECT_EQ(identify_options(axis), "--motion rotary --output-quantity velocity");
  axis.controller = R"({"kind": "pi", "gain": 2})";
  auto& spec = axis.spec;
  spec.input_scale = 0.1 + 0.2;
  spec.output_scale = -1.0 / 3.0;
  spec.input_unit = "A";
  spec.output_unit = "1/min";
  spec.motion = data::Motion::linear;
  spec.output_quantity = data::OutputQuantity::position;
  auto& common = spec.track.common;
  common.excitation_type = identification::ExcitationType::prbs;
  common.chirp = online::SweepLaw{1.5, 80.1, 12.25};
  common.lines_hz = {1.1, 2.2, 100.0 / 3.0};
  common.period_samples = 1023;
  common.band_hz = {0.7, 99.9};
  common.friction = identification::Friction::dry;
  common.delay_s = 1e-4 / 3.0;
  expect_same(axis);
}

TEST(EvidenceReport, TellsWhatMakesItAgainAndNoFolderOfTheServer) {
  const Folder folder;
  const auto file = folder.path() / "17.csv";
  const auto values = drive_samples(20.0, 1000.0, 1);
  {
    std::ofstream csv(file);
    csv << "t_s,ru,u,y\n";
    for (std::size_t k = 0; k < values.size() / 3; ++k)
      csv << static_cast<double>(k) / kRate << ',' << values[3 * k] << ',' << values[3 * k + 1] << ','
          << values[3 * k + 2] << '\n';
  }
  InstalledAxis axis;
  axis.spec.sample_rate_hz = kRate;
  axis.controller = "pi:0.5,0.2";
  const auto page = evidence_report(axis, file, "1.2.3");
  ASSERT_TRUE(page) << page.error().text;
  EXPECT_NE(page->find("resonid identify alarm-17.csv --time t_s " + identify_options(axis) +
                       " --report alarm-17.html"),
            std::string::npos);
  EXPECT_NE(page->find("1.2.3"), std::string::npos);
  EXPECT_EQ(page->find(folder.path().string()), std::string::npos);
  EXPECT_TRUE(std::filesystem::exists(folder.path() / "17.html"));
  axis.controller = (folder.path() / "loop.toml").string();
  const auto other = evidence_report(axis, file, "1.2.3");
  ASSERT_TRUE(other) << other.error().text;
  EXPECT_NE(other->find("--controller loop.toml"), std::string::npos);
  EXPECT_EQ(other->find(folder.path().string()), std::string::npos);
  std::ofstream(file) << "t_s,u,y\n";
  const auto none = evidence_report(axis, file, "1.2.3");
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().text.find(folder.path().string()), std::string::npos) << none.error().text;
  EXPECT_TRUE(none.error().lasts);
}

TEST(EvidenceReport, SaysInOptionsWhyTheSamplesShowNoResult) {
  const Folder folder;
  const auto file = folder.path() / "17.csv", page = folder.path() / "17.html";
  const auto values = drive_samples(20.0, 1000.0, 1);
  {
    std::ofstream csv(file);
    csv << "t_s,u,y\n";
    for (std::size_t k = 0; k < values.size() / 3; ++k)
      csv << static_cast<double>(k) / kRate << ',' << values[3 * k + 1] << ',' << 2.0 + values[3 * k + 1]
          << '\n';
  }
  InstalledAxis axis;
  axis.spec.sample_rate_hz = kRate;
  axis.spec.has_excitation = false;
  const auto none = evidence_report(axis, file, "1.2.3");
  ASSERT_FALSE(none);
  EXPECT_TRUE(none.error().lasts);
  EXPECT_NE(none.error().text.find("with --output"), std::string::npos) << none.error().text;
  EXPECT_EQ(none.error().text.find(" .output"), std::string::npos) << none.error().text;
  EXPECT_FALSE(std::filesystem::exists(page));
}

TEST(RawCsv, NamesTheCommandThatMakesTheReportOfTheFileAsItIsDownloaded) {
  const Folder folder;
  InstalledAxis axis;
  axis.spec.name = "x";
  axis.spec.sample_rate_hz = 100.0;
  axis.spec.has_excitation = false;
  const auto ring = Ring::open(folder.path() / "x.ring", {"x", {"u", "y"}, 100.0, 1024}).value();
  ring->put_anchor(0, std::nullopt);
  ring->put(std::vector<double>(20, 0.25));
  ring->commit({});
  const auto text = raw_csv(*ring, axis, {0, 10}, downloaded_name("17"));
  EXPECT_EQ(text.substr(0, text.find('\n')),
            "# axis x, samples 0 to 10; resonid identify alarm-17.csv --time t_s " + identify_options(axis) +
                " --report alarm-17.html");
}

}  // namespace
}  // namespace resonid::monitor
