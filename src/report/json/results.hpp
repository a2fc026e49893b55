// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/identification/compare.hpp>
#include <resonid/identification/track.hpp>
#include <resonid/identification/tune.hpp>
#include <resonid/identification/validate.hpp>
#include <resonid/planning/plan.hpp>
#include <resonid/report/detail/batch.hpp>
#include <resonid/report/detail/inspection.hpp>
#include <resonid/report/detail/truth.hpp>

#include "report/json/parts.hpp"

// What each result file holds, said once: writer, reader, JSON Schema and table of docs/results.md come from
// it.
namespace resonid::report {

void describe(Fields& f, identification::Result& result);
void describe(Fields& f, BatchResult& result);
void describe(Fields& f, identification::Track& track);
void describe(Fields& f, identification::ModelValidation& validation);
void describe(Fields& f, identification::Changes& changes);
void describe(Fields& f, FileInspection& inspection);
void describe(Fields& f, planning::Plan& plan);
void describe(Fields& f, identification::Tuning& tuning);
void describe(Fields& f, SimulatedTruth& truth);

/// "model" of a result, with or without drive structure.
void describe_model(Fields& f, identification::Result& result);

/// The identified drive itself, in an object that says nothing else.
void describe_machine(Fields& f, fit::DriveModel& drive, identification::Units& units);

void describe(Fields& f, identification::TunedController& controller);
void describe(Fields& f, identification::LoopFigure& figure);
void describe(Fields& f, identification::TuningCheck& check);
void describe(Fields& f, response::DistortionLevel& level);
void describe(Fields& f, data::Mode& resonance);
void describe(Fields& f, identification::SecondOutputResult& second);
void describe(Fields& f, identification::Validation& validation);
void describe(Fields& f, identification::IndependentValidation& validation);
void describe(Fields& f, identification::Choice& choice);
void describe(Fields& f, identification::StructureTrial& trial);
void describe(Fields& f, identification::Root& root);
void describe(Fields& f, identification::BootstrapInterval& interval);
void describe(Fields& f, identification::Bootstrap& bootstrap);

}  // namespace resonid::report
