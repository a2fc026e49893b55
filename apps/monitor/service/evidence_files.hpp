// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>

#include "monitor/store/reader.hpp"
#include "monitor/store/records.hpp"

namespace resonid::monitor {

/// At the start: removes files that no record knows (of a process that was killed in between) and, by the
/// batch, records whose file is gone. Files that are not named like evidence stay.
void tidy_evidence(const std::filesystem::path& folder, Reader& reader, Batch& batch);

/// Removes files that retention has given up, with the reports that were made of them, and tells so in the
/// batch.
void remove_evidence(const std::filesystem::path& folder, Reader& reader, Batch& batch);

}  // namespace resonid::monitor
