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

/// The record without the periods in which transients last.
expected<data::Record, Error> without_transient(data::Record record, const Options& options) {
  if (options.drop_periods == 0) return record;
  const std::size_t period = period_of(record, options);
  if (period != 0 && averages_realisations(options.method) && !realisations_in(record, period).empty())
    return record;  // each realisation loses its own
  if (period == 0)
    return tl::unexpected(
        Error{"drop-periods", "no period was found in the excitation; give --period-samples N"});
  if (options.drop_periods >= record.samples() / period)
    return tl::unexpected(
        Error{"drop-periods",
              fmt::format("dropping {} periods of {} samples leaves less than one of the record's {} samples",
                          options.drop_periods, period, record.samples())});
  const std::size_t dropped = options.drop_periods * period;
  return data::part_of(record, dropped, record.samples() - dropped);
}

}  // namespace

expected<Prepared, Error> prepare(data::Record record, const Options& options) {
  auto cut = without_transient(std::move(record), options);
  if (!cut) return tl::unexpected(std::move(cut.error()));
  Prepared prepared{std::move(*cut), {}, ExcitationSource::none};
  prepared.facts = facts_of(prepared.record);
  prepared.source = complete_excitation(prepared.record, options);
  return prepared;
}

}  // namespace resonid::identification::detail
