// SPDX-License-Identifier: MIT
#include "report/json/results.hpp"

namespace resonid::report {
namespace {

using identification::Changes;

void describe_difference(Fields& f, identification::Difference& d) {
  f({"name", "quantity, \"stiffness\", \"resonance\""}, d.name);
  f({"unit", "unit of first, second, change and their std"}, d.unit);
  f({"first", "value of the first result"}, d.first.value);
  f.unless(0.0, {"first_std", "its standard deviation", "", not_negative}, d.first.std);
  f({"second", "value of the second result"}, d.second.value);
  f.unless(0.0, {"second_std", "its standard deviation", "", not_negative}, d.second.std);
  f({"change", "second less first"}, d.change);
  f({"std", "standard deviation of the change", "", not_negative}, d.std);
  f({"relative", "change over first"}, d.relative);
  f({"probability", "probability of a change at least so large by noise alone"}, d.probability);
  f({"significant", "judged over all differences together (Holm)"}, d.significant);
  f.object({"interval", "interval of the change, from repetitions of both experiments"},
           d.interval.has_value(), [&] {
             if (!d.interval) d.interval.emplace();
             f({"low", "lower end"}, d.interval->first);
             f({"high", "upper end"}, d.interval->second);
           });
}

void describe_differences(Fields& f, const Key& key, std::vector<identification::Difference>& list) {
  f.list(
      key, true, list, [&](identification::Difference& d) { describe_difference(f, d); }, Presence::required);
}

void describe_distance(Fields& f, Changes& c) {
  auto& gap = c.gap;
  const bool there = !gap.frequency_hz.empty();
  f.object({"response_distance", "distance of the measured responses, line by line"}, there, [&] {
    f({"frequency_hz", "lines", "Hz"}, gap.frequency_hz);
    f({"distance", "chordal distance per line, 0 ... 1"}, gap.distance);
    const std::size_t at = there ? gap.largest() : 0;
    f.derived({"largest", "largest of them"}, there ? gap.distance[at] : 0.0);
    f.derived({"largest_hz", "where that is", "Hz"}, there ? gap.frequency_hz[at] : 0.0);
    f({"weighted", "both were multiplied by a weight before"}, c.weighted);
    f({"significant", "more than noise makes"}, c.gap_significant);
    const bool known = f.only_if(!gap.std.empty(), {"std", "standard deviation per line"}, gap.std);
    f.with(known, {"noise", "rms distance that noise alone makes per line"}, gap.noise);
    f({"probability", "probability of the largest distance by noise alone, all lines counted"},
      c.gap_probability);
    if (f.reading())
      f.require(gap.distance.size() == gap.frequency_hz.size(), "distance",
                "as many numbers as frequency_hz has");
  });
}

void describe_model_gap(Fields& f, Changes& c) {
  f.object({"model_gap", "Vinnicombe's gap of the models"}, c.model_gap.has_value(), [&] {
    if (!c.model_gap) c.model_gap.emplace();
    f({"gap", "0 ... 1"}, c.model_gap->gap);
    f({"largest_distance", "over all frequencies"}, c.model_gap->largest_distance);
    f({"frequency_hz", "where that is", "Hz"}, c.model_gap->frequency_hz);
    f({"winding_number_condition", "whether it holds"}, c.model_gap->condition_holds);
    f({"std", "standard deviation of the gap", "", not_negative}, c.model_gap_std);
    auto& b = c.model_gap_bootstrap;
    f.object({"bootstrap", "the gap in repetitions of both experiments"}, b.has_value(), [&] {
      if (!b) b.emplace();
      f({"pairs", "pairs of repetitions"}, b->pairs);
      f({"low", "lower end at the confidence"}, b->low);
      f({"high", "upper end"}, b->high);
      f({"noise", "gap of two repetitions on one machine, not exceeded at the confidence"}, b->noise);
      f({"probability", "probability of a gap at least so large on one machine"}, b->probability);
    });
  });
}

}  // namespace

void describe(Fields& f, Changes& c) {
  f.schema({"resonid.comparison/1"});
  f.object({"first", "recording of the first result"}, [&] { describe_file(f, c.first); });
  f.object({"second", "recording of the second result"}, [&] { describe_file(f, c.second); });
  f({"confidence", "confidence of the verdict over all differences", "", positive}, c.confidence);
  f({"changed", "any difference is significant"}, c.changed);
  f({"trusted", "both results are, and they can be compared"}, c.trusted);
  describe_differences(f, {"resonances", "in pairs, ascending"}, c.resonances);
  describe_differences(f, {"parameters", "parameters of the models"}, c.parameters);
  describe_differences(f, {"margins", "margins of the loops"}, c.margins);
  f({"findings", "what cannot be compared"}, c.findings);
  describe_distance(f, c);
  describe_model_gap(f, c);
}

}  // namespace resonid::report
