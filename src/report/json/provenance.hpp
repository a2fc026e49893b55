// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/report/detail/provenance.hpp>

#include "report/json/fields.hpp"

namespace resonid::report {

void describe(Fields& f, InputFile& file);
void describe(Fields& f, Provenance& provenance);

/// The key `provenance`, which every result file may have.
void describe_provenance(Fields& f, Provenance& provenance, bool there);

}  // namespace resonid::report
