// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "monitor/web/backend.hpp"

namespace resonid::monitor::web {

/// A figure's name in the API: resonance_hz, stiffness, phase_margin_deg ...
[[nodiscard]] std::string_view key_of(monitoring::Watched) noexcept;
[[nodiscard]] std::optional<monitoring::Watched> figure_of(std::string_view key) noexcept;

/// Texts of the API (openapi.json). Bytes that are no UTF-8 are replaced, numbers that are none left out, or
/// null within columns.
[[nodiscard]] std::string axes_json(double time_s, const std::vector<AxisStatus>&);  ///< Worst first.
[[nodiscard]] std::string axis_json(const AxisDetail&);
[[nodiscard]] std::string response_json(const AxisResponse&);
[[nodiscard]] std::string history_json(const History&);
[[nodiscard]] std::string comparison_json(const Comparison&);
[[nodiscard]] std::string alarms_json(const std::vector<Alarm>&);
[[nodiscard]] std::string events_json(const std::vector<AlarmEvent>&);
[[nodiscard]] std::string audit_json(const std::vector<AuditEntry>&);
[[nodiscard]] std::string status_json(const ServiceStatus&);
[[nodiscard]] std::string readiness_json(const Readiness&);
[[nodiscard]] std::string error_json(std::string_view field, std::string_view message);

/// Data of the stream's events.
[[nodiscard]] std::string status_short_json(const AxisStatus&);  ///< One axis of a frame.
[[nodiscard]] std::string status_full_json(const AxisStatus&);
[[nodiscard]] std::string response_json(std::string_view axis, const AxisResponse&);
[[nodiscard]] std::string alarm_json(const Alarm&);

/// What is told to webhooks and brokers.
[[nodiscard]] std::string notice_json(const Alarm&, const AlarmEvent&);

/// Whether `a` stands above `b` in a list that begins with the worst.
[[nodiscard]] bool worse(const AxisStatus& a, const AxisStatus& b);

}  // namespace resonid::monitor::web
