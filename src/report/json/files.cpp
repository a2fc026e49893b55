// SPDX-License-Identifier: MIT
#include "report/json/files.hpp"

#include <algorithm>
#include <array>
#include <cassert>

#include "report/json/provenance.hpp"
#include "report/json/results.hpp"

namespace resonid::report {
namespace {

template <class T>
ResultFile file(const char* name, const char* made_by) {
  return {name, made_by, [](Fields& f) {
            T result;
            describe(f, result);
            Provenance provenance;
            describe_provenance(f, provenance, false);
          }};
}

}  // namespace

std::span<const ResultFile> result_files() {
  static const std::array<ResultFile, 9> kFiles = {
      file<identification::Result>("identification", "Written by `resonid identify RECORD`"),
      file<BatchResult>("identifications", "Written by `resonid identify RECORD RECORD ...`"),
      file<identification::Track>("track", "Written by `resonid track`"),
      file<identification::ModelValidation>("validation", "Written by `resonid validate`"),
      file<identification::Changes>("comparison", "Written by `resonid compare`"),
      file<FileInspection>("inspection", "Written by `resonid inspect`"),
      file<planning::Plan>("plan", "Written by `resonid plan`"),
      file<identification::Tuning>("tuning", "Written by `resonid tune`"),
      file<SimulatedTruth>("truth", "Written by `resonid simulate` as the truth")};
  return kFiles;
}

const ResultFile& result_file(std::string_view name) {
  const auto files = result_files();
  const auto found = std::find_if(files.begin(), files.end(), [&](const auto& f) { return f.name == name; });
  assert(found != files.end());
  return *found;
}

const std::string_view kResultsIntroduction =
    R"(# Result files

<!-- Made from the descriptions in src/report/json by the test report.ResultFiles; change those, not this file. -->

Every verb writes its result as JSON when it is told a file for it. Names and meanings of the keys are a contract: keys may be added, none is
renamed or goes. A quantity that was not computed is absent, never 0 or null; only a row of a track that has no value holds
null. Frequencies are in Hz, phases in degrees unless the name says otherwise. A unit `unit` is told by the key `unit` of the
same object; numbers without a unit are plain, or in the units that the file's `units` tells.

The JSON Schemas beside this file are installed in `share/resonid/schema`. `check-jsonschema` or Python's `jsonschema` hold
a file against them:

    python3 -m jsonschema -i result.json share/resonid/schema/identification.json

C++ reads and writes the same files with `report::from_json` and `report::to_json` (include/resonid/report/json.hpp).
)";

}  // namespace resonid::report
