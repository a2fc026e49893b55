// SPDX-License-Identifier: MIT
#include <algorithm>

#include "report/json/results.hpp"

namespace resonid::report {
namespace {

using identification::CheckedFigure;
using identification::TuningCheck;

/// Complex values per line as two lists, and their standard deviation.
void describe_lines(Fields& f, const Key& key, std::vector<std::complex<double>>& value,
                    std::vector<double>& std, std::size_t lines) {
  std::vector<double> real, imag;
  for (const auto& v : value) {
    real.push_back(v.real());
    imag.push_back(v.imag());
  }
  f.object(key, [&] {
    f({"real", "real part per line"}, real);
    f({"imag", "imaginary part per line"}, imag);
    f({"std", "total standard deviation of the complex value per line", "", not_negative}, std);
    const bool same = real.size() == lines && imag.size() == lines && std.size() == lines;
    f.require(same, "real", "as many numbers, as imag and std too, as frequency_hz has");
    if (!f.reading() || !same) return;
    value.clear();
    for (std::size_t i = 0; i < lines; ++i) value.emplace_back(real[i], imag[i]);
  });
}

void describe_estimate(Fields& f, const Key& key, data::Estimate& e) {
  f.object(key, [&] {
    f({"value", "estimate", "unit"}, e.value);
    f.unless(kUnknown, {"std", "its standard deviation", "unit", not_negative}, e.std);
  });
}

void describe_given_estimate(Fields& f, const Key& key, std::optional<data::Estimate>& e) {
  f.object(key, e.has_value(), [&] {
    if (!e) e.emplace();
    f({"value", "estimate", key.unit}, e->value);
    f.unless(kUnknown, {"std", "its standard deviation, of promise and recording", key.unit, not_negative},
             e->std);
  });
}

void describe_checked(Fields& f, CheckedFigure& figure) {
  f({"name", "name of the figure, \"phase_margin_deg\""}, figure.name);
  f.unless_empty({"unit", "unit of its numbers"}, figure.unit);
  describe_estimate(f, {"predicted", "by the design"}, figure.predicted);
  describe_estimate(f, {"measured", "under the controller"}, figure.measured);
  f({"probability", "of so large a difference by noise alone", "", not_negative}, figure.probability);
}

}  // namespace

void describe(Fields& f, TuningCheck& check) {
  f({"record", "the recording"}, check.record);
  f({"agrees", "nothing differs by more than both error bars"}, check.agrees);
  f.unless(true, {"decided", "false where the recording is not good enough to tell; absent: it is"},
           check.decided);
  f.unless_empty({"cause", "likely cause, where it does not"}, check.cause);
  f({"probability", "of so large a difference of L at any line by noise", "", not_negative},
    check.probability);
  f({"worst_line_hz", "line that differs most surely; 0: none by more than matters", "Hz", not_negative},
    check.worst_line_hz);
  f({"judged_lines", "lines near the margins, which were judged"}, check.judged_lines);
  describe_given_estimate(f, {"gain_change", "of the loop against what was promised, a part of it"},
                          check.gain_change);
  describe_given_estimate(f, {"delay_change_s", "of the loop against what was promised", "s"},
                          check.delay_change_s);
  f({"detectable_gain", "least change of the gain that 90 % of such recordings would show", "", not_negative},
    check.detectable_gain);
  f({"detectable_delay_s", "least change of the delay that they would show", "s", not_negative},
    check.detectable_delay_s);
  f.list(
      {"figures", "margins, predicted and measured"}, true, check.figures,
      [&](CheckedFigure& figure) { describe_checked(f, figure); }, Presence::required);
  f({"frequency_hz", "lines", "Hz"}, check.frequency_hz);
  const std::size_t lines = check.frequency_hz.size();
  describe_lines(f, {"predicted", "L of the design per line"}, check.predicted, check.predicted_std, lines);
  describe_lines(f, {"measured", "L of the recording per line"}, check.measured, check.measured_std, lines);
}

}  // namespace resonid::report
