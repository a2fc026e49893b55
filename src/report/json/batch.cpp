// SPDX-License-Identifier: MIT
#include "report/json/results.hpp"

namespace resonid::report {
namespace {

void describe_spread(Fields& f, identification::Spread& s) {
  f({"name", "figure, \"stiffness\", \"resonance_hz\""}, s.name);
  f({"unit", "unit of value, std, mean and deviation"}, s.unit);
  f.list(
      {"values", "values of the recordings that have it"}, true, s.values,
      [&](identification::Spread::Value& v) {
        f({"record", "place in results, from 0"}, v.record);
        f({"value", "estimate"}, v.value);
        f({"std", "its standard deviation", "", not_negative}, v.std);
      },
      Presence::required);
  f({"mean", "weighted by inverse variances where all are known"}, s.mean);
  f({"std", "standard deviation of the weighted mean", "", not_negative}, s.std);
  f.only_if(s.values.size() > 1, {"deviation", "standard deviation over the recordings"}, s.deviation);
  const bool judged = s.probability.has_value();
  if (judged || !f.writing()) f({"chi_square", "sum ((x - mean)/std)^2"}, s.chi_square);
  f.only_if(judged, {"degrees_of_freedom", "degrees of freedom of chi_square"}, s.degrees);
  f({"probability", "probability of differences at least so large by the error bars alone"}, s.probability);
  f.only_if(judged, {"agrees", "judged over all figures together (Holm)"}, s.agrees);
}

void describe_joined(Fields& f, identification::JoinedRecord& r) {
  f({"file", "name of the recording's file"}, r.file);
  f({"own_estimate", "it says something of the parameters by itself"}, r.own_estimate);
  f({"agrees", "whether it agrees with the others, judged over all recordings together (Bonferroni)"},
    r.agrees);
  f({"chi_square", "squared distance of its parameters from the estimate of all others"}, r.chi_square);
  f.only_if(r.chi_square.has_value(), {"degrees_of_freedom", "degrees of freedom of chi_square"}, r.degrees);
  f({"probability", "probability of a distance at least so large by the error bars alone"}, r.probability);
  f({"response_chi_square", "squared distance of its lines from the averaged response, per degree"},
    r.response_chi_square);
  f({"fit_percent", "fit of the joint model, simulated on this recording", "%"}, r.fit_percent);
}

void describe_entry(Fields& f, identification::BatchEntry& entry) {
  f({"file", "name of the recording's file"}, entry.file);
  const bool failed = f.reading() ? f.holds("error") : !entry.result;
  f.one_of(2, failed ? 1 : 0, [&](std::size_t kind) {
    if (kind == 0) {
      if (!entry.result) entry.result.emplace();
      describe(f, *entry.result);
      return;
    }
    std::string text = f.writing() ? error_text(entry.error) : std::string();
    f({"error", "why there is no result"}, text);
    if (f.reading()) entry.error = Error{{}, text};
  });
}

}  // namespace

void describe(Fields& f, BatchResult& r) {
  f.schema({"resonid.identifications/1"});
  f({"confidence", "confidence of all intervals", "", positive}, r.batch.confidence);
  f.list(
      {"results", "results of the recordings in the order given"}, true, r.batch.entries,
      [&](identification::BatchEntry& entry) { describe_entry(f, entry); }, Presence::required);
  f.object({"table", "figures side by side"}, [&] {
    f.list(
        {"figures", "figures of the recordings that have them"}, true, r.batch.figures,
        [&](identification::Spread& s) { describe_spread(f, s); }, Presence::required);
  });
  f.object({"joint", "one estimate of all recordings"}, r.joint.has_value(), [&] {
    if (!r.joint) r.joint.emplace();
    f({"result", "the estimate"}, r.joint->result);
    f.list(
        {"records", "each against the others"}, true, r.joint->records,
        [&](identification::JoinedRecord& record) { describe_joined(f, record); }, Presence::required);
    f({"response_chi_square",
       "squared differences of the lines over their error bars, per degree of freedom"},
      r.joint->response_chi_square);
  });
  f.unless_empty({"join_error", "why there is no joint estimate although one was requested"}, r.join_error);
}

}  // namespace resonid::report
