// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <resonid/base/constants.hpp>

#include "report/pages/track_parts.hpp"

namespace resonid::report {
namespace {

using identification::Track;

constexpr std::size_t kMostLines = 6;

double decibel(double re, double im) { return 20.0 * std::log10(std::hypot(re, im)); }

/// Magnitudes of some of the lines over time.
Chart line_chart(const Track& track, const TrackAxis& time) {
  Chart chart;
  chart.title = "Magnitude at the lines";
  chart.x_label = time.label;
  chart.y_label = "Magnitude in dB";
  const std::size_t lines = track.lines.size() / 3;
  const std::size_t shown = std::min(lines, kMostLines);
  for (std::size_t n = 0; n < shown; ++n) {
    const std::size_t i = shown < 2 ? 0 : n * (lines - 1) / (shown - 1);
    const auto& re = track.lines[3 * i];
    const auto& im = track.lines[3 * i + 1];
    Curve curve;
    curve.name = re.name.substr(3) + " Hz";
    curve.x = time.x;
    for (std::size_t k = 0; k < re.value.size(); ++k) curve.y.push_back(decibel(re.value[k], im.value[k]));
    chart.curves.push_back(std::move(curve));
  }
  if (shown < lines) chart.caption = fmt::format("{} of {} lines.", shown, lines);
  chart.shapes = untrusted(track);
  return chart;
}

/// Magnitude of all lines over time, in colour. A line known worse than its magnitude is a gap.
std::optional<Chart> waterfall(const Track& track, const TrackAxis& time) {
  constexpr std::size_t kLeastLines = 4, kMostColumns = 240, kMostRows = 120;
  const std::size_t lines = track.lines.size() / 3, rows = time.x.size();
  if (lines < kLeastLines || rows < 2) return std::nullopt;
  HeatMap map;
  map.unit = "dB";
  const std::size_t columns = std::min(rows, kMostColumns), shown = std::min(lines, kMostRows);
  const auto row_of = [&](std::size_t c) { return columns > 1 ? c * (rows - 1) / (columns - 1) : 0; };
  for (std::size_t c = 0; c < columns; ++c) map.x.push_back(time.x[row_of(c)]);
  for (std::size_t n = 0; n < shown; ++n) {
    const std::size_t i = n * (lines - 1) / (shown - 1);
    const auto &re = track.lines[3 * i], &im = track.lines[3 * i + 1], &std = track.lines[3 * i + 2];
    map.y.push_back(std::strtod(re.name.c_str() + 3, nullptr));
    auto& level = map.value.emplace_back();
    for (std::size_t c = 0; c < columns; ++c) {
      const std::size_t k = row_of(c);
      const double size = std::hypot(re.value[k], im.value[k]);
      const bool known = !(k < std.value.size() && std.value[k] > size);
      level.push_back(known ? decibel(re.value[k], im.value[k]) : std::nan(""));
    }
  }
  Chart chart;
  chart.title = "Magnitude of the response over time";
  chart.x_label = time.label;
  chart.y_label = "Frequency in Hz";
  chart.caption =
      "Bright: much velocity for the torque, a resonance; dark: an anti-resonance. Where a line is not "
      "known, "
      "nothing is drawn.";
  chart.map = std::move(map);
  return chart;
}

/// Magnitude and phase over the frequency that a chirp passed.
std::vector<Chart> sweep_charts(const Track& track) {
  const auto& f = track.lines[0].value;
  const auto& re = track.lines[1].value;
  const auto& im = track.lines[2].value;
  const auto& std = track.lines[3].value;
  const double radius = std::sqrt(-std::log(1.0 - track.confidence));
  Curve magnitude, phase;
  magnitude.name = "magnitude";
  phase.name = "phase";
  const auto put = [&](std::size_t k) {
    if (!std::isfinite(re[k]) || (!magnitude.x.empty() && !(f[k] > magnitude.x.back()))) return;
    const double size = std::hypot(re[k], im[k]);
    magnitude.x.push_back(f[k]);
    magnitude.y.push_back(decibel(re[k], im[k]));
    const double off = std::isfinite(std[k]) ? radius * std[k] : HUGE_VAL;
    magnitude.lower.push_back(off < size ? 20.0 * std::log10(size - off) : std::nan(""));
    magnitude.upper.push_back(off < size ? 20.0 * std::log10(size + off) : std::nan(""));
    phase.x.push_back(f[k]);
    phase.y.push_back(std::atan2(im[k], re[k]) * 360.0 / kTwoPi);
  };
  const bool rising = f.size() > 1 && f.back() > f.front();
  for (std::size_t i = 0; i < f.size(); ++i) put(rising ? i : f.size() - 1 - i);
  Chart one{"Response along the chirp", "Frequency in Hz", "Magnitude in dB", true, false, {magnitude}, ""};
  Chart two{"Its phase", "Frequency in Hz", "Phase in degrees", true, false, {phase}, ""};
  return {one, two};
}

}  // namespace

std::vector<Shape> untrusted(const Track& track) {
  std::vector<Shape> shapes;
  const auto& trusted = track.trusted_rows;
  for (std::size_t i = 0; i < trusted.size();) {
    if (trusted[i]) {
      ++i;
      continue;
    }
    std::size_t end = i;
    while (end < trusted.size() && !trusted[end]) ++end;
    const double until = end < trusted.size() ? track.time_s[end] : track.time_s.back();
    shapes.push_back(
        {Shape::Kind::rectangle, "not trusted", track.time_s[i], -HUGE_VAL, 0.0, until, HUGE_VAL});
    i = end;
  }
  // Rows that change their minds all the time would hide the curves.
  constexpr std::size_t kMostStretches = 150;
  if (shapes.size() > kMostStretches) shapes.clear();
  return shapes;
}

Section track_response_section(const Track& track, const TrackAxis& time) {
  Section section;
  section.title = "Response";
  if (track.lines.empty()) return section;
  if (track.lines.front().name == "frequency_hz")
    section.charts = sweep_charts(track);
  else {
    if (auto map = waterfall(track, time)) section.charts.push_back(std::move(*map));
    section.charts.push_back(line_chart(track, time));
  }
  return section;
}

}  // namespace resonid::report
