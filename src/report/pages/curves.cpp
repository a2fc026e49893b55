// SPDX-License-Identifier: MIT
#include "report/pages/curves.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <resonid/base/constants.hpp>

#include "report/document/words.hpp"

namespace resonid::report {

Curve thinned(const std::string& name, std::span<const double> x, double start_s, double rate_hz,
              std::size_t bins) {
  Curve curve{name, Curve::Mark::line, {}, {}};
  const auto put = [&](std::size_t i) {
    const double time = start_s + static_cast<double>(i) / rate_hz;
    if (!curve.x.empty() && time <= curve.x.back()) return;
    curve.x.push_back(time);
    curve.y.push_back(x[i]);
  };
  if (x.size() <= 2 * bins) {
    for (std::size_t i = 0; i < x.size(); ++i) put(i);
    return curve;
  }
  for (std::size_t b = 0; b < bins; ++b) {
    const auto from = static_cast<std::ptrdiff_t>(b * x.size() / bins);
    const auto to = static_cast<std::ptrdiff_t>((b + 1) * x.size() / bins);
    auto [low, high] = std::minmax_element(x.begin() + from, x.begin() + to);
    if (high < low) std::swap(low, high);
    put(static_cast<std::size_t>(low - x.begin()));
    put(static_cast<std::size_t>(high - x.begin()));
  }
  return curve;
}

Curve level_db(const std::string& name, const data::FrequencyResponse& g, Curve::Mark mark) {
  Curve curve{name, mark, g.frequency_hz, {}};
  for (const auto& value : g.value) curve.y.push_back(20.0 * std::log10(std::abs(value)));
  return curve;
}

Curve phase_deg(const std::string& name, const data::FrequencyResponse& g, Curve::Mark mark) {
  Curve curve{name, mark, g.frequency_hz, {}};
  double last = 0.0;
  for (const auto& value : g.value) {
    double degrees = std::arg(value) * 360.0 / kTwoPi;
    degrees += 360.0 * std::round((last - degrees) / 360.0);
    curve.y.push_back(last = degrees);
  }
  return curve;
}

bool determined(const data::FrequencyResponse& g, std::size_t line) {
  constexpr double kMostError = 0.5, kLeastCoherence = 0.3;
  if (g.coherence.size() == g.lines() && g.coherence[line] < kLeastCoherence) return false;
  return g.std.size() != g.lines() || g.std[line] < kMostError * std::abs(g.value[line]);
}

namespace {

/// The lines of a response for which `wanted` holds.
template <class Wanted>
data::FrequencyResponse lines_of(const data::FrequencyResponse& g, Wanted&& wanted) {
  data::FrequencyResponse out;
  for (std::size_t i = 0; i < g.lines(); ++i) {
    if (!wanted(i)) continue;
    out.frequency_hz.push_back(g.frequency_hz[i]);
    out.value.push_back(g.value[i]);
  }
  return out;
}

}  // namespace

BodeCharts::BodeCharts() {
  magnitude.title = "Magnitude";
  magnitude.y_label = "Magnitude in dB";
  phase.title = "Phase";
  phase.y_label = "Phase in degrees";
  for (Chart* chart : {&magnitude, &phase}) {
    chart->x_label = "Frequency in Hz";
    chart->log_x = true;
  }
}

void BodeCharts::add_measured(const std::string& name, const data::FrequencyResponse& g, Curve::Mark mark) {
  const auto good = lines_of(g, [&](std::size_t i) { return determined(g, i); });
  const auto poor = lines_of(g, [&](std::size_t i) { return !determined(g, i); });
  if (good.lines() == 0) return add_model(name, g);
  magnitude.curves.push_back(level_db(name, good, mark));
  phase.curves.push_back(phase_deg(name, good, mark));
  if (poor.lines() == 0) return;
  magnitude.curves.push_back(level_db(name + ", hardly excited", poor, Curve::Mark::faint));
}

void BodeCharts::add_model(const std::string& name, const data::FrequencyResponse& g) {
  magnitude.curves.push_back(level_db(name, g, Curve::Mark::dashed));
  phase.curves.push_back(phase_deg(name, g, Curve::Mark::dashed));
}

Curve nyquist_curve(const std::string& name, const data::FrequencyResponse& loop, Curve::Mark mark) {
  Curve curve{name, mark, {}, {}, {}};
  constexpr double kFar = 4.0;  // beyond it nothing is shown
  for (std::size_t i = 0; i < loop.lines(); ++i) {
    const bool near = std::abs(loop.value[i]) < kFar;
    curve.x.push_back(near ? loop.value[i].real() : std::nan(""));
    curve.y.push_back(near ? loop.value[i].imag() : std::nan(""));
    curve.at.push_back(loop.frequency_hz[i]);
  }
  return curve;
}

Chart nyquist_plane(const std::string& title) {
  Chart chart{title, "Real part of L", "Imaginary part of L", false, true, {}, ""};
  Shape unit;
  unit.kind = Shape::Kind::circle;
  unit.name = "unit circle |L| = 1";
  unit.radius = 1.0;
  Shape critical;
  critical.kind = Shape::Kind::cross;
  critical.name = "the point -1";
  critical.x = -1.0;
  chart.shapes = {unit, critical};
  chart.x_range = AxisRange{-2.0, 2.0};
  chart.y_range = AxisRange{-2.0, 2.0};
  return chart;
}

std::string base_name(const std::string& path) {
  const auto slash = path.find_last_of("/\\");
  return slash == std::string::npos || slash + 1 == path.size() ? path : path.substr(slash + 1);
}

Card estimate_card(const std::string& name, double value, double half_width, const std::string& unit,
                   double confidence, std::vector<std::string> under) {
  const std::string text = with_error(value, half_width);
  const auto sign = text.find(" +- ");
  Card card{name, text.substr(0, sign), unit, std::move(under)};
  if (sign != std::string::npos)
    card.under.insert(card.under.begin(),
                      fmt::format("+- {} at {:.0f} %", text.substr(sign + 4), 100.0 * confidence));
  return card;
}

Curve power_curve(const std::string& name, const response::PowerSpectrum& spectrum, Curve::Mark mark) {
  Curve curve{name, mark, {}, {}};
  for (std::size_t i = 1; i < spectrum.power.size(); ++i) {
    if (!(spectrum.power[i] > 0.0)) continue;
    curve.x.push_back(spectrum.frequency_hz[i]);
    curve.y.push_back(10.0 * std::log10(spectrum.power[i]));
  }
  return curve;
}

}  // namespace resonid::report
