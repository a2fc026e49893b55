// SPDX-License-Identifier: MIT
#include "report/json/results.hpp"

namespace resonid::report {
namespace {

using identification::ModelValidation;

/// Where the lags of a correlation are not known: the file has none.
void describe_correlation(Fields& f, const Key& key, diagnostics::ResidualCorrelation& c) {
  f.object(key, !c.value.empty(), [&] {
    f({"correlation", "per lag"}, c.value);
    f({"largest", "magnitude over the judged lags"}, c.largest);
    f({"largest_lag", "where that is"}, c.largest_lag);
    f({"beyond_limit", "number of judged lags beyond the limit"}, c.beyond);
    f({"colour", "factor by which the limit is wider, residual and signal being coloured"}, c.colour);
  });
}

void describe_bands(Fields& f, ModelValidation& v) {
  f.list({"bands", "octaves down from half the sample rate"}, !v.bands.empty(), v.bands,
         [&](identification::ResidualBand& b) {
           f({"low_hz", "lower end", "Hz"}, b.low_hz);
           f({"high_hz", "upper end", "Hz"}, b.high_hz);
           f({"output_share", "share of the output's power"}, b.output_share);
           f({"residual_share", "share of the residual's power"}, b.residual_share);
           f({"left", "residual over output power there"}, b.residual_over_output);
         });
}

void describe_dependence(Fields& f, diagnostics::ResidualDependence& d) {
  f.object({"dependence", "dependence of the residual on the past of a signal"}, d.lags > 0, [&] {
    f({"on", "\"excitation\" or \"input\""}, d.on);
    f({"lags", "number of past samples"}, d.lags);
    f({"probability", "probability of so strong a dependence by chance"}, d.probability);
    f({"share", "share of the whitened residual's power that it explains beyond chance"}, d.share);
  });
}

void describe_maps(Fields& f, ModelValidation& v) {
  f.list({"static", "what looks like friction or a dead zone"}, !v.maps.empty(), v.maps,
         [&](diagnostics::StaticMap& m) {
           f({"over", "\"velocity\" or \"input\""}, m.over);
           f({"level", "mean of that signal per bin"}, m.level);
           f({"mean", "disturbance of the input per bin"}, m.mean);
           f({"std", "standard deviation per bin"}, m.std);
           f({"unit", "unit of mean and std"}, v.units.input);
           f({"probability", "probability of so large values by chance"}, m.probability);
           f({"share", "share of the whitened residual's power that they explain beyond chance"}, m.share);
         });
}

void describe_residual(Fields& f, ModelValidation& v) {
  auto& t = v.residual_test;
  std::vector<int> lags;
  const auto most = static_cast<int>(t.max_lag);
  for (int lag = -most; lag <= most && !f.reading(); ++lag) lags.push_back(lag);
  double practical = diagnostics::kPracticalCorrelation;
  f({"samples", "judged"}, t.samples);
  f({"mean", "mean of the residual"}, t.mean);
  f({"rms", "rms of the residual, mean removed"}, t.rms);
  f({"unit", "unit of mean and rms"}, v.units.velocity);
  f.unless(kUnknown, {"snr_db", "simulated output over residual, in power", "dB"}, t.snr_db);
  f({"limit", "exceeded by 3 % of the lags of an independent residual"}, t.limit);
  f({"practical_limit", "practical limit of a correlation"}, practical);
  f({"judged_lags", "from lag 1 on"}, t.judged_lags);
  f({"lags", "lags of all correlations"}, lags);
  if (f.reading()) t.max_lag = lags.size() / 2;
  f({"autocorrelation", "autocorrelation of the residual, per lag"}, t.self.value);
  describe_correlation(f, {"simulated", "correlation with the simulated output"}, t.with_simulated);
  describe_correlation(f, {"input", "correlation with the input"}, t.with_input);
  describe_correlation(f, {"excitation", "correlation with the excitation"}, t.with_excitation);
  describe_bands(f, v);
  describe_dependence(f, v.dependence);
  describe_maps(f, v);
}

void describe_response(Fields& f, ModelValidation& v) {
  const bool there = v.gap && !v.gap->distance.empty();
  f.object({"response", "distance of model and measured response"}, there, [&] {
    if (!v.gap) v.gap.emplace();
    auto& gap = *v.gap;
    f({"frequency_hz", "lines", "Hz"}, gap.frequency_hz);
    f({"distance", "chordal distance per line, 0 ... 1"}, gap.distance);
    const std::size_t at = there ? gap.largest() : 0;
    f.derived({"largest", "largest of them"}, there ? gap.distance[at] : 0.0);
    f.derived({"largest_hz", "where that is", "Hz"}, there ? gap.frequency_hz[at] : 0.0);
    f.unless_empty({"std", "standard deviation per line"}, gap.std);
    f({"error", "relative difference (rms over the lines) beyond the noise"}, v.response_error);
    f({"error_at_least", "lower 95 % confidence bound of the error"}, v.response_error_low);
    f({"probability", "probability of so large a difference at any line by noise alone"},
      v.response_probability);
    f({"worst_line_hz", "line that differs most in multiples of its noise", "Hz"}, v.worst_line_hz);
    f({"worst_line_error", "its difference over |G| beyond the noise"}, v.worst_line_error);
    if (f.reading())
      f.require(gap.distance.size() == gap.frequency_hz.size(), "distance",
                "as many numbers as frequency_hz has");
  });
}

}  // namespace

void describe(Fields& f, ModelValidation& v) {
  f.schema({"resonid.validation/1"});
  f({"model", "file of the model"}, v.candidate.source);
  f({"record", "recording that the model was validated on"}, v.record);
  f({"approach", "\"direct\": simulated from the input; \"indirect\": from the excitation, in closed loop"},
    v.approach);
  f.choice(
      {"verdict", "nothing speaks against the model; it lacks dynamics of the drive; it is not this drive"},
      v.verdict);
  f({"trusted", "not rejected, and nothing wrong with the recording"}, v.trusted);
  f({"simulation_fit_percent", "100 (1 - |y - yh|/|y - mean y|), simulated", "%"}, v.simulation_fit_percent);
  f({"prediction_fit_percent", "the same one step ahead", "%"}, v.prediction_fit_percent);
  f.object({"residual", "residual: output less simulation"}, [&] { describe_residual(f, v); });
  f({"findings", "what to know of model and recording"}, v.findings);
  f.unless(0.0, {"known_delay_s", "known delay in the measured output", "s", not_negative}, v.known_delay_s);
  f.object({"fit_in_band", "fit within a band of frequencies"}, v.fit_in_band_percent.has_value(), [&] {
    if (!v.fit_band_hz) v.fit_band_hz.emplace();
    if (!v.fit_in_band_percent) v.fit_in_band_percent.emplace();
    f({"low_hz", "lower end", "Hz"}, v.fit_band_hz->first);
    f({"high_hz", "upper end", "Hz"}, v.fit_band_hz->second);
    f({"fit_percent", "100 (1 - sqrt(residual/output power))", "%"}, *v.fit_in_band_percent);
  });
  f({"judged_from_hz", "most of the residual lies below, where nothing excites: what lies above is judged",
     "Hz"},
    v.judged_from_hz);
  f({"judged_fit_percent", "fit above judged_from_hz", "%"}, v.judged_fit_percent);
  f.object(
      {"judged_band", "band in which the model is judged; what lies outside is shown"}, v.judged.has_value(),
      [&] {
        if (!v.judged) v.judged.emplace();
        f({"low_hz", "lower end", "Hz"}, v.judged->low_hz);
        f({"high_hz", "upper end", "Hz"}, v.judged->high_hz);
        f({"of_model",
           "the band in which the model was identified; otherwise that of this recording's lines"},
          v.judged->of_model);
        f({"fit_percent", "100 (1 - sqrt(residual/output power)) within it", "%"}, v.judged->fit_percent);
        f({"residual_rms", "rms of the residual within it, in the unit of residual.rms"},
          v.judged->residual_rms);
      });
  f.unless(false, {"own_record", "the recording is the one that the model was fitted to"}, v.fitted_here);
  f({"expected_fit_percent", "fit with the residual of the model's own recording", "%"},
    v.expected_fit_percent);
  quantity(f, {"offset", "constant torque, estimated on this recording"}, v.offset, v.units.torque);
  quantity(f, {"coulomb_friction", "estimated on this recording again"}, v.coulomb_friction, v.units.torque);
  describe_response(f, v);
}

}  // namespace resonid::report
