// SPDX-License-Identifier: MIT
#pragma once

#include <identification/excitation_source.hpp>
#include <resonid/identification/identify.hpp>

namespace resonid::identification::detail {

/// A record as everything off line works on it.
struct Prepared {
  data::Record record;  ///< Without the periods that transients last in, the excitation completed.
  RecordFacts facts;    ///< Of the signals that were recorded.
  ExcitationSource source = ExcitationSource::none;
};

/// Refused: periods to be dropped where none is found, or more than the record has.
[[nodiscard]] expected<Prepared, Error> prepare(data::Record record, const Options& options);

}  // namespace resonid::identification::detail
