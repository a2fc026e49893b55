// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "monitor/engine/engine.hpp"
#include "monitor/samples/intake.hpp"
#include "monitor/samples/ring.hpp"
#include "monitor/service/alarm_view.hpp"
#include "monitor/service/axis_view.hpp"
#include "monitor/service/installation.hpp"
#include "monitor/service/measured_coherence.hpp"
#include "monitor/service/recorder.hpp"
#include "monitor/sources/source.hpp"
#include "monitor/store/reader.hpp"
#include "monitor/web/backend.hpp"

namespace resonid::monitor {

/// What the web server asks, answered from the engine's newest state, the counters and the store.
class LiveBackend : public web::Backend {
 public:
  struct Axis {
    const InstalledAxis* installed = nullptr;
    Ring* ring = nullptr;
    const Intake* intake = nullptr;
    std::string configuration_hash;
  };
  struct RunningSource {
    const InstalledSource* installed = nullptr;
    Source* source = nullptr;
  };
  LiveBackend(const Installation& installation, Engine& engine, const Recorder& recorder, Reader reader,
              std::vector<Axis> axes, std::vector<RunningSource> sources);

  [[nodiscard]] web::AxisNews axes(std::uint64_t after) const override;
  [[nodiscard]] web::Answer<web::AxisDetail> axis(const std::string& name) const override;
  [[nodiscard]] web::Answer<web::AxisResponse> response(const std::string& axis) const override;
  [[nodiscard]] web::Answer<web::History> history(const std::string& axis,
                                                  const web::HistoryQuestion& question) const override;
  [[nodiscard]] web::Answer<std::string> raw(const std::string& axis, double from_s,
                                             double to_s) const override;
  [[nodiscard]] web::Answer<web::Comparison> compare(const std::string& axis, double a_time_s,
                                                     double b_time_s) const override;
  [[nodiscard]] web::Answer<std::vector<web::Alarm>> alarms(
      const web::AlarmQuestion& question) const override;
  [[nodiscard]] web::Answer<web::AlarmCounts> active_alarms() const override;
  [[nodiscard]] web::Answer<web::Alarm> alarm(std::uint64_t alarm) const override;
  [[nodiscard]] web::Answer<std::vector<web::AlarmEvent>> events(std::uint64_t alarm) const override;
  [[nodiscard]] web::Answer<std::string> evidence(std::uint64_t alarm) const override;
  [[nodiscard]] web::Answer<std::string> report(std::uint64_t alarm) const override;
  using web::Backend::audit;
  [[nodiscard]] web::Answer<std::vector<web::AuditEntry>> audit(
      const web::AuditQuestion& question) const override;
  [[nodiscard]] web::ServiceStatus status() const override;
  [[nodiscard]] web::Readiness readiness() const override;
  [[nodiscard]] web::Answer<void> act(const web::Action& action) override;

 private:
  [[nodiscard]] web::Answer<std::size_t> index_of(const std::string& axis) const;
  [[nodiscard]] web::Answer<void> knows(const std::string& axis,
                                        const std::vector<AlarmRecord>& unwritten) const;
  [[nodiscard]] double longest_shelving_s(std::size_t index) const;
  [[nodiscard]] AxisView view_of(std::size_t index, const LiveAxis& live) const;
  [[nodiscard]] web::AxisStatus status_of(std::size_t index, const LiveAxis& live) const;
  [[nodiscard]] web::Alarm told(const AlarmRecord& record) const;
  [[nodiscard]] web::Answer<AlarmRecord> record_of(std::uint64_t alarm) const;

  const Installation& installation_;
  Engine& engine_;
  const Recorder& recorder_;
  mutable std::mutex reader_mutex_, report_mutex_;
  mutable Reader reader_;
  std::vector<Axis> axes_;
  mutable std::vector<MeasuredCoherence> coherence_;  // [axis]
  std::vector<RunningSource> sources_;
  std::vector<monitoring::AxisAlarmRules> rules_;
  std::vector<AxisView::Due> due_;  // [axis] before its source began to write
  std::int64_t started_ns_;
};

/// For how long this alarm can be shelved.
[[nodiscard]] double longest_shelving_s(const monitoring::AxisAlarmRules& rules, monitoring::AlarmId alarm);
/// Why an alarm in this state cannot be treated so.
[[nodiscard]] std::optional<web::Problem> refusal_of(monitoring::ActionKind kind,
                                                     const monitoring::AlarmState& alarm,
                                                     std::optional<double> seconds, double longest_s);

}  // namespace resonid::monitor
