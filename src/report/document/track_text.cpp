// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <resonid/report/detail/track.hpp>

#include "report/document/track_words.hpp"
#include "report/document/words.hpp"

namespace resonid::report {
namespace {

using identification::Track;
using identification::TrackSeries;

std::string line_of(const Track& track, const TrackSeries& series, double z) {
  const auto s = summary_of(track, series);
  if (!s) return "";
  const std::string unit = series.unit.empty() ? "" : " " + unit_words(series.unit);
  return fmt::format("  {:<18} {}{}   ({:.4g} ... {:.4g})\n", quantity_words(series.name, series.unit),
                     with_error(s->last, z * s->last_deviation.value_or(0.0)), unit, s->least, s->greatest);
}

}  // namespace

std::optional<SeriesSummary> summary_of(const Track& track, const TrackSeries& series) {
  const bool any =
      std::find(track.trusted_rows.begin(), track.trusted_rows.end(), true) != track.trusted_rows.end();
  SeriesSummary s;
  std::size_t count = 0;
  for (std::size_t i = 0; i < series.value.size(); ++i) {
    const double v = series.value[i];
    if (!std::isfinite(v) || (any && !track.trusted_rows[i])) continue;
    if (count++ == 0) s.first = s.least = s.greatest = v;
    s.last = v;
    s.least = std::min(s.least, v);
    s.greatest = std::max(s.greatest, v);
    s.mean += (v - s.mean) / static_cast<double>(count);
    s.last_deviation.reset();
    if (!series.std.empty() && std::isfinite(series.std[i])) s.last_deviation = series.std[i];
  }
  return count == 0 ? std::nullopt : std::optional(s);
}

std::vector<std::string> track_sentences(const Track& track) {
  std::vector<std::string> list;
  if (!(track.shares.all > 0.0))
    list.emplace_back("No estimate is valid: what follows are the last values, not a result.");
  const double z = two_sided_quantile(track.confidence);
  const auto* resonance = track.find("resonance_hz");
  const auto s = resonance == nullptr ? std::nullopt : summary_of(track, *resonance);
  if (s) {
    const double half = z * s->last_deviation.value_or(0.0);
    const double moved = s->greatest - s->least;
    std::string text = fmt::format("The resonance is {} Hz at the end", with_error(s->last, half));
    text +=
        moved > std::max(4.0 * half, 0.005 * s->last)
            ? fmt::format("; start {:.4g} Hz, range {:.4g} ... {:.4g} Hz.", s->first, s->least, s->greatest)
            : std::string("; it stayed there.");
    list.push_back(text);
  } else {
    list.emplace_back("No resonance was found.");
  }
  const auto last_of = [&](const char* name) {
    const auto* series = track.find(name);
    return series == nullptr ? std::nullopt : summary_of(track, *series);
  };
  if (const auto margin = last_of("modulus_margin")) {
    const auto phase = last_of("phase_margin_deg");
    list.push_back(fmt::format("Minimum distance to -1 (modulus margin) {:.2f}, Ms {:.2f}{}.", margin->least,
                               1.0 / margin->least,
                               phase ? fmt::format("; smallest phase margin {:.1f} deg", phase->least) : ""));
  }
  if (const auto gap = last_of("gap"))
    list.push_back(fmt::format("The gap to the baseline is {:.3g} at the end, {:.3g} at most.", gap->last,
                               gap->greatest));
  list.push_back(
      fmt::format("Estimates valid in {:.0f} % of the rows after the start.", 100.0 * track.shares.all));
  return list;
}

std::string track_text(const Track& track) {
  const auto& r = track.record;
  std::string text = fmt::format("{}: {} samples at {:g} Hz\n", r.file, r.samples, r.sample_rate_hz);
  text += fmt::format("  input {}, output {}", r.input, r.output);
  if (!r.excitation.empty()) text += fmt::format(", excitation {}", r.excitation);
  text += fmt::format("\n  tracked by {}, {} approach, {} rows\n", track.method, track.approach, track.rows);
  if (!track.reason.empty()) text += wrapped("chosen: " + track.reason, "  ", "    ") + "\n";
  if (!track.start.empty()) text += "  initial model: " + track.start + "\n";
  text += track.causal ? fmt::format("  rows begin after {:.3g} s of learning\n", track.learned_s)
                       : std::string("  learned from the whole recording: rows use later samples\n");
  text += "\n";
  for (const auto& sentence : track_sentences(track)) text += wrapped(sentence, "", "") + "\n";
  const double z = two_sided_quantile(track.confidence);
  text +=
      track.shares.all > 0.0
          ? fmt::format(
                "\nLast valid estimates, {:.0f} % confidence intervals (and the range over the valid rows)\n",
                100.0 * track.confidence)
          : fmt::format("\nLast row, {:.0f} % confidence intervals (and the range); no estimate is valid\n",
                        100.0 * track.confidence);
  for (const auto* group : {&track.figures, &track.parameters})
    for (const TrackSeries& series : *group) text += line_of(track, series, z);
  text += findings_text(track.findings);
  text +=
      track.trusted ? "\nTrusted.\n" : "\nNOT trusted: the result is not reliable; see the errors above.\n";
  return text;
}

}  // namespace resonid::report
