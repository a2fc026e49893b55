// SPDX-License-Identifier: MIT
#pragma once

#include <identification/identify/prepare/excitation_source.hpp>
#include <identification/identify/prepare/motion.hpp>
#include <identification/identify/prepare/plan.hpp>
#include <resonid/identification/result.hpp>

namespace resonid::identification::detail {

/// The options with the controller at the record's sample time.
[[nodiscard]] Options sampled(Options options, const data::Record& record);

/// A record as everything off line works on it.
struct Prepared {
  data::Record record;  ///< Without the periods that transients last in, the excitation completed.
  RecordFacts facts;    ///< Of the signals that were recorded.
  ExcitationSource source = ExcitationSource::none;
};

/// Refused: periods to be dropped where none is found, or more than the record has.
[[nodiscard]] expected<Prepared, Error> prepare(data::Record record, const Options& options);

/// A prepared record and what will be done with it.
struct Experiment : Prepared {
  Plan plan;
  Units units;
  std::optional<fit::InverseDynamics> motion;  ///< Where a motion profile is all that excites.
  std::vector<Choice> choices;                 ///< Excitation, method and approach, each with its reason.
  std::vector<diagnostics::Finding> findings;  ///< Of the record.
};

/// The first step of identify(). Refused: what prepare() and make_plan() refuse, and records of fewer than
/// 128 samples.
[[nodiscard]] expected<Experiment, Error> plan_experiment(const data::Record& record, const Options& options);

}  // namespace resonid::identification::detail
