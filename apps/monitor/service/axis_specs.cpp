// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <identification/track/plan.hpp>
#include <monitoring/threshold.hpp>
#include <resonid/base/error_text.hpp>
#include <resonid/io/controller_file.hpp>
#include <system_error>

#include "cli/stored_result.hpp"
#include "io/columns.hpp"
#include "io/signal_units.hpp"
#include "io/text.hpp"
#include "io/units.hpp"
#include "monitor/service/axis_spec_of.hpp"

namespace resonid::monitor {
namespace {

/// Whether any of the signals is converted by this constant.
bool applies(std::optional<double> io::ColumnMapping::*constant, const io::ColumnMapping& mapping,
             data::Motion motion, const std::vector<io::SignalUnit>& signals) {
  auto without = mapping;
  without.*constant = std::nullopt;
  std::vector<std::string> unheard;
  return std::any_of(signals.begin(), signals.end(), [&](const auto& signal) {
    const auto with_it = io::UnitConverter(mapping, motion, unheard).convert(signal);
    const auto without_it = io::UnitConverter(without, motion, unheard).convert(signal);
    return with_it.unit != without_it.unit || with_it.factor != without_it.factor;
  });
}

class SpecBuilder {
 public:
  SpecBuilder(const Configuration& configuration, const AxisConfig& axis, std::vector<std::string>& notes)
      : c_(configuration), a_(axis), notes_(notes) {}

  expected<monitoring::AxisSpec, std::vector<Error>> build(const std::string& name, double interval_s) {
    s_.name = name;
    s_.sample_rate_hz = a_.sample_rate_hz;
    s_.motion = a_.motion;
    s_.output_quantity = a_.output_quantity;
    s_.has_excitation = !a_.excitation.empty();
    s_.has_position = !a_.position.empty();
    s_.row_every_s = c_.monitor.row_every_s;
    s_.baseline_s = a_.baseline_s;
    s_.false_alarm_interval_s = interval_s;
    s_.alarms = a_.alarms;
    set_units();
    set_options();
    set_controller();
    set_start();
    set_baseline();
    check_method();
    if (!faults_.empty()) return unexpected(std::move(faults_));
    return std::move(s_);
  }

 private:
  void refuse_key(const char* key, std::string requirement) {
    faults_.push_back(Error{key, std::move(requirement)});
  }
  /// Others of units may come of the first.
  void refuse_unit(const char* key, std::string requirement) {
    if (faults_.empty()) refuse_key(key, std::move(requirement));
  }

  void set_units() {
    if (!a_.output_unit.empty() || std::abs(a_.output_scale) == 1.0) check_quantity();
    check_names();
    check_motion();
    io::ColumnMapping mapping;
    mapping.torque_constant = a_.torque_constant;
    mapping.rated_torque = a_.rated_torque;
    mapping.counts_per_rev = a_.counts_per_rev;
    io::UnitConverter converter(mapping, a_.motion, notes_);
    const auto given = [](const std::string& unit) {
      return unit.empty() ? std::nullopt : std::optional<std::string>(unit);
    };
    const auto first_note = notes_.size();
    const std::string input_si = io::input_si_unit(a_.motion);
    const std::string output_si = io::output_si_unit(a_.motion, a_.output_quantity);
    std::vector<io::SignalUnit> signals = {
        {a_.input, unit_in_name(a_.input), given(a_.input_unit), a_.input_scale, input_si},
        {a_.output, unit_in_name(a_.output), given(a_.output_unit), a_.output_scale, output_si,
         std::string(name_of(a_.output_quantity))}};
    const auto u = converter.convert(signals[0]);
    const auto y = converter.convert(signals[1]);
    if (const std::string unit = unit_in_name(a_.excitation); !unit.empty()) {
      signals.push_back({a_.excitation, unit, {}, a_.input_scale, input_si});
      const auto ru = converter.convert(signals.back());
      if (ru.factor != u.factor || ru.unit != u.unit)
        refuse_unit("excitation",
                    fmt::format("{} is in {}: it must be in the unit of the input, which has the same "
                                "scale",
                                io::in_quotes(a_.excitation), unit));
    }
    s_.input_scale = u.factor;
    s_.input_unit = u.unit == input_si ? "" : u.unit;
    s_.excitation_scale = a_.excitation_scale;
    s_.output_scale = y.factor;
    s_.output_unit = y.unit == output_si ? "" : y.unit;
    s_.position_scale = a_.position_scale;
    if (!a_.position.empty()) {
      const std::string si = io::output_si_unit(a_.motion, data::OutputQuantity::position);
      const std::string unit = unit_in_name(a_.position);
      if (!unit.empty()) {
        signals.push_back({a_.position, unit, {}, a_.position_scale, si});
        s_.position_scale = converter.convert(signals.back()).factor;
      }
    }
    check_constants(mapping, signals, u.unit, y.unit);
    note_units();
    for (auto note = first_note; note < notes_.size(); ++note) notes_[note] = library_keys(notes_[note]);
  }

  /// Limits and tables are read in these, and Nm/rad is what their reader expects.
  void note_units() {
    const auto units = monitoring::figure_units(s_);
    if (units.physical) return;
    notes_.push_back(
        fmt::format("figures and their limits are in {} (stiffness), {} (inertia), {} (damping) and {} "
                    "(friction, load)",
                    units.stiffness, units.inertia, units.damping, units.torque));
  }

  /// A constant that converts nothing was meant for a signal that is taken for something else.
  void check_constants(const io::ColumnMapping& mapping, const std::vector<io::SignalUnit>& signals,
                       const std::string& input_is, const std::string& output_is) {
    using Mapping = io::ColumnMapping;
    const auto check = [&](const char* key, std::optional<double> Mapping::*constant, const char* signal,
                           const std::string& column, double scale, const std::string& taken_for,
                           const std::string& required) {
      if (!(mapping.*constant) || applies(constant, mapping, a_.motion, signals)) return;
      const bool scaled = std::abs(scale) != 1.0;
      refuse_unit(key,
                  fmt::format("applies to nothing: the {0} {1}{2} is taken for {3}; required {0}_unit = {4}",
                              signal, io::in_quotes(column),
                              scaled ? fmt::format(" times {}_scale", signal) : "", taken_for, required));
    };
    check("torque_constant", &Mapping::torque_constant, "input", a_.input, a_.input_scale, input_is, "\"A\"");
    check("rated_torque", &Mapping::rated_torque, "input", a_.input, a_.input_scale, input_is, "\"%\"");
    check(
        "counts_per_rev", &Mapping::counts_per_rev, "output", a_.output, a_.output_scale, output_is,
        fmt::format("\"{}\"{}", a_.output_quantity == data::OutputQuantity::velocity ? "counts/s" : "counts",
                    a_.position.empty() ? "" : ", or counts in the name of the position"));
  }

  void check_quantity() {
    const std::string unit = a_.output_unit.empty() ? unit_in_name(a_.output) : a_.output_unit;
    const auto known = io::known_unit(unit);
    if (!known) return;
    const auto quantity = io::quantity_of(known->dimension);
    if (!quantity || *quantity != a_.output_quantity)
      refuse_unit("output_quantity",
                  fmt::format("is {}, and the output {} is in {}", name_of(a_.output_quantity),
                              io::in_quotes(a_.output), unit));
  }

  /// A key may correct the unit in a name, but not make an ampere of a Nm: only a scale or a constant does.
  void check_names() {
    check_name("input_unit", a_.input, a_.input_unit, a_.input_scale, false);
    check_name("output_unit", a_.output, a_.output_unit, a_.output_scale, true);
  }
  void check_name(const char* key, const std::string& column, const std::string& given, double scale,
                  bool output) {
    const auto fits = [output](const std::optional<io::Unit>& unit) {
      using io::Dimension;
      if (!unit) return false;
      if (output) return io::quantity_of(unit->dimension).has_value();
      return unit->dimension == Dimension::torque || unit->dimension == Dimension::force ||
             unit->dimension == Dimension::current || unit->dimension == Dimension::ratio;
    };
    const std::string named = unit_in_name(column);
    const auto by_name = io::known_unit(named), by_key = io::known_unit(given);
    if (std::abs(scale) != 1.0 || !fits(by_name) || !fits(by_key)) return;
    if (by_name->dimension != by_key->dimension)
      refuse_unit(key, fmt::format("found {}, required another name of {}, the unit in {}, or {} that "
                                   "converts it",
                                   given, named, io::in_quotes(column),
                                   output ? "an output_scale" : "an input_scale"));
  }

  /// What counts before it is converted: a scale gives SI, unless the key says what.
  static ColumnUnit told_unit(const std::string& column, const std::string& given, double scale) {
    if (!given.empty()) return {column, given};
    return {column, std::abs(scale) == 1.0 ? unit_in_name(column) : std::string()};
  }

  void check_motion() {
    const auto output = told_unit(a_.output, a_.output_unit, a_.output_scale);
    if (auto fault = motion_fault(a_.motion, told_unit(a_.input, a_.input_unit, a_.input_scale), output))
      return refuse_unit("motion", std::move(*fault));
    const auto known = io::known_unit(output.unit);
    const bool counts =
        known && (known->dimension == io::Dimension::counts || known->dimension == io::Dimension::count_rate);
    if (counts && a_.counts_per_rev && a_.motion == data::Motion::linear)
      refuse_unit("counts_per_rev",
                  fmt::format("makes an angle of the output {}; required with motion = \"linear\": in its "
                              "place output_scale, {} per count, and no output_unit",
                              io::in_quotes(a_.output), io::output_si_unit(a_.motion, a_.output_quantity)));
  }

  void set_options() {
    auto& o = s_.track.common;
    o.excitation_type = a_.excitation_type;
    if (a_.chirp.size() == 3) o.chirp = online::SweepLaw{a_.chirp[0], a_.chirp[1], a_.chirp[2]};
    const auto lines = a_.lines_hz.hz();
    o.lines_hz.assign(lines.begin(), lines.end());
    o.period_samples = a_.period_samples;
    if (a_.band_hz.size() == 2) o.band_hz = {a_.band_hz[0], a_.band_hz[1]};
    o.delay_s = a_.delay_s;
    o.friction = a_.friction;
    s_.track.method = a_.method;
    s_.track.memory_s = a_.memory_s;
    s_.track.drift_per_s = a_.drift_per_s;
  }

  /// The path of a file that is there.
  std::optional<std::string> file(const char* key, const std::string& name) {
    std::error_code code;
    const auto path = c_.file(name).string();
    if (std::filesystem::is_regular_file(path, code)) return path;
    refuse_key(key,
               fmt::format("found {}, required a file: there is none of that name", io::in_quotes(path)));
    return std::nullopt;
  }

  void set_controller() {
    if (a_.controller.empty()) return;
    std::string text = a_.controller;
    if (!tells_controller(text)) {
      const auto path = file("controller", text);
      if (!path) return;
      text = *path;
    }
    auto read = io::read_controller(text, 1.0 / a_.sample_rate_hz);
    if (!read) return refuse_key("controller", message_of(read.error()));
    s_.track.common.controller = data::Controller(static_cast<data::TransferFunction&>(*read));
  }

  std::optional<identification::Result> result(const char* key, const std::string& name) {
    const auto path = file(key, name);
    if (!path) return std::nullopt;
    auto read = cli::stored_result(*path);
    if (read) return std::move(*read);
    refuse_key(key, message_of(read.error()));
    return std::nullopt;
  }

  void set_start() {
    if (a_.start.empty()) return;
    const auto found = result("start", a_.start);
    if (!found) return;
    if (!found->model) return refuse_key("start", io::in_quotes(a_.start) + " holds no model");
    s_.track.start = found->model->drive;
    s_.track.start_units = found->units;
  }

  void set_baseline() {
    if (!a_.baseline.empty()) s_.track.baseline = result("baseline", a_.baseline);
  }

  void check_method() {
    if (!faults_.empty() || a_.method == identification::TrackMethod::automatic) return;
    data::Record record;
    record.output_quantity = a_.output_quantity;
    if (s_.has_excitation) record.excitation.samples = {0.0};
    const auto fault = identification::detail::contradiction(record, s_.track, a_.method);
    if (!fault) return;
    const bool lacks = fault->field == "controller" || fault->field == "excitation";
    faults_.push_back(
        Error{fault->field, lacks ? fmt::format("must be given for method = \"{}\"", name_of(a_.method))
                                  : library_keys(fault->requirement.str())});
  }

  const Configuration& c_;
  const AxisConfig& a_;
  std::vector<std::string>& notes_;
  monitoring::AxisSpec s_;
  std::vector<Error> faults_;
};

}  // namespace

std::optional<std::string> motion_fault(data::Motion motion, const ColumnUnit& input,
                                        const ColumnUnit& output) {
  std::string found;
  bool some_fit = false;
  for (const auto& [signal, told] : {std::pair{"input", &input}, std::pair{"output", &output}}) {
    const auto unit = io::known_unit(told->unit);
    const auto of_unit = unit ? io::motion_of(unit->dimension) : std::nullopt;
    if (of_unit && *of_unit != motion)
      found += fmt::format("{} and the {} {} is in {}", found.empty() ? "," : "", signal,
                           io::in_quotes(told->column), told->unit);
    some_fit = some_fit || of_unit == motion;
  }
  if (found.empty()) return std::nullopt;
  const bool rotary = motion == data::Motion::rotary;
  return fmt::format("is {0}{1}; required {2}units of a {0} drive: {3}", name_of(motion), found,
                     some_fit ? ""
                     : rotary ? "linear, or "
                              : "rotary, or ",
                     rotary ? "Nm, A or % of the input, rad, rpm, counts ... of the output"
                            : "N, A or % of the input, m, mm/s, counts ... of the output");
}

std::string unit_in_name(const std::string& column) {
  io::Table table;
  table.names = {column};
  return io::named_unit(table, 0).unit;
}

bool tells_controller(std::string_view text) { return text.starts_with("pi:") || text.starts_with('{'); }

std::string library_keys(std::string text) {
  for (std::size_t i = 0; i + 2 < text.size(); ++i)
    if (text[i] == ' ' && text[i + 1] == '.' && text[i + 2] >= 'a' && text[i + 2] <= 'z')
      text.erase(i + 1, 1);
  return text;
}

expected<monitoring::AxisSpec, std::vector<Error>> axis_spec_of(const Configuration& configuration,
                                                                const std::string& name,
                                                                const AxisConfig& axis, double interval_s,
                                                                std::vector<std::string>& notes) {
  return SpecBuilder(configuration, axis, notes).build(name, interval_s);
}

std::size_t detectors_of(const AxisConfig& axis) {
  const auto& figures = axis.alarms.figures;
  return static_cast<std::size_t>(std::count_if(figures.begin(), figures.end(), [](const auto& figure) {
    return figure.alarm.enabled && figure.changes;
  }));
}

expected<std::vector<monitoring::AxisSpec>> axis_specs(const Configuration& configuration) {
  std::size_t detectors = 0;
  for (const auto& [name, axis] : configuration.axes.tables) detectors += detectors_of(axis);
  const auto interval_s = monitoring::detector_interval_s(configuration.monitor.false_alarm_interval_s,
                                                          std::max<std::size_t>(detectors, 1));
  if (!interval_s) return unexpected(interval_s.error());
  std::vector<monitoring::AxisSpec> specs;
  std::vector<std::string> notes;
  for (const auto& [name, axis] : configuration.axes.tables) {
    auto spec = axis_spec_of(configuration, name, axis, *interval_s, notes);
    if (!spec) {
      Error fault = spec.error().front();
      fault.field = "axis." + name + "." + fault.field.str();
      return unexpected(std::move(fault));
    }
    specs.push_back(std::move(*spec));
  }
  return specs;
}

}  // namespace resonid::monitor
