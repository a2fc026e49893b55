// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>

#include "monitor/store/reader.hpp"
#include "monitor/store/records.hpp"

namespace resonid::monitor {

/// At the start: removes files that no record knows (of a process that was killed in between) and, by the
/// batch, records whose file is gone. Files that are not named like evidence stay.
void tidy_evidence(const std::filesystem::path& folder, Reader& reader, Batch& batch);

/// Bytes of the reports that were counted, by their names.
using ReportSizes = std::map<std::string, std::uint64_t, std::less<>>;

/// Tells in the batch of evidence to which a report came since: it counts for retention, too.
void count_reports(const std::filesystem::path& folder, ReportSizes& counted, Batch& batch);

/// Removes the report that was made of a file of evidence, where there is one; whether none is left.
bool remove_report(const std::filesystem::path& file);

/// Removes files that retention has given up, with the reports that were made of them, and tells so in the
/// batch.
void remove_evidence(const std::filesystem::path& folder, Reader& reader, Batch& batch);

}  // namespace resonid::monitor
