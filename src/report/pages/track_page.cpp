// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <resonid/base/constants.hpp>
#include <resonid/report/detail/track.hpp>

#include "report/document/document_cells.hpp"
#include "report/document/track_words.hpp"
#include "report/document/words.hpp"
#include "report/pages/curves.hpp"
#include "report/pages/track_parts.hpp"

namespace resonid::report {
namespace {

using identification::Track;
using identification::TrackSeries;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::size_t kLeastRows = 8;  // of a passage

bool moves(const Track& track) {
  if (track.position_m.size() < 2) return false;
  const auto [low, high] = std::minmax_element(track.position_m.begin(), track.position_m.end());
  return *high - *low > 1e-3 * std::max(std::abs(*low), std::abs(*high));
}

std::string label(const TrackSeries& series) { return quantity_words(series.name, series.unit); }

/// The rows that a curve over `axis` runs through, passage by passage: all of them over time; over a position
/// those that are trusted and go on in its direction, until it has turned back by a twentieth of its range.
std::vector<std::vector<std::size_t>> passages(const Track& track, const TrackAxis& axis) {
  std::vector<std::vector<std::size_t>> list(1);
  if (axis.time) {
    for (std::size_t i = 0; i < axis.x.size(); ++i) list[0].push_back(i);
    return list;
  }
  constexpr double kTurn = 0.05;
  const auto [low, high] = std::minmax_element(axis.x.begin(), axis.x.end());
  const double turn = kTurn * (*high - *low);
  double direction = 0.0;
  for (std::size_t i = 0; i < axis.x.size(); ++i) {
    if (!track.trusted_rows[i]) continue;
    if (!list.back().empty()) {
      const double step = axis.x[i] - axis.x[list.back().back()];
      if (direction == 0.0) direction = step;
      if (direction * step <= 0.0) {
        if (std::abs(step) < turn) continue;
        list.emplace_back();
        direction = step;
      }
    }
    list.back().push_back(i);
  }
  std::erase_if(list, [](const auto& rows) { return rows.size() < kLeastRows; });
  return list;
}

/// In ascending x, as charts want it; a machine that goes back and forth gives several curves.
std::vector<Curve> curves_of(const Track& track, const TrackSeries& series, const TrackAxis& axis, double z) {
  std::vector<Curve> curves;
  const bool band = !series.std.empty();
  for (auto& rows : passages(track, axis)) {
    if (!axis.time && axis.x[rows.front()] > axis.x[rows.back()]) std::reverse(rows.begin(), rows.end());
    Curve& c = curves.emplace_back();
    c.name = label(series);
    for (const std::size_t i : rows) {
      c.x.push_back(axis.x[i]);
      c.y.push_back(series.value[i]);
      if (!band) continue;
      c.lower.push_back(series.value[i] - z * series.std[i]);
      c.upper.push_back(series.value[i] + z * series.std[i]);
    }
  }
  for (std::size_t n = 0; n < curves.size() && curves.size() > 1; ++n)
    curves[n].name += fmt::format(", passage {}", n + 1);
  return curves;
}

/// What the trusted rows need, with room for their bands, up to a quarter of the values' own span; the start
/// and single wide bands would else flatten everything.
std::optional<AxisRange> range_of(const Track& track, const std::vector<const TrackSeries*>& list, double z) {
  double low = kInfinity, high = -kInfinity, band_low = kInfinity, band_high = -kInfinity;
  std::size_t count = 0;
  for (const auto* series : list)
    for (std::size_t i = 0; i < series->value.size(); ++i) {
      const double value = series->value[i];
      if (!track.trusted_rows[i] || !std::isfinite(value)) continue;
      const double half = series->std.empty() || !std::isfinite(series->std[i]) ? 0.0 : z * series->std[i];
      low = std::min(low, value);
      high = std::max(high, value);
      band_low = std::min(band_low, value - half);
      band_high = std::max(band_high, value + half);
      ++count;
    }
  if (count < 10 || !(band_high > band_low)) return std::nullopt;
  if (const double most = 0.25 * (high - low); most > 1e-3 * std::abs(high)) {
    band_low = std::max(band_low, low - most);
    band_high = std::min(band_high, high + most);
  }
  const double room = std::max(0.1 * (band_high - band_low), 1e-3 * std::abs(band_high));
  // A frequency or an inertia is not negative, whatever its error bar.
  const double least = low >= 0.0 ? std::max(band_low - room, 0.0) : band_low - room;
  return AxisRange{least, band_high + room};
}

Chart chart_of(const Track& track, std::string title, const std::string& unit,
               const std::vector<const TrackSeries*>& list, const TrackAxis& axis) {
  const double z = two_sided_quantile(track.confidence);
  Chart chart;
  chart.title = std::move(title);
  chart.x_label = axis.label;
  chart.y_label = unit;
  for (const auto* series : list) {
    auto curves = curves_of(track, *series, axis, z);
    std::move(curves.begin(), curves.end(), std::back_inserter(chart.curves));
  }
  chart.y_range = range_of(track, list, z);
  if (axis.time) chart.shapes = untrusted(track);
  return chart;
}

std::string with_unit(const TrackSeries& series) {
  return series.unit.empty() ? label(series) : fmt::format("{} in {}", label(series), series.unit);
}

bool known(const TrackSeries* series) {
  return series != nullptr &&
         std::any_of(series->value.begin(), series->value.end(), [](double v) { return std::isfinite(v); });
}

Section resonance_section(const Track& track, const TrackAxis& time, const TrackAxis& along) {
  Section section;
  section.title = "Resonance";
  std::vector<const TrackSeries*> list;
  for (const char* name : {"resonance_hz", "antiresonance_hz"})
    if (known(track.find(name))) list.push_back(track.find(name));
  if (list.empty()) return section;
  const std::string caption =
      fmt::format("Shaded around a curve: {:.0f} % confidence interval.", 100.0 * track.confidence);
  section.charts.push_back(chart_of(track, "Over time", "Frequency in Hz", list, time));
  if (!along.time) section.charts.push_back(chart_of(track, "Over position", "Frequency in Hz", list, along));
  for (Chart& chart : section.charts) chart.caption = caption;
  return section;
}

Section parameter_section(const Track& track, const TrackAxis& time, const TrackAxis& along) {
  Section section;
  section.title = "Parameters";
  const bool physical = known(track.find("stiffness"));
  if (physical) {
    for (const auto& series : track.parameters)
      if (known(&series))
        section.charts.push_back(chart_of(track, label(series), with_unit(series), {&series},
                                          series.name == "torque_offset" ? time : along));
    return section;
  }
  for (const char* letter : {"b", "a"}) {
    std::vector<const TrackSeries*> list;
    for (const auto& series : track.parameters)
      if (series.name.starts_with(letter) && known(&series)) list.push_back(&series);
    if (list.empty()) continue;
    section.charts.push_back(chart_of(track, fmt::format("Coefficients {}", letter), "", list, along));
    section.text = {"Coefficients of y(k) = -a1 y(k-1) - ... + b1 u(k-1) + ..., without the known delay."};
  }
  return section;
}

/// Publication VI's on-line Nyquist plot: the loop along the record, with the regions that it is read in.
Chart nyquist(const Track& track) {
  Chart chart;
  chart.title = "Nyquist curve of the loop along the recording";
  chart.x_label = "real part";
  chart.y_label = "imaginary part";
  chart.equal_axes = true;
  chart.x_range = AxisRange{-1.5, 1.5};
  chart.y_range = AxisRange{-1.5, 1.0};
  chart.shapes = {
      {Shape::Kind::rectangle, "region I: crossover and margins are read here", -1.0, -1.0, 0.0, 0.0, 0.0},
      {Shape::Kind::rectangle, "region II: anti-resonance and resonance are read here", 0.0, -1.0, 0.0, 1.0,
       0.0},
      {Shape::Kind::circle, "unit circle", 0.0, 0.0, 1.0},
      {Shape::Kind::cross, "the point -1", -1.0, 0.0}};
  if (const auto* margin = track.find("modulus_margin"))
    if (const auto s = summary_of(track, *margin))
      chart.shapes.push_back({Shape::Kind::circle, "modulus margin, at the end", -1.0, 0.0, s->last});
  if (track.baseline_loop)
    chart.curves.push_back(nyquist_curve("baseline", *track.baseline_loop, Curve::Mark::dashed));
  for (const auto& snapshot : track.loop)
    chart.curves.push_back(nyquist_curve(fmt::format("at {:.4g} s", snapshot.time_s), snapshot.curve));
  chart.caption =
      "L = C G with its delay, as estimated at these times. The phase margin is the angle at the crossing of "
      "the unit circle; the circle around -1 touches the curve where it comes closest.";
  return chart;
}

Section loop_section(const Track& track, const TrackAxis& axis) {
  Section section;
  section.title = "Loop and its margins";
  for (const char* name : {"crossover_hz", "phase_margin_deg", "modulus_margin"})
    if (const auto* series = track.find(name); known(series))
      section.charts.push_back(chart_of(track, label(*series), with_unit(*series), {series}, axis));
  if (!track.loop.empty()) section.charts.push_back(nyquist(track));
  return section;
}

Section gap_section(const Track& track, const TrackAxis& axis) {
  Section section;
  section.title = "Distance from the baseline";
  const auto* gap = track.find("gap");
  if (!known(gap)) return section;
  section.text = {
      "Largest chordal distance over frequency between this response and the baseline's, each times the "
      "controller where it is known: 0 the same, 1 as different as can be."};
  section.charts.push_back(chart_of(track, "Gap", "gap", {gap}, axis));
  return section;
}

std::string percent(double share) { return fmt::format("{:.0f} %", 100.0 * share); }

Section trust_section(const Track& track, const TrackAxis& time) {
  Section section;
  section.title = "Trust";
  const auto& s = track.shares;
  section.plain_tables.push_back(
      {"Rows after the start that passed",
       {"gate", "share", "what it asks"},
       {{"excitation", percent(s.excited),
         "excitation around the resonance at least a tenth of the strongest so far"},
        {"converged", percent(s.converged), "converged: known well enough, and no longer moving"},
        {"physical", percent(s.physical), "stable; inertia, stiffness and damping above 0"},
        {"residual", percent(s.residual), "not above three times its usual rms"},
        {"all", percent(s.all), ""}}});
  Chart residual{"Residual", time.label, "rms in " + track.units.velocity, false, false, {}, ""};
  residual.curves.push_back(
      {"residual, rms over the last stretch", Curve::Mark::line, time.x, track.residual});
  residual.shapes = untrusted(track);
  const auto finite = [](double v) { return std::isfinite(v); };
  if (std::any_of(track.residual.begin(), track.residual.end(), finite))
    section.charts.push_back(std::move(residual));
  Chart lag{"Age of the estimate",
            time.label,
            "Lag in s",
            false,
            false,
            {},
            "The time axes are already corrected for it."};
  lag.curves.push_back({"lag", Curve::Mark::line, time.x, track.lag_s});
  if (std::any_of(track.lag_s.begin(), track.lag_s.end(), [](double v) { return v > 0.0; }))
    section.charts.push_back(std::move(lag));
  return section;
}

Table final_table(const Track& track) {
  Table table{"Last valid estimates", {"quantity", "value", "minimum", "maximum", "unit"}, {}};
  const double z = two_sided_quantile(track.confidence);
  for (const auto* group : {&track.figures, &track.parameters})
    for (const auto& series : *group) {
      const auto s = summary_of(track, series);
      if (!s) continue;
      table.rows.push_back({label(series), with_error(s->last, z * s->last_deviation.value_or(0.0)),
                            number_text(s->least), number_text(s->greatest), series.unit});
    }
  return table;
}

Section signal_section(const Track& track, const data::Record& record) {
  Section section;
  section.title = "Input and output";
  const auto add = [&](const char* name, const data::Channel& channel) {
    if (!channel.present()) return;
    Chart chart;
    chart.title = name;
    chart.x_label = "Time in s";
    chart.y_label = channel.unit.empty() ? channel.name : fmt::format("{} in {}", channel.name, channel.unit);
    chart.curves = {thinned(channel.name, channel.samples, record.start_time_s, record.sample_rate_hz)};
    chart.shapes = untrusted(track);
    section.charts.push_back(std::move(chart));
  };
  add("Excitation", record.excitation);
  add("Input", record.input);
  add("Output", record.output);
  return section;
}

std::vector<Card> cards_of(const Track& track) {
  const double z = two_sided_quantile(track.confidence);
  std::vector<Card> cards;
  const auto last = [&](const char* series, const char* name) {
    const auto* found = track.find(series);
    const auto s = found == nullptr ? std::nullopt : summary_of(track, *found);
    if (s)
      cards.push_back(estimate_card(name, s->last, z * s->last_deviation.value_or(0.0), found->unit,
                                    track.confidence,
                                    {fmt::format("{:.4g} ... {:.4g}", s->least, s->greatest)}));
  };
  const auto extreme = [&](const char* series, const char* name, bool least) {
    const auto* found = track.find(series);
    const auto s = found == nullptr ? std::nullopt : summary_of(track, *found);
    if (s)
      cards.push_back({name,
                       fmt::format("{:.3g}", least ? s->least : s->greatest),
                       found->unit,
                       {least ? "minimum along the recording" : "maximum along the recording"}});
  };
  last("antiresonance_hz", "Anti-resonance, at the end");
  last("resonance_hz", "Resonance, at the end");
  extreme("phase_margin_deg", "Phase margin", true);
  extreme("modulus_margin", "Modulus margin", true);
  extreme("gap", "Gap to the baseline", false);
  last("stiffness", "Stiffness, at the end");
  if (cards.size() > 5) cards.resize(5);
  cards.push_back({"Estimates valid",
                   fmt::format("{:.0f}", 100.0 * track.shares.all),
                   "%",
                   {"of the rows after the start"}});
  return cards;
}

Badge badge_of(const Track& track) {
  const auto errors = std::count_if(track.findings.begin(), track.findings.end(),
                                    [](const auto& f) { return f.severity == diagnostics::Severity::error; });
  if (!track.trusted)
    return {false, "Not trusted", errors > 0 ? fmt::format("{} error{}", errors, errors > 1 ? "s" : "") : ""};
  return {true, "Trusted", fmt::format("estimates valid in {:.0f} % of the rows", 100.0 * track.shares.all)};
}

Document page_of(const Track& track, const data::Record* record) {
  Document document;
  document.kind = "tracking";
  document.title = fmt::format("{}, tracked by {}", base_name(track.record.file), track.method);
  document.facts = {fmt::format("{} samples", track.record.samples),
                    fmt::format("{:g} Hz", track.record.sample_rate_hz), track.approach + " approach",
                    fmt::format("{} rows", track.rows)};
  document.summary = track_sentences(track);
  document.badge = badge_of(track);
  document.cards = cards_of(track);
  document.findings = track.findings;
  if (!track.reason.empty())
    document.summary.push_back(fmt::format("{} was chosen: {}.", track.method, track.reason));
  if (!track.start.empty()) document.summary.push_back("Initial model: " + track.start + ".");
  const TrackAxis time{"Time in s", track.time_s, true};
  const TrackAxis along = moves(track) ? TrackAxis{"Position in m", track.position_m, false} : time;
  Section values{"Values", {}, {}, {}, {final_table(track)}};
  Section resonance = resonance_section(track, time, along);
  resonance.sheet = values.sheet = true;
  std::vector<Section> sections{std::move(resonance),
                                track_response_section(track, time),
                                loop_section(track, time),
                                values,
                                parameter_section(track, time, along),
                                gap_section(track, time)};
  if (record != nullptr) sections.push_back(signal_section(track, *record));
  sections.push_back(trust_section(track, time));
  for (auto& section : sections)
    if (!section.charts.empty() || !section.plain_tables.empty())
      document.sections.push_back(std::move(section));
  return document;
}

}  // namespace

Document track_document(const Track& track) { return page_of(track, nullptr); }
Document track_document(const Track& track, const data::Record& record) { return page_of(track, &record); }

}  // namespace resonid::report
