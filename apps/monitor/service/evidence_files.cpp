// SPDX-License-Identifier: MIT
#include "monitor/service/evidence_files.hpp"

#include <algorithm>
#include <set>
#include <string>
#include <string_view>
#include <system_error>

#include "monitor/service/log.hpp"

namespace resonid::monitor {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kFilesAtOnce = 100;

/// NUMBER.csv, NUMBER.html, and what atomic writing calls them before they are whole.
bool is_evidence(std::string_view name) {
  if (name.starts_with('.') && name.ends_with(".tmp")) return true;
  const auto stem = name.substr(0, name.find('.'));
  return !stem.empty() && (name.ends_with(".csv") || name.ends_with(".html")) &&
         stem.find_first_not_of("0123456789") == stem.npos;
}

/// Whether nothing is left of it.
bool removed(const fs::path& file) {
  std::error_code code;
  fs::remove(file, code);
  if (code) say(LogLevel::warning, "evidence '{}' cannot be removed: {}", file.string(), code.message());
  return !code;
}

}  // namespace

void tidy_evidence(const fs::path& folder, Reader& reader, Batch& batch) {
  const auto known = reader.evidence_files();
  if (!known) return;
  std::set<std::string, std::less<>> lost(known->begin(), known->end()), stems;
  for (const auto& file : *known) stems.insert(file.substr(0, file.find('.')));
  std::error_code code;
  for (auto entry = fs::directory_iterator(folder, code); entry != fs::directory_iterator();
       entry.increment(code)) {
    const std::string name = entry->path().filename().string();
    lost.erase(name);
    if (!is_evidence(name) || stems.contains(name.substr(0, name.find('.')))) continue;
    if (removed(entry->path())) say(LogLevel::info, "evidence '{}', which no alarm knows, is removed", name);
  }
  if (code) return;
  for (const auto& file : lost) {
    say(LogLevel::warning, "evidence '{}' is gone", file);
    batch.evidence_lost.push_back(file);
  }
}

bool remove_report(const fs::path& file) { return removed(fs::path(file).replace_extension(".html")); }

void count_evidence(const fs::path& folder, EvidenceSizes& counted, Batch& batch) {
  EvidenceSizes found;
  std::error_code code;
  for (auto entry = fs::directory_iterator(folder, code); entry != fs::directory_iterator();
       entry.increment(code)) {
    const std::string name = entry->path().filename().string();
    std::error_code gone;
    const auto bytes = entry->file_size(gone);
    if (!gone && !name.starts_with('.') && is_evidence(name))
      found[name.substr(0, name.find('.')) + ".csv"] += bytes;
  }
  if (code) return;
  for (const auto& [name, bytes] : found)
    if (const auto before = counted.find(name); before == counted.end() || before->second != bytes)
      batch.evidence_sizes.push_back({name, bytes});
  counted = std::move(found);
}

void remove_evidence(const fs::path& folder, Reader& reader, Batch& batch) {
  const auto files = reader.evidence_to_remove(kFilesAtOnce);
  if (!files) return;
  for (const auto& name : *files) {
    const fs::path file = folder / fs::path(name).filename();
    if (!remove_report(file) || !removed(file)) continue;
    say(LogLevel::info, "evidence '{}' is removed as retention asks for", name);
    batch.evidence_removed.push_back(name);
  }
}

}  // namespace resonid::monitor
