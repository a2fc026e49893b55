// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/data/estimate.hpp>
#include <resonid/data/transfer_function.hpp>
#include <resonid/diagnostics/finding.hpp>
#include <resonid/diagnostics/margins.hpp>
#include <resonid/identification/result.hpp>

#include "report/json/fields.hpp"

// What several kinds of result files hold alike.
namespace resonid::report {

inline constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

void describe(Fields& f, diagnostics::Finding& finding);
void describe(Fields& f, diagnostics::Crossover& crossover);
void describe(Fields& f, data::FrequencyResponse& g);
void describe(Fields& f, data::TransferFunction& g);
void describe(Fields& f, identification::RecordFacts& record);

/// "record": only the file, its length and its rate.
void describe_file(Fields& f, identification::RecordFacts& record);
/// "units", of signals and response.
void describe_units(Fields& f, identification::Units& units);

/// {value, std, unit}; false where it is not there. A standard deviation that is absent is read as not
/// finite.
bool quantity(Fields& f, const Key& key, data::Estimate& estimate, std::string& unit, bool there = true,
              Presence presence = Presence::optional);
/// The same of an estimate that may not be.
void quantity(Fields& f, const Key& key, std::optional<data::Estimate>& estimate, std::string& unit);

}  // namespace resonid::report
