// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <identification/criteria.hpp>
#include <identification/identify/measure/methods.hpp>
#include <identification/identify/prepare/choices.hpp>
#include <identification/identify/prepare/contradictions.hpp>
#include <identification/identify/prepare/prepare.hpp>
#include <identification/identify/prepare/units.hpp>
#include <resonid/diagnostics/detail/data_findings.hpp>

namespace resonid::identification::detail {
namespace {

RecordFacts facts_of(const data::Record& record) {
  return {record.source,          record.samples(),   record.sample_rate_hz,  record.sampling.time_name,
          record.input.name,      record.output.name, record.excitation.name, record.reference.name,
          record.output_quantity, record.reading};
}

/// The record without the periods in which transients last.
expected<data::Record, Error> without_transient(data::Record record, const Options& options) {
  if (options.drop_periods == 0) return record;
  const std::size_t period = period_of(record, options);
  if (period != 0 && averages_realisations(options.method) && !realisations_in(record, period).empty())
    return record;  // each realisation loses its own
  if (period == 0)
    return tl::unexpected(
        Error{"drop_periods", "no period was found in the excitation; give .period_samples"});
  if (options.drop_periods >= record.samples() / period)
    return tl::unexpected(Error{
        "drop_periods",
        fmt::format("dropping {} periods of {} samples leaves less than one of the recording's {} samples",
                    options.drop_periods, period, record.samples())});
  const std::size_t dropped = options.drop_periods * period;
  return data::part_of(record, dropped, record.samples() - dropped);
}

}  // namespace

Options sampled(Options options, const data::Record& record) {
  if (options.controller) options.controller = options.controller->sampled(record.sample_time_s());
  return options;
}

expected<Prepared, Error> prepare(data::Record record, const Options& options) {
  auto cut = without_transient(std::move(record), options);
  if (!cut) return tl::unexpected(std::move(cut.error()));
  Prepared prepared{std::move(*cut), {}, ExcitationSource::none};
  prepared.facts = facts_of(prepared.record);
  prepared.source = complete_excitation(prepared.record, options);
  return prepared;
}

expected<Experiment, Error> plan_experiment(const data::Record& record, const Options& options) {
  auto prepared = prepare(record, options);
  if (!prepared) return tl::unexpected(std::move(prepared.error()));
  if (prepared->record.samples() < kCriteria.fewest_samples)
    return tl::unexpected(
        Error{"input", fmt::format("holds {} samples, too few for a response; required at least {}",
                                   prepared->record.samples(), kCriteria.fewest_samples)});
  for (auto check : {constant_input(prepared->record), copied_input(prepared->record),
                     contradiction(prepared->record, options)})
    if (check) return tl::unexpected(std::move(*check));
  auto motion = motion_in(prepared->record, prepared->source, options);
  Options planned = options;
  if (motion) {
    planned.excitation_type = ExcitationType::other;
    if (prepared->source == ExcitationSource::reference) prepared->record.excitation = {};
    prepared->source = ExcitationSource::none;
  }
  auto plan = make_plan(prepared->record, planned);
  if (!plan) return tl::unexpected(std::move(plan.error()));
  Experiment experiment{std::move(*prepared), std::move(*plan), {}, std::move(motion), {}, {}};
  experiment.units = units_of(experiment.record);
  experiment.choices = explain(experiment.record, options, experiment.plan, experiment.source);
  if (experiment.motion && options.excitation_type == ExcitationType::automatic)
    experiment.choices.front() = {
        "excitation", "other",
        fmt::format("inertia and friction explain {:.3g} % of the input: the motion "
                    "itself is all that excites",
                    100.0 * experiment.motion->share)};
  experiment.findings = diagnostics::inspect(experiment.record);
  if (const auto n = experiment.plan.hold.samples; n > 1)
    experiment.findings.push_back(
        {"held-output", diagnostics::Severity::info, static_cast<double>(n), 1.0,
         fmt::format(
             "The measured output is new in every {}th sample only: between them it says nothing. Models "
             "are fitted to the new values; response, modes and parameters are without the hold, margins "
             "with it. Record at the rate of the measurement where that is possible.",
             n)});
  return experiment;
}

}  // namespace resonid::identification::detail
