// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <identification/track/rows.hpp>
#include <string_view>

namespace resonid::identification::detail {
namespace {

using online::Axis;
using online::AxisMethod;
using online::AxisRow;
using online::Figure;

/// Keeps the first, the third ...
template <class Values>
void thin(Values& values) {
  const std::size_t kept = (values.size() + 1) / 2;
  for (std::size_t i = 1; i < kept; ++i) values[i] = values[2 * i];
  values.resize(kept);
}

std::string unit_of(std::string_view parameter, const Units& units) {
  if (parameter.ends_with("inertia")) return units.inertia;
  if (parameter == "stiffness") return units.stiffness;
  if (parameter == "damping" || parameter == "viscous_friction") return units.damping;
  if (parameter.starts_with("torque") || parameter == "coulomb_friction") return units.torque;
  return {};
}

}  // namespace

Rows::Rows(const data::Record& stretch, const TrackOptions& options, const AxisSetup& setup, const Axis& axis,
           Track& track)
    : options_(options),
      has_position_(stretch.position.present()),
      doubtful_(std::any_of(track.findings.begin(), track.findings.end(),
                            [](const auto& f) { return f.severity == diagnostics::Severity::error; })),
      track_(track) {
  if (setup.config.method == AxisMethod::chirp)
    add_chirp();
  else
    add_lines(axis);
  add_parameters(axis, setup);
  add_figures(setup);
  values_.resize(series_.size());
  if (options.on_columns) options.on_columns(names());
}

void Rows::add_series(std::vector<TrackSeries> Track::*group, std::string name, std::string unit,
                      bool has_std, Read of) {
  auto& list = track_.*group;
  series_.push_back({group, list.size(), has_std, std::move(of)});
  list.push_back({std::move(name), std::move(unit), {}, {}});
}

void Rows::add_lines(const Axis& axis) {
  const std::size_t lines = axis.lines();
  for (std::size_t i = 0; i < lines; ++i) {
    const double hz = axis.line(i).frequency_hz;
    const auto add_part = [&](const char* part, double (*of)(const online::AxisLine&)) {
      add_series(&Track::lines, fmt::format("{}_{:g}", part, hz), "", false, [i, of](const Axis& a) {
        const auto line = a.line(i);
        return Figure{line.settled ? of(line) : kUnknown, kUnknown};
      });
    };
    add_part("re", [](const online::AxisLine& line) { return line.response.real(); });
    add_part("im", [](const online::AxisLine& line) { return line.response.imag(); });
    add_part("std", [](const online::AxisLine& line) { return line.std; });
  }
}

void Rows::add_chirp() {
  const auto add_part = [&](const char* name, const char* unit, double (*of)(const online::AxisLine&)) {
    add_series(&Track::lines, name, unit, false, [of](const Axis& a) {
      return Figure{of(a.line(0)), kUnknown};
    });
  };
  add_part("frequency_hz", "Hz", [](const online::AxisLine& line) { return line.frequency_hz; });
  add_part("real", "", [](const online::AxisLine& line) { return line.response.real(); });
  add_part("imag", "", [](const online::AxisLine& line) { return line.response.imag(); });
  add_part("std", "", [](const online::AxisLine& line) { return line.std; });
}

void Rows::add_parameters(const Axis& axis, const AxisSetup& setup) {
  const auto& p = setup.config.physical;
  for (std::size_t i = 0; !axis.parameter_name(i).empty(); ++i) {
    const auto name = axis.parameter_name(i);
    if (name == "viscous_friction" && !(p.viscous_friction_nms_rad.std > 0.0)) continue;
    if (name == "coulomb_friction" && !setup.config.coulomb_friction) continue;
    add_series(&Track::parameters, std::string(name), unit_of(name, track_.units), true,
               [i](const Axis& a) { return a.row().parameter[i]; });
  }
}

void Rows::add_figures(const AxisSetup& setup) {
  const auto add_figure = [&](const char* name, const char* unit, Figure AxisRow::*figure) {
    add_series(&Track::figures, name, unit, true, [figure](const Axis& a) { return a.row().*figure; });
  };
  add_figure("resonance_hz", "Hz", &AxisRow::resonance_hz);
  add_figure("antiresonance_hz", "Hz", &AxisRow::antiresonance_hz);
  if (!setup.numerator.empty()) {
    add_figure("crossover_hz", "Hz", &AxisRow::crossover_hz);
    add_figure("phase_margin_deg", "deg", &AxisRow::phase_margin_deg);
    add_figure("modulus_margin", "", &AxisRow::modulus_margin);
  }
  if (!setup.baseline_hz.empty()) add_figure("gap", "", &AxisRow::gap);
  if (setup.config.change_of)
    add_series(&Track::figures, "changed", "", false, [](const Axis& a) {
      return Figure{a.result().changed ? 1.0 : 0.0, kUnknown};
    });
}

std::vector<std::string> Rows::names() const {
  std::vector<std::string> names{"time_s"};
  for (const Series& s : series_) {
    const auto& name = (track_.*s.group)[s.index].name;
    names.push_back(name);
    if (s.has_std) names.push_back(name + "_std");
  }
  if (has_position_) names.emplace_back("position_m");
  names.emplace_back("trusted");
  return names;
}

void Rows::add(const Axis& axis, const Place& place) {
  for (std::size_t i = 0; i < series_.size(); ++i) values_[i] = series_[i].of(axis);
  if (options_.on_row) {
    flat_.assign({place.time_s});
    for (std::size_t i = 0; i < series_.size(); ++i) {
      flat_.push_back(values_[i].value);
      if (series_[i].has_std) flat_.push_back(values_[i].std);
    }
    if (has_position_) flat_.push_back(place.position_m);
    flat_.push_back(trusted(axis.row()) ? 1.0 : 0.0);
    options_.on_row(flat_);
  }
  if (track_.rows++ % stride_ != 0) return;
  keep(place, axis.row());
  if (options_.kept_rows == 0 || track_.time_s.size() <= options_.kept_rows) return;
  keep_every_second();
  stride_ *= 2;
}

void Rows::keep(const Place& place, const AxisRow& row) {
  track_.time_s.push_back(place.time_s);
  track_.lag_s.push_back(place.lag_s);
  track_.residual.push_back(row.residual_rms);
  if (has_position_) track_.position_m.push_back(place.position_m);
  track_.trusted_rows.push_back(trusted(row));
  for (std::size_t i = 0; i < series_.size(); ++i) {
    TrackSeries& series = (track_.*series_[i].group)[series_[i].index];
    series.value.push_back(values_[i].value);
    if (series_[i].has_std) series.std.push_back(values_[i].std);
  }
}

void Rows::keep_every_second() {
  for (auto* values : {&track_.time_s, &track_.lag_s, &track_.position_m, &track_.residual}) thin(*values);
  thin(track_.trusted_rows);
  for (auto* group : {&track_.lines, &track_.parameters, &track_.figures})
    for (auto& series : *group) {
      thin(series.value);
      thin(series.std);
    }
}

}  // namespace resonid::identification::detail
