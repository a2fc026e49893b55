// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/identification/compare.hpp>
#include <resonid/identification/track.hpp>
#include <resonid/identification/tune.hpp>
#include <resonid/identification/validate.hpp>
#include <resonid/report/detail/batch.hpp>
#include <string>
#include <vector>

namespace resonid::cli {

/// What results say to their readers, in the words of the command line.
void put_in_options(std::vector<diagnostics::Finding>& findings);
void put_in_options(identification::Result& result);
void put_in_options(report::BatchResult& result);
void put_in_options(identification::Track& track);
void put_in_options(identification::ModelValidation& validation);
void put_in_options(identification::Changes& changes);
void put_in_options(identification::Tuning& tuning);
void put_in_options(std::vector<std::string>& sentences);

}  // namespace resonid::cli
