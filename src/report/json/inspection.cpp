// SPDX-License-Identifier: MIT
#include <resonid/report/detail/inspection.hpp>
#include <utility>

#include "report/json/passes.hpp"
#include "report/json/results.hpp"

namespace resonid::report {
namespace {

void describe_recording(Fields& f, identification::Inspection& r) {
  f.object({"record", "what was read"}, [&] { describe(f, r.record); });
  f.choice({"motion", "whether the machine turns or slides"}, r.motion, Presence::required);
  f({"duration_s", "length", "s", positive}, r.duration_s);
  const bool measured =
      f.object({"sampling", "how evenly the samples lie in time"}, r.sampling.measured, [&] {
        f({"jitter_rms_s", "deviation of the stamps from their grid, rms", "s", not_negative},
          r.sampling.jitter_rms_s);
        f({"gaps", "intervals longer than 1.5 sample times"}, r.sampling.gaps);
        f({"largest_gap_s", "longest of them", "s", not_negative}, r.sampling.largest_gap_s);
      });
  if (f.reading()) r.sampling.measured = measured;
  f.list(
      {"signals", "what the signals look like"}, true, r.signals,
      [&](identification::SignalFacts& s) {
        f({"role", "input, output, excitation, reference or position"}, s.role);
        f({"name", "column"}, s.name);
        f({"unit", "after conversion"}, s.unit);
        f({"least", "smallest value", "unit"}, s.least);
        f({"greatest", "largest value", "unit"}, s.greatest);
        f({"rms", "about the mean", "unit", not_negative}, s.rms);
        f.unless(0.0, {"step", "resolution, where it is coarse", "unit", positive}, s.step);
        f({"drift", "mean of the last tenth less that of the first", "unit"}, s.drift);
      },
      Presence::required);
  f.object({"excitation", "how the machine was excited"}, [&] {
    f({"kind", "chirp, multisine, prbs, stepped-sine or other"}, r.excitation);
    f({"because", "why"}, r.excitation_because);
    f({"signal", "column that tells"}, r.exciting);
    f({"low_hz", "lower end of the excited band", "Hz", not_negative}, r.low_hz);
    f({"high_hz", "upper end", "Hz", positive}, r.high_hz);
    f({"rms", "of the exciting signal about its mean, in its unit", "", not_negative}, r.strength);
  });
  f.choice({"loop", "whether a controller returns the output's noise"}, r.loop, Presence::required);
  f({"feedback_probability", "of so much of that by chance"}, r.feedback_probability);
  f({"findings", "what to know of the recording"}, r.findings);
}

}  // namespace

void describe(Fields& f, FileInspection& i) {
  f.schema({"resonid.inspection/1"});
  f({"file", "name of the file"}, i.file);
  f({"rows", "rows of samples"}, i.rows);
  f.unless_empty({"reading", "how the file was read, a phrase each"}, i.reading);
  f.list(
      {"columns", "all of the file that hold numbers"}, true, i.columns,
      [&](FileInspection::Column& c) {
        f({"name", "as the file has it"}, c.name);
        f.unless_empty({"unit", "of a row of units or in the name"}, c.unit);
        f.unless_empty({"guess", "what it seems to hold"}, c.guess);
        f({"missing", "cells without a number"}, c.missing);
        f({"least", "smallest value"}, c.least);
        f({"greatest", "largest value"}, c.greatest);
      },
      Presence::required);
  f.unless_empty({"obstacle", "why no recording could be made of it"}, i.obstacle);
  auto recording = i.recording.value_or(identification::Inspection{});
  if (f.object({"recording", "what the recording holds"}, i.recording.has_value(),
               [&] { describe_recording(f, recording); }) &&
      f.reading())
    i.recording = std::move(recording);
  f({"command", "to go on with"}, i.command);
}

}  // namespace resonid::report
