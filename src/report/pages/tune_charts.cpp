// SPDX-License-Identifier: MIT
#include "report/pages/tune_charts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <resonid/base/constants.hpp>

#include "report/document/tune_words.hpp"
#include "report/pages/curves.hpp"

namespace resonid::report {
namespace {

using design::TradeOff;
using identification::Band;
using identification::LoopCurves;
using identification::TunedController;
using identification::Tuning;

/// What of the running controller a picture shows.
enum class Running { always, alike };

/// The controllers that pictures show: the proposed one with its bands, and the running one.
std::vector<std::pair<std::string, const TunedController*>> drawn_controllers(const Tuning& t,
                                                                              Running running) {
  std::vector<std::pair<std::string, const TunedController*>> list = {
      {t.is_evaluation() ? "given: " + t.proposed().name : t.proposed().name, &t.proposed()}};
  if (t.running && (running == Running::always || are_alike(*t.running, t.proposed())))
    list.emplace_back("running controller", &*t.running);
  return list;
}

/// Whether a frequency lies on the axis that the chart's first curve has; times all do.
bool is_shown(const Chart& chart, double x) {
  if (!chart.log_x || chart.curves.empty()) return true;
  return x >= chart.curves.front().x.front() && x <= chart.curves.front().x.back();
}

/// A curve with its band, all of it through a function that grows; nothing where lengths differ.
template <class Function>
void put_band(Chart& chart, const std::string& name, bool first, const std::vector<double>& x,
              const Band& band, Function&& shown) {
  if (x.empty() || band.value.size() != x.size()) return;
  Curve curve{name, first ? Curve::Mark::line : Curve::Mark::dashed, {}, {}};
  const bool both = first && band.low.size() == x.size() && band.high.size() == x.size();
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (!is_shown(chart, x[i])) continue;
    curve.x.push_back(x[i]);
    curve.y.push_back(shown(band.value[i]));
    if (!both) continue;
    curve.lower.push_back(shown(band.low[i]));
    curve.upper.push_back(shown(band.high[i]));
  }
  if (!curve.x.empty()) chart.curves.push_back(std::move(curve));
}

constexpr auto kAsIs = [](double v) { return v; };
constexpr auto kDecibel = [](double v) { return 20.0 * std::log10(v); };

/// |S| or another size of each controller, which `band_of` gives, and the bound on it.
template <class BandOf>
Chart peak_chart(const Tuning& t, const char* title, const char* figure, BandOf&& band_of,
                 Running running = Running::always) {
  Chart chart;
  chart.title = title;
  chart.x_label = "Frequency in Hz";
  const std::string unit = unit_of_figure(t.proposed(), figure);
  chart.y_label = "Magnitude" + (unit.empty() ? "" : " in " + unit);
  chart.log_x = true;
  bool first = true;
  for (const auto& [name, c] : drawn_controllers(t, running)) {
    put_band(chart, name, first, c->curves.frequency_hz, band_of(*c), kAsIs);
    first = false;
  }
  if (chart.curves.empty()) return chart;
  const auto& figures = t.proposed().figures;
  const auto found =
      std::find_if(figures.begin(), figures.end(), [&](const auto& f) { return f.name == figure; });
  if (found == figures.end() || !found->bound || !std::isfinite(*found->bound)) return chart;
  const auto& x = chart.curves.front().x;
  chart.curves.push_back({"bound " + three_digits(*found->bound),
                          Curve::Mark::line,
                          {x.front(), x.back()},
                          {*found->bound, *found->bound}});
  return chart;
}

/// A curve of each controller as it is.
auto curve_of(Band LoopCurves::*band) {
  return [band](const TunedController& c) -> const Band& { return c.curves.*band; };
}

/// |S| times |C|, or |T| over it. No machine changes C: what lies between bounds of the one lies between
/// those of the other times the same factor.
Band times_controller(const TunedController& c, Band band, bool over) {
  const auto& f = c.curves.frequency_hz;
  if (c.feedback.denominator.empty() || band.value.size() != f.size()) return {};
  for (std::size_t i = 0; i < f.size(); ++i) {
    const double size = std::abs(c.feedback.response(f[i]));
    for (auto* values : {&band.value, &band.low, &band.high})
      if (i < values->size())
        (*values)[i] *= over ? (size > 0.0 ? 1.0 / size : std::numeric_limits<double>::quiet_NaN()) : size;
  }
  return band;
}

/// Around L, 95 % of what the covariance leaves in the plane: a closed line, then a gap.
void put_ellipse(const LoopCurves::Ellipse& e, Curve& curve) {
  constexpr double kFar = 3.0;  // beyond it no loop is judged
  const double a = e.covariance(0, 0), b = e.covariance(0, 1), c = e.covariance(1, 1);
  const double middle = 0.5 * (a + c), half = std::hypot(0.5 * (a - c), b);
  if (!std::isfinite(middle) || !(middle > 0.0) || std::abs(e.value) > kFar) return;
  const double radius = std::sqrt(-2.0 * std::log(0.05));
  const double major = radius * std::sqrt(middle + half),
               minor = radius * std::sqrt(std::max(0.0, middle - half)),
               turn = 0.5 * std::atan2(2.0 * b, a - c);
  constexpr int kPoints = 48;
  for (int k = 0; k <= kPoints; ++k) {
    const double at = kTwoPi * k / kPoints;
    const auto point =
        e.value + std::polar(1.0, turn) * std::complex<double>(major * std::cos(at), minor * std::sin(at));
    curve.x.push_back(point.real());
    curve.y.push_back(point.imag());
    curve.at.push_back(e.frequency_hz);
  }
  for (auto* list : {&curve.x, &curve.y, &curve.at}) list->push_back(std::nan(""));
}

Chart nyquist_chart(const Tuning& t) {
  Chart chart = nyquist_plane("Nyquist curve of L = C G, every delay included");
  for (const auto& [name, c] : drawn_controllers(t, Running::always)) {
    if (c->curves.loop.empty() || c->curves.loop.size() != c->curves.frequency_hz.size()) continue;
    data::FrequencyResponse loop;
    loop.frequency_hz = c->curves.frequency_hz;
    loop.value = c->curves.loop;
    chart.curves.push_back(
        nyquist_curve(name, loop, c == &t.proposed() ? Curve::Mark::line : Curve::Mark::dashed));
  }
  if (chart.curves.empty()) return chart;
  Curve ellipses{"95 % of the machines at key frequencies", Curve::Mark::line, {}, {}, {}};
  for (const auto& e : t.proposed().curves.ellipses) put_ellipse(e, ellipses);
  if (!ellipses.x.empty()) chart.curves.push_back(std::move(ellipses));
  Shape circle;
  circle.kind = Shape::Kind::circle;
  circle.name = fmt::format("|S| = {}: no loop may enter", three_digits(t.options.largest_sensitivity));
  circle.x = -1.0;
  circle.radius = 1.0 / t.options.largest_sensitivity;
  chart.shapes.insert(chart.shapes.begin(), std::move(circle));  // the first region is red
  return chart;
}

/// Ends a curve over time there: what was followed for a shorter time has settled to a thousandth, and stays.
void end_at(Curve& curve, double end_s, bool settles) {
  const auto shown =
      static_cast<std::size_t>(std::upper_bound(curve.x.begin(), curve.x.end(), end_s) - curve.x.begin());
  const bool ends_later = shown < curve.x.size();
  for (auto* list : {&curve.x, &curve.y, &curve.lower, &curve.upper})
    if (list->size() > shown) list->resize(shown);
  if (!settles || ends_later || curve.x.empty() || curve.x.back() >= end_s) return;
  curve.x.push_back(end_s);
  for (auto* list : {&curve.y, &curve.lower, &curve.upper})
    if (!list->empty()) list->push_back(list->back());
}

/// A step of all controllers, for the longest time that one takes; a running one that is far slower does not
/// make the proposed one a flank.
Chart step_chart(const Tuning& t, std::string title, std::string y_label, Band LoopCurves::*band) {
  constexpr double kLongest = 4.0;  // of the time that the proposed one takes
  Chart chart;
  chart.title = std::move(title);
  chart.x_label = "Time in s";
  chart.y_label = std::move(y_label);
  const auto drawn = drawn_controllers(t, Running::alike);
  const auto last_of = [](const TunedController& c) {
    return c.curves.time_s.empty() ? 0.0 : c.curves.time_s.back();
  };
  double end_s = 0.0;
  for (const auto& [name, c] : drawn) end_s = std::max(end_s, last_of(*c));
  if (const double first = last_of(t.proposed()); first > 0.0) end_s = std::min(end_s, kLongest * first);
  bool first = true;
  for (const auto& [name, c] : drawn) {
    const std::size_t before = chart.curves.size();
    put_band(chart, name, first, c->curves.time_s, c->curves.*band, kAsIs);
    if (chart.curves.size() > before) end_at(chart.curves.back(), end_s, c->stable);
    first = false;
  }
  return chart;
}

/// What a velocity adds up to: "rad" of "rad/s".
std::string place_unit(const std::string& velocity) {
  return velocity.ends_with("/s") ? velocity.substr(0, velocity.size() - 2) : velocity + " s";
}

void put_chart(Section& s, Chart chart) {
  if (!chart.curves.empty()) s.charts.push_back(std::move(chart));
}

void put_left_out(const Tuning& t, Section& s) {
  if (auto text = left_out_sentence(t); !s.charts.empty() && !text.empty()) s.text.push_back(std::move(text));
}

std::vector<Chart> trade_off_pair(const std::vector<TradeOff>& list, double bound, double TradeOff::*of,
                                  const char* symbol, const std::string& ki_unit,
                                  const std::string& iae_unit) {
  std::vector<const TradeOff*> points;
  for (const auto& point : list)
    if (std::isfinite(point.*of)) points.push_back(&point);
  if (points.size() < 2) return {};
  std::sort(points.begin(), points.end(),
            [&](const TradeOff* a, const TradeOff* b) { return a->*of < b->*of; });
  const auto* here = *std::min_element(points.begin(), points.end(), [&](const auto* a, const auto* b) {
    return std::abs(a->*of - bound) < std::abs(b->*of - bound);
  });
  const auto chart = [&](const std::string& title, const std::string& y_label, double TradeOff::*y) {
    Chart c;
    c.title = title;
    c.x_label = fmt::format("Bound on {}", symbol);
    c.y_label = y_label;
    Curve curve{"best PI", Curve::Mark::line, {}, {}};
    for (const auto* point : points) {
      curve.x.push_back(point->*of);
      curve.y.push_back(point->*y);
    }
    c.curves = {std::move(curve)};
    if (std::abs(here->*of - bound) <= 0.02 * bound)
      c.curves.push_back({"bound of this design", Curve::Mark::points, {here->*of}, {here->*y}});
    return c;
  };
  return {chart(fmt::format("Integral gain over the bound on {}", symbol),
                ki_unit.empty() ? "ki" : "ki in " + ki_unit, &TradeOff::ki),
          chart(fmt::format("Error of the load over the bound on {}", symbol),
                "IAE of the load step" + (iae_unit.empty() ? "" : " in " + iae_unit), &TradeOff::iae)};
}

}  // namespace

Section sensitivity_section(const Tuning& t) {
  Section s;
  s.title = "Sensitivity, and what the load does";
  s.sheet = true;
  s.side_by_side = true;
  put_chart(s, peak_chart(t, "Sensitivity |S|", "sensitivity_peak", curve_of(&LoopCurves::sensitivity)));
  const char* title = t.proposed().position_gain ? "From the reference to the load's position, |T_position|"
                                                 : "From the reference to the load, |T_load|";
  put_chart(s, peak_chart(t, title, "load_peak", curve_of(&LoopCurves::load_transfer), Running::alike));
  if (!s.charts.empty())
    s.text = {
        t.by_response
            ? "Bands are the error bars (95 %) of the measured response, line by line; the curves are those "
              "of the response as it was measured."
            : "Bands hold 95 % of the machines that the identification leaves possible, line by line; the "
              "curves are those of " +
                  machine_words(t) + "."};
  put_left_out(t, s);
  return s;
}

Section loop_section(const Tuning& t) {
  Section s;
  s.title = "Loop";
  s.side_by_side = true;
  BodeCharts bode;
  bode.magnitude.title = "Open loop L: magnitude";
  bode.phase.title = "Open loop L: phase, every delay included";
  bool first = true;
  for (const auto& [name, c] : drawn_controllers(t, Running::always)) {
    put_band(bode.magnitude, name, first, c->curves.frequency_hz, c->curves.loop_size, kDecibel);
    put_band(bode.phase, name, first, c->curves.frequency_hz, c->curves.loop_phase_deg, kAsIs);
    first = false;
  }
  put_chart(s, bode.magnitude);
  put_chart(s, bode.phase);
  put_chart(s, peak_chart(t, "Complementary sensitivity |T|", "complementary_peak",
                          curve_of(&LoopCurves::complementary)));
  put_chart(s, peak_chart(t, "From noise of the velocity to the torque, |C S|", "controller_sensitivity_peak",
                          [](const TunedController& c) {
                            return times_controller(c, c.curves.sensitivity, false);
                          }));
  put_chart(s, peak_chart(t, "From a torque to the measured velocity, |S G|", "process_sensitivity_peak",
                          [](const TunedController& c) {
                            return times_controller(c, c.curves.complementary, true);
                          }));
  put_chart(s, nyquist_chart(t));
  return s;
}

Section step_section(const Tuning& t) {
  Section s;
  s.title = "Steps";
  s.sheet = true;
  const auto& u = t.units;
  const bool position = t.proposed().position_gain.has_value();
  const std::string unit = position ? place_unit(u.velocity) : u.velocity;
  const std::string y_label = (position ? "Position of the load in " : "Velocity of the load in ") + unit;
  put_chart(s, step_chart(t, fmt::format("Load after a torque step of 1 {} on it", u.input), y_label,
                          &LoopCurves::load_by_torque));
  put_chart(s, step_chart(
                   t, fmt::format("Load after a reference step of {:.4g} {}", t.options.reference_step, unit),
                   y_label, &LoopCurves::load_by_reference));
  s.side_by_side = true;
  if (position && !s.charts.empty())
    s.text.push_back(
        "The curves are of the load. Peak, IAE and IE of the load step are those of the measured position, "
        "which comes back to where it was; as long as the torque stays, the load stands off by torque over "
        "stiffness.");
  put_left_out(t, s);
  return s;
}

Section torque_section(const Tuning& t) {
  Section s;
  s.title = "What it asks of the drive";
  put_chart(s, step_chart(t, "Torque after the reference step", "Torque in " + t.units.input,
                          &LoopCurves::torque_by_reference));
  return s;
}

std::vector<Chart> trade_off_charts(const Tuning& t) {
  const auto unit = gain_units(t.units.input, t.units.velocity).ki;
  // The best PI is one of velocity, whatever was proposed.
  const std::string iae_unit = t.running ? unit_of_figure(*t.running, "load_step_iae") : "";
  auto charts = trade_off_pair(t.over_sensitivity, t.options.largest_sensitivity, &TradeOff::sensitivity,
                               "|S|", unit, iae_unit);
  for (auto& chart : trade_off_pair(t.over_load_transfer, t.options.largest_load_transfer,
                                    &TradeOff::load_transfer, "|T_load|", unit, iae_unit))
    charts.push_back(std::move(chart));
  return charts;
}

}  // namespace resonid::report
