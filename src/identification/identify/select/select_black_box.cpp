// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <identification/identify/select/band_record.hpp>
#include <identification/identify/select/select_black_box.hpp>
#include <resonid/fit/detail/order_selection.hpp>

namespace resonid::identification::detail {
namespace {

std::string name_of_order(int order) { return fmt::format("black-box of order {}", order); }

StructureTrial listed(const fit::OrderTrial& t, const fit::OrderSelection& selected) {
  StructureTrial trial;
  trial.name = name_of_order(t.order);
  trial.parameters = static_cast<std::size_t>(2 * t.order - (t.integrator ? 1 : 0) + (t.direct_term ? 1 : 0));
  trial.bic = t.bic;
  trial.holdout_fit_percent = t.fit_percent;
  trial.holdout_score = t.holdout_score(selected.holdout);
  trial.chosen = t.order == selected.order;
  if (!t.converged)
    trial.remark = "did not converge";
  else if (!t.stable)
    trial.remark = "unstable";
  return trial;
}

std::vector<Choice> choices_of(const BlackBoxSelection& s, const fit::OrderSelection& selected, bool asked) {
  std::vector<Choice> choices;
  std::string why = "lowest order that predicts the hold-out data as well as any";
  if (asked)
    why = "as specified";
  else if (s.result.converged && s.result.stable)
    why += " whose fit converged and is stable";
  choices.push_back({"structure", name_of_order(selected.order), why});
  const auto& model = s.result.model;
  if (model.realisation.integrator)
    choices.push_back({"integrator", "one pole fixed at z = 1",
                       "a pole lies within its error bar of 1, and the criterion is less with it there"});
  if (s.result.further_delay)
    choices.push_back({"delay",
                       fmt::format("{:.4g} +- {:.2g} ms additional", 1e3 * s.result.further_delay->value,
                                   1e3 * s.result.further_delay->std),
                       "the criterion is clearly less with it than with the known delay alone"});
  return choices;
}

/// Between the samples of a record in a band the signals go on smoothly, they are not held: the output knows
/// of the input to come. A sample later it does not.
void shift_output(data::Record& record) {
  for (auto* c : {&record.input, &record.excitation, &record.reference})
    if (c->present()) c->samples.erase(c->samples.begin());
  record.output.samples.pop_back();
}

}  // namespace

fit::BlackBoxConfig black_box_config(const data::Record& record, const Options& options) {
  fit::BlackBoxConfig config;
  constexpr double kWhole = 1e-3;  // of a sample
  const double samples = options.delay_s * record.sample_rate_hz;
  config.delay_samples = static_cast<std::size_t>(std::ceil(samples - kWhole));
  config.direct_term = std::abs(samples - std::round(samples)) > kWhole;
  config.known_delay_s = options.delay_s;
  if (options.approach == Approach::joint) config.predictor = fit::Predictor::joint;
  if (options.approach == Approach::indirect) {
    config.predictor = fit::Predictor::closed_loop;
    config.controller = options.controller;
  }
  return config;
}

fit::BlackBoxConfig black_box_config(const data::Record& record, const Options& options,
                                     const fit::BlackBoxModel& model) {
  auto config = black_box_config(record, options);
  const auto& r = model.realisation;
  config.order = static_cast<int>(model.transfer_function.denominator.size()) - 1;
  config.delay_samples = model.delay_samples;
  config.integrator = r.integrator;
  config.direct_term = r.taps.size() > (r.integrator ? 1 : 0);
  config.start = r;
  return config;
}

/// Where the poles are not those of a continuous plant, the sample within which the delay lies is known.
data::Estimate delay_of(const fit::BlackBoxModel& model) {
  if (const auto delay = model.delay()) return *delay;
  const double ts = model.transfer_function.sample_time_s;
  constexpr double kUniform = 0.29;  // standard deviation over a sample
  return {(static_cast<double>(model.delay_samples) - 0.5) * ts, kUniform * ts};
}

expected<BlackBoxSelection, Error> select_black_box(const data::Record& whole, const Options& given,
                                                    const BlackBoxBand& band) {
  Options options = given;
  const bool in_band = band.hz && options.approach != Approach::indirect && options.bootstrap == 0;
  auto part = in_band ? record_in_band(whole, *band.hz, band.alone) : BandRecord{whole, 1, 0};
  auto& record = part.record;
  if (part.every > 1) {
    shift_output(record);
    options.delay_s += record.sample_time_s();
  }
  if (options.approach == Approach::indirect && record.output_quantity != data::OutputQuantity::velocity)
    return tl::unexpected(Error{"approach",
                                "indirect with .model black-box needs a recorded velocity, which is what the "
                                "controller is fed; found another output"});
  fit::OrderSelectionConfig search;
  search.model = black_box_config(record, options);
  if (part.every > 1) search.model.direct_term = true;
  search.further_delay = part.every == 1;
  if (options.order != 0) search.lowest = search.highest = static_cast<int>(options.order);
  auto selected = fit::select_order(record, search);
  if (!selected)
    return tl::unexpected(Error{"model", fmt::format("black-box: {} {}", selected.error().field.view(),
                                                     selected.error().requirement.view())});
  BlackBoxSelection s;
  auto& fit = selected->fit;
  s.result = {fit.model, fit.fit_percent, fit.converged, fit.stable, {}};
  if (selected->further_delay) {
    s.result.further_delay = delay_of(fit.model);
    s.result.further_delay->value -= options.delay_s;
  }
  if (part.every > 1) {
    --s.result.model.delay_samples;
    s.result.model.known_delay_s = given.delay_s;
  } else if (!(in_band && band.alone)) {  // that of a filtered record is none of the record
    s.residual = std::move(fit.residual);
    s.residual_start = part.first_sample + fit.first_sample;
  }
  s.choices = choices_of(s, *selected, options.order != 0);
  if (part.every > 1)
    s.choices.push_back({"sample rate", fmt::format("{:.4g} Hz", record.sample_rate_hz),
                         "the black box is fitted at the rate that the band needs"});
  if (options.order == 0)
    for (const auto& t : selected->trials) s.structures.push_back(listed(t, *selected));
  return s;
}

}  // namespace resonid::identification::detail
