// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <iterator>
#include <limits>
#include <optional>
#include <resonid/base/enum_names.hpp>
#include <resonid/base/expected.hpp>
#include <resonid/data/record.hpp>
#include <resonid/identification/result.hpp>
#include <resonid/online/axis_result.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "monitoring/alarm_settings.hpp"
#include "monitoring/row.hpp"

namespace resonid::monitor::web {

/// What is asked of the service, as plain values: JSON and other texts are made of them in one place each
/// (api_json.hpp, metrics.hpp). Everywhere: times in UNIX seconds, a number that is not one is not known and
/// left out of the answer.
inline constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
inline constexpr double kLastTime_s = 9e9;  ///< Year 2255; in ns it is a 64-bit number.

/// Why a question has no answer.
struct Problem {
  enum class Kind : std::uint8_t {
    not_found,    ///< 404
    invalid,      ///< 400
    conflict,     ///< 409: right in itself, but not in the state that things are in
    unavailable,  ///< 503: for the moment
  };
  Kind kind = Kind::not_found;
  std::string field;    ///< Which part of the question.
  std::string message;  ///< What was found, and what is required.
};
template <class T>
using Answer = expected<T, Problem>;

enum class AxisState : std::uint8_t { waiting, learning, following, stale, refused };
inline constexpr EnumName<AxisState> kAxisStateNames[] = {{AxisState::waiting, "waiting"},
                                                          {AxisState::learning, "learning"},
                                                          {AxisState::following, "following"},
                                                          {AxisState::stale, "stale"},
                                                          {AxisState::refused, "refused"}};
[[nodiscard]] constexpr std::span<const EnumName<AxisState>> enum_names(AxisState) noexcept {
  return kAxisStateNames;
}

using monitoring::Severity;

/// One figure now, and against its baseline.
struct FigureStatus {
  online::Figure now;
  double baseline = kUnknown;
  double change = kUnknown;                ///< From the baseline, in the figure's unit.
  double change_std = kUnknown;            ///< Standard deviation of `change`.
  double low = kUnknown, high = kUnknown;  ///< Beyond which the alarm of its limits comes.
};

struct Fault {
  std::string kind;  ///< Name of a Fault of the samples: rate, columns, format, value, clock, order ...
  std::uint64_t count = 0;
  std::string text;  ///< An example, as it came: any bytes.
};

struct SampleCounts {
  std::uint64_t received = 0, missing = 0, late = 0, duplicate = 0, lost = 0;
};

struct AxisStatus {
  std::string name;
  AxisState state = AxisState::waiting;
  bool trusted = false;
  online::AxisVerdict verdict = online::AxisVerdict::not_measured;
  std::string why;                             ///< The verdict in words.
  data::Motion motion = data::Motion::rotary;  ///< Decides the names of the figures.
  identification::Units units;                 ///< In which the figures are.
  double time_s = kUnknown;                    ///< When the newest row's machine was so.
  double age_s = kUnknown;      ///< Since the newest sample's time; while nothing is followed, since it came.
  double latency_s = kUnknown;  ///< From a sample's time to its row.
  double newest_time_s = kUnknown;  ///< Of the newest sample, as `age_s` counts.
  double rate_hz = kUnknown;
  std::uint64_t sample = 0;  ///< Index of the newest sample in the newest row.
  double maintenance_until_time_s =
      kUnknown;  ///< Until then its alarms are suppressed; not known: they are not.
  struct Worst {
    Severity severity = Severity::low;
    std::string text;
  };
  std::optional<Worst> worst_alarm;
  /// Alarms that are active or not acknowledged, but neither shelved nor suppressed; how many are not
  /// acknowledged.
  std::uint64_t alarms = 0, unacknowledged = 0;
  std::array<FigureStatus, monitoring::kWatched> figures{};
  SampleCounts samples;
  std::vector<Fault> faults;
  std::string source;
};

/// Axes that changed, and the number to ask with the next time.
struct AxisNews {
  std::vector<AxisStatus> axes;
  std::uint64_t revision = 0;
};

struct Baseline {
  double time_s = kUnknown;
  std::uint64_t sample = 0;
  std::string who, reason;
  bool active = false;
  std::array<online::Figure, monitoring::kWatched> figures{};
};

struct AxisDetail {
  AxisStatus status;
  struct Estimator {
    std::string method;
    double memory_s = kUnknown;
    online::AxisGates gates;
    double learned_s = kUnknown;  ///< For how long it has learned.
    std::string start;            ///< What it started from, in words.
  } estimator;
  struct Loop {
    std::string controller;  ///< In words; empty: not told, and no loop figures.
    double delay_s = kUnknown;
    double crossover_hz = kUnknown;
    double gain_margin_db = kUnknown, gain_margin_hz = kUnknown;
    double modulus_margin_hz = kUnknown;
    double worst_phase_margin_deg = kUnknown;
  } loop;
  std::vector<Baseline> baselines;
  double longest_shelving_s = kUnknown;  ///< For which any of its alarms can be shelved.
  double raw_from_time_s = kUnknown;     ///< Time of the oldest raw sample; not known: none is kept.
  std::string configuration_hash;
};

/// A response at its lines; columns of equal length, or empty where not known.
struct Curve {
  std::vector<double> frequency_hz, real, imag, std;
  /// Measured between what excites the axis and its output; of the plant now alone.
  std::vector<double> coherence, coherence_std;
};
struct AxisResponse {
  double time_s = kUnknown;
  Curve plant;
  std::optional<Curve> loop;      ///< At the plant's frequencies.
  std::optional<Curve> baseline;  ///< The plant's.
};

enum class Resolution : std::uint8_t { row, five_minutes, hour, day };
inline constexpr EnumName<Resolution> kResolutionNames[] = {{Resolution::row, "row"},
                                                            {Resolution::five_minutes, "five-minutes"},
                                                            {Resolution::hour, "hour"},
                                                            {Resolution::day, "day"}};
[[nodiscard]] constexpr std::span<const EnumName<Resolution>> enum_names(Resolution) noexcept {
  return kResolutionNames;
}

struct HistoryQuestion {
  std::vector<monitoring::Watched> figures;  ///< At least one.
  double from_s = 0.0, to_s = 0.0;
  std::uint32_t points = 0;  ///< At most so many.
};
struct History {
  struct Trend {
    monitoring::Watched figure{};
    std::vector<double> value, std, min, max;  ///< As long as the times.
    std::vector<double> trusted;               ///< Part of the rows that were trusted, 0 ... 1.
  };
  std::vector<double> time_s;
  std::vector<Trend> trends;
  Resolution resolution = Resolution::row;
};

struct Comparison {
  struct Line {
    monitoring::Watched figure{};
    online::Figure a, b;
    double difference = kUnknown, std = kUnknown;
    double sigma = kUnknown;  ///< |difference| over its standard deviation
  };
  double a_time_s = kUnknown, b_time_s = kUnknown;  ///< Of the rows that were found.
  std::vector<Line> lines;
};

/// What changed, as an alarm says it.
struct AlarmChange {
  double before = kUnknown, after = kUnknown;
  double size = kUnknown, std = kUnknown;
  double relative = kUnknown;  ///< size / before
  double sigma = kUnknown;     ///< |size| / std
};

struct Alarm {
  std::uint64_t id = 0;
  std::string axis;   ///< Empty: of the installation.
  std::string alarm;  ///< Name of a figure, data, stale, estimate, controller, disk
  Severity severity = Severity::medium;
  bool active = false, acknowledged = false, latched = false;
  struct Shelved {
    double until_time_s = kUnknown;
    std::string reason, who;
  };
  std::optional<Shelved> shelved;
  std::string suppressed;            ///< Cause; empty: not suppressed.
  std::string text;                  ///< What changed, since when, how much and how sure.
  std::string cause;                 ///< Likely cause in words, or empty.
  double since_time_s = kUnknown;    ///< When the change began.
  double raised_time_s = kUnknown;   ///< When the alarm came.
  double cleared_time_s = kUnknown;  ///< When it went.
  std::optional<AlarmChange> change;
  bool evidence = false;                 ///< Raw samples around it are kept.
  double longest_shelving_s = kUnknown;  ///< Told where alarms are asked for, not with their events.
};

/// `open`: not done with, that is active, unacknowledged, latched or shelved.
enum class AlarmFilter : std::uint8_t { all, open, active, unacknowledged, shelved, cleared };
inline constexpr EnumName<AlarmFilter> kAlarmFilterNames[] = {
    {AlarmFilter::all, "all"},         {AlarmFilter::open, "open"},
    {AlarmFilter::active, "active"},   {AlarmFilter::unacknowledged, "unacknowledged"},
    {AlarmFilter::shelved, "shelved"}, {AlarmFilter::cleared, "cleared"}};
[[nodiscard]] constexpr std::span<const EnumName<AlarmFilter>> enum_names(AlarmFilter) noexcept {
  return kAlarmFilterNames;
}
/// How many alarms there are, [severity].
using AlarmCounts = std::array<std::uint64_t, std::size(monitoring::kSeverityNames)>;

struct AlarmQuestion {
  AlarmFilter state = AlarmFilter::all;
  std::string axis;  ///< Empty: all.
  std::uint32_t limit = 0;
  double from_s = 0.0, to_s = kLastTime_s;  ///< Open at some time within.
};

/// One transition of an alarm.
struct AlarmEvent {
  double time_s = kUnknown;
  std::uint64_t sample = 0;
  std::string transition;  ///< raised, acknowledged, cleared, shelved ...
  std::string state;       ///< After it, in words.
  std::string text;
  std::string who, reason;  ///< Empty: nobody's doing.
  std::optional<AlarmChange> change;
};

struct AuditQuestion {
  std::uint32_t limit = 0;
  double from_s = 0.0, to_s = kLastTime_s;  ///< The latter not included.
};

/// What a person or the service did.
struct AuditEntry {
  double time_s = kUnknown;
  std::string axis;
  std::string action;
  std::string who, reason;
  std::string text;
};

enum class ActionKind : std::uint8_t {
  acknowledge,
  shelve,
  unshelve,
  reset,
  baseline,
  relearn,
  maintenance,
  end_maintenance
};

/// An action of a person; on an alarm or on an axis, as its kind says.
struct Action {
  ActionKind kind = ActionKind::acknowledge;
  std::uint64_t alarm = 0;
  std::string axis;
  std::string who, reason;
  double until_time_s = kUnknown;  ///< End of shelving or maintenance.
  bool in_seconds = false;         ///< It was given as seconds from now.
};

struct SourceStatus {
  std::string name, kind;
  std::string state;    ///< In a word.
  std::string promise;  ///< What it can lose when the process is killed.
  std::uint64_t messages = 0, bytes = 0, lost = 0;
  std::string text;           ///< What is wrong, or empty.
  std::vector<Fault> faults;  ///< That belong to no axis; without examples, which the text has.
};
/// A receiver of alarms.
struct DeliveryStatus {
  std::string name;  ///< webhook, mqtt, nats
  std::uint64_t waiting = 0;
  std::uint64_t delivered = 0, failures = 0, given_up = 0;  ///< Since the start.
  std::string text;                                         ///< Why the last try failed, or empty.
};
struct ServiceStatus {
  std::string version;
  double started_time_s = kUnknown, uptime_s = kUnknown;
  std::uint64_t axes = 0;
  std::vector<SourceStatus> sources;
  struct Store {
    std::uint64_t bytes = 0;    ///< On disk.
    std::uint64_t pending = 0;  ///< Entries that wait to be written.
    bool disk_full = false;
    std::string text;  ///< Why nothing can be written, or too much is kept; or empty.
    bool failing = false, over_limit = false;
  } store;
  struct Threshold {
    double false_alarm_interval_s = kUnknown;  ///< Mean time between false alarms of the installation.
    double per_figure_s = kUnknown;            ///< What follows of it for one figure of one axis.
    double present_interval_s = kUnknown;  ///< Of what is watched now, with the thresholds that were learned.
  } threshold;
  std::vector<DeliveryStatus> deliveries;
};

/// What has to run before the service is ready.
struct Readiness {
  bool sources = false, store = false, engine = false;
  std::string text;  ///< What is missing.
};

/// The rest of the service, as the web server sees it. Called from several threads at once; every call must
/// come back within a second or so, and hold no lock that the sample path takes.
class Backend {
 public:
  virtual ~Backend() = default;

  /// Axes that changed after revision `after` (0: all), in any order.
  [[nodiscard]] virtual AxisNews axes(std::uint64_t after) const = 0;
  [[nodiscard]] virtual Answer<AxisDetail> axis(const std::string& name) const = 0;
  [[nodiscard]] virtual Answer<AxisResponse> response(const std::string& axis) const = 0;
  [[nodiscard]] virtual Answer<History> history(const std::string& axis, const HistoryQuestion&) const = 0;
  /// Raw samples as CSV.
  [[nodiscard]] virtual Answer<std::string> raw(const std::string& axis, double from_s,
                                                double to_s) const = 0;
  [[nodiscard]] virtual Answer<Comparison> compare(const std::string& axis, double a_time_s,
                                                   double b_time_s) const = 0;
  [[nodiscard]] virtual Answer<std::vector<Alarm>> alarms(const AlarmQuestion&) const = 0;  ///< Newest first.
  /// Those that are active, shelved and suppressed ones among them.
  [[nodiscard]] virtual Answer<AlarmCounts> active_alarms() const = 0;
  [[nodiscard]] virtual Answer<Alarm> alarm(std::uint64_t alarm) const = 0;
  [[nodiscard]] virtual Answer<std::vector<AlarmEvent>> events(std::uint64_t alarm) const = 0;
  [[nodiscard]] virtual Answer<std::string> evidence(std::uint64_t alarm) const = 0;  ///< CSV
  [[nodiscard]] virtual Answer<std::string> report(std::uint64_t alarm) const = 0;    ///< HTML
  [[nodiscard]] virtual Answer<std::vector<AuditEntry>> audit(
      const AuditQuestion&) const = 0;  ///< Newest first.
  [[nodiscard]] Answer<std::vector<AuditEntry>> audit(std::uint32_t limit) const {
    return audit(AuditQuestion{limit, 0.0, kLastTime_s});
  }
  [[nodiscard]] virtual ServiceStatus status() const = 0;
  [[nodiscard]] virtual Readiness readiness() const = 0;
  /// Takes an action in; it becomes effective with the axis' next samples.
  [[nodiscard]] virtual Answer<void> act(const Action&) = 0;
};

}  // namespace resonid::monitor::web
