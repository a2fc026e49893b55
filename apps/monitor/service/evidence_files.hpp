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

/// Bytes of samples and reports that were counted, by the files of the samples.
using EvidenceSizes = std::map<std::string, std::uint64_t, std::less<>>;

/// Tells in the batch what takes more or less than was counted: a report counts for retention, too.
void count_evidence(const std::filesystem::path& folder, EvidenceSizes& counted, Batch& batch);

/// Removes the report that was made of a file of evidence, where there is one; whether none is left.
bool remove_report(const std::filesystem::path& file);

/// Removes files that retention has given up, with the reports that were made of them, and tells so in the
/// batch.
void remove_evidence(const std::filesystem::path& folder, Reader& reader, Batch& batch);

}  // namespace resonid::monitor
