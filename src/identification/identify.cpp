// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <identification/black_box_selection.hpp>
#include <identification/bootstrap.hpp>
#include <identification/choices.hpp>
#include <identification/closed_loop.hpp>
#include <identification/distortion.hpp>
#include <identification/loop.hpp>
#include <identification/measured_response.hpp>
#include <identification/model_selection.hpp>
#include <identification/preparation.hpp>
#include <identification/simulate_and_correct.hpp>
#include <identification/trust.hpp>
#include <identification/uncertainty.hpp>
#include <identification/units.hpp>
#include <resonid/diagnostics/detail/data_findings.hpp>
#include <resonid/diagnostics/detail/response_extrema.hpp>
#include <resonid/diagnostics/residuals.hpp>

namespace resonid::identification {
namespace {

void append(std::vector<diagnostics::Finding>& to, std::vector<diagnostics::Finding> from) {
  std::move(from.begin(), from.end(), std::back_inserter(to));
}

/// Of the model, else of the response, unless that is biased.
std::vector<Resonance> resonances_of(const Result& result, bool biased) {
  std::vector<Resonance> found;
  if (result.model) {
    return detail::resonances_of(result.model->drive);
  } else if (!biased) {
    for (const auto& e : diagnostics::response_extrema(result.response))
      found.push_back({e.minimum, e.frequency_hz, std::nullopt, std::nullopt, false});
  }
  return found;
}

void validate_on_record(const data::Record& record, double fit_percent, std::vector<double> residual,
                        std::size_t residual_start, std::size_t order, Result& result) {
  const auto simulated = diagnostics::simulated_of(record.output.samples, residual);
  const double further = result.black_box && result.black_box->further_delay
                             ? std::max(0.0, result.black_box->further_delay->value)
                             : 0.0;
  const auto delay =
      static_cast<std::size_t>(std::lround((result.known_delay_s + further) * record.sample_rate_hz));
  const auto test = diagnostics::test_residual({residual, simulated, {}, {}}, 40 + delay, order + delay);
  result.validation =
      Validation{fit_percent, true, test.with_simulated.largest, test.limit, std::hypot(test.mean, test.rms)};
  result.residual = std::move(residual);
  result.residual_start = residual_start;
}

void validate_on_lines(const response::LineEstimates& lines, Result& result) {
  const auto fitted = result.model->drive.values(result.response.frequency_hz, true);
  double left = 0.0, total = 0.0;
  for (std::size_t i = 0; i < fitted.size() && i < lines.lines.size(); ++i) {
    const double power = std::norm(lines.lines[i].input);
    left += power * std::norm(result.response.value[i] - fitted[i]);
    total += power * std::norm(result.response.value[i]);
  }
  if (total > 0.0)
    result.validation =
        Validation{100.0 * (1.0 - std::sqrt(left / total)), false, std::nullopt, std::nullopt, std::nullopt};
}

}  // namespace

expected<Result, Error> identify(const data::Record& whole, const Options& options) {
  const auto progress = [&](std::string_view stage) {
    if (options.progress) options.progress(stage);
  };
  const auto prepared = detail::prepare(whole, options);
  if (!prepared) return tl::unexpected(prepared.error());
  const auto source = prepared->source;
  const data::Record& record = prepared->record;
  constexpr std::size_t kFewest = 128;
  if (record.samples() < kFewest)
    return tl::unexpected(
        Error{"input", fmt::format("holds {} samples, too few for a response; required at least {}",
                                   record.samples(), kFewest)});
  auto plan = detail::make_plan(record, options);
  if (!plan) return tl::unexpected(plan.error());

  Result result;
  result.record = prepared->facts;
  result.choices = detail::explain(record, options, *plan, source);
  result.units = detail::units_of(record);
  result.approach = detail::name_of(plan->approach);
  result.confidence = options.confidence;
  result.known_delay_s = options.delay_s;
  result.radius_m = options.radius_m;
  append(result.findings, diagnostics::inspect(record));

  progress("response");
  auto measured = detail::measure_response(record, *plan, options, result.choices);
  if (!measured) return tl::unexpected(measured.error());
  result.method = detail::name_of(options.method == Method::model ? Method::model : plan->method);
  auto* lines = &measured->lines;
  result.response = std::move(measured->response);
  if (result.response.lines() == 0)
    return tl::unexpected(Error{"input",
                                "gives no finite response: the input does not move, or its numbers are too "
                                "large to be squared"});
  if (plan->low_hz <= 0.0 || plan->method == Method::periodic || plan->method == Method::best_linear) {
    plan->low_hz = result.response.frequency_hz.front();
    plan->high_hz = result.response.frequency_hz.back();
  }
  append(result.findings, diagnostics::inspect(result.response));
  result.distortion = detail::find_distortion(record, *plan, options, *measured, result.response);
  if (result.distortion) append(result.findings, detail::inspect_distortion(*result.distortion));

  const auto evidence = detail::loop_evidence(record, *plan, source, options, result.response);
  plan->loop_controller = detail::predictor_controller(evidence.controller, options);
  if (auto f = detail::inspect_orientation(evidence, result.response))
    result.findings.push_back(std::move(*f));
  auto differs = detail::inspect_controller(options, evidence, result.response);
  const bool controller_differs = differs.has_value();
  if (differs) result.findings.push_back(std::move(*differs));

  std::optional<detail::Selection> selection;
  std::optional<detail::BlackBoxSelection> black_box;
  if (options.model == ModelChoice::black_box) {
    progress("model");
    auto chosen = detail::select_black_box(record, options);
    if (!chosen) return tl::unexpected(chosen.error());
    black_box = std::move(*chosen);
    result.black_box = black_box->result;
    result.structures = std::move(black_box->structures);
    std::move(black_box->choices.begin(), black_box->choices.end(), std::back_inserter(result.choices));
    append(result.findings, std::move(black_box->findings));
  } else if (options.model != ModelChoice::none) {
    progress("model");
    selection =
        detail::select_model({&record, 1}, *plan, options, detail::without_bias(result.response, evidence),
                             {}, !detail::rules_over_noise(result.distortion));
    if (selection) {
      result.model = selection->result;
      result.structures = std::move(selection->structures);
      result.choices.push_back(std::move(selection->choice));
    }
  }
  if (options.method == Method::simulate_and_correct) {
    progress("correction");
    auto done = detail::simulate_and_correct(record, *plan, options, result.response, selection);
    if (!done) return tl::unexpected(done.error());
    result.model = selection->result;
    result.method = detail::name_of(options.method);
  }
  const bool fitted_to_record = black_box || (selection && selection->result.from_record);
  const bool takes_model = options.method == Method::automatic && evidence.biased() && fitted_to_record;
  if (takes_model) detail::choose_model(evidence, result);
  if (fitted_to_record) detail::weigh_incoherence(evidence, result.findings);
  if (plan->loop_controller && fitted_to_record)
    result.choices.push_back(detail::predictor_choice(options, *evidence.controller));
  if (auto f = detail::inspect_feedback(evidence, takes_model || options.method == Method::model))
    result.findings.push_back(std::move(*f));
  if (!black_box) detail::inspect_model(*plan, options, selection, result);
  if (black_box)
    validate_on_record(record, black_box->result.fit_percent, std::move(black_box->residual),
                       black_box->residual_start,
                       black_box->result.model.transfer_function.denominator.size() - 1, result);
  else if (selection && !selection->residual.empty())
    validate_on_record(record, selection->fit_percent, std::move(selection->residual),
                       selection->residual_start,
                       static_cast<std::size_t>(fit::order_of(selection->result.drive.structure)), result);
  else if (selection && result.response.lines() == lines->lines.size())
    validate_on_lines(*lines, result);
  detail::inspect_validation(result);
  const std::pair modes_hz(0.3 * plan->low_hz, 1.5 * plan->high_hz);  // those that the record can show
  result.resonances = black_box
                          ? detail::resonances_of(black_box->result.model, modes_hz.first, modes_hz.second)
                          : resonances_of(result, evidence.biased());
  if (result.model)
    result.roots = detail::roots_of(result.model->drive);
  else if (result.black_box)
    result.roots = detail::roots_of(result.black_box->model);

  progress("loop");
  if (source == detail::ExcitationSource::reference) lines->has_excitation = false;  // L = Ru/U - 1 needs ru
  if (auto loop = response::loop_response(*lines)) result.measured_loop = std::move(*loop);
  Options in_loop = options;
  const bool own_controller = evidence.controller && (!options.controller || controller_differs);
  if (own_controller) {
    in_loop.controller = evidence.controller->controller;
    result.choices.push_back(detail::controller_choice(*evidence.controller));
  }
  result.loop = detail::loop_of(*plan, in_loop, *lines, result.response, detail::plant_model(result));
  if (own_controller && result.loop) {
    const auto loop_with =
        [&, plant = detail::plain(detail::plant_model(result))](const data::TransferFunction& controller) {
          Options other = in_loop;
          other.controller = controller;
          return detail::loop_of(*plan, other, *lines, result.response, plant);
        };
    if (auto finding = detail::include_controller(*evidence.controller, *plan, loop_with, *result.loop))
      result.findings.push_back(std::move(*finding));
  }
  detail::inspect_loop(result);
  if ((result.model || result.black_box) && options.bootstrap > 0) {
    progress("bootstrap");
    const detail::LoopOfModel loop_of_model = [&](const detail::PlantModel& model) {
      return detail::loop_of(*plan, in_loop, *lines, result.response, model);
    };
    auto bootstrap = detail::bootstrap(detail::repetition_of(record, *plan, options, result), options, result,
                                       loop_of_model, modes_hz);
    if (auto finding = detail::inspect_bootstrap(bootstrap, result))
      result.findings.push_back(std::move(*finding));
    else
      result.bootstrap = std::move(bootstrap);
  }
  if (options.method == Method::model && !result.model && !result.black_box)
    return tl::unexpected(Error{"method", "model needs --model other than none, and a fit"});
  if (options.method == Method::model || takes_model) {
    const auto coherence = result.response.coherence;
    const auto& f = result.response.frequency_hz;
    result.response = result.model ? result.model->drive.response(f) : result.black_box->model.response(f);
    result.response.coherence = coherence;
  }
  result.trusted = detail::trusted(result);
  return result;
}

}  // namespace resonid::identification
