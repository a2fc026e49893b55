// SPDX-License-Identifier: MIT
#include "report/json/provenance.hpp"

#include <nlohmann/json.hpp>

#include "report/json/passes.hpp"

namespace resonid::report {

void describe(Fields& f, InputFile& file) {
  f({"name", "as it was named"}, file.name);
  f.unless_empty({"sha256", "64 hexadecimal digits; absent: not a file that can be read twice"}, file.sha256);
}

void describe(Fields& f, Provenance& p) {
  f({"version", "version of the program, \"0.1.0\""}, p.version);
  f({"command", "the whole command line"}, p.command);
  f({"date", "when, UTC, ISO 8601; $SOURCE_DATE_EPOCH where that is set"}, p.date);
  f.list(
      {"files", "the files that it was made from"}, true, p.files,
      [&](InputFile& file) { describe(f, file); }, Presence::required);
}

void describe_provenance(Fields& f, Provenance& provenance, bool there) {
  f.object({"provenance", "what the file was made by, and from what"}, there,
           [&] { describe(f, provenance); });
}

void put_provenance(nlohmann::json& result, const Provenance& provenance) {
  auto copy = provenance;
  result.update(write([&](Fields& f) { describe_provenance(f, copy, true); }));
}

std::optional<Provenance> provenance_of(const nlohmann::json& result) {
  Provenance found;
  bool there = false;
  const auto done = read(result, [&](Fields& f) {
    there = f.holds("provenance");
    describe_provenance(f, found, there);
  });
  if (!done || !there) return std::nullopt;
  return found;
}

}  // namespace resonid::report
