// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "report/document/track_words.hpp"
#include "report/json/results.hpp"

namespace resonid::report {
namespace {

using identification::Track;
using identification::TrackSeries;

/// What "final" and "range" hold of a series.
struct Summary {
  SeriesSummary values;
  std::string unit;
};
using Summaries = std::map<std::string, Summary, std::less<>>;

std::vector<std::string> names_of(const Summaries& summaries) {
  std::vector<std::string> names;
  for (const auto& [name, summary] : summaries) names.push_back(name);
  return names;
}

Summaries summaries_of(const Track& track) {
  Summaries all;
  for (const auto* group : {&track.parameters, &track.figures})
    for (const TrackSeries& series : *group)
      if (const auto s = summary_of(track, series)) all[series.name] = {*s, series.unit};
  return all;
}

void describe_summaries(Fields& f, Summaries& all) {
  const auto names = names_of(all);
  f.map({"final", "parameters and figures of the last trusted row"}, names, [&](std::string_view name) {
    auto& s = all[std::string(name)];
    f({"value", "estimate", "unit"}, s.values.last);
    f({"std", "its standard deviation", "unit", not_negative}, s.values.last_deviation);
    f.unless_empty({"unit", "unit of value and std"}, s.unit);
  });
  f.map({"range", "over the trusted rows"}, names, [&](std::string_view name) {
    auto& s = all[std::string(name)].values;
    f({"least", "smallest value"}, s.least);
    f({"greatest", "largest value"}, s.greatest);
    f({"mean", "over the rows"}, s.mean);
  });
}

/// At most so many rows of a series, evenly spread.
template <class T>
std::vector<T> thinned(const std::vector<T>& values, std::size_t stride) {
  std::vector<T> some;
  for (std::size_t i = 0; i < values.size(); i += stride) some.push_back(values[i]);
  return some;
}

using Columns = std::map<std::string, std::vector<double>, std::less<>>;

Columns columns_of(const Track& track, std::size_t stride) {
  Columns columns;
  for (const auto* group : {&track.lines, &track.parameters, &track.figures})
    for (const TrackSeries& series : *group) {
      columns[series.name] = thinned(series.value, stride);
      if (!series.std.empty()) columns[series.name + "_std"] = thinned(series.std, stride);
    }
  return columns;
}

enum class Group { line, parameter, figure };

/// The group of a series by its name (identification::Track).
Group group_of(std::string_view name) {
  constexpr std::array<std::string_view, 4> kLine = {"frequency_hz", "real", "imag", "std"};
  constexpr std::array<std::string_view, 7> kFigures = {
      "resonance_hz", "antiresonance_hz", "crossover_hz", "phase_margin_deg", "modulus_margin",
      "gap",          "changed"};
  if (name.starts_with("re_") || name.starts_with("im_") || name.starts_with("std_") ||
      std::find(kLine.begin(), kLine.end(), name) != kLine.end())
    return Group::line;
  return std::find(kFigures.begin(), kFigures.end(), name) != kFigures.end() ? Group::figure
                                                                             : Group::parameter;
}

/// Columns of the file as series, with what the file says of all rows.
void update_track(Track& track, Columns& columns, const Summaries& summaries) {
  constexpr std::string_view kStd = "_std";
  for (auto& [name, values] : columns) {
    if (name.ends_with(kStd) && columns.contains(name.substr(0, name.size() - kStd.size()))) continue;
    TrackSeries series{name, {}, values, {}};
    if (const auto std = columns.find(name + std::string(kStd)); std != columns.end())
      series.std = std->second;
    if (const auto s = summaries.find(name); s != summaries.end()) {
      series.unit = s->second.unit;
    }
    const Group group = group_of(name);
    auto& list = group == Group::line     ? track.lines
                 : group == Group::figure ? track.figures
                                          : track.parameters;
    list.push_back(std::move(series));
  }
}

void describe_rows(Fields& f, Track& track, const Summaries& summaries) {
  const std::size_t stride = std::max<std::size_t>(1, (track.time_s.size() + kTrackRows - 1) / kTrackRows);
  auto time = thinned(track.time_s, stride), lag = thinned(track.lag_s, stride),
       position = thinned(track.position_m, stride), residual = thinned(track.residual, stride);
  auto trusted = thinned(track.trusted_rows, stride);
  auto columns = f.writing() ? columns_of(track, stride) : Columns();
  const bool left =
      std::any_of(track.residual.begin(), track.residual.end(), [](double r) { return std::isfinite(r); });
  Gaps times{time}, lags{lag}, positions{position}, residuals{residual};
  f.object({"over_time", "rows, evenly thinned; null where a row has none"}, [&] {
    f({"time_s", "time that the estimates describe, or of the newest sample", "s"}, times);
    f({"lag_s", "time of the newest sample less the one described", "s"}, lags);
    f({"trusted", "per row"}, trusted);
    f.only_if(!position.empty(), {"position_m", "position of the machine at time_s", "m"}, positions);
    f.only_if(left, {"residual_rms", "over the last stretch, in the output's unit"}, residuals);
    std::vector<std::string> names;
    for (const auto& [name, values] : columns) names.push_back(name);
    f.each(names, [&](const Key& key) {
      Gaps column{columns[std::string(key.name)]};
      f({key.name, "a parameter, figure or part of the response, with _std its standard deviation"}, column);
    });
  });
  if (!f.reading()) return;
  track.time_s = std::move(time);
  track.lag_s = std::move(lag);
  track.position_m = std::move(position);
  track.residual = std::move(residual);
  if (track.residual.empty()) track.residual.assign(track.time_s.size(), kUnknown);
  track.trusted_rows = std::move(trusted);
  const auto fits = [&](const std::vector<double>& rows) {
    return rows.empty() || rows.size() == track.time_s.size();
  };
  f.require(fits(track.lag_s) && fits(track.position_m) && fits(track.residual), "over_time",
            "as many rows of lag_s, position_m and residual_rms as of time_s");
  for (const auto& [name, values] : columns)
    f.require(values.size() == track.time_s.size(), "over_time", "as many rows of " + name + " as of time_s");
  f.require(track.trusted_rows.size() == track.time_s.size(), "over_time",
            "as many rows of trusted as of time_s");
  update_track(track, columns, summaries);
}

}  // namespace

void describe(Fields& f, Track& track) {
  f.schema({"resonid.track/1"});
  f({"record", "what was tracked"}, track.record);
  f({"method", "on-line estimator, \"iv\""}, track.method);
  f({"approach", "\"direct\", \"indirect\" or \"joint\""}, track.approach);
  f.unless_empty({"reason", "why it was chosen; absent: it was specified"}, track.reason);
  f.unless_empty({"start", "where the initial model came from; absent: the method needs none"}, track.start);
  f({"known_delay_s", "known delay in the measured output", "s", not_negative}, track.known_delay_s);
  f({"confidence", "confidence of all intervals", "", positive}, track.confidence);
  describe_units(f, track.units);
  f({"rows", "number of rows made"}, track.rows);
  const bool learned = track.learned_s > 0.0;
  f.unless(0.0, {"learned_s", "length of the learning stretch", "s", not_negative}, track.learned_s);
  if (!f.only_if(learned, {"causal", "no row depends on a later sample"}, track.causal) && f.reading())
    track.causal = false;  // earlier programs looked ahead
  f({"trusted", "no finding is an error"}, track.trusted);
  f.object({"trust", "shares of the rows that passed each gate, 0 ... 1"}, [&] {
    auto& s = track.shares;
    f({"excited", "there is excitation, of the rows after the start"}, s.excited);
    f({"converged", "the resonance has settled, of the excited rows"}, s.converged);
    f({"physical", "the parameters are physical, of the excited rows"}, s.physical);
    f({"residual", "the residual is what it was, of the excited rows"}, s.residual);
    f({"all", "every gate, of the rows after the start"}, s.all);
  });
  online::Change change = track.change.value_or(online::Change{});
  if (f.object({"change", "a lasting change of the watched figure; times from the first sample on"},
               track.change.has_value(),
               [&] {
                 f({"time_s", "when it began", "s"}, change.time_s);
                 f({"detected_s", "when it was certain", "s"}, change.detected_s);
                 f({"size", "new value less the usual one, in the figure's unit"}, change.size);
                 f({"size_std", "its standard deviation", "", not_negative}, change.size_std);
               }) &&
      f.reading())
    track.change = change;
  f({"findings", "what to know of recording and estimates"}, track.findings);
  auto summaries = f.writing() ? summaries_of(track) : Summaries();
  describe_summaries(f, summaries);
  describe_rows(f, track, summaries);
}

}  // namespace resonid::report
