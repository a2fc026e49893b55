// SPDX-License-Identifier: MIT
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <memory>
#include <monitor/service/installation.hpp>
#include <monitor/web/backend.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

namespace resonid::monitor {

/// A sender of some samples whenever the test wants it, and of none in between.
class Pulses {
 public:
  /// Samples without numbers, as of lines; `time_ns`: of the first one, where it is told.
  void send(std::size_t samples = 10, std::optional<std::int64_t> time_ns = {}) {
    constexpr std::array<std::string_view, 2> kColumns{"u", "y"};
    const std::vector<double> values(2 * samples, 0.25);
    Arrival arrival;
    arrival.time_ns = time_ns;
    arrival.columns = kColumns;
    arrival.values = values;
    for (auto* intake : axes_->all()) EXPECT_EQ(intake->add(arrival), Intake::Outcome::taken);
  }
  /// A message that no axis can use.
  void send_other_columns() {
    constexpr std::array<std::string_view, 2> kColumns{"torque", "speed"};
    const std::vector<double> values(20, 0.25);
    Arrival arrival;
    arrival.columns = kColumns;
    arrival.values = values;
    for (auto* intake : axes_->all()) EXPECT_EQ(intake->add(arrival), Intake::Outcome::refused);
  }
  /// Axes that are stale after 50 ms, and well at once when samples come.
  [[nodiscard]] Installation installation(const std::filesystem::path& data,
                                          const std::vector<std::string>& names) {
    Installation all;
    all.data = data;
    all.version = "test";
    all.engine.workers = 1;
    all.engine.stale_s = all.engine.first_sample_s = 0.05;
    for (const auto& name : names) {
      InstalledAxis axis;
      axis.spec.name = name;
      axis.spec.sample_rate_hz = 1000.0;
      axis.spec.has_excitation = false;
      axis.spec.alarms.stale.off_delay_s = 0.0;
      axis.columns = {"", "u", "y", ""};
      axis.source = "pulses";
      axis.channel = name;
      axis.configuration = "test";
      all.axes.push_back(std::move(axis));
    }
    all.sources.push_back(
        {"pulses", "pulses", [this](Axes& axes) -> expected<std::unique_ptr<Source>, Error> {
           axes_ = &axes;
           return std::make_unique<Silent>();
         }});
    return all;
  }

 private:
  class Silent : public Source {
   public:
    void start() override {}
    void stop() override {}
    [[nodiscard]] SourceStatus status() const override {
      SourceStatus s;
      s.state = SourceState::running;
      return s;
    }
    [[nodiscard]] std::string_view promise() const noexcept override { return "none"; }
  };
  Axes* axes_ = nullptr;
};

/// The alarms that are active, newest first, once the condition is true of them.
template <class Condition>
std::vector<web::Alarm> alarms_once(const web::Backend& backend, web::AlarmFilter state, Condition&& holds) {
  std::vector<web::Alarm> alarms;
  for (int i = 0; i < 1000; ++i) {
    alarms = backend.alarms({state, "", 100}).value();
    if (holds(alarms)) break;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return alarms;
}

}  // namespace resonid::monitor
