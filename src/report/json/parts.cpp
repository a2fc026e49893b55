// SPDX-License-Identifier: MIT
#include "report/json/parts.hpp"

#include <algorithm>

namespace resonid::report {

void describe(Fields& f, diagnostics::Finding& finding) {
  f({"id", "stable name, \"low-coherence\""}, finding.id);
  f.choice({"severity", "how much it matters: an error means that the result is not reliable"},
           finding.severity, Presence::assumed);
  f({"value", "what was measured"}, finding.value);
  f({"threshold", "value that it is compared with"}, finding.threshold);
  f({"meaning", "in one or two sentences"}, finding.meaning);
  f.unless(false, {"follows", "whether it only follows from what another finding tells: texts leave it out"},
           finding.follows);
}

void describe(Fields& f, diagnostics::Crossover& crossover) {
  f({"frequency_hz", "frequency of a downward crossing of |L| = 1", "Hz", positive}, crossover.frequency_hz);
  f({"phase_margin_deg", "180 deg + arg L there", "deg"}, crossover.phase_margin_deg);
}

void describe(Fields& f, data::FrequencyResponse& g) {
  std::vector<double> real, imag;
  for (const auto& value : g.value) {
    real.push_back(value.real());
    imag.push_back(value.imag());
  }
  f({"frequency_hz", "lines, ascending", "Hz"}, g.frequency_hz);
  f({"real", "real part per line, in units.response"}, real);
  f({"imag", "imaginary part per line"}, imag);
  f.unless_empty(
      {"std", "total standard deviation of the complex value per line, std^2 = E|error|^2", "", not_negative},
      g.std);
  f.unless_empty(
      {"coherence", "per line, between input and output, or excitation and output", "", not_negative},
      g.coherence);
  f.unless_empty({"unsettled_hz", "lines at which the estimate had not settled", "Hz"}, g.unsettled_hz);
  if (!f.reading()) return;
  const auto& hz = g.frequency_hz;
  const std::string same = "as many numbers as frequency_hz has, " + std::to_string(hz.size());
  f.require(real.size() == hz.size(), "real", same);
  f.require(imag.size() == hz.size(), "imag", same);
  f.require(g.std.empty() || g.std.size() == hz.size(), "std", same);
  f.require(g.coherence.empty() || g.coherence.size() == hz.size(), "coherence", same);
  f.require(
      std::adjacent_find(hz.begin(), hz.end(), [](double a, double b) { return !(a < b); }) == hz.end() &&
          (hz.empty() || hz.front() >= 0.0),
      "frequency_hz", "ascending frequencies >= 0");
  g.value.clear();
  for (std::size_t i = 0; i < std::min({hz.size(), real.size(), imag.size()}); ++i)
    g.value.emplace_back(real[i], imag[i]);
}

void describe(Fields& f, data::TransferFunction& g) {
  f({"numerator", "b0, b1 ... in powers of z^-1"}, g.numerator);
  f({"denominator", "a0, a1 ... in powers of z^-1"}, g.denominator);
  f({"sample_time_s", "sample time of the sampled system", "s", positive}, g.sample_time_s);
}

void describe_file(Fields& f, identification::RecordFacts& record) {
  f({"file", "name of the recording's file"}, record.file);
  f({"samples", "used, after cutting"}, record.samples);
  f({"sample_rate_hz", "sample rate of the recording", "Hz", positive}, record.sample_rate_hz);
}

void describe(Fields& f, identification::RecordFacts& record) {
  describe_file(f, record);
  f.choice({"output_quantity", "what the output is"}, record.output_quantity, Presence::assumed);
  f.object({"signals", "columns of the file by what they were taken for"}, [&] {
    f({"input", "torque, force or what stands for it"}, record.input);
    f({"output", "velocity, position or acceleration of the driven side"}, record.output);
    f.unless_empty({"time", "time stamps"}, record.time);
    f.unless_empty({"excitation", "what was added to the controller's output"}, record.excitation);
    f.unless_empty({"reference", "reference of the loop"}, record.reference);
  });
  f.unless_empty({"reading", "what was told from the file, assumed and converted, a sentence each"},
                 record.reading);
}

void describe_units(Fields& f, identification::Units& units) {
  const Key key{"units", "units of the signals and of the response"};
  const bool there = f.object(
      key, true,
      [&] {
        f({"input", "unit of the input, \"Nm\""}, units.input);
        f({"velocity", "unit of the velocity that responses refer to, \"rad/s\""}, units.velocity);
        f({"response", "unit of the response, \"(rad/s)/Nm\""}, units.response);
      },
      Presence::assumed);
  if (!f.reading() || !there) return;
  units.torque = units.input;
  units.physical =
      (units.input == "Nm" && units.velocity == "rad/s") || (units.input == "N" && units.velocity == "m/s");
}

bool quantity(Fields& f, const Key& key, data::Estimate& estimate, std::string& unit, bool there,
              Presence presence) {
  return f.object(
      {key.name, key.meaning}, there,
      [&] {
        f({"value", "estimate", "unit", key.range}, estimate.value);
        f.unless(kUnknown, {"std", "its standard deviation", "unit", not_negative}, estimate.std);
        f.assumed({"unit", "unit of value and std"}, unit);
      },
      presence);
}

void quantity(Fields& f, const Key& key, std::optional<data::Estimate>& estimate, std::string& unit) {
  data::Estimate read;
  if (quantity(f, key, estimate ? *estimate : read, unit, estimate.has_value()) && f.reading())
    estimate = read;
}

}  // namespace resonid::report
