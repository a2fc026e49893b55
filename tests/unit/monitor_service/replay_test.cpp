// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <identification/track/follower.hpp>
#include <monitor/service/replay.hpp>
#include <monitor/service/service.hpp>
#include <resonid/base/error_text.hpp>
#include <thread>

#include "drive.hpp"
#include "folder.hpp"

namespace resonid::monitor {
namespace {

using monitoring::Watched;
using namespace std::chrono_literals;

data::Record recorded(double seconds, double loosens_at_s) {
  data::Record r;
  r.source = "belt drive.csv";
  r.sample_rate_hz = kRate;
  r.start_time_s = 12.5;
  r.input.unit = r.excitation.unit = "Nm";
  r.output.unit = "rad/s";
  const auto values = drive_samples(seconds, loosens_at_s, 3);
  for (std::size_t k = 0; k < values.size(); k += 3) {
    r.excitation.samples.push_back(values[k]);
    r.input.samples.push_back(values[k + 1]);
    r.output.samples.push_back(values[k + 2]);
  }
  return r;
}

identification::TrackOptions known_loop() {
  identification::TrackOptions options;
  options.common.controller = pi(0.5, 0.2).sampled(1.0 / kRate);
  return options;
}

/// What the engine of the monitor gives for each row.
struct Replayed {
  std::vector<monitoring::Row> rows;
  std::vector<double> time_s, crossover_hz;
  std::vector<web::Alarm> alarms;
};
Replayed replayed(Replay replay, double speed) {
  const Folder folder;
  Replayed all;
  auto installation = replay_installation(std::move(replay), folder.path(), speed, "test");
  installation.engine.on_row = [&](std::size_t, const monitoring::AxisMonitor& axis) {
    all.rows.push_back(axis.row());
    all.time_s.push_back(axis.follower()->place().time_s);
    all.crossover_hz.push_back(axis.follower()->axis().row().crossover_hz.value);
  };
  auto service = Service::start(std::move(installation));
  EXPECT_TRUE(service) << message_of(service.error());
  while (!(*service)->finished()) std::this_thread::sleep_for(5ms);
  (*service)->stop();
  all.alarms = (*service)->backend().alarms({web::AlarmFilter::all, "", 100}).value();
  return all;
}

/// Not the same number: the same bits.
bool same(double a, double b) {
  return std::memcmp(&a, &b, sizeof a) == 0 || (std::isnan(a) && std::isnan(b));
}

TEST(Replay, GivesTheRowsOfTrackBitForBit) {
  const auto record = recorded(60.0, 30.0);
  constexpr std::size_t kEvery = 7;
  auto options = known_loop();
  const auto all = replayed(replay_of(record, options, "pi:0.5,0.2", kEvery), 0.0);
  options.long_term = true;
  options.every = kEvery;
  const auto track = identification::track(record, options).value();
  ASSERT_GT(track.time_s.size(), 2000U);
  ASSERT_EQ(all.rows.size(), track.time_s.size());
  const std::pair<Watched, const char*> columns[] = {
      {Watched::resonance, "resonance_hz"},       {Watched::antiresonance, "antiresonance_hz"},
      {Watched::stiffness, "stiffness"},          {Watched::driven_inertia, "driven_inertia"},
      {Watched::load_inertia, "load_inertia"},    {Watched::damping, "damping"},
      {Watched::load_torque, "torque_offset"},    {Watched::modulus_margin, "modulus_margin"},
      {Watched::phase_margin, "phase_margin_deg"}};
  for (std::size_t i = 0; i < all.rows.size(); ++i) {
    ASSERT_TRUE(same(record.start_time_s + all.time_s[i], track.time_s[i])) << i;
    ASSERT_TRUE(same(all.crossover_hz[i], track.find("crossover_hz")->value[i])) << i;
    ASSERT_EQ(all.rows[i].trusted, track.trusted_rows[i]) << i;
    for (const auto& [figure, name] : columns) {
      const auto* series = track.find(name);
      ASSERT_NE(series, nullptr) << name;
      ASSERT_TRUE(same(all.rows[i][figure].value, series->value[i])) << name << ' ' << i;
      ASSERT_TRUE(same(all.rows[i][figure].std, series->std[i])) << name << ' ' << i;
    }
  }
}

TEST(Replay, KeepsStepWithTheClockAndGivesTheSame) {
  const auto record = recorded(8.0, 100.0);
  const auto begin = std::chrono::steady_clock::now();
  const auto paced = replayed(replay_of(record, known_loop(), "", 25), 10.0);
  EXPECT_GE(std::chrono::steady_clock::now() - begin, 780ms);
  const auto fast = replayed(replay_of(record, known_loop(), "", 25), 0.0);
  ASSERT_GT(paced.rows.size(), 50U);
  ASSERT_EQ(paced.rows.size(), fast.rows.size());
  for (std::size_t i = 0; i < fast.rows.size(); ++i)
    ASSERT_TRUE(same(paced.rows[i][Watched::stiffness].value, fast.rows[i][Watched::stiffness].value)) << i;
}

TEST(Replay, TellsAlarmsInTheTimeOfTheRecording) {
  const auto all = replayed(replay_of(recorded(110.0, 75.0), known_loop(), "", 0), 0.0);
  ASSERT_FALSE(all.alarms.empty());
  const auto change = std::find_if(all.alarms.begin(), all.alarms.end(), [](const auto& a) {
    return a.text.find("Stiffness fell by ") != std::string::npos;
  });
  ASSERT_NE(change, all.alarms.end()) << (all.alarms.empty() ? "no alarms" : all.alarms.front().text);
  const auto since = change->text.find(" since ");
  ASSERT_NE(since, std::string::npos) << change->text;
  EXPECT_NEAR(std::atof(change->text.c_str() + since + 7), 12.5 + 75.0, 5.0) << change->text;
}

TEST(Replay, TakesAnAxisOfAConfiguration) {
  const Folder folder;
  // The same drive in the units of its controller, the sign of the motor turned round.
  const auto record = recorded(20.0, 100.0);
  {
    std::ofstream file(folder.path() / "monday.csv");
    file.precision(17);
    file << "time_s,iq_A,n_rpm,add_A,place_mm\n";
    for (std::size_t k = 0; k < record.samples(); ++k)
      file << static_cast<double>(k) / kRate << ',' << record.input.samples[k] / 0.5 << ','
           << -record.output.samples[k] * 60.0 / 6.283185307179586 << ','
           << record.excitation.samples[k] / 0.5 << ',' << 500.0 + 0.01 * static_cast<double>(k) << '\n';
  }
  const auto file = parse_configuration(R"(
[monitor]
data = "data"
row_every_s = 0.1
[source.line]
kind = "stdin"
[axis.gantry-x]
source = "line"
sample_rate_hz = 250.0
input = "iq_A"
output = "n_rpm"
excitation = "add_A"
position = "place_mm"
motion = "rotary"
torque_constant = 0.5
output_scale = -1.0
position_scale = -1.0
controller = "pi:0.5,0.2"
)",
                                        "m.toml", folder.path());
  ASSERT_TRUE(file.usable()) << message_of(file.findings.errors.front());
  auto replay = replay_of(file.configuration, "gantry-x", folder.path() / "monday.csv");
  ASSERT_TRUE(replay) << message_of(replay.error());
  EXPECT_EQ(replay->spec.name, "gantry-x");
  EXPECT_EQ(replay->record->samples(), record.samples());
  for (std::size_t k = 0; k < record.samples(); k += 100) {
    EXPECT_NEAR(replay->record->input.samples[k], record.input.samples[k], 1e-12);
    EXPECT_NEAR(replay->record->output.samples[k] * replay->spec.output_scale, record.output.samples[k],
                1e-9);
    EXPECT_NEAR(replay->record->excitation.samples[k], record.excitation.samples[k], 1e-12);
    EXPECT_NEAR(replay->record->position.samples[k] * replay->spec.position_scale,
                -0.5 - 1e-5 * static_cast<double>(k), 1e-9);
  }
  const auto all = replayed(std::move(*replay), 0.0);
  auto same_drive = record;
  for (std::size_t k = 0; k < record.samples(); ++k)
    same_drive.position.samples.push_back(-0.5 - 1e-5 * static_cast<double>(k));
  const auto direct = replayed(replay_of(std::move(same_drive), known_loop(), "", 25), 0.0);
  ASSERT_GT(all.rows.size(), 100U);
  ASSERT_EQ(all.rows.size(), direct.rows.size());
  const double stiffness = direct.rows.back()[Watched::stiffness].value;
  EXPECT_NEAR(all.rows.back()[Watched::stiffness].value, stiffness, 1e-6 * stiffness);

  const auto unknown = replay_of(file.configuration, "gantry-y", folder.path() / "monday.csv");
  ASSERT_FALSE(unknown);
  EXPECT_EQ(unknown.error().field, "axis");
  EXPECT_NE(message_of(unknown.error()).find("gantry-x"), std::string::npos);
  EXPECT_FALSE(replay_of(file.configuration, "gantry-x", folder.path() / "none.csv"));
}

TEST(Replay, KnowsUnitsOfAnotherMotion) {
  auto record = recorded(1.0, 100.0);
  EXPECT_FALSE(motion_fault(record));
  record.motion = data::Motion::linear;
  const auto fault = motion_fault(record);
  ASSERT_TRUE(fault);
  EXPECT_EQ(fault->field, "motion");
  EXPECT_NE(message_of(*fault).find("is in Nm and the output '' is in rad/s; required rotary"),
            std::string::npos)
      << message_of(*fault);
}

TEST(Replay, RefusesWhatHasNoSamples) {
  class NoAxes : public Axes {
    Intake* find(std::string_view) override { return nullptr; }
    std::span<Intake* const> all() override { return {}; }
  } axes;
  Replay replay{std::make_shared<const data::Record>(), {}, ""};
  const Folder folder;
  const auto installation = replay_installation(replay, folder.path(), 0.0, "test");
  EXPECT_EQ(installation.sources.front().make(axes).error().field, "record");
}

}  // namespace
}  // namespace resonid::monitor
