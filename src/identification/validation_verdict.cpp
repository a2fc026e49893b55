// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <identification/validation_verdict.hpp>

namespace resonid::identification::detail {
namespace {

using diagnostics::Severity;

constexpr double kNoticeable = 0.1;
constexpr double kWorthless = 0.3;
constexpr double kHalf = 50.0;

struct Largest {
  double value = 0.0;
  const char* with = "";
  int lag = 0;
};

Largest largest_correlation(const diagnostics::ResidualTest& test, bool indirect) {
  Largest l;
  const auto take = [&](const diagnostics::ResidualCorrelation& c, const char* with) {
    if (c.value.empty() || c.largest <= l.value) return;
    l = {c.largest, with, c.largest_lag};
  };
  take(test.with_simulated, "simulated output");
  // Driven by the excitation, the input holds noise that feedback put there.
  if (!indirect) take(test.with_input, "input");
  take(test.with_excitation, "excitation");
  return l;
}

void inspect_correlation(ModelValidation& v, const Largest& l) {
  const auto& test = v.residual_test;
  if (l.value > diagnostics::kPracticalCorrelation)
    v.findings.push_back({"correlated-residual", Severity::warning, l.value,
                          diagnostics::kPracticalCorrelation,
                          fmt::format("What the model leaves follows the {} with a correlation of {:.2f} "
                                      "(lag {}), beyond the practical "
                                      "limit: it misses something of the drive.",
                                      l.with, l.value, l.lag)});
  else if (l.value > test.limit)
    v.findings.push_back(
        {"correlation-shows", Severity::info, l.value, test.limit,
         fmt::format(
             "The residual's correlation with the {} passes the limit of 3 % per lag. At {:.0f} dB of signal "
             "over residual even small errors of the true structure do: it decides nothing.",
             l.with, test.snr_db)});
}

/// One line that noise cannot explain.
bool line_differs(const ModelValidation& v) {
  constexpr double kImprobable = 1e-4;
  return v.response_probability.value_or(1.0) < kImprobable && v.worst_line_error.value_or(0.0) > kNoticeable;
}

void inspect_response(ModelValidation& v) {
  if (line_differs(v))
    v.findings.push_back({"response-differs", Severity::warning, v.worst_line_error, kNoticeable,
                          fmt::format("At {:.4g} Hz model and measured response differ by {:.0f} %, more "
                                      "than noise explains: there the "
                                      "drive is another, or has changed.",
                                      *v.worst_line_hz, 100.0 * *v.worst_line_error)});
  if (!v.response_error || *v.response_error <= kNoticeable) return;
  const bool bad = *v.response_error > kWorthless;
  v.findings.push_back(
      {"misfit", bad ? Severity::error : Severity::warning, *v.response_error, bad ? kWorthless : kNoticeable,
       fmt::format("Model and measured response differ by {:.0f} % (rms over the lines), beyond the "
                   "noise.",
                   100.0 * *v.response_error)});
}

}  // namespace

void judge(ModelValidation& v) {
  const auto l = largest_correlation(v.residual_test, v.approach == "indirect");
  inspect_correlation(v, l);
  inspect_response(v);
  const bool correlated = l.value > diagnostics::kPracticalCorrelation;
  if (v.simulation_fit_percent < kHalf)
    v.findings.push_back(
        correlated
            ? diagnostics::
                  Finding{"poor-fit", Severity::error, v.simulation_fit_percent, kHalf,
                          "The model reproduces less than half of the output, and what it leaves is no "
                          "noise: it is not the model of this drive at this operating point."}
            : diagnostics::Finding{
                  "noisy-record", Severity::warning, v.simulation_fit_percent, kHalf,
                  "Less than half of the output is reproduced, but what is left does not follow "
                  "the input: noise or disturbances, which say little for or against the model."});
  if (!v.candidate.trusted)
    v.findings.push_back({"untrusted-model",
                          Severity::warning,
                          {},
                          {},
                          "The result that the model comes from is not to be trusted itself."});
  if (!v.candidate.units_response.empty() && v.candidate.units_response != v.units.response)
    v.findings.push_back(
        {"different-units",
         Severity::error,
         {},
         {},
         fmt::format("The model is in {}, the record in {}.", v.candidate.units_response, v.units.response)});
  const auto error = [](const diagnostics::Finding& f) { return f.severity == Severity::error; };
  v.trusted = std::none_of(v.findings.begin(), v.findings.end(), error);
  const bool noticeable = correlated || line_differs(v) || v.response_error.value_or(0.0) > kNoticeable;
  const bool wrong = std::any_of(v.findings.begin(), v.findings.end(), [&](const diagnostics::Finding& f) {
    return error(f) && (f.id == "misfit" || f.id == "poor-fit" || f.id == "different-units");
  });
  v.verdict = wrong ? Verdict::rejected : noticeable ? Verdict::doubtful : Verdict::accepted;
}

}  // namespace resonid::identification::detail
