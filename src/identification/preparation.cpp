// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <identification/measurement.hpp>
#include <identification/preparation.hpp>

namespace resonid::identification::detail {
namespace {

RecordFacts facts_of(const data::Record& record) {
  return {record.source,         record.samples(),   record.sample_rate_hz,  record.sampling.time_name,
          record.input.name,     record.output.name, record.excitation.name, record.reference.name,
          record.output_quantity};
}

void cut_front(data::Record& record, std::size_t samples) {
  for (auto* channel :
       {&record.input, &record.output, &record.excitation, &record.reference, &record.position})
    if (channel->present())
      channel->samples.erase(channel->samples.begin(),
                             channel->samples.begin() + static_cast<std::ptrdiff_t>(samples));
  record.start_time_s += static_cast<double>(samples) / record.sample_rate_hz;
}

/// The record without the periods in which transients last.
expected<data::Record, Refusal> without_transient(data::Record record, const Options& options) {
  if (options.drop_periods == 0) return record;
  const std::size_t period = period_of(record, options);
  if (period != 0 && averages_realisations(options.method) && !realisations_in(record, period).empty())
    return record;  // each realisation loses its own
  if (period == 0)
    return tl::unexpected(
        Refusal{"drop-periods", "no period was found in the excitation; give --period-samples N"});
  if (options.drop_periods >= record.samples() / period)
    return tl::unexpected(Refusal{
        "drop-periods",
        fmt::format("dropping {} periods of {} samples leaves less than one of the record's {} samples",
                    options.drop_periods, period, record.samples())});
  cut_front(record, options.drop_periods * period);
  return record;
}

}  // namespace

expected<Prepared, Refusal> prepare(data::Record record, const Options& options) {
  auto cut = without_transient(std::move(record), options);
  if (!cut) return tl::unexpected(std::move(cut.error()));
  Prepared prepared{std::move(*cut), {}, ExcitationSource::none};
  prepared.facts = facts_of(prepared.record);
  prepared.source = complete_excitation(prepared.record, options);
  return prepared;
}

}  // namespace resonid::identification::detail
