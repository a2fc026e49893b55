// SPDX-License-Identifier: MIT
#include "reproduce/vi_page.hpp"

#include <cmath>
#include <limits>
#include <resonid/base/constants.hpp>

namespace resonid::reproduction::vi {

using report::Curve;

void add_noise_free_rows(report::ComparisonTable& table, const std::string& name, const ResponseErrors& e) {
  table.rows.push_back(row(name + ", noise-free: largest magnitude error", "dB", e.decibel));
  table.rows.push_back(row(name + ", noise-free: largest phase error", "deg", e.degree));
  table.rows.push_back(
      row(name + ", noise-free: largest magnitude error above 5 Hz", "dB", e.decibel_above_5hz));
  table.rows.push_back(row(name + ", noise-free: largest phase error above 5 Hz", "deg", e.degree_above_5hz));
  table.rows.push_back(row(name + ", noise-free: rms relative error", "", e.rms));
}

void add_noisy_rows(report::ComparisonTable& table, const std::string& name,
                    const std::vector<ResponseErrors>& runs) {
  const auto add = [&](const char* what, const char* unit, double ResponseErrors::*figure) {
    std::vector<double> values;
    for (const auto& e : runs) values.push_back(e.*figure);
    table.rows.push_back(row(name + what, unit, spread(values)));
  };
  add(", noisy: largest magnitude error above 5 Hz", "dB", &ResponseErrors::decibel_above_5hz);
  add(", noisy: largest phase error above 5 Hz", "deg", &ResponseErrors::degree_above_5hz);
  add(", noisy: rms relative error", "", &ResponseErrors::rms);
  add(", noisy: rms relative error above 5 Hz", "", &ResponseErrors::rms_above_5hz);
}

Curve magnitude_curve(std::string name, Curve::Mark mark, const data::FrequencyResponse& g) {
  Curve c;
  c.name = std::move(name);
  c.mark = mark;
  c.x = g.frequency_hz;
  for (const auto& value : g.value) c.y.push_back(20.0 * std::log10(std::abs(value)));
  return c;
}

Curve phase_curve(std::string name, Curve::Mark mark, const data::FrequencyResponse& g,
                  const data::FrequencyResponse& truth) {
  Curve c;
  c.name = std::move(name);
  c.mark = mark;
  c.x = g.frequency_hz;
  for (std::size_t i = 0; i < g.lines(); ++i) {
    const auto reference = truth.at(g.frequency_hz[i]);
    c.y.push_back((std::arg(reference) + std::arg(g.value[i] / reference)) * 180.0 / kPi);
  }
  return c;
}

Curve plane_curve(std::string name, Curve::Mark mark, const data::FrequencyResponse& loop) {
  constexpr double kEdge = 1.25;
  constexpr double kGap = std::numeric_limits<double>::quiet_NaN();
  Curve c;
  c.name = std::move(name);
  c.mark = mark;
  for (const auto& value : loop.value) {
    const bool inside = std::abs(value.real()) <= kEdge && std::abs(value.imag()) <= kEdge;
    c.x.push_back(value.real());
    c.y.push_back(inside ? value.imag() : kGap);
  }
  c.at = loop.frequency_hz;
  return c;
}

void add_bode(report::Section& section, const std::string& title, const std::vector<Named>& responses,
              const std::string& caption) {
  report::Chart magnitude;
  magnitude.title = title + ": magnitude";
  magnitude.x_label = "frequency (Hz)";
  magnitude.y_label = "magnitude (dB, rad/s per Nm)";
  magnitude.log_x = true;
  magnitude.caption = caption;
  report::Chart phase = magnitude;
  phase.title = title + ": phase";
  phase.y_label = "phase (deg)";
  for (const auto& r : responses) {
    magnitude.curves.push_back(magnitude_curve(r.name, r.mark, r.response));
    phase.curves.push_back(phase_curve(r.name, r.mark, r.response, responses.front().response));
  }
  section.charts.push_back(std::move(magnitude));
  section.charts.push_back(std::move(phase));
}

}  // namespace resonid::reproduction::vi
