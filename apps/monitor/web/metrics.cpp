// SPDX-License-Identifier: MIT
#include "monitor/web/metrics.hpp"

#include <fmt/compile.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <numbers>
#include <string_view>
#include <utility>
#include <vector>

#include "io/units.hpp"
#include "monitoring/axis_spec.hpp"

namespace resonid::monitor::web {
namespace {

using monitoring::Watched;

/// A label's value with what the format asks for escaped, and bytes that are no UTF-8 as question marks.
std::string label(std::string_view text) {
  std::string escaped;
  for (std::size_t i = 0; i < text.size();) {
    const auto byte = static_cast<unsigned char>(text[i]);
    const std::size_t length = byte < 0x80 ? 1 : byte >= 0xF0 ? 4 : byte >= 0xE0 ? 3 : 2;
    bool whole = (byte < 0x80 || (byte >= 0xC2 && byte < 0xF5)) && i + length <= text.size();
    for (std::size_t k = 1; whole && k < length; ++k)
      whole = (static_cast<unsigned char>(text[i + k]) & 0xC0U) == 0x80U;
    // Overlong forms, surrogates and what lies above U+10FFFF begin like well-formed text.
    if (whole && length > 2) {
      const auto next = static_cast<unsigned char>(text[i + 1]);
      whole = !(byte == 0xE0 && next < 0xA0) && !(byte == 0xED && next > 0x9F) &&
              !(byte == 0xF0 && next < 0x90) && !(byte == 0xF4 && next > 0x8F);
    }
    if (!whole) {
      escaped += '?';
      ++i;
      continue;
    }
    if (byte == '\\' || byte == '"') escaped += '\\';
    if (byte == '\n') {
      escaped += "\\n";
    } else {
      escaped.append(text, i, length);
    }
    i += length;
  }
  return escaped;
}

/// Writes families one after the other; a family without any sample leaves no trace.
class Exposition {
 public:
  explicit Exposition(std::size_t axes) { text_.reserve((axes + 4) * kAxisBytes); }
  void family(std::string_view name, std::string_view type, std::string_view help) {
    name_ = name;
    type_ = type;
    help_ = help;
    begun_ = false;
  }
  /// `labels` as axis="x",side="load", or empty. What is not a number is left out.
  void sample(std::string_view labels, double value) {
    if (std::isfinite(value)) write(labels, value);
  }
  void sample(std::string_view labels, std::uint64_t value) { write(labels, value); }
  [[nodiscard]] std::string text() && { return std::move(text_); }

 private:
  static constexpr std::size_t kAxisBytes = 2560;  ///< About what an axis takes: the text grows in place.
  template <typename Value>
  void write(std::string_view labels, Value value) {
    if (!begun_)
      fmt::format_to(std::back_inserter(text_), "# HELP {0} {1}\n# TYPE {0} {2}\n", name_, help_, type_);
    begun_ = true;
    text_ += name_;
    if (!labels.empty()) (text_ += '{').append(labels) += '}';
    char number[40];  // tens of thousands in an answer
    text_.append(number, fmt::format_to(number, FMT_COMPILE(" {}\n"), value));
  }

  std::string text_;
  std::string name_, type_, help_;  // copies: what is written comes later
  bool begun_ = false;
};

/// A figure of drives that turn and of those that run straight, whose unit may differ.
struct FigureFamily {
  Watched figure;
  std::string_view rotary, linear;  ///< Equal, and their units too: one family for both.
  std::string_view unit_rotary, unit_linear;
  std::string_view side;  ///< A further label, or empty.
  double factor = 1.0;
  std::string_view help;
};

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr FigureFamily kFigureFamilies[] = {
    {Watched::resonance, "resonance", "resonance", "_hertz", "_hertz", "", 1.0, "Undamped resonance"},
    {Watched::antiresonance, "antiresonance", "antiresonance", "_hertz", "_hertz", "", 1.0,
     "Undamped anti-resonance"},
    {Watched::stiffness, "stiffness", "stiffness", "_newton_meters_per_radian", "_newtons_per_meter", "", 1.0,
     "Stiffness between motor and load"},
    {Watched::driven_inertia, "inertia", "mass", "_kilogram_square_meters", "_grams", "motor", 1.0,
     "Inertia or mass of either side"},
    {Watched::load_inertia, "inertia", "mass", "_kilogram_square_meters", "_grams", "load", 1.0,
     "Inertia or mass of either side"},
    {Watched::damping, "damping", "damping", "_newton_meter_seconds_per_radian", "_newton_seconds_per_meter",
     "", 1.0, "Damping between motor and load"},
    {Watched::coulomb_friction, "coulomb_friction", "coulomb_friction", "_newton_meters", "_newtons", "", 1.0,
     "Coulomb friction"},
    {Watched::load_torque, "load_torque", "load_force", "_newton_meters", "_newtons", "", 1.0,
     "Constant load that the input does not hold"},
    {Watched::modulus_margin, "modulus_margin", "modulus_margin", "_ratio", "_ratio", "", 1.0,
     "Least distance of the loop from the critical point"},
    {Watched::phase_margin, "phase_margin", "phase_margin", "_radians", "_radians", "", kDegree,
     "Phase margin of the running loop"},
    {Watched::gap, "gap", "gap", "_ratio", "_ratio", "", 1.0, "Largest chordal distance to the baseline"},
};
static_assert(std::size(kFigureFamilies) == monitoring::kWatched);

/// A figure's name behind its stem, and what makes its value that.
struct MetricUnit {
  std::string text;
  double factor = 1.0;
  std::string_view unit_label = {};  ///< Told in a label, where no name would be true.
};

/// `resonid_stiffness_amperes_per_radian`; what Prometheus has no word for is told in a label.
MetricUnit own_metric_unit(Watched figure, const identification::Units& units, std::string_view own) {
  const MetricUnit labelled{"_own_units", 1.0, own};
  const auto input = io::known_unit(units.input);
  if (!input) return labelled;
  std::string_view one = "_ratio", many = "_ratio";
  if (input->dimension == io::Dimension::current) {
    one = "_ampere";
    many = "_amperes";
  } else if (input->dimension == io::Dimension::voltage) {
    one = "_volt";
    many = "_volts";
  } else if (input->dimension != io::Dimension::ratio) {
    return labelled;
  }
  const double factor = input->factor;
  if (figure == Watched::coulomb_friction || figure == Watched::load_torque)
    return {std::string(many), factor};
  const bool angle = units.velocity == "rad/s";
  if (!angle && units.velocity != "m/s") return labelled;
  const auto per = [&](std::string_view above) {
    return MetricUnit{fmt::format("{}_per_{}", above, angle ? "radian" : "meter"), factor};
  };
  if (figure == Watched::stiffness) return per(many);
  return per(fmt::format("{}_seconds{}", one, figure == Watched::damping ? "" : "_squared"));
}

MetricUnit metric_unit(const FigureFamily& f, const AxisStatus& axis) {
  if (!axis.units.physical)
    if (const auto own = monitoring::unit_of(f.figure, axis.units); !own.empty())
      return own_metric_unit(f.figure, axis.units, own);
  const bool linear = axis.motion == data::Motion::linear;
  const auto unit = linear ? f.unit_linear : f.unit_rotary;
  return {std::string(unit), unit == "_grams" ? 1000.0 : f.factor};
}

/// Axes whose figures are in the same units: many axes are of few.
struct UnitSystem {
  const AxisStatus* first;  ///< The first such axis.
  std::vector<std::size_t> axes;

  [[nodiscard]] bool takes(const AxisStatus& axis) const {
    const auto& a = first->units;
    const auto& b = axis.units;
    return first->motion == axis.motion && a.physical == b.physical && a.input == b.input &&
           a.velocity == b.velocity;
  }
};

std::vector<UnitSystem> unit_systems(const std::vector<AxisStatus>& axes) {
  std::vector<UnitSystem> systems;
  for (std::size_t i = 0; i < axes.size(); ++i) {
    const auto at =
        std::find_if(systems.begin(), systems.end(), [&](const auto& s) { return s.takes(axes[i]); });
    if (at != systems.end())
      at->axes.push_back(i);
    else
      systems.push_back({&axes[i], {i}});
  }
  return systems;
}

void figure_families(Exposition& to, const std::vector<AxisStatus>& axes,
                     const std::vector<std::string>& labels) {
  const auto systems = unit_systems(axes);
  // Samples of a family stand together, whichever figures (both sides) and units (both motions) it has.
  struct Part {
    const FigureFamily* figure;
    const UnitSystem* system;
    MetricUnit unit;
  };
  std::vector<std::pair<std::string, std::vector<Part>>> families;
  const auto family = [&](std::string name) -> std::vector<Part>& {
    const auto at =
        std::find_if(families.begin(), families.end(), [&](const auto& f) { return f.first == name; });
    return at != families.end() ? at->second
                                : families.emplace_back(std::move(name), std::vector<Part>{}).second;
  };
  for (const bool deviation : {false, true}) {
    families.clear();
    for (const auto& system : systems)
      for (const auto& f : kFigureFamilies) {
        auto unit = metric_unit(f, *system.first);
        const bool linear = system.first->motion == data::Motion::linear;
        const auto stem = linear ? f.linear : f.rotary;
        auto& parts = family(fmt::format("resonid_{}{}{}", stem, deviation ? "_std" : "", unit.text));
        parts.push_back({&f, &system, std::move(unit)});
      }
    for (const auto& [name, parts] : families) {
      to.family(name, "gauge",
                fmt::format("{}{}.", parts[0].figure->help, deviation ? ", standard deviation" : ""));
      for (const auto& [figure, system, unit] : parts) {
        std::string further;
        if (!figure->side.empty()) further = fmt::format(",side=\"{}\"", figure->side);
        if (!unit.unit_label.empty()) further += fmt::format(",unit=\"{}\"", label(unit.unit_label));
        for (const auto i : system->axes) {
          const auto& now = axes[i].figures[static_cast<std::size_t>(figure->figure)].now;
          const double value = unit.factor * (deviation ? now.std : now.value);
          if (further.empty())
            to.sample(labels[i], value);
          else
            to.sample(labels[i] + further, value);
        }
      }
    }
  }
}

}  // namespace

std::string metrics_text(const std::vector<AxisStatus>& axes, const Answer<AlarmCounts>& active,
                         const ServiceStatus& status, const WebCounts& web) {
  std::vector<std::string> labels;
  for (const auto& axis : axes) labels.push_back(fmt::format("axis=\"{}\"", label(axis.name)));
  Exposition to(axes.size());
  to.family("resonid_build_info", "gauge", "Version of the program.");
  to.sample(fmt::format("version=\"{}\"", label(status.version)), std::uint64_t{1});
  to.family("resonid_start_time_seconds", "gauge", "When the service started, UNIX time.");
  to.sample("", status.started_time_s);
  to.family("resonid_axes", "gauge", "Axes that are configured.");
  to.sample("", status.axes);

  figure_families(to, axes, labels);

  const auto per_axis = [&](std::string_view name, std::string_view type, std::string_view help, auto value) {
    to.family(name, type, help);
    for (std::size_t i = 0; i < axes.size(); ++i) to.sample(labels[i], value(axes[i]));
  };
  per_axis("resonid_trusted", "gauge", "Whether the newest estimate is trusted.",
           [](const AxisStatus& a) { return std::uint64_t{a.trusted}; });
  per_axis("resonid_estimate_timestamp_seconds", "gauge",
           "When the machine was as the estimate says, UNIX time.",
           [](const AxisStatus& a) { return a.time_s; });
  per_axis("resonid_newest_sample_timestamp_seconds", "gauge",
           "Time of the newest sample; while nothing is followed, when it came. UNIX time.",
           [](const AxisStatus& a) { return a.newest_time_s; });
  per_axis("resonid_axis_alarms", "gauge",
           "Open alarms of an axis, but those that are shelved or suppressed.",
           [](const AxisStatus& a) { return a.alarms; });
  to.family("resonid_axis_state", "gauge", "1 for the state in which an axis is, 0 for the others.");
  for (std::size_t i = 0; i < axes.size(); ++i)
    for (const auto& [state, name] : kAxisStateNames)
      to.sample(fmt::format("{},state=\"{}\"", labels[i], name), std::uint64_t{axes[i].state == state});
  per_axis("resonid_latency_seconds", "gauge", "From a sample's time to its estimate.",
           [](const AxisStatus& a) { return a.latency_s; });
  per_axis("resonid_samples_total", "counter", "Samples received.",
           [](const AxisStatus& a) { return a.samples.received; });
  per_axis("resonid_samples_missing_total", "counter", "Samples that never came.",
           [](const AxisStatus& a) { return a.samples.missing; });
  per_axis("resonid_samples_late_total", "counter", "Samples that came after their turn.",
           [](const AxisStatus& a) { return a.samples.late; });
  per_axis("resonid_samples_duplicate_total", "counter", "Samples that came again.",
           [](const AxisStatus& a) { return a.samples.duplicate; });
  per_axis("resonid_samples_lost_total", "counter", "Samples that came and could not be taken in.",
           [](const AxisStatus& a) { return a.samples.lost; });
  to.family("resonid_faults_total", "counter", "Faults of the data by kind.");
  for (std::size_t i = 0; i < axes.size(); ++i)
    for (const auto& fault : axes[i].faults)
      to.sample(fmt::format("{},kind=\"{}\"", labels[i], label(fault.kind)), fault.count);

  to.family("resonid_alarms_active", "gauge",
            "Active alarms by severity, those that are shelved or suppressed too.");
  for (const auto& [severity, name] : monitoring::kSeverityNames) {
    if (!active) break;  // the store cannot be read
    to.sample(fmt::format("severity=\"{}\"", name), (*active)[static_cast<std::size_t>(severity)]);
  }

  const auto per_source = [&](std::string_view name, std::string_view help, auto value) {
    to.family(name, "counter", help);
    for (const auto& s : status.sources)
      to.sample(fmt::format("source=\"{}\",kind=\"{}\"", label(s.name), label(s.kind)), value(s));
  };
  per_source("resonid_source_messages_total", "Messages of a source.",
             [](const SourceStatus& s) { return s.messages; });
  per_source("resonid_source_bytes_total", "Bytes of a source.",
             [](const SourceStatus& s) { return s.bytes; });
  per_source("resonid_source_lost_total", "Messages that a source is known to have lost.",
             [](const SourceStatus& s) { return s.lost; });
  to.family("resonid_source_faults_total", "counter", "Faults that belong to no axis, by what is wrong.");
  for (const auto& s : status.sources)
    for (const auto& fault : s.faults)
      to.sample(fmt::format("source=\"{}\",kind=\"{}\",fault=\"{}\"", label(s.name), label(s.kind),
                            label(fault.kind)),
                fault.count);

  to.family("resonid_store_bytes", "gauge", "Size of the database on disk.");
  to.sample("", status.store.bytes);
  to.family("resonid_store_pending", "gauge", "Entries that wait to be written.");
  to.sample("", status.store.pending);
  to.family("resonid_store_disk_full", "gauge", "Whether the disk is full.");
  to.sample("", std::uint64_t{status.store.disk_full});
  to.family("resonid_store_failing", "gauge", "Whether nothing can be written, be the disk full or not.");
  to.sample("", std::uint64_t{status.store.failing});
  to.family("resonid_store_over_limit", "gauge",
            "Whether more is kept than may be, and nothing is left to remove.");
  to.sample("", std::uint64_t{status.store.over_limit});

  const auto per_target = [&](std::string_view name, std::string_view type, std::string_view help,
                              auto value) {
    to.family(name, type, help);
    for (const auto& d : status.deliveries) to.sample(fmt::format("target=\"{}\"", label(d.name)), value(d));
  };
  per_target("resonid_deliveries_waiting", "gauge", "Messages of alarms that wait for a target.",
             [](const DeliveryStatus& d) { return d.waiting; });
  per_target("resonid_deliveries_total", "counter", "Messages of alarms that a target has confirmed.",
             [](const DeliveryStatus& d) { return d.delivered; });
  per_target("resonid_delivery_failures_total", "counter", "Tries that a target has not confirmed.",
             [](const DeliveryStatus& d) { return d.failures; });
  per_target("resonid_deliveries_given_up_total", "counter",
             "Messages of alarms that never reached a target.",
             [](const DeliveryStatus& d) { return d.given_up; });

  to.family("resonid_http_connections", "gauge", "Open connections.");
  to.sample("", web.connections);
  to.family("resonid_http_streams", "gauge", "Open event streams.");
  to.sample("", web.streams);
  to.family("resonid_http_refused_total", "counter", "Connections and requests refused by a limit.");
  to.sample("", web.refused_connections);
  to.family("resonid_http_responses_total", "counter", "Answers by status.");
  for (const auto& [code, count] : web.responses) to.sample(fmt::format("code=\"{}\"", code), count);
  to.family("resonid_http_frames_total", "counter", "Frames made for event streams.");
  to.sample("", web.frames);
  to.family("resonid_http_frames_skipped_total", "counter", "Frames left out for slow clients.");
  to.sample("", web.skipped_frames);
  return std::move(to).text();
}

}  // namespace resonid::monitor::web
