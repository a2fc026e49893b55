// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <identification/criteria.hpp>
#include <identification/validate/verdict.hpp>

namespace resonid::identification::detail {
namespace {

using diagnostics::Severity;

struct Largest {
  double value = 0.0;
  const char* with = "";
  int lag = 0;
  double colour = 1.0;  ///< By which the limit per lag is wider, of coloured signals.
};

/// Of the output within the band, or above what drifts where nothing excites.
double judged_fit(const ModelValidation& v) {
  return v.judged ? v.judged->fit_percent : v.judged_fit_percent.value_or(v.simulation_fit_percent);
}

Largest largest_correlation(const ModelValidation& v) {
  const auto& test = v.residual_test;
  Largest l;
  const auto take = [&](const diagnostics::ResidualCorrelation& c, const char* with) {
    if (c.value.empty() || c.largest <= l.value) return;
    l = {c.largest, with, c.largest_lag, c.colour};
  };
  // Feedback puts the noise of this record into the input, and into what is simulated from it; what a filter
  // to a band makes of both looks like dependence.
  const bool driven = !test.with_excitation.value.empty();
  if (!(driven && v.in_loop && v.judged)) take(test.with_simulated, "simulated output");
  if (!(driven && v.in_loop && v.judged) && v.approach != "indirect") take(test.with_input, "input");
  take(test.with_excitation, "excitation");
  return l;
}

/// What speaks against a model: each figure beyond its limit, and beyond chance.
struct Evidence {
  Largest correlation;
  bool line_differs = false;    ///< One line that noise cannot explain.
  bool significant = false;     ///< That, or a residual that depends on what drives the machine.
  bool telling = true;          ///< Whether a correlation says anything of the model.
  double response_error = 0.0;  ///< At least.

  [[nodiscard]] bool correlated() const {
    return significant && telling && correlation.value > diagnostics::kPracticalCorrelation;
  }
  [[nodiscard]] bool misfit() const { return significant && response_error > kCriteria.noticeable_error; }
};

Evidence evidence_of(const ModelValidation& v) {
  Evidence e;
  e.correlation = largest_correlation(v);
  e.line_differs = v.response_probability.value_or(1.0) < kCriteria.improbable_line &&
                   v.worst_line_error.value_or(0.0) > kCriteria.noticeable_error;
  e.significant = e.line_differs || v.dependence.probability < kCriteria.chance;
  // Where friction and motion alone drive a record, what little is off of the friction adds up in the
  // simulated velocity: two slow signals, which always correlate.
  e.telling = !v.in_motion || judged_fit(v) < kCriteria.motion_fit;
  e.response_error = v.response_error_low.value_or(0.0);
  return e;
}

void inspect_correlation(ModelValidation& v, const Evidence& e) {
  const auto& test = v.residual_test;
  const auto& l = e.correlation;
  if (e.correlated())
    v.findings.push_back({"correlated-residual", Severity::warning, l.value,
                          diagnostics::kPracticalCorrelation,
                          fmt::format("The residual is correlated with the {} ({:.2f} at lag {}), beyond the "
                                      "practical limit: the drive has dynamics that the model lacks. "
                                      "Identify it with more masses, friction or lags.",
                                      l.with, l.value, l.lag)});
  else if (l.value > l.colour * test.limit)
    v.findings.push_back(
        {"correlation-shows", Severity::info, l.value, l.colour * test.limit,
         fmt::format("The residual's correlation with the {} exceeds the limit of 3 % per lag. With the "
                     "simulated output {:.0f} dB above the residual, even small errors of a model of the "
                     "right structure do that: it does not affect the verdict.",
                     l.with, test.snr_db)});
}

void inspect_response(ModelValidation& v, const Evidence& e) {
  if (e.line_differs)
    v.findings.push_back({"response-differs", Severity::warning, v.worst_line_error,
                          kCriteria.noticeable_error,
                          fmt::format("At {:.4g} Hz model and measured response differ by {:.0f} %, more "
                                      "than noise explains: the drive is different there, or has changed. "
                                      "Identify this recording and compare.",
                                      *v.worst_line_hz, 100.0 * *v.worst_line_error)});
  if (!e.misfit()) return;
  const bool bad = e.response_error > kCriteria.rejected_error;
  v.findings.push_back({"misfit", bad ? Severity::error : Severity::warning, e.response_error,
                        bad ? kCriteria.rejected_error : kCriteria.noticeable_error,
                        fmt::format("Model and measured response differ beyond the noise by {:.0f} % (rms "
                                    "over the lines), and by at least {:.0f} % with 95 % confidence. "
                                    "Identify this recording and compare.",
                                    100.0 * v.response_error.value_or(0.0), 100.0 * e.response_error)});
}

/// Much less is reproduced than the residual on the model's own record lets expect, and noise is not why.
bool fits_less_here(const ModelValidation& v, const Evidence& e) {
  // What is expected is of the whole output.
  return e.significant && !v.judged_fit_percent &&
         v.expected_fit_percent.value_or(-HUGE_VAL) > v.simulation_fit_percent + kCriteria.fit_points;
}

void inspect_fit(ModelValidation& v, const Evidence& e) {
  if (fits_less_here(v, e))
    v.findings.push_back(
        {"fits-less-here", Severity::warning, v.simulation_fit_percent, v.expected_fit_percent,
         fmt::format("Fit {:.0f} % (NRMSE) here; with the residual of the model's own recording it would be "
                     "{:.0f} %. The residual depends on the {}: the drive behaves differently here. Identify "
                     "this recording and compare.",
                     v.simulation_fit_percent, *v.expected_fit_percent, v.dependence.on)});
  const double fit = judged_fit(v);
  if (fit >= kCriteria.poor_fit) return;
  if (e.correlated() || e.misfit() || e.line_differs)
    v.findings.push_back(
        {"poor-fit", Severity::error, fit, kCriteria.poor_fit,
         "Fit below 50 % (NRMSE), and the residual is not noise: "
         "this is not the model of this drive at this operating point. Check columns, units and the "
         "model's file, or identify this recording."});
  else if (!e.significant)
    v.findings.push_back({"noisy-record", Severity::warning, fit, kCriteria.poor_fit,
                          "Fit below 50 % (NRMSE), but the residual is not correlated with the "
                          "input: it is noise or disturbances, which say little for or against the model. "
                          "Excite more strongly."});
}

void inspect_maps(ModelValidation& v) {
  for (const auto& map : v.maps) {
    if (map.probability > kCriteria.improbable_map || map.share < kCriteria.map_share) continue;
    const auto [low, high] = std::minmax_element(map.mean.begin(), map.mean.end());
    v.findings.push_back({"static-nonlinearity", Severity::warning, map.share, kCriteria.map_share,
                          fmt::format("A static function of the {} at the model's input ({:.3g} ... {:.3g} "
                                      "{} off a straight line) accounts for {:.0f} % of the residual: {}.",
                                      map.over, *low, *high, v.units.input, 100.0 * map.share,
                                      map.over == "velocity" ? "perhaps friction that is not viscous"
                                                             : "perhaps a dead zone or saturation")});
  }
}

}  // namespace

bool is_fed_back(const data::Record& record) {
  if (!record.excitation.present() || !record.input.present()) return false;
  const auto& u = record.input.samples;
  const auto& ru = record.excitation.samples;
  double apart = 0.0, all = 0.0;
  for (std::size_t k = 0; k < u.size(); ++k) {
    apart += (u[k] - ru[k]) * (u[k] - ru[k]);
    all += ru[k] * ru[k];
  }
  return apart > kCriteria.excitation_share * all;
}

bool speaks_of_response_alone(ModelValidation& v) {
  const bool grounded = (v.candidate.model && v.candidate.model->drive.grounded()) || !v.candidate.model;
  const bool fits = judged_fit(v) >= kCriteria.poor_fit;
  if (fits && grounded) std::erase_if(v.findings, [](const auto& f) { return f.id == "reversed"; });
  bool alone = v.in_motion;
  for (auto& f : v.findings) {
    if (f.severity != Severity::error) continue;
    const bool of_response = f.id == "feedback-bias" || f.id == "incoherent";
    const bool of_motion = v.in_motion && (of_response || f.id == "reversed" || f.id == "controller-differs");
    if (of_motion || (f.id == "spring-to-ground" && fits && grounded))
      f.severity = Severity::info;
    else if (of_response || (f.id == "controller-differs" && v.approach != "indirect"))
      f.severity = Severity::warning;
    alone = alone || of_response;
  }
  return alone;
}

void judge(ModelValidation& v) {
  const auto e = evidence_of(v);
  inspect_correlation(v, e);
  inspect_response(v, e);
  inspect_fit(v, e);
  inspect_maps(v);
  const bool known_bad = !v.candidate.trusted && v.fitted_here;
  if (!v.candidate.trusted)
    v.findings.push_back(
        {"untrusted-model",
         known_bad ? Severity::error : Severity::warning,
         {},
         {},
         known_bad ? "The result of this very recording is not reliable: mend what its own findings "
                     "name first."
                   : "The result that the model comes from is itself not reliable: mend what its own "
                     "findings name first."});
  if (!v.candidate.units_response.empty() && v.candidate.units_response != v.units.response)
    v.findings.push_back(
        {"different-units",
         Severity::error,
         {},
         {},
         fmt::format("The model is in {}, the recording in {}: give the same scales and units to both.",
                     v.candidate.units_response, v.units.response)});
  const auto is_error = [](const diagnostics::Finding& f) { return f.severity == Severity::error; };
  v.trusted = std::none_of(v.findings.begin(), v.findings.end(), is_error);
  const bool refitted = std::any_of(v.findings.begin(), v.findings.end(), [](const diagnostics::Finding& f) {
    return f.id == "parameters-differ";
  });
  const bool noticeable =
      known_bad || refitted || e.correlated() || e.line_differs || e.misfit() || fits_less_here(v, e);
  const bool wrong = std::any_of(v.findings.begin(), v.findings.end(), [&](const diagnostics::Finding& f) {
    return is_error(f) && (f.id == "misfit" || f.id == "poor-fit" || f.id == "different-units");
  });
  v.verdict = wrong ? Verdict::rejected : noticeable ? Verdict::doubtful : Verdict::accepted;
}

}  // namespace resonid::identification::detail
